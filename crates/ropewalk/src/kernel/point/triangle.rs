//! The point of a triangle that is nearest to a point.
//!
//! Four points of the triangle are looked at: the nearest of each edge, and the foot of the
//! perpendicular with its weights clamped to the triangle. Each is a mixture of the vertices, so whatever
//! rounding does to the weights, a distance is never less than the triangle's, but for a few roundings.
//! Nothing is divided by a small area that decides: where a sliver's normal is rounding alone, an edge is
//! as near.

#![allow(unsafe_code)]

use crate::kernel::beam::Doubles;

/// A point `a + v (b - a) + w (c - a)` of a triangle.
#[derive(Clone, Copy)]
pub struct Foot<D> {
    /// Squared distance from the point asked for.
    pub distance2: D,
    /// Weight of vertex 1.
    pub v: D,
    /// Weight of vertex 2.
    pub w: D,
}

/// The points looked at: of the edges `ab`, `bc` and `ac`, and inside.
///
/// # Safety
/// The machine must have the features of `D`'s level, and the caller must enable them.
#[inline(always)]
pub unsafe fn feet<D: Doubles>(p: [D; 3], [a, b, c]: [[D; 3]; 3]) -> [Foot<D>; 4] {
    // SAFETY: passed on to the caller.
    let (zero, one) = unsafe { (D::splat(0.0), D::splat(1.0)) };
    let (ab, ac, bc) = (minus(b, a), minus(c, a), minus(c, b));
    let (ap, bp) = (minus(p, a), minus(p, b));

    let t = dot(ap, ab).div(dot(ab, ab)).max(zero).min(one);
    let on_ab = Foot { distance2: square(minus(ap, times(ab, t))), v: t, w: zero };
    let t = dot(bp, bc).div(dot(bc, bc)).max(zero).min(one);
    let on_bc = Foot { distance2: square(minus(bp, times(bc, t))), v: one - t, w: t };
    let t = dot(ap, ac).div(dot(ac, ac)).max(zero).min(one);
    let on_ac = Foot { distance2: square(minus(ap, times(ac, t))), v: zero, w: t };

    let normal = cross(ab, ac);
    let area2 = square(normal);
    let v = dot(cross(ap, ac), normal).div(area2).max(zero).min(one);
    let w = dot(cross(ab, ap), normal).div(area2).max(zero).min(one - v);
    let offset = minus(minus(ap, times(ab, v)), times(ac, w));
    [on_ab, on_bc, on_ac, Foot { distance2: square(offset), v, w }]
}

/// The squared distance of a point from a triangle in each lane; NaN in lanes without one.
///
/// # Safety
/// As for [`feet`].
#[inline(always)]
pub unsafe fn distance2<D: Doubles>(p: [D; 3], corners: [[D; 3]; 3]) -> D {
    // SAFETY: passed on to the caller.
    let [ab, bc, ac, inside] = unsafe { feet(p, corners) };
    ab.distance2.min(bc.distance2).min(ac.distance2).min(inside.distance2)
}

/// The smallest squared distance of a point from the boxes of the triangles, NaN in lanes without one.
///
/// # Safety
/// As for [`feet`].
#[inline(always)]
pub unsafe fn box_distance2<D: Doubles>(p: [D; 3], [a, b, c]: [[D; 3]; 3]) -> D {
    // SAFETY: passed on to the caller.
    let zero = unsafe { D::splat(0.0) };
    let mut sum = zero;
    for i in 0..3 {
        let low = a[i].min(b[i]).min(c[i]);
        let high = a[i].max(b[i]).max(c[i]);
        let gap = zero.max(low - p[i]).max(p[i] - high);
        sum = sum + gap * gap;
    }
    sum
}

/// The nearest point of a triangle: the first of the nearest of [`feet`].
pub fn nearest_foot(p: [f64; 3], triangle: [[f64; 3]; 3]) -> Foot<f64> {
    // SAFETY: portable code.
    let [ab, bc, ac, inside] = unsafe { feet(p, triangle) };
    let mut nearest = ab;
    for foot in [bc, ac, inside] {
        if foot.distance2 < nearest.distance2 {
            nearest = foot;
        }
    }
    nearest
}

#[inline(always)]
fn minus<D: Doubles>(p: [D; 3], q: [D; 3]) -> [D; 3] {
    [p[0] - q[0], p[1] - q[1], p[2] - q[2]]
}

#[inline(always)]
fn times<D: Doubles>(p: [D; 3], t: D) -> [D; 3] {
    [p[0] * t, p[1] * t, p[2] * t]
}

#[inline(always)]
fn dot<D: Doubles>(p: [D; 3], q: [D; 3]) -> D {
    p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
}

#[inline(always)]
fn square<D: Doubles>(p: [D; 3]) -> D {
    dot(p, p)
}

#[inline(always)]
fn cross<D: Doubles>(p: [D; 3], q: [D; 3]) -> [D; 3] {
    [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
}
