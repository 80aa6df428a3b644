//! What a render is asked for.

use crate::error::RenderError;
use ropewalk_scene::Camera;

/// Largest number of pixels (and so of corner or pixel cells) in a picture.
pub const MAX_PIXELS: u64 = 1 << 28;

/// Most samples per pixel; their number enters loops as is.
const MAX_SAMPLES: u32 = 1 << 16;

/// Deepest tree of rays: the tracer recurses once a level, and its number of rays can double.
const MAX_DEPTH: u32 = 64;

/// Settings of a render. [`RenderSettings::default`] makes a plain picture with one ray through
/// each pixel's centre, [`RenderSettings::spd`] one by the rules of the Standard Procedural
/// Databases.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RenderSettings {
    /// Width and height in pixels; `None` takes the camera's resolution.
    pub size: Option<[u32; 2]>,
    /// Eye rays a pixel, at least 1: one goes through the centre, more are stratified, at the same
    /// places in each render. Ignored under `spd_rules`.
    pub samples_per_pixel: u32,
    /// Eye rays through the `(w + 1) x (h + 1)` corners of pixels; a pixel is the mean of its four
    /// corners (SPD, testing procedure 6). Also decides by the surface's own normal, not by the one
    /// on the viewer's side, which lights get a shadow ray (procedure 10).
    pub spd_rules: bool,
    /// Deepest level of the tree of rays; the eye ray is level 1 (SPD, testing procedure 7).
    pub max_depth: u32,
    /// Number of threads; `None` takes the current rayon pool (all cores). The picture and the
    /// counts do not depend on it.
    pub threads: Option<usize>,
    /// Whether traversal events are counted ([`Render::traversal`](crate::Render)).
    pub count_traversal: bool,
    /// Whether auxiliary pictures are made; implies `count_traversal`.
    pub aov: bool,
}

impl Default for RenderSettings {
    fn default() -> Self {
        RenderSettings {
            size: None,
            samples_per_pixel: 1,
            spd_rules: false,
            max_depth: 5,
            threads: None,
            count_traversal: true,
            aov: false,
        }
    }
}

impl RenderSettings {
    /// The rules of the Standard Procedural Databases: corner rays, depth 5, size of the scene.
    pub fn spd() -> Self {
        RenderSettings { spd_rules: true, ..Self::default() }
    }

    /// The picture's size for `camera`, after all settings have been checked.
    pub(crate) fn checked_size(&self, camera: &Camera) -> Result<[u32; 2], RenderError> {
        let [width, height] = self.size.unwrap_or(camera.resolution);
        let pixels = u64::from(width) * u64::from(height);
        if pixels == 0 || pixels > MAX_PIXELS {
            return Err(RenderError::Size { width, height, max: MAX_PIXELS });
        }
        let spp = self.samples_per_pixel;
        if !(1..=MAX_SAMPLES).contains(&spp) {
            let (name, expected) = ("samples per pixel", "1 to 65536");
            return Err(RenderError::Setting { name, found: spp.into(), expected });
        }
        if !(1..=MAX_DEPTH).contains(&self.max_depth) {
            let (name, expected) = ("ray depth", "1 to 64");
            return Err(RenderError::Setting { name, found: self.max_depth.into(), expected });
        }
        if self.threads == Some(0) {
            return Err(RenderError::Setting { name: "threads", found: 0, expected: "at least 1" });
        }
        Ok([width, height])
    }
}
