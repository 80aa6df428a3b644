//! The definition of every answer about points: all triangles, one after the other.

use super::winding::winding_number;
use super::{ClosestPoint, Crossing, Side, Triangles, crossing, flushed, is_near};
use crate::geometry::Geometry;
use crate::kernel::point::triangle::nearest_foot;

/// Points against all triangles; other primitives and triangles without area are passed over.
pub struct PointBruteForce<'a, G = Geometry> {
    /// The triangles.
    pub geometry: &'a G,
}

impl<G> Clone for PointBruteForce<'_, G> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<G> Copy for PointBruteForce<'_, G> {}

impl<'a, G: Triangles> PointBruteForce<'a, G> {
    /// Scaled triangles that have an area, with their ids.
    fn triangles(&self) -> impl Iterator<Item = (u32, [[f64; 3]; 3])> + use<'a, G> {
        let geometry = self.geometry;
        let ids = (0..geometry.count() as u32).filter(|&id| geometry.has_area(id));
        ids.filter_map(|id| Some((id, geometry.corners(id)?)))
    }

    /// True if a point has an answer: its coordinates, and those of its scaled image, are numbers up to
    /// [`LARGEST`](super::LARGEST).
    pub fn is_near(&self, point: &[f64; 3]) -> bool {
        is_near(point) && is_near(&self.geometry.scaled(*point))
    }

    /// The nearest triangle by squared distance in `f64`, of those equally near the lowest; `None`
    /// without triangles and for points that are [none](is_near).
    pub fn closest_point(&self, point: [f64; 3]) -> Option<ClosestPoint> {
        if !self.is_near(&point) {
            return None;
        }
        let scaled = self.geometry.scaled(point);
        let mut best: Option<(f64, u32)> = None;
        for (id, triangle) in self.triangles() {
            let distance2 = nearest_foot(scaled, triangle).distance2;
            if best.is_none_or(|(least, _)| distance2 < least) {
                best = Some((distance2, id));
            }
        }
        best.map(|(distance2, prim_id)| closest(self.geometry, point, distance2, prim_id))
    }

    /// On which side of the surface a point is, by the crossings of the ray along +z; outside of the
    /// geometry's box nothing is inside.
    pub fn side(&self, point: [f64; 3]) -> Side {
        let (p, [low, high]) = (flushed(self.geometry.scaled(point)), self.geometry.extent());
        if !(0..3).all(|a| low[a] <= p[a] && p[a] <= high[a]) {
            return Side::Outside;
        }
        let mut crossings = 0;
        for (_, triangle) in self.triangles() {
            match crossing(p, triangle) {
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
        if !self.is_near(&point) {
            return f64::NAN;
        }
        winding_number(self.geometry.scaled(point), self.triangles().map(|(_, triangle)| triangle))
    }
}

/// The answer for the triangle that was found, from its scaled distance. An altered file may name one that is
/// not there; then there is no point.
pub fn closest<G: Triangles>(
    geometry: &G,
    point: [f64; 3],
    distance2: f64,
    prim_id: u32,
) -> ClosestPoint {
    let distance = geometry.unscaled(distance2.sqrt());
    let Some(corners) = geometry.corners(prim_id) else {
        return ClosestPoint { distance, prim_id, point: [f64::NAN; 3], uv: [f64::NAN; 2] };
    };
    let foot = nearest_foot(geometry.scaled(point), corners);
    let [a, b, c] = corners;
    let on = |i: usize| geometry.unscaled(a[i] + (foot.v * (b[i] - a[i]) + foot.w * (c[i] - a[i])));
    ClosestPoint { distance, prim_id, point: std::array::from_fn(on), uv: [foot.v, foot.w] }
}
