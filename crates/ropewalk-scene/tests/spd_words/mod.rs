//! Scenes as the words that the published programs print: the unit in which the generators are
//! compared with published files.

use ropewalk_scene::spd::{Spd, generate};
use ropewalk_scene::{Camera, Light, Material, SceneSink, Surface};

/// A number as C prints it with `%g`: six significant digits, trailing zeros removed, with an
/// exponent below 1e-4 and from 1e6 on. Exact ties go to the even digit, as in glibc.
pub fn percent_g(x: f64) -> String {
    const DIGITS: i32 = 6;
    let scientific = format!("{:.*e}", DIGITS as usize - 1, x);
    let (mantissa, exponent) = scientific.split_once('e').expect("finite");
    let exponent: i32 = exponent.parse().expect("an integer");
    let trimmed = |text: &str| match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text.to_owned(),
    };
    if (-4..DIGITS).contains(&exponent) {
        trimmed(&format!("{x:.*}", (DIGITS - 1 - exponent) as usize))
    } else {
        let sign = if exponent < 0 { '-' } else { '+' };
        format!("{}e{sign}{:02}", trimmed(mantissa), exponent.abs())
    }
}

/// Takes a scene as words, one call a piece.
pub struct Words<F>(pub F);

impl<F: FnMut(&str)> Words<F> {
    fn entity(&mut self, name: &str, numbers: &[f64]) {
        (self.0)(name);
        self.numbers(numbers);
    }

    fn numbers(&mut self, numbers: &[f64]) {
        numbers.iter().for_each(|&number| (self.0)(&percent_g(number)));
    }
}

impl<F: FnMut(&str)> SceneSink for Words<F> {
    type Error = std::convert::Infallible;

    fn comment(&mut self, _: &str) -> Result<(), Self::Error> {
        Ok(())
    }

    fn background(&mut self, color: [f64; 3]) -> Result<(), Self::Error> {
        self.entity("b", &color);
        Ok(())
    }

    fn camera(&mut self, camera: &Camera) -> Result<(), Self::Error> {
        self.entity("v", &[]);
        self.entity("from", &camera.from);
        self.entity("at", &camera.at);
        self.entity("up", &camera.up);
        self.entity("angle", &[camera.angle]);
        self.entity("hither", &[camera.hither]);
        self.entity("resolution", &camera.resolution.map(f64::from));
        Ok(())
    }

    fn light(&mut self, light: &Light) -> Result<(), Self::Error> {
        self.entity("l", &light.position);
        if let Some(color) = &light.color {
            self.numbers(color);
        }
        Ok(())
    }

    fn material(&mut self, m: &Material) -> Result<(), Self::Error> {
        let [r, g, b] = m.color;
        self.entity("f", &[r, g, b, m.kd, m.ks, m.shine, m.transmittance, m.index_of_refraction]);
        Ok(())
    }

    fn surface(&mut self, surface: &Surface) -> Result<(), Self::Error> {
        match surface {
            Surface::Sphere { center, radius } => {
                self.entity("s", center);
                self.numbers(&[*radius]);
            }
            Surface::Cone(cone) => {
                let ([a, b, c], [d, e, f]) = (cone.base, cone.apex);
                self.entity("c", &[a, b, c, cone.base_radius, d, e, f, cone.apex_radius]);
            }
            Surface::Polygon(vertices) => {
                self.entity("p", &[vertices.len() as f64]);
                vertices.iter().for_each(|v| self.numbers(v));
            }
            Surface::Patch { vertices, normals } => {
                self.entity("pp", &[vertices.len() as f64]);
                for (v, n) in vertices.iter().zip(normals) {
                    self.numbers(v);
                    self.numbers(n);
                }
            }
        }
        Ok(())
    }
}

/// Calls `visit` with each word of a scene, in order.
pub fn each_word(spd: Spd, size: u32, visit: impl FnMut(&str)) {
    generate(spd, size, &mut Words(visit)).expect("a valid size and a sink that takes everything");
}
