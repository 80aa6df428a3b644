//! Lights and their intensities.

use crate::vec3::Vec3;
use ropewalk_scene::Scene;

/// A point light ready for shading.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PointLight {
    pub position: Vec3,
    pub intensity: Vec3,
}

/// All light of a scene.
#[derive(Clone, Debug)]
pub(crate) struct Lighting {
    pub lights: Vec<PointLight>,
    pub ambient: f64,
}

impl Lighting {
    /// The scene's lights; without any, one white light at the eye, so that shapes can be seen.
    ///
    /// A light with a colour has that intensity, one without has [`relative_intensity`], which is
    /// also the ambient one. Light does not fade with distance (SPD pictures have none of that).
    pub fn new(scene: &Scene, eye: Vec3) -> Self {
        let ambient = relative_intensity(scene.lights.len().max(1));
        let mut lights: Vec<PointLight> = scene
            .lights
            .iter()
            .map(|l| PointLight {
                position: l.position,
                intensity: l.color.unwrap_or([ambient; 3]),
            })
            .collect();
        if lights.is_empty() {
            lights.push(PointLight { position: eye, intensity: [ambient; 3] });
        }
        Lighting { lights, ambient }
    }
}

/// Intensity of each of `lights` lights and of the ambient term: `sqrt(L) / (2 L)` (SPD Readme,
/// "File Structure").
fn relative_intensity(lights: usize) -> f64 {
    let l = lights as f64;
    l.sqrt() / (2.0 * l)
}
