//! What a path-traced picture is asked for.

use super::camera::Lens;
use crate::error::RenderError;
use crate::settings::MAX_PIXELS;

/// Which light counts; the parts are there to check each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Strategy {
    /// Lights are sampled and met by scattering, weighed by the power heuristic.
    #[default]
    Both,
    /// Lights are sampled only; they are met only by eye rays, mirrors and clear glass.
    Lights,
    /// Lights are met by scattering only, but for those without extent.
    Bsdf,
}

/// How the light is chosen that a vertex of a path is connected with; the means are the same, the noise is not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LightChoice {
    /// By an estimate of what arrives at the vertex.
    #[default]
    Place,
    /// By what lights send out, everywhere alike.
    Power,
}

/// Settings of a path-traced picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathSettings {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Samples per pixel, 1 to 2^24.
    pub samples: u32,
    /// Seconds after which no pass is begun or ended, the first pass excepted; 0 or more.
    pub seconds: Option<f64>,
    /// Most edges of a path, from the eye to the light; 1 shows lights only. 1 to 1024.
    pub max_depth: u32,
    /// Pictures with different seeds have independent noise.
    pub seed: u32,
    /// Number of threads; `None` takes the current rayon pool (all cores). The picture does not depend on it.
    pub threads: Option<usize>,
    /// The lens.
    pub lens: Lens,
    /// Which light counts.
    pub strategy: Strategy,
    /// How one of many lights is chosen.
    pub light_choice: LightChoice,
    /// Largest luminance that a path may bring after its first bounce; darkens, but tames bright specks.
    pub clamp: Option<f32>,
    /// Whether one more ray a pixel is walked with counters, for [`Film::walks`](super::Film::walks).
    pub walk_costs: bool,
}

impl Default for PathSettings {
    fn default() -> Self {
        PathSettings {
            size: [768, 576],
            samples: 64,
            seconds: None,
            max_depth: 16,
            seed: 0,
            threads: None,
            lens: Lens::default(),
            strategy: Strategy::Both,
            light_choice: LightChoice::Place,
            clamp: None,
            walk_costs: false,
        }
    }
}

impl PathSettings {
    pub(crate) fn check(&self) -> Result<(), RenderError> {
        let [width, height] = self.size;
        let pixels = u64::from(width) * u64::from(height);
        if pixels == 0 || pixels > MAX_PIXELS {
            return Err(RenderError::Size { width, height, max: MAX_PIXELS });
        }
        let setting = |name, found: u32, expected| {
            Err(RenderError::Setting { name, found: found.into(), expected })
        };
        if !(1..=1 << 24).contains(&self.samples) {
            return setting("samples per pixel", self.samples, "1 to 16777216");
        }
        if !(1..=1024).contains(&self.max_depth) {
            return setting("ray depth", self.max_depth, "1 to 1024");
        }
        if self.threads == Some(0) {
            return setting("threads", 0, "at least 1");
        }
        Ok(())
    }
}
