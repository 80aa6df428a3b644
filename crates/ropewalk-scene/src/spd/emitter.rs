//! What the generators speak through: one call an object, one buffer for all of them.

use super::transform::Vec3;
use crate::{Camera, Cone, Light, Material, SceneSink, Surface};

/// The sky blue that most databases have behind them.
pub(super) const SKY: Vec3 = [0.078, 0.361, 0.753];

/// Phong exponent of a surface without a highlight.
const NO_HIGHLIGHT: f64 = 100_000.0;

/// The Phong exponent at which a highlight falls to half its strength at `half_angle` degrees;
/// below 90 degrees, as all databases are.
fn phong_exponent(half_angle: f64) -> f64 {
    let radians = std::f64::consts::PI * half_angle / 180.0;
    if radians > 0.0 { 0.5f64.ln() / radians.cos().ln() } else { NO_HIGHLIGHT }
}

/// A material in the terms of the databases; `half_angle` in degrees, 0 for no highlight.
pub(super) struct Finish {
    pub(super) color: Vec3,
    pub(super) kd: f64,
    pub(super) ks: f64,
    pub(super) half_angle: f64,
    pub(super) transmittance: f64,
    pub(super) index_of_refraction: f64,
}

impl Finish {
    /// A surface that scatters only, with no reflection, highlight or transmission.
    pub(super) const fn matte(color: Vec3, kd: f64) -> Finish {
        Finish { color, kd, ks: 0.0, half_angle: 0.0, transmittance: 0.0, index_of_refraction: 0.0 }
    }

    /// An opaque surface with a highlight of `half_angle` degrees.
    pub(super) const fn shiny(color: Vec3, kd: f64, ks: f64, half_angle: f64) -> Finish {
        Finish { ks, half_angle, ..Finish::matte(color, kd) }
    }

    /// The same surface with an index of refraction.
    pub(super) const fn with_index(self, index_of_refraction: f64) -> Finish {
        Finish { index_of_refraction, ..self }
    }
}

/// Hands objects to a sink. Vertex buffers are used again and again, so that a scene of any size
/// takes no memory here.
pub(super) struct Emitter<'a, S> {
    sink: &'a mut S,
    vertices: Vec<Vec3>,
    normals: Vec<Vec3>,
}

impl<'a, S: SceneSink> Emitter<'a, S> {
    pub(super) fn new(sink: &'a mut S) -> Self {
        Emitter { sink, vertices: Vec::new(), normals: Vec::new() }
    }

    /// Everything before the first material: background, view, lights.
    pub(super) fn head(
        &mut self,
        background: Vec3,
        camera: Camera,
        lights: &[Vec3],
    ) -> Result<(), S::Error> {
        self.sink.background(background)?;
        self.sink.camera(&camera)?;
        lights.iter().try_for_each(|&position| self.sink.light(&Light { position, color: None }))
    }

    /// The material of all objects that follow.
    pub(super) fn finish(&mut self, finish: Finish) -> Result<(), S::Error> {
        self.sink.material(&Material {
            color: finish.color,
            kd: finish.kd,
            ks: finish.ks,
            shine: phong_exponent(finish.half_angle),
            transmittance: finish.transmittance,
            index_of_refraction: finish.index_of_refraction,
        })
    }

    pub(super) fn sphere(&mut self, center: Vec3, radius: f64) -> Result<(), S::Error> {
        self.sink.surface(&Surface::Sphere { center, radius })
    }

    pub(super) fn cone(
        &mut self,
        (base, base_radius): (Vec3, f64),
        (apex, apex_radius): (Vec3, f64),
    ) -> Result<(), S::Error> {
        self.sink.surface(&Surface::Cone(Cone { base, base_radius, apex, apex_radius }))
    }

    pub(super) fn polygon(&mut self, vertices: &[Vec3]) -> Result<(), S::Error> {
        let surface = Surface::Polygon(refill(&mut self.vertices, vertices));
        let taken = self.sink.surface(&surface);
        if let Surface::Polygon(buffer) = surface {
            self.vertices = buffer;
        }
        taken
    }

    pub(super) fn patch(&mut self, vertices: &[Vec3], normals: &[Vec3]) -> Result<(), S::Error> {
        let surface = Surface::Patch {
            vertices: refill(&mut self.vertices, vertices),
            normals: refill(&mut self.normals, normals),
        };
        let taken = self.sink.surface(&surface);
        if let Surface::Patch { vertices, normals } = surface {
            (self.vertices, self.normals) = (vertices, normals);
        }
        taken
    }
}

/// The buffer's allocation with new content.
fn refill(buffer: &mut Vec<Vec3>, content: &[Vec3]) -> Vec<Vec3> {
    let mut taken = std::mem::take(buffer);
    taken.clear();
    taken.extend_from_slice(content);
    taken
}
