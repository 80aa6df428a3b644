//! The GGX microsurface: normals, shadowing, visible normals. Directions are unit vectors in a frame whose third
//! axis is the surface normal; `alpha` is above 0.
//!
//! B. Walter et al., "Microfacet Models for Refraction through Rough Surfaces" (2007); E. Heitz, "Understanding the
//! Masking-Shadowing Function in Microfacet-Based BRDFs" (2014) and "Sampling the GGX Distribution of Visible
//! Normals" (2018).

use glam::{Vec2, Vec3};
use std::f32::consts::{PI, TAU};

/// Density of microsurface normals around `m`, by projected area.
pub(crate) fn normals(m: Vec3, alpha: f32) -> f32 {
    // By the tangent, which does not cancel near the normal: alpha may be 0.001.
    let a2 = alpha * alpha;
    let c2 = m.z * m.z;
    let spread = a2 * c2 + (m.x * m.x + m.y * m.y);
    a2 / (PI * spread * spread)
}

/// Smith's auxiliary function.
fn lambda(w: Vec3, alpha: f32) -> f32 {
    let c2 = w.z * w.z;
    let tan2 = (w.x * w.x + w.y * w.y) / c2.max(1e-12);
    0.5 * ((1.0 + alpha * alpha * tan2).sqrt() - 1.0)
}

/// The share of the microsurface that is seen from `w`.
pub(crate) fn seen(w: Vec3, alpha: f32) -> f32 {
    1.0 / (1.0 + lambda(w, alpha))
}

/// The share that is seen from both, heights correlated.
pub(crate) fn seen_from_both(a: Vec3, b: Vec3, alpha: f32) -> f32 {
    1.0 / (1.0 + lambda(a, alpha) + lambda(b, alpha))
}

/// A normal that is visible from `w` (above the surface).
pub(crate) fn sample_visible_normal(w: Vec3, alpha: f32, u: [f32; 2]) -> Vec3 {
    let stretched = Vec3::new(alpha * w.x, alpha * w.y, w.z).normalize();
    let across = Vec2::new(stretched.x, stretched.y);
    let length = across.length();
    let first = if length > 1e-7 { Vec3::new(-across.y, across.x, 0.0) / length } else { Vec3::X };
    let second = stretched.cross(first);
    let (r, phi) = (u[0].sqrt(), TAU * u[1]);
    let (x, y) = (r * phi.cos(), r * phi.sin());
    let s = 0.5 * (1.0 + stretched.z);
    let y = (1.0 - s) * (1.0 - x * x).max(0.0).sqrt() + s * y;
    let z = (1.0 - x * x - y * y).max(0.0).sqrt();
    let m = x * first + y * second + z * stretched;
    Vec3::new(alpha * m.x, alpha * m.y, m.z.max(1e-6)).normalize()
}

/// Density of [`sample_visible_normal`] by solid angle.
pub(crate) fn visible_normal_density(w: Vec3, m: Vec3, alpha: f32) -> f32 {
    seen(w, alpha) * w.dot(m).max(0.0) * normals(m, alpha) / w.z
}
