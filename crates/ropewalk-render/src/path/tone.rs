//! From radiance to the bytes of a display.

use super::film::Film;
use crate::image::Image;
use glam::{Mat3, Vec3};

/// How radiance becomes display values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tone {
    /// AgX (T. Sobotka 2022), by B. Wrensch's polynomial of its contrast curve (2023): bright colours fade to white
    /// as on film.
    #[default]
    Agx,
    /// Values above 1 are cut off.
    Clip,
}

impl Tone {
    /// All of them.
    pub const ALL: [Tone; 2] = [Tone::Agx, Tone::Clip];

    /// Name on command lines.
    pub const fn name(self) -> &'static str {
        match self {
            Tone::Agx => "agx",
            Tone::Clip => "clip",
        }
    }
}

/// Into AgX's working space, columns.
const INSET: Mat3 = Mat3::from_cols_array(&[
    0.842_479_06,
    0.042_328_24,
    0.042_375_654,
    0.078_433_6,
    0.878_468_6,
    0.078_433_6,
    0.079_223_745,
    0.079_166_13,
    0.879_143,
]);

/// And back.
const OUTSET: Mat3 = Mat3::from_cols_array(&[
    1.196_879,
    -0.052_896_85,
    -0.052_971_635,
    -0.098_020_88,
    1.151_903_1,
    -0.098_043_45,
    -0.099_029_74,
    -0.098_961_18,
    1.151_073_7,
]);

/// Stops from mid-grey that the curve spans, as binary logarithms of radiance.
const STOPS: [f32; 2] = [-12.473_93, 4.026_069];

/// The contrast and the colour that the curve is given ("punchy" is 1.35 and 1.4): its plain form is flat.
const POWER: f32 = 1.25;
const SATURATION: f32 = 1.3;

/// Display values 0 to 1, sRGB encoded, of linear radiance.
pub(crate) fn display(radiance: Vec3, tone: Tone) -> Vec3 {
    let linear = match tone {
        Tone::Clip => radiance,
        Tone::Agx => agx(radiance),
    };
    linear.map(|x| encode_srgb(x.clamp(0.0, 1.0)))
}

fn agx(radiance: Vec3) -> Vec3 {
    let x = (INSET * radiance.max(Vec3::ZERO)).max(Vec3::splat(1e-10));
    let x = x.map(|x| ((x.log2() - STOPS[0]) / (STOPS[1] - STOPS[0])).clamp(0.0, 1.0));
    let x2 = x * x;
    let x4 = x2 * x2;
    let curve =
        15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x
            - Vec3::splat(0.00232);
    let punchy = curve.max(Vec3::ZERO).powf(POWER);
    let grey = Vec3::splat(super::bsdf::luminance(punchy));
    let vivid = grey + SATURATION * (punchy - grey);
    // What comes out is encoded for a display of gamma 2.2.
    (OUTSET * vivid).max(Vec3::ZERO).powf(2.2)
}

fn encode_srgb(x: f32) -> f32 {
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

/// The exposure, in stops, at which the geometric mean of a picture's luminance becomes mid-grey (E. Reinhard et al.,
/// "Photographic Tone Reproduction for Digital Images", 2002).
pub fn automatic_exposure(film: &Film) -> f32 {
    let bright: Vec<f32> =
        film.radiance().into_iter().map(|c| super::bsdf::luminance(Vec3::from_array(c))).collect();
    let lit: Vec<f64> = bright.iter().filter(|&&y| y > 0.0).map(|&y| f64::from(y).ln()).collect();
    if lit.is_empty() {
        return 0.0;
    }
    let mean = (lit.iter().sum::<f64>() / lit.len() as f64).exp();
    (0.18 / mean).log2() as f32
}

/// The picture for a display: radiance times `2^exposure`, tone-mapped and sRGB-encoded.
pub fn developed(film: &Film, exposure: f32, tone: Tone) -> Image {
    let [width, height] = film.size();
    let mut image = Image::filled(width, height, [0.0; 3]);
    for (pixel, radiance) in image.pixels_mut().iter_mut().zip(film.radiance()) {
        *pixel = display(Vec3::from_array(radiance) * exposure.exp2(), tone).to_array();
    }
    image
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_rise_and_stay_in_range() {
        for tone in Tone::ALL {
            let mut last = -1.0;
            for i in -120..60 {
                let y = display(Vec3::splat((i as f32 / 8.0).exp2()), tone).x;
                assert!((0.0..=1.0).contains(&y) && y >= last - 1e-3, "{tone:?} {i}: {y} {last}");
                last = y;
            }
        }
        let grey = display(Vec3::splat(0.18), Tone::Agx);
        assert!(grey.x > 0.35 && grey.x < 0.55 && (grey.x - grey.z).abs() < 0.01, "{grey}");
        let half = display(Vec3::splat(0.5), Tone::Clip).x;
        assert!((half - 0.7354).abs() < 1e-3, "{half}");
        let odd = display(Vec3::new(f32::NAN, -1.0, f32::INFINITY), Tone::Agx);
        assert!(odd.is_finite(), "{odd}");
    }
}
