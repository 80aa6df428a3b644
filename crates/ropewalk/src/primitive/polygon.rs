//! Planar polygons of any number of vertices, concave ones included.

use super::planar::{
    CLIP_SLACK, Extent, SmallLoop, clip_long_loop, clip_segment, length, loop_ramps, overlap,
    round_down, round_up, vector_area,
};
use super::{AreaRamp, Crossing, Primitive, ShapeError, Sides, SurfaceNormals};
use crate::aabb::Aabb;
use crate::ray::PreparedRay;

/// A simple planar polygon, convex or concave; counter-clockwise as seen from the front.
///
/// The surface is the polygon's projection along the largest axis of its normal (Newell's, in
/// `f64`), lifted to the plane through the vertices' mean. Vertices that miss this plane, as those
/// of files with six digits do, so move along that one axis, and `bounds` covers both places.
///
/// A ray hits where it meets the plane if the projected point is inside by the even-odd rule,
/// edges half-open in the second projected coordinate; points within [`EDGE_TOLERANCE`] of an edge
/// count as inside, so that coplanar neighbours cannot both miss a point of their common edge.
/// Only a simple polygon has the area and the sweep that are computed here; intersections and
/// clips of a self-intersecting one follow the even-odd rule.
///
/// Error: `t` carries about ten roundings of `2^-53` of the distances involved, divided by the
/// cosine at which the ray meets the plane, and is then rounded once to `f32`.
#[derive(Clone, Debug, PartialEq)]
pub struct Polygon {
    vertices: Vec<[f32; 3]>,
    bounds: Aabb,
    /// A point of the plane.
    base: [f64; 3],
    /// Unit normal; zero for a degenerate polygon.
    normal: [f64; 3],
    area: f64,
    /// The axes: two projected ones, and the one that is projected away.
    axes: [usize; 3],
    /// How the plane rises along the third axis per unit of the other two; at most 1 in size.
    rise: [f64; 2],
    /// Slack of clips per axis.
    slack: [f64; 3],
    /// Largest coordinate in size.
    magnitude: f64,
}

/// A point counts as on an edge within this share of the largest coordinate of ray origin and
/// polygon. The plane's `t` and the point take fewer than 16 roundings of 2^-53, which a ray that
/// meets the plane at a cosine of 1/64 amplifies to 2^-43; the rule for shared edges does not hold
/// for rays that graze more.
pub const EDGE_TOLERANCE: f64 = 1.0 / (1u64 << 43) as f64;

/// A vertex this close to the plane, as a share of the largest coordinate, lies in it: Newell's
/// sums over 1000 vertices carry less, and half an ulp of `f32` is 2^-24.
const PLANE_TOLERANCE: f64 = 1.0 / (1u64 << 43) as f64;

impl Polygon {
    /// A polygon of at least three finite vertices. One without area is degenerate and never hit.
    ///
    /// # Errors
    /// [`ShapeError::TooFewVertices`] or [`ShapeError::NotFinite`].
    pub fn new(vertices: Vec<[f32; 3]>) -> Result<Self, ShapeError> {
        if vertices.len() < 3 {
            return Err(ShapeError::TooFewVertices { found: vertices.len() });
        }
        super::check_points("vertex", &vertices)?;
        let bounds = Aabb::from_points(vertices.iter().copied());
        let magnitude =
            bounds.min.iter().chain(&bounds.max).fold(0.0, |m: f64, x| m.max(f64::from(x.abs())));
        let points: Vec<_> = vertices.iter().map(|p| p.map(f64::from)).collect();
        let vector = vector_area(&points);
        let area = length(vector);
        let mut out = Polygon {
            bounds,
            base: points[0],
            normal: [0.0; 3],
            area,
            axes: [0, 1, 2],
            rise: [0.0; 2],
            slack: [0.0; 3],
            magnitude,
            vertices,
        };
        if area > 0.0 {
            out.fit_plane(&points, vector);
        }
        Ok(out)
    }

