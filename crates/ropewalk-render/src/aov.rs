//! Auxiliary pictures: what a render saw and what it cost, pixel by pixel.

/// The auxiliary pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum AovKind {
    /// Distance from the eye.
    Depth,
    /// Shading normal turned to the eye.
    Normal,
    /// Traversal steps per sample.
    Steps,
    /// Intersection tests per sample.
    Tests,
}

impl AovKind {
    /// All kinds.
    pub const ALL: [AovKind; 4] = [AovKind::Depth, AovKind::Normal, AovKind::Steps, AovKind::Tests];

    /// Name on command lines and in file names.
    pub const fn name(self) -> &'static str {
        match self {
            AovKind::Depth => "depth",
            AovKind::Normal => "normal",
            AovKind::Steps => "steps",
            AovKind::Tests => "tests",
        }
    }
}

/// One value a pixel for each kind, rows from the top.
///
/// `depth` and `normal` are those of the pixel's nearest sample (under the SPD rules, of its four
/// corners). `steps` and `tests` are means over the pixel's samples, each with *all* rays of its
/// tree: eye, reflection, refraction and shadow rays.
#[derive(Clone, Debug, PartialEq)]
pub struct AovBuffers {
    /// Distance from the eye along the eye ray, in scene units; infinite where nothing is hit.
    pub depth: Vec<f32>,
    /// Shading normal in world space, unit length, turned to the eye; zero where nothing is hit.
    pub normal: Vec<[f32; 3]>,
    /// Inner nodes, rope crossings and rope-tree nodes per sample.
    pub steps: Vec<f32>,
    /// Ray-primitive tests per sample.
    pub tests: Vec<f32>,
}

impl AovBuffers {
    /// Buffers for a number of pixels, as if nothing was hit.
    pub(crate) fn new(pixels: usize) -> Self {
        AovBuffers {
            depth: vec![f32::INFINITY; pixels],
            normal: vec![[0.0; 3]; pixels],
            steps: vec![0.0; pixels],
            tests: vec![0.0; pixels],
        }
    }

    pub(crate) fn set(&mut self, pixel: usize, sample: &AovSample) {
        self.depth[pixel] = sample.depth;
        self.normal[pixel] = sample.normal;
        self.steps[pixel] = sample.steps;
        self.tests[pixel] = sample.tests;
    }
}

/// One or several samples' auxiliary values.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AovSample {
    pub depth: f32,
    pub normal: [f32; 3],
    pub steps: f32,
    pub tests: f32,
}

impl AovSample {
    pub const MISS: AovSample =
        AovSample { depth: f32::INFINITY, normal: [0.0; 3], steps: 0.0, tests: 0.0 };

    /// Several samples as one: the nearest sample's depth and normal, the means of the costs.
    pub fn merged(samples: impl ExactSizeIterator<Item = AovSample>) -> AovSample {
        let n = samples.len() as f32;
        let mut out = AovSample::MISS;
        for s in samples {
            if s.depth < out.depth {
                (out.depth, out.normal) = (s.depth, s.normal);
            }
            out.steps += s.steps;
            out.tests += s.tests;
        }
        out.steps /= n;
        out.tests /= n;
        out
    }
}
