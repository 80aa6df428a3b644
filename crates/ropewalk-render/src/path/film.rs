//! What passes have gathered, pixel by pixel.

use glam::{DVec3, Vec3};

/// The number of a face where nothing was hit.
pub const NO_FACE: u32 = u32::MAX;

/// What samples of a pixel bring back, added up.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cell {
    pub radiance: Vec3,
    /// Base colour of what is seen first.
    pub albedo: Vec3,
    /// Its shading normal, turned to the viewer.
    pub normal: Vec3,
    /// Distance of the nearest sample, in units of the stage.
    pub depth: f32,
    /// The face that the first sample of a pass meets.
    pub face: u32,
}

impl Cell {
    pub const EMPTY: Cell = Cell {
        radiance: Vec3::ZERO,
        albedo: Vec3::ZERO,
        normal: Vec3::ZERO,
        depth: f32::INFINITY,
        face: NO_FACE,
    };
}

/// What it costs to find what one ray meets first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WalkCost {
    /// Treelets that the ray steps through: three levels of the tree each.
    pub steps: u32,
    /// Blocks of eight triangles that it is tested with.
    pub blocks: u32,
}

/// A picture that grows with each pass. It holds complete passes only.
#[derive(Clone, Debug)]
pub struct Film {
    size: [u32; 2],
    samples: u32,
    radiance: Vec<DVec3>,
    albedo: Vec<DVec3>,
    normal: Vec<DVec3>,
    depth: Vec<f32>,
    face: Vec<u32>,
    walks: Vec<WalkCost>,
}

impl Film {
    pub(crate) fn new(size: [u32; 2]) -> Film {
        let pixels = size[0] as usize * size[1] as usize;
        Film {
            size,
            samples: 0,
            radiance: vec![DVec3::ZERO; pixels],
            albedo: vec![DVec3::ZERO; pixels],
            normal: vec![DVec3::ZERO; pixels],
            depth: vec![f32::INFINITY; pixels],
            face: vec![NO_FACE; pixels],
            walks: Vec::new(),
        }
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Samples of each pixel.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Adds what a pass brought to a pixel.
    pub(crate) fn add(&mut self, pixel: usize, cell: &Cell) {
        self.radiance[pixel] += cell.radiance.as_dvec3();
        self.albedo[pixel] += cell.albedo.as_dvec3();
        self.normal[pixel] += cell.normal.as_dvec3();
        self.depth[pixel] = self.depth[pixel].min(cell.depth);
        if self.samples == 0 {
            self.face[pixel] = cell.face;
        }
    }

    /// Ends a pass of so many samples a pixel.
    pub(crate) fn end_pass(&mut self, samples: u32) {
        self.samples += samples;
    }

    /// Mean radiance, row by row from the top left; linear Rec. 709.
    pub fn radiance(&self) -> Vec<[f32; 3]> {
        self.means(&self.radiance)
    }

    /// Mean base colour of what is seen first; black where nothing is.
    pub fn albedo(&self) -> Vec<[f32; 3]> {
        self.means(&self.albedo)
    }

    /// Mean shading normal of what is seen first, turned to the viewer; shorter than 1 at edges.
    pub fn normal(&self) -> Vec<[f32; 3]> {
        self.means(&self.normal)
    }

    /// Distance of the nearest sample; infinite where nothing is hit.
    pub fn depth(&self) -> &[f32] {
        &self.depth
    }

    /// The face that the first sample meets, those of the ground behind those of the stage; [`NO_FACE`] where none is.
    pub fn face(&self) -> &[u32] {
        &self.face
    }

    /// What the walk of a ray through each pixel's middle costs; empty unless
    /// [`PathSettings::walk_costs`](super::PathSettings::walk_costs) asks for it.
    pub fn walks(&self) -> &[WalkCost] {
        &self.walks
    }

    pub(crate) fn set_walks(&mut self, walks: Vec<WalkCost>) {
        self.walks = walks;
    }

    fn means(&self, sums: &[DVec3]) -> Vec<[f32; 3]> {
        let n = f64::from(self.samples.max(1));
        sums.iter().map(|&sum| (sum / n).as_vec3().to_array()).collect()
    }
}
