//! Triangles, intersected watertight.

use super::planar::{CLIP_SLACK, Extent, SmallLoop, length, loop_ramps, overlap};
use super::{AreaRamp, Crossing, Primitive, ShapeError, Sides, SurfaceNormals};
use crate::aabb::Aabb;
use crate::ray::{PreparedRay, Shear};

/// A triangle by its three vertices; counter-clockwise as seen from the front.
///
/// Intersected after Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection" (JCGT 2013):
/// the vertices are sheared into the ray's frame, where each edge function is the same for both
/// triangles of an edge up to its sign. Products are rounded monotonically, so that a computed sign
/// is right or zero; a zero is computed again exactly, and if it stays it counts as inside: a ray
/// through a shared edge or vertex of a closed mesh is never lost. A triangle that the ray meets
/// exactly edge-on is missed; its neighbours are not.
///
/// Error: a hit lies on the triangle whose vertices are moved by at most `2^-51 |p - origin|`
/// across the ray, and along it off by at most `2^-42` of the triangle's depth; it lies between
/// the depths of the vertices, and `t` is then rounded once to `f32`.
///
/// Deviation: computed in `f64` throughout, with exact products in place of the paper's fall-back
/// to double precision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// The vertices.
    pub vertices: [[f32; 3]; 3],
}

impl Triangle {
    /// A triangle of finite vertices; it may be degenerate and is then never hit.
    ///
    /// # Errors
    /// [`ShapeError::NotFinite`] with the number of the first bad vertex.
    pub fn new(vertices: [[f32; 3]; 3]) -> Result<Self, ShapeError> {
        super::check_points("vertex", &vertices)?;
        Ok(Triangle { vertices })
    }

    /// Twice the area times the unit normal; zero only if the vertices lie on one line exactly.
    pub fn scaled_normal(&self) -> [f64; 3] {
        let [a, b, c] = self.vertices.map(|p| p.map(f64::from));
        let e = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
        let f = [c[0] - a[0], c[1] - a[1], c[2] - a[2]];
        let cross = |i: usize, j: usize| e[i] * f[j] - e[j] * f[i];
        let n = [cross(1, 2), cross(2, 0), cross(0, 1)];
        // A component at the level of its rounding error is computed again without any.
        let size = |v: [f64; 3]| v.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        if size(n) > NORMAL_FILTER * size(e) * size(f) {
            return n;
        }
        let p = self.vertices;
        [exact_orientation(p, 1, 2), exact_orientation(p, 2, 0), exact_orientation(p, 0, 1)]
    }

    /// The vertex whose coordinates are `at(axis)` as the ray of a frame sees it: sheared across, and its depth.
    #[inline(always)]
    pub(crate) fn corner<T: Into<f64>>(at: impl Fn(usize) -> T, frame: &Shear) -> [f64; 3] {
        let [kx, ky, kz] = frame.k;
        let [sx, sy, _] = frame.shear;
        let dz = at(kz).into() - frame.origin[2];
        let dx = at(kx).into() - frame.origin[0];
        let dy = at(ky).into() - frame.origin[1];
        [dx - sx * dz, dy - sy * dz, dz]
    }

    fn unit_normal(&self) -> [f64; 3] {
        let n = self.scaled_normal();
        let len = length(n);
        n.map(|x| x / len)
    }

    /// Where the line of a ray meets the triangle whose vertex `i` has the coordinate `at(i, axis)`,
    /// on one of `sides`, whatever the ray's range. The triangle must not be degenerate. With `f64`
    /// coordinates the differences to the origin are rounded too, the same way for all triangles of a
    /// vertex.
    ///
    /// Written out without arrays of vertices: the batch kernels call it for triangles that lie
    /// elsewhere.
    #[inline(always)]
    pub fn meet<T: Into<f64>>(
        at: impl Fn(usize, usize) -> T,
        frame: &Shear,
        sides: Sides,
    ) -> Option<Meeting> {
        let sz = frame.shear[2];
        let corner = |i: usize| Self::corner(|axis| at(i, axis), frame);
        let (a, b, c) = (corner(0), corner(1), corner(2));
        // Edge functions: no fused operations, or the two triangles of an edge would differ.
        let (mut u, mut v, mut w) = (edge(c, b), edge(a, c), edge(b, a));
        if of_both_signs(u, v, w) {
            return None;
        }
        // A candidate. A small sum may be rounding (a needle, or a triangle seen edge-on), and a
        // zero may be: both are settled without rounding the products.
        let product = |p: [f64; 3], q: [f64; 3]| (p[0] * q[1]).abs() + (p[1] * q[0]).abs();
        let products = product(c, b) + product(a, c) + product(b, a);
        if u == 0.0 || v == 0.0 || w == 0.0 || (u + v + w).abs() < EDGE_FILTER * products {
            (u, v, w) = (edge_exactly(c, b), edge_exactly(a, c), edge_exactly(b, a));
            if of_both_signs(u, v, w) {
                return None;
            }
        }
        // All of one sign: the sum vanishes only for a triangle seen exactly edge-on.
        let det = u + v + w;
        if det == 0.0 || !sides.accepts(-det) {
            return None;
        }
        let depth = (u * a[2] + v * b[2] + w * c[2]) / det;
        let nearest = a[2].min(b[2]).min(c[2]);
        let farthest = a[2].max(b[2]).max(c[2]);
        // Not `clamp`, which panics where an altered file makes these NaN.
        let depth = if depth < nearest { nearest } else { depth };
        let depth = if depth > farthest { farthest } else { depth };
        let t = sz * depth;
        Some(Meeting { t, u: v / det, v: w / det })
    }