    /// Lays the plane through the mean of the vertices and widens the bounds by what misses it.
    fn fit_plane(&mut self, points: &[[f64; 3]], vector: [f64; 3]) {
        self.normal = vector.map(|x| x / self.area);
        let w = (0..3).fold(0, |k, a| if vector[a].abs() > vector[k].abs() { a } else { k });
        let (u, v) = ((w + 1) % 3, (w + 2) % 3);
        self.axes = [u, v, w];
        self.rise = [-vector[u] / vector[w], -vector[v] / vector[w]];
        // Relative to the first vertex, so that an axis-parallel plane stays exact.
        let n = points.len() as f64;
        let first = points[0];
        self.base = std::array::from_fn(|a| {
            first[a] + points.iter().map(|p| p[a] - first[a]).sum::<f64>() / n
        });
        let heights = points.iter().map(|p| self.height(p[u], p[v]));
        let (mut lo, mut hi, mut deviation) = (f64::INFINITY, f64::NEG_INFINITY, 0.0f64);
        for (height, p) in heights.zip(points) {
            (lo, hi) = (lo.min(height), hi.max(height));
            deviation = deviation.max((height - p[w]).abs());
        }
        let loose = deviation > PLANE_TOLERANCE * self.magnitude;
        if loose {
            self.bounds.min[w] = self.bounds.min[w].min(round_down(lo));
            self.bounds.max[w] = self.bounds.max[w].max(round_up(hi));
        }
        self.slack = std::array::from_fn(|a| {
            let size = self.bounds.min[a].abs().max(self.bounds.max[a].abs());
            CLIP_SLACK * f64::from(size)
        });
        // Where the plane is taken as through the vertices, the clip must reach both.
        self.slack[w] += if loose { 0.0 } else { deviation };
    }

    /// The vertices, as given.
    pub fn vertices(&self) -> &[[f32; 3]] {
        &self.vertices
    }

    /// Unit normal by Newell's method, pointing to the front; zero for a degenerate polygon.
    pub fn normal(&self) -> [f64; 3] {
        self.normal
    }

    /// The two axes on which the polygon is projected; the third is the largest of its normal.
    pub(super) fn projection(&self) -> [usize; 2] {
        [self.axes[0], self.axes[1]]
    }

    /// The plane's third coordinate over a projected point.
    #[inline]
    fn height(&self, u: f64, v: f64) -> f64 {
        let [ku, kv, kw] = self.axes;
        self.base[kw] + (self.rise[0] * (u - self.base[ku]) + self.rise[1] * (v - self.base[kv]))
    }

    /// A vertex, moved to the plane.
    #[inline]
    fn lifted(&self, p: [f32; 3]) -> [f64; 3] {
        let [ku, kv, kw] = self.axes;
        let mut q = p.map(f64::from);
        q[kw] = self.height(q[ku], q[kv]);
        q
    }

    /// Even-odd test of a projected point; points within `tolerance` of an edge are inside.
    fn covers(&self, u: f64, v: f64, tolerance: f64) -> bool {
        let [ku, kv, _] = self.axes;
        let relative = |p: [f32; 3]| [f64::from(p[ku]) - u, f64::from(p[kv]) - v];
        let mut inside = false;
        let mut a = relative(self.vertices[self.vertices.len() - 1]);
        for &p in &self.vertices {
            let b = relative(p);
            let crosses = (a[1] > 0.0) != (b[1] > 0.0);
            let near = a[1].min(b[1]) <= tolerance
                && a[1].max(b[1]) >= -tolerance
                && a[0].max(b[0]) >= -tolerance;
            if crosses || near {
                let side = a[0] * b[1] - a[1] * b[0];
                // To the right of the point: the sign of the edge function agrees with the
                // edge's direction.
                inside ^= crosses && (side > 0.0) == (b[1] > a[1]);
                let reach = tolerance * ((b[0] - a[0]).abs() + (b[1] - a[1]).abs());
                if near && side.abs() <= reach && a[0].min(b[0]) <= tolerance {
                    return true;
                }
            }
            a = b;
        }
        inside
    }

    /// The lifted polygon cut to `cell`.
    fn clipped_loop(&self, cell: &Aabb) -> Vec<[f64; 3]> {
        let points = self.vertices.iter().map(|&p| self.lifted(p)).collect();
        clip_long_loop(points, &Extent::widened(cell, [0.0; 3]))
    }

