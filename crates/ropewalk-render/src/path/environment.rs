//! Light from infinitely far away: a picture of all directions, from a file or of a plain sky.

use super::bsdf::luminance;
use super::distribution::Distribution;
use crate::error::RenderError;
use glam::Vec3;
use std::f32::consts::{PI, TAU};
use std::path::Path;

/// Size of the table of the built-in sky.
const SKY: [u32; 2] = [512, 256];

/// Most pixels of a picture from a file.
const MAX_PIXELS: u64 = 1 << 27;

/// Radiance from all directions: a picture by longitude (across) and latitude (down), the zenith being its upper
/// edge. Directions are given in a frame whose third axis is up.
#[derive(Clone, Debug)]
pub struct Environment {
    width: u32,
    height: u32,
    radiance: Vec<Vec3>,
    table: Distribution,
    /// Integral of the luminance over all directions that are sampled.
    power: f32,
}

impl Environment {
    /// From pixels, row by row from the zenith; longitude grows to the left, seen from inside, and begins where the
    /// first axis is.
    ///
    /// # Errors
    /// [`RenderError::Environment`] if a value is negative or not finite, or if there is not one for each pixel.
    pub fn new(width: u32, height: u32, pixels: &[[f32; 3]]) -> Result<Self, RenderError> {
        let fail = |what: String| Err(RenderError::Environment { what });
        if width == 0 || height == 0 || pixels.len() as u64 != u64::from(width) * u64::from(height)
        {
            return fail(format!("expected {width} x {height} pixels, found {}", pixels.len()));
        }
        let sound = |p: &[f32; 3]| p.iter().all(|x| x.is_finite() && *x >= 0.0);
        if let Some(at) = pixels.iter().position(|p| !sound(p)) {
            let (x, y) = (at as u32 % width, at as u32 / width);
            let found = pixels[at];
            return fail(format!(
                "expected numbers from 0 on at column {x}, row {y}, found {found:?}"
            ));
        }
        let radiance: Vec<Vec3> = pixels.iter().map(|&p| Vec3::from_array(p)).collect();
        Ok(Self::of(width, height, radiance, height))
    }

    /// Of which so many rows are worth sampling.
    fn of(width: u32, height: u32, radiance: Vec<Vec3>, rows: u32) -> Self {
        let (w, h) = (width as usize, height as usize);
        let mut weights = vec![0f64; w * h];
        let mut power = 0.0;
        for y in 0..rows as usize {
            let sine = (PI * (y as f32 + 0.5) / h as f32).sin();
            for x in 0..w {
                // Values between pixels come from their neighbours: where these shine, light must be looked for.
                let mut around = 0.0;
                for row in [y.saturating_sub(1), y, (y + 1).min(h - 1)] {
                    for column in [x + w - 1, x, x + 1] {
                        around += luminance(radiance[row * w + column % w]);
                    }
                }
                weights[y * w + x] = f64::from(around / 9.0 * sine);
                power += f64::from(luminance(radiance[y * w + x]) * sine);
            }
        }
        let power = (power * f64::from(2.0 * PI * PI) / (w * h) as f64) as f32;
        Environment { width, height, radiance, table: Distribution::new(w, &weights), power }
    }

    /// The same radiance from everywhere.
    pub fn even(radiance: [f32; 3]) -> Self {
        Self::of(1, 1, vec![Vec3::from_array(radiance)], 1)
    }

    /// Reads a picture of linear radiance: Radiance HDR (`.hdr`) or OpenEXR (`.exr`).
    ///
    /// # Errors
    /// [`RenderError::Environment`], naming the file.
    pub fn read(path: &Path) -> Result<Self, RenderError> {
        let fail =
            |what: String| RenderError::Environment { what: format!("{}: {what}", path.display()) };
        let extension = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
        let format = match extension.as_deref() {
            Some("hdr") => image::ImageFormat::Hdr,
            Some("exr") => image::ImageFormat::OpenExr,
            _ => return Err(fail("expected a name that ends in .hdr or .exr".to_owned())),
        };
        let bytes = std::fs::read(path).map_err(|e| fail(format!("cannot read it: {e}")))?;
        let mut reader = image::ImageReader::with_format(std::io::Cursor::new(bytes), format);
        let mut limits = image::Limits::default();
        limits.max_alloc = Some(MAX_PIXELS * 16);
        reader.limits(limits);
        let picture = reader
            .decode()
            .map_err(|e| fail(format!("expected a whole picture: {e}")))?
            .into_rgb32f();
        let pixels: Vec<[f32; 3]> = picture.pixels().map(|p| p.0).collect();
        Self::new(picture.width(), picture.height(), &pixels).map_err(|error| match error {
            RenderError::Environment { what } => fail(what),
            other => other,
        })
    }

    /// A clear sky without its sun: blue above, pale at the horizon; below it the colour of lit ground. Where there is
    /// ground, nothing is lit from below the horizon, and it is not sampled.
    pub fn sky(has_ground: bool) -> Self {
        let (zenith, horizon) = (Vec3::new(0.17, 0.25, 0.42), Vec3::new(0.55, 0.59, 0.63));
        let ground = Vec3::new(0.48, 0.465, 0.45);
        let [width, height] = SKY;
        let row = |y: u32| {
            let up = (PI * (y as f32 + 0.5) / height as f32).cos();
            if up < 0.0 {
                return ground.lerp(horizon, (1.0 + up / 0.03).max(0.0));
            }
            horizon.lerp(zenith, 1.0 - (1.0 - up).powi(4))
        };
        let radiance = (0..height).flat_map(|y| std::iter::repeat_n(row(y), width as usize));
        let rows = if has_ground { height / 2 } else { height };
        Self::of(width, height, radiance.collect(), rows)
    }

