//! How much light a boundary reflects.

use glam::Vec3;

/// Schlick's approximation (1994) from the reflectance at normal incidence.
pub(crate) fn schlick(f0: f32, cosine: f32) -> f32 {
    f0 + (at_grazing(f0) - f0) * (1.0 - cosine.clamp(0.0, 1.0)).powi(5)
}

/// The reflectance at grazing incidence: full, but for boundaries that hardly reflect, so that one between like media
/// reflects nothing.
pub(crate) fn at_grazing(f0: f32) -> f32 {
    (50.0 * f0).min(1.0)
}

/// The reflectance at normal incidence of a dielectric in air.
pub(crate) fn normal_incidence(ior: f32) -> f32 {
    ((ior - 1.0) / (ior + 1.0)).powi(2)
}

/// Fresnel's equations for unpolarised light that comes from `w` to a facet with normal `m`, `w . m` being positive:
/// the share that is reflected, and where the rest goes (Snell's law), `None` on total reflection. `eta` is the index
/// of refraction behind the facet over that before it.
pub(crate) fn dielectric(w: Vec3, m: Vec3, eta: f32) -> (f32, Option<Vec3>) {
    let cosine = w.dot(m).clamp(0.0, 1.0);
    let sine2 = (1.0 - cosine * cosine) / (eta * eta);
    if sine2 >= 1.0 {
        return (1.0, None);
    }
    let inner = (1.0 - sine2).sqrt();
    let parallel = (eta * cosine - inner) / (eta * cosine + inner);
    let crossed = (cosine - eta * inner) / (cosine + eta * inner);
    let share = 0.5 * (parallel * parallel + crossed * crossed);
    let out = -w / eta + (cosine / eta - inner) * m;
    (share, Some(out.normalize()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn glass_reflects_four_percent_and_all_beyond_the_critical_angle() {
        let (share, out) = dielectric(Vec3::Z, Vec3::Z, 1.5);
        assert!((share - 0.04).abs() < 1e-6 && (share - normal_incidence(1.5)).abs() < 1e-6);
        assert!((out.expect("refracted") + Vec3::Z).length() < 1e-6);
        let steep = Vec3::new(0.8, 0.0, 0.6);
        assert_eq!(dielectric(steep, Vec3::Z, 1.0 / 1.5), (1.0, None));
        let (_, out) = dielectric(steep, Vec3::Z, 1.5);
        assert!((out.expect("refracted").x + 0.8 / 1.5).abs() < 1e-6);
    }

    /// Brewster's angle: light polarised in the plane of incidence is not reflected.
    #[test]
    fn half_of_the_light_is_left_at_brewsters_angle() {
        let angle = 1.5f32.atan();
        let (share, _) = dielectric(Vec3::new(angle.sin(), 0.0, angle.cos()), Vec3::Z, 1.5);
        let crossed = (1.5f32 * 1.5 - 1.0) / (1.5 * 1.5 + 1.0);
        assert!((share - 0.5 * crossed * crossed).abs() < 1e-6, "{share}");
    }
}
