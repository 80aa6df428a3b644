//! The definition of every answer about points: all triangles, one after the other.

use super::winding::winding_number;
use super::{ClosestPoint, Crossing, Side, crossing, flushed, is_near};
use crate::geometry::Geometry;
use crate::kernel::point::triangle::nearest_foot;
use crate::primitive::Primitive;

/// Points against all triangles; other primitives and triangles without area are passed over.
#[derive(Clone, Copy)]
pub struct PointBruteForce<'a> {
    /// The triangles.
    pub geometry: &'a Geometry,
}

impl<'a> PointBruteForce<'a> {
    /// Triangles that have an area, with their ids.
    fn triangles(&self) -> impl Iterator<Item = (u32, [[f32; 3]; 3])> + use<'a> {
        let geometry = self.geometry;
        (0..geometry.len() as u32).filter_map(move |id| {
            let triangle = geometry.triangle(id).filter(|t| !t.is_degenerate())?;
            Some((id, triangle.vertices))
        })
    }

    /// The nearest triangle by squared distance in `f64`, of those equally near the lowest; `None`
    /// without triangles and for points that are [none](is_near).
    pub fn closest_point(&self, point: [f64; 3]) -> Option<ClosestPoint> {
        if !is_near(&point) {
            return None;
        }
        let mut best: Option<(f64, u32)> = None;
        for (id, triangle) in self.triangles() {
            let distance2 = nearest_foot(point, &triangle).distance2;
            if best.is_none_or(|(least, _)| distance2 < least) {
                best = Some((distance2, id));
            }
        }
        best.map(|(distance2, prim_id)| closest(self.geometry, point, distance2, prim_id))
    }

    /// On which side of the surface a point is, by the crossings of the ray along +z; outside of the
    /// geometry's box nothing is inside.
    pub fn side(&self, point: [f64; 3]) -> Side {
        let (p, bounds, mut crossings) = (flushed(point), self.geometry.bounds(), 0);
        if !(0..3).all(|a| f64::from(bounds.min[a]) <= p[a] && p[a] <= f64::from(bounds.max[a])) {
            return Side::Outside;
        }
        for (_, triangle) in self.triangles() {
            match crossing(p, &triangle) {
                Crossing::Passes => {}
                Crossing::Crosses => crossings += 1,
                Crossing::Starts => return Side::On,
            }
        }
        if crossings % 2 == 1 { Side::Inside } else { Side::Outside }
    }

    /// The generalised winding number (Jacobson, Kavan, Sorkine-Hornung 2013): the solid angles of all
    /// triangles over 4 pi, summed in the order of their ids. NaN for points that are
    /// [none](is_near).
    pub fn winding_number(&self, point: [f64; 3]) -> f64 {
        if !is_near(&point) {
            return f64::NAN;
        }
        winding_number(point, self.triangles().map(|(_, triangle)| triangle))
    }
}

/// The answer for the triangle that was found. An altered file may name one that is not there; then
/// there is no point.
pub fn closest(geometry: &Geometry, point: [f64; 3], distance2: f64, prim_id: u32) -> ClosestPoint {
    let distance = distance2.sqrt();
    let Some(triangle) = geometry.triangle(prim_id) else {
        return ClosestPoint { distance, prim_id, point: [f64::NAN; 3], uv: [f64::NAN; 2] };
    };
    let foot = nearest_foot(point, &triangle.vertices);
    let [a, b, c] = triangle.vertices.map(|v| v.map(f64::from));
    let on = |i: usize| a[i] + (foot.v * (b[i] - a[i]) + foot.w * (c[i] - a[i]));
    ClosestPoint { distance, prim_id, point: std::array::from_fn(on), uv: [foot.v, foot.w] }
}