    /// Radiance that comes from a direction.
    #[cfg(test)]
    fn radiance(&self, direction: Vec3) -> Vec3 {
        self.radiance_at(place(direction))
    }

    /// Radiance that comes from a direction, and the density of [`Environment::sample`] there by solid angle.
    pub(crate) fn radiance_and_density(&self, direction: Vec3) -> (Vec3, f32) {
        let at = place(direction);
        (self.radiance_at(at), self.density_at(at, direction.truncate().length()))
    }

    /// Radiance from a place in the picture, 0 to 1 across and down.
    fn radiance_at(&self, [u, v]: [f32; 2]) -> Vec3 {
        let (x, y) = (u * self.width as f32 - 0.5, v * self.height as f32 - 0.5);
        let (w, h) = (i64::from(self.width), i64::from(self.height));
        let (column, row) = (x.floor() as i64, y.floor() as i64);
        let at = |column: i64, row: i64| {
            // From one before the first to one behind the last.
            let column = if column < 0 {
                w - 1
            } else if column >= w {
                0
            } else {
                column
            };
            let row = row.clamp(0, h - 1);
            self.radiance[(row * w + column) as usize]
        };
        let across = x - column as f32;
        let along = |row: i64| at(column, row).lerp(at(column + 1, row), across);
        along(row).lerp(along(row + 1), y - row as f32)
    }

    /// A direction by the radiance from there, that radiance, and the direction's density; `None` if nothing shines.
    pub(crate) fn sample(&self, u: [f32; 2]) -> Option<(Vec3, Vec3, f32)> {
        if self.table.is_empty() {
            return None;
        }
        let ([x, y], density) = self.table.sample(u);
        let ((sin_phi, cos_phi), (sin_theta, cos_theta)) =
            ((TAU * x).sin_cos(), (PI * y).sin_cos());
        let direction = Vec3::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta);
        Some((direction, self.radiance_at([x, y]), by_solid_angle(density, sin_theta)))
    }

    /// The density of [`Environment::sample`] by solid angle, at a place whose angle to the zenith has this sine.
    fn density_at(&self, place: [f32; 2], sine: f32) -> f32 {
        if self.table.is_empty() {
            return 0.0;
        }
        by_solid_angle(self.table.density(place), sine)
    }

    /// The integral of the luminance over all directions that are sampled.
    pub(crate) fn power(&self) -> f32 {
        self.power
    }
}

/// A density over the picture as one by solid angle, where the angle to the zenith has this sine.
fn by_solid_angle(density: f32, sine: f32) -> f32 {
    density / (2.0 * PI * PI * sine.max(1e-6))
}

/// Where a direction lies in the picture, 0 to 1 across and down.
fn place(d: Vec3) -> [f32; 2] {
    let turn = d.y.atan2(d.x) / TAU;
    [if turn < 0.0 { turn + 1.0 } else { turn }, d.z.clamp(-1.0, 1.0).acos() / PI]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The density integrates to 1, and sampling by it integrates radiance.
    #[test]
    fn directions_come_by_radiance() {
        let pixels: Vec<[f32; 3]> =
            (0..32 * 16).map(|i| [if i % 37 == 0 { 40.0 } else { 0.3 }; 3]).collect();
        let map = Environment::new(32, 16, &pixels).expect("sound");
        let n = 512;
        let (mut total, mut even) = (0.0, 0.0);
        for i in 0..n {
            for j in 0..n {
                let at = |k: i32| (k as f32 + 0.5) / n as f32;
                let (direction, radiance, density) = map.sample([at(i), at(j)]).expect("bright");
                let (met, met_density) = map.radiance_and_density(direction);
                assert!((met - radiance).length() < 1e-2 * radiance.length(), "{met} {radiance}");
                assert!((met_density / density - 1.0).abs() < 0.02 || density < 1e-3);
                total += f64::from(radiance.x / density);
                let (z, phi) = (1.0 - 2.0 * at(i), TAU * at(j));
                let r = (1.0 - z * z).sqrt();
                even += f64::from(map.radiance(Vec3::new(r * phi.cos(), r * phi.sin(), z)).x);
            }
        }
        let (total, even) =
            (total / f64::from(n * n), even / f64::from(n * n) * 4.0 * f64::from(PI));
        assert!((total / even - 1.0).abs() < 0.01, "{total} {even}");
        assert!((f64::from(map.power()) / even - 1.0).abs() < 0.02, "{}", map.power());
    }

    #[test]
    fn unusable_pictures_are_refused() {
        let sentence =
            |result: Result<Environment, RenderError>| result.expect_err("refused").to_string();
        assert!(sentence(Environment::new(2, 1, &[[0.0; 3]])).contains("2 x 1 pixels, found 1"));
        let nan = Environment::new(1, 2, &[[0.0; 3], [0.0, f32::NAN, 0.0]]);
        assert!(sentence(nan).contains("column 0, row 1"));
        assert!(sentence(Environment::read(Path::new("a.png"))).contains(".hdr or .exr"));
        assert!(Environment::even([0.0; 3]).sample([0.5, 0.5]).is_none());
    }
}
