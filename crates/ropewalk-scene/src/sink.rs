//! Scenes as sinks and as sources of scene pieces.

use crate::model::{Camera, Light, Material, Object, Scene, SceneSink, Surface};
use crate::nff::{NffError, NffLimits, NffReadError, read_nff};
use std::convert::Infallible;
use std::io::BufRead;

impl Default for Material {
    /// The material of objects that precede every `f`: matte white.
    fn default() -> Self {
        Material {
            color: [1.0; 3],
            kd: 1.0,
            ks: 0.0,
            shine: 1.0,
            transmittance: 0.0,
            index_of_refraction: 1.0,
        }
    }
}

/// Collects the pieces; comments are dropped, later views and backgrounds replace earlier ones.
impl SceneSink for Scene {
    type Error = Infallible;

    fn comment(&mut self, _: &str) -> Result<(), Infallible> {
        Ok(())
    }

    fn background(&mut self, color: [f64; 3]) -> Result<(), Infallible> {
        self.background = color;
        Ok(())
    }

    fn camera(&mut self, camera: &Camera) -> Result<(), Infallible> {
        self.camera = Some(*camera);
        Ok(())
    }

    fn light(&mut self, light: &Light) -> Result<(), Infallible> {
        self.lights.push(*light);
        Ok(())
    }

    fn material(&mut self, material: &Material) -> Result<(), Infallible> {
        self.materials.push(*material);
        Ok(())
    }

    fn surface(&mut self, surface: &Surface) -> Result<(), Infallible> {
        if self.materials.is_empty() {
            self.materials.push(Material::default());
        }
        let material = (self.materials.len() - 1) as u32;
        self.objects.push(Object { surface: surface.clone(), material });
        Ok(())
    }
}

impl Scene {
    /// Reads a scene from an NFF text; its name is left empty. See [`read_nff`].
    ///
    /// # Errors
    /// [`NffError`] at the first fault of the text.
    pub fn read_nff<R: BufRead>(input: R, limits: &NffLimits) -> Result<Scene, NffError> {
        let mut scene = Scene::default();
        match read_nff(input, limits, &mut scene) {
            Ok(_) => Ok(scene),
            Err(NffReadError::Input(error)) => Err(error),
            Err(NffReadError::Sink(never)) => match never {},
        }
    }

    /// Hands the scene to `sink`: background, view, lights, then objects in order, each preceded by
    /// its material where that is not the current one. Unused materials are handed over too, so
    /// that a scene whose material indices do not decrease (as every scene that was read) arrives
    /// equal. An index beyond the materials stands for the default one.
    ///
    /// # Errors
    /// Those of `sink`.
    pub fn write_to<S: SceneSink>(&self, sink: &mut S) -> Result<(), S::Error> {
        sink.background(self.background)?;
        self.camera.iter().try_for_each(|camera| sink.camera(camera))?;
        self.lights.iter().try_for_each(|light| sink.light(light))?;
        let mut handed_over = 0;
        let mut current = None;
        for object in &self.objects {
            let wanted = object.material as usize;
            if current != Some(wanted) {
                match self.materials.get(handed_over..=wanted) {
                    Some(next) if !next.is_empty() => {
                        next.iter().try_for_each(|material| sink.material(material))?;
                        handed_over = wanted + 1;
                    }
                    _ => {
                        sink.material(&self.materials.get(wanted).copied().unwrap_or_default())?;
                    }
                }
                current = Some(wanted);
            }
            sink.surface(&object.surface)?;
        }
        let rest = self.materials.get(handed_over..).unwrap_or_default();
        rest.iter().try_for_each(|material| sink.material(material))
    }
}
