//! Generalised winding numbers: solid angles, summed one by one ([`winding_number`]) or, from afar, by
//! the moments of many triangles at once ([`WindingMoments`]).

mod moments;

pub use moments::WindingMoments;
pub(crate) use moments::{Moments, NOTHING};

/// The sum of the signed solid angles of triangles, seen from a point, over 4 pi.
pub fn winding_number(point: [f64; 3], triangles: impl Iterator<Item = [[f64; 3]; 3]>) -> f64 {
    let halves: f64 = triangles.map(|triangle| half_solid_angle(point, triangle)).sum();
    // -0.0 where there is nothing.
    halves / std::f64::consts::TAU + 0.0
}

/// Half of the solid angle of a triangle, positive where its back is seen: from inside of a surface
/// whose front is outside (van Oosterom and Strackee, 1983). 0 from its plane, also from the triangle
/// itself, so that a point on a closed surface gets the mean of both sides.
pub(crate) fn half_solid_angle(point: [f64; 3], triangle: [[f64; 3]; 3]) -> f64 {
    let [a, b, c] = triangle.map(|v| std::array::from_fn(|i| v[i] - point[i]));
    half_angle(tangent(a, b, c))
}

/// The tangent of half of the solid angle as sine and cosine, up to a common factor. The same
/// operations in the same order wherever it is inlined, so the same bits.
#[inline(always)]
pub(crate) fn tangent(a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> (f64, f64) {
    let normal = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
    let (la, lb, lc) = (dot(a, a).sqrt(), dot(b, b).sqrt(), dot(c, c).sqrt());
    (dot(a, normal), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb)
}

// No closure: those do not get the vector instructions of what they are inlined into.
#[inline(always)]
fn dot(p: [f64; 3], q: [f64; 3]) -> f64 {
    p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
}

/// The angle of such a tangent.
#[inline(always)]
pub(crate) fn half_angle((sine, cosine): (f64, f64)) -> f64 {
    if sine == 0.0 { 0.0 } else { sine.atan2(cosine) }
}