    /// The clipped triangle, in a cell widened by `slack`.
    #[inline]
    fn clipped(&self, bounds: &Aabb, cell: &Aabb, slack: [f64; 3]) -> Option<SmallLoop> {
        let corners = self.vertices.map(|p| p.map(f64::from));
        SmallLoop::new(corners).clip(bounds, &Extent::widened(cell, slack))
    }
}

/// A point common to the line of a ray and a triangle.
#[derive(Clone, Copy, Debug)]
pub struct Meeting {
    /// Parameter along the ray, not yet rounded.
    pub t: f64,
    /// Barycentric weight of vertex 1.
    pub u: f64,
    /// Barycentric weight of vertex 2.
    pub v: f64,
}

/// Where the sum of the edge functions is below this share of their products, these are computed
/// again without rounding: the rounding of the products, 2^-53 each, so moves the hit by less than
/// 2^-42 of the triangle's depth.
pub(crate) const EDGE_FILTER: f64 = 1.0 / (1u64 << 11) as f64;

/// The edge function of two sheared vertices: twice the signed area they span with the ray.
#[inline]
fn edge(p: [f64; 3], q: [f64; 3]) -> f64 {
    p[0] * q[1] - p[1] * q[0]
}

/// The same without rounding the products; antisymmetric too.
#[cold]
pub(crate) fn edge_exactly(p: [f64; 3], q: [f64; 3]) -> f64 {
    let (a, b) = (p[0] * q[1], p[1] * q[0]);
    (a - b) + (p[0].mul_add(q[1], -a) - p[1].mul_add(q[0], -b))
}

#[inline]
fn of_both_signs(u: f64, v: f64, w: f64) -> bool {
    (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0)
}

/// A normal below this share of the product of two edges may be rounding alone: the edges carry
/// one rounding each and a component three more, 2^-50 in all; 2^-48 leaves room.
const NORMAL_FILTER: f64 = 1.0 / (1u64 << 48) as f64;

/// Twice the signed area of the triangle's projection on two axes, with the sign right and zero
/// exactly where it is zero: products of `f32` are exact in `f64`, and their sum is kept as an
/// expansion that does not round (Shewchuk 1997, Grow-Expansion).
fn exact_orientation(p: [[f32; 3]; 3], i: usize, j: usize) -> f64 {
    let mut expansion = [0.0f64; 6];
    let mut len = 0;
    for k in 0..3 {
        let (a, b) = (p[k], p[(k + 1) % 3]);
        for term in [f64::from(a[i]) * f64::from(b[j]), -f64::from(a[j]) * f64::from(b[i])] {
            let mut sum = term;
            for part in &mut expansion[..len] {
                // Two-Sum: `total + error` is `sum + part` exactly.
                let total = sum + *part;
                let virtual_part = total - sum;
                let error = (sum - (total - virtual_part)) + (*part - virtual_part);
                *part = error;
                sum = total;
            }
            expansion[len] = sum;
            len += 1;
        }
    }
    expansion.iter().sum()
}

impl Primitive for Triangle {
    #[inline]
    fn bounds(&self) -> Aabb {
        let [a, b, c] = self.vertices;
        Aabb {
            min: std::array::from_fn(|i| a[i].min(b[i]).min(c[i])),
            max: std::array::from_fn(|i| a[i].max(b[i]).max(c[i])),
        }
    }

    #[inline]
    fn clipped_bounds(&self, cell: &Aabb) -> Option<Aabb> {
        let bounds = self.bounds();
        if cell.contains(&bounds) {
            return Some(bounds);
        }
        let loose = overlap(&bounds, cell)?;
        let slack = std::array::from_fn(|a| {
            CLIP_SLACK * f64::from(bounds.min[a].abs().max(bounds.max[a].abs()))
        });
        let Some(clipped) = self.clipped(&bounds, cell, slack) else { return Some(loose) };
        overlap(&clipped.extent().outward(slack), &loose)
    }

    fn area(&self) -> f64 {
        0.5 * length(self.scaled_normal())
    }

    fn area_ramps(&self, cell: &Aabb, axis: usize, out: &mut Vec<AreaRamp>) {
        let bounds = self.bounds();
        if overlap(&bounds, cell).is_some()
            && let Some(clipped) = self.clipped(&bounds, cell, [0.0; 3])
        {
            loop_ramps(clipped.points(), cell, axis, out);
        }
    }

    #[inline]
    fn intersect(&self, ray: &PreparedRay, sides: Sides) -> Option<Crossing> {
        let Meeting { t, u, v } = Self::meet(|i, axis| self.vertices[i][axis], &ray.frame, sides)?;
        let crossing = Crossing::in_range(ray, t)?;
        // Points on one line can enclose a ray only by rounding.
        (!self.is_degenerate()).then_some(Crossing { u: u as f32, v: v as f32, ..crossing })
    }

    fn normals(&self, _point: [f64; 3], _crossing: Crossing) -> SurfaceNormals {
        let n = self.unit_normal();
        SurfaceNormals { geometric: n, shading: n }
    }

    fn is_degenerate(&self) -> bool {
        self.scaled_normal() == [0.0; 3]
    }
}
