//! Phong's model with the materials of NFF.

use crate::vec3::{Vec3, add, add_scaled, dot, mul, scale};
use ropewalk_scene::Material;

/// Ambient light off a surface: the intensity times the diffuse colour.
pub(crate) fn ambient(material: &Material, intensity: f64) -> Vec3 {
    scale(material.color, material.kd * intensity)
}

/// Light off a surface from one light that it faces: `Kd * color * (N.L)` plus, where the surface
/// is reflective (SPD, testing procedure 4), a white highlight `Ks * (R.V)^Shine`.
///
/// All vectors have unit length and point away from the surface.
pub(crate) fn direct(
    material: &Material,
    intensity: Vec3,
    normal: Vec3,
    to_light: Vec3,
    to_viewer: Vec3,
) -> Vec3 {
    let facing = dot(normal, to_light).max(0.0);
    let diffuse = scale(material.color, material.kd * facing);
    let highlight = material.ks * phong_lobe(normal, to_light, to_viewer, material.shine);
    mul(intensity, add(diffuse, [highlight; 3]))
}

/// `(R.V)^shine` with `R` the mirrored light direction, 0 behind it. The cosine is clamped to 1, so
/// that rounding cannot blow up under exponents such as 100000, which the generators write for
/// surfaces without a highlight; a negative exponent counts as 0.
fn phong_lobe(normal: Vec3, to_light: Vec3, to_viewer: Vec3, shine: f64) -> f64 {
    let mirrored = add_scaled(scale(to_light, -1.0), 2.0 * dot(normal, to_light), normal);
    let cosine = dot(mirrored, to_viewer).min(1.0);
    if cosine > 0.0 { cosine.powf(shine.max(0.0)) } else { 0.0 }
}

/// `dir` mirrored at the plane with unit normal `normal`.
pub(crate) fn mirrored(dir: Vec3, normal: Vec3) -> Vec3 {
    add_scaled(dir, -2.0 * dot(dir, normal), normal)
}

/// `dir` (unit length) refracted by Snell's law at a surface whose unit `normal` is on the side of
/// arrival; `eta` is the index of refraction of that side over the one of the other side. `None`
/// on total internal reflection.
pub(crate) fn refracted(dir: Vec3, normal: Vec3, eta: f64) -> Option<Vec3> {
    let cos_in = -dot(dir, normal);
    let sin2_out = eta * eta * (1.0 - cos_in * cos_in).max(0.0);
    if sin2_out > 1.0 {
        return None;
    }
    let cos_out = (1.0 - sin2_out).sqrt();
    Some(add_scaled(scale(dir, eta), eta * cos_in - cos_out, normal))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vec3::{cross, length, unit};

    #[test]
    fn refraction_obeys_snell_and_stays_in_the_plane() {
        let n = [0.0, 0.0, 1.0];
        for (k, eta) in [(1, 1.0 / 1.5), (20, 1.0 / 1.5), (60, 1.0 / 1.1), (35, 1.5), (89, 0.4)] {
            let a = f64::from(k) * std::f64::consts::PI / 180.0;
            let d = [a.sin(), 0.0, -a.cos()];
            let r = refracted(d, n, eta).expect("below the critical angle");
            assert!((length(r) - 1.0).abs() < 1e-12);
            assert!((length(cross(r, n)) - eta * a.sin()).abs() < 1e-12, "{k} {eta}");
            assert!(r[2] < 0.0 && r[1].abs() < 1e-15);
        }
    }

    #[test]
    fn above_the_critical_angle_nothing_is_refracted() {
        let critical = (1.0f64 / 1.5).asin();
        let at = |a: f64| refracted([a.sin(), 0.0, -a.cos()], [0.0, 0.0, 1.0], 1.5);
        assert!(at(critical - 1e-6).is_some());
        assert!(at(critical + 1e-6).is_none());
    }

    #[test]
    fn highlights_survive_huge_exponents() {
        let n = unit([0.3, -0.2, 0.9]).expect("not zero");
        assert!((phong_lobe(n, n, n, 100_000.0) - 1.0).abs() < 1e-9);
        let aside = unit([0.31, -0.2, 0.9]).expect("not zero");
        let lobe = phong_lobe(n, aside, n, 100_000.0);
        assert!((0.0..0.01).contains(&lobe));
        assert_eq!(phong_lobe(n, n, scale(n, -1.0), 0.0), 0.0);
    }
}
