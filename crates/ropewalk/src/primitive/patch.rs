//! Smooth patches: polygons with a normal at each vertex.

use super::planar::length;
use super::{AreaRamp, Crossing, Polygon, Primitive, ShapeError, Sides, SurfaceNormals, Triangle};
use crate::aabb::Aabb;
use crate::ray::PreparedRay;

/// A triangle or a planar polygon with a normal at each vertex (`pp` in NFF). It is hit like the
/// flat shape; the shading normal is interpolated, by barycentric coordinates on triangles and by
/// mean value coordinates (Hormann and Floater 2006) on polygons, concave ones included.
#[derive(Clone, Debug, PartialEq)]
pub struct Patch {
    face: Face,
    normals: Vec<[f32; 3]>,
}

#[derive(Clone, Debug, PartialEq)]
enum Face {
    Triangle(Triangle),
    Polygon(Polygon),
}

macro_rules! each_face {
    ($self:expr, $p:ident => $body:expr) => {
        match &$self.face {
            Face::Triangle($p) => $body,
            Face::Polygon($p) => $body,
        }
    };
}

impl Patch {
    /// A patch; the normals need not have unit length, and zero ones leave the flat normal.
    ///
    /// # Errors
    /// [`ShapeError`] as for polygons, and for a number of normals that differs from that of the
    /// vertices or a normal that is not finite.
    pub fn new(vertices: Vec<[f32; 3]>, normals: Vec<[f32; 3]>) -> Result<Self, ShapeError> {
        if vertices.len() != normals.len() {
            let (vertices, found) = (vertices.len(), normals.len());
            return Err(ShapeError::NormalCount { vertices, found });
        }
        super::check_points("normal", &normals)?;
        let face = match <[[f32; 3]; 3]>::try_from(vertices) {
            Ok(corners) => Face::Triangle(Triangle::new(corners)?),
            Err(vertices) => Face::Polygon(Polygon::new(vertices)?),
        };
        Ok(Patch { face, normals })
    }

    /// The vertices.
    pub fn vertices(&self) -> &[[f32; 3]] {
        match &self.face {
            Face::Triangle(p) => &p.vertices,
            Face::Polygon(p) => p.vertices(),
        }
    }

    /// The normals at the vertices, as given.
    pub fn vertex_normals(&self) -> &[[f32; 3]] {
        &self.normals
    }

    /// The sum of the unit vertex normals, each times its weight.
    fn blend(&self, weights: impl IntoIterator<Item = f64>) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (n, weight) in self.normals.iter().zip(weights) {
            let n = n.map(f64::from);
            let len = length(n);
            if len > 0.0 {
                for a in 0..3 {
                    sum[a] += weight * n[a] / len;
                }
            }
        }
        sum
    }
}

/// Mean value coordinates of `x` in a polygon, up to a common factor.
fn mean_value_weights(corners: &[[f64; 2]], x: [f64; 2]) -> Vec<f64> {
    let n = corners.len();
    let spoke: Vec<_> = corners.iter().map(|p| [p[0] - x[0], p[1] - x[1]]).collect();
    let radius: Vec<_> = spoke.iter().map(|s| s[0].hypot(s[1])).collect();
    let one_hot = |i: usize, share: f64| {
        let mut weights = vec![0.0; n];
        weights[i] = 1.0 - share;
        weights[(i + 1) % n] += share;
        weights
    };
    if let Some(i) = radius.iter().position(|&r| r == 0.0) {
        return one_hot(i, 0.0);
    }
    let mut half_tangents = Vec::with_capacity(n);
    for i in 0..n {
        let j = (i + 1) % n;
        let cross = spoke[i][0] * spoke[j][1] - spoke[i][1] * spoke[j][0];
        let dot = spoke[i][0] * spoke[j][0] + spoke[i][1] * spoke[j][1];
        if cross == 0.0 && dot < 0.0 {
            return one_hot(i, radius[i] / (radius[i] + radius[j])); // on the edge
        }
        // tan(angle / 2) without an angle.
        let sum = radius[i] * radius[j] + dot;
        half_tangents.push(if sum == 0.0 { 0.0 } else { cross / sum });
    }
    (0..n).map(|i| (half_tangents[(i + n - 1) % n] + half_tangents[i]) / radius[i]).collect()
}

impl Primitive for Patch {
    fn bounds(&self) -> Aabb {
        each_face!(self, p => p.bounds())
    }

    fn clipped_bounds(&self, cell: &Aabb) -> Option<Aabb> {
        each_face!(self, p => p.clipped_bounds(cell))
    }

    fn area(&self) -> f64 {
        each_face!(self, p => p.area())
    }

    fn area_ramps(&self, cell: &Aabb, axis: usize, out: &mut Vec<AreaRamp>) {
        each_face!(self, p => p.area_ramps(cell, axis, out))
    }

    fn intersect(&self, ray: &PreparedRay, sides: Sides) -> Option<Crossing> {
        each_face!(self, p => p.intersect(ray, sides))
    }

    /// The shading normal lies on the side of the geometric one, which replaces it where the
    /// interpolated normal vanishes.
    fn normals(&self, point: [f64; 3], crossing: Crossing) -> SurfaceNormals {
        let blended = match &self.face {
            Face::Triangle(_) => {
                let (u, v) = (f64::from(crossing.u), f64::from(crossing.v));
                self.blend([1.0 - u - v, u, v])
            }
            Face::Polygon(p) => {
                let [ku, kv] = p.projection();
                let corner = |p: &[f32; 3]| [f64::from(p[ku]), f64::from(p[kv])];
                let corners: Vec<_> = p.vertices().iter().map(corner).collect();
                let weights = mean_value_weights(&corners, [point[ku], point[kv]]);
                // Weights are positive inside for either orientation once divided by their sum.
                let sign = weights.iter().sum::<f64>().signum();
                self.blend(weights.into_iter().map(|w| sign * w))
            }
        };
        let mut out = each_face!(self, p => p.normals(point, crossing));
        let len = length(blended);
        if len > 0.0 && len.is_finite() {
            let facing = (0..3).map(|a| blended[a] * out.geometric[a]).sum::<f64>();
            let scale = if facing < 0.0 { -1.0 / len } else { 1.0 / len };
            out.shading = blended.map(|x| x * scale);
        }
        out
    }

    fn is_degenerate(&self) -> bool {
        each_face!(self, p => p.is_degenerate())
    }
}