    /// Adds the corners of the piece of the plane inside `cell` that the polygon covers. `None` if
    /// rounding left no room to cut it.
    fn add_plane_corners(&self, loose: &Aabb, cell: &Extent, extent: &mut Extent) -> Option<()> {
        let [ku, kv, kw] = self.axes;
        let lo = [f64::from(loose.min[ku]), f64::from(loose.min[kv])];
        let hi = [f64::from(loose.max[ku]), f64::from(loose.max[kv])];
        let corner = |u: f64, v: f64| {
            let mut p = [0.0; 3];
            (p[ku], p[kv], p[kw]) = (u, v, self.height(u, v));
            p
        };
        let rectangle = [[lo[0], lo[1]], [hi[0], lo[1]], [hi[0], hi[1]], [lo[0], hi[1]]];
        let piece = SmallLoop::new(rectangle.map(|[u, v]| corner(u, v))).clip_axis(kw, cell)?;
        let tolerance = EDGE_TOLERANCE * self.magnitude;
        for &[x, y, z, _] in piece.points() {
            let p = [x, y, z];
            if self.covers(p[ku], p[kv], tolerance) {
                extent.add(p);
            }
        }
        Some(())
    }
}

impl Primitive for Polygon {
    fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Tight for concave polygons too: the part's extreme points are ends of clipped edges, or
    /// corners of the piece of the plane inside the cell that the polygon covers.
    fn clipped_bounds(&self, cell: &Aabb) -> Option<Aabb> {
        if cell.contains(&self.bounds) {
            return Some(self.bounds);
        }
        let loose = overlap(&self.bounds, cell)?;
        let wide = Extent::widened(cell, self.slack);
        let mut extent = Extent::EMPTY;
        let mut a = self.lifted(self.vertices[self.vertices.len() - 1]);
        for &p in &self.vertices {
            let b = self.lifted(p);
            if let Some([p, q]) = clip_segment(a, b, &wide) {
                extent.add(p);
                extent.add(q);
            }
            a = b;
        }
        if self.is_degenerate() {
            return overlap(&extent.outward(self.slack), &loose);
        }
        if self.add_plane_corners(&loose, &wide, &mut extent).is_none() {
            return Some(loose);
        }
        overlap(&extent.outward(self.slack), &loose)
    }

    fn area(&self) -> f64 {
        self.area
    }

    fn area_ramps(&self, cell: &Aabb, axis: usize, out: &mut Vec<AreaRamp>) {
        if !self.is_degenerate() && overlap(&self.bounds, cell).is_some() {
            let points = self.clipped_loop(cell);
            if points.len() > 2 {
                loop_ramps(&points, cell, axis, out);
            }
        }
    }

    fn intersect(&self, ray: &PreparedRay, sides: Sides) -> Option<Crossing> {
        let ([ku, kv, kw], [rise_u, rise_v]) = (self.axes, self.rise);
        let (o, d) = (ray.origin, ray.dir);
        let approach = d[kw] - (rise_u * d[ku] + rise_v * d[kv]);
        let facing = if self.normal[kw] < 0.0 { -approach } else { approach };
        if approach == 0.0 || self.area == 0.0 || !sides.accepts(facing) {
            return None;
        }
        let [du, dv] = [self.base[ku] - o[ku], self.base[kv] - o[kv]];
        let t = ((self.base[kw] - o[kw]) - (rise_u * du + rise_v * dv)) / approach;
        let crossing = Crossing::in_range(ray, t)?;
        let (u, v) = (o[ku] + t * d[ku], o[kv] + t * d[kv]);
        let origin = o[ku].abs().max(o[kv].abs()).max(o[kw].abs());
        let tolerance = EDGE_TOLERANCE * self.magnitude.max(origin);
        let beside = |x: f64, k: usize| {
            x < f64::from(self.bounds.min[k]) - tolerance
                || x > f64::from(self.bounds.max[k]) + tolerance
        };
        if beside(u, ku) || beside(v, kv) || !self.covers(u, v, tolerance) {
            return None;
        }
        Some(crossing)
    }

    fn normals(&self, _point: [f64; 3], _crossing: Crossing) -> SurfaceNormals {
        SurfaceNormals { geometric: self.normal, shading: self.normal }
    }

    fn is_degenerate(&self) -> bool {
        self.area == 0.0
    }
}
