//! Triangles, intersected watertight.

use super::{AreaRamp, Crossing, Primitive, Sides, SurfaceNormals};
use crate::aabb::Aabb;
use crate::ray::PreparedRay;

/// A triangle by its three vertices; counter-clockwise as seen from the front.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// The vertices.
    pub vertices: [[f32; 3]; 3],
}

impl Primitive for Triangle {
    fn bounds(&self) -> Aabb {
        Aabb::from_points(self.vertices)
    }

    fn clipped_bounds(&self, cell: &Aabb) -> Option<Aabb> {
        // Stand-in until the exact clip: the boxes' common part.
        let b = self.bounds().intersection(cell);
        (!b.is_empty()).then_some(b)
    }

    fn area(&self) -> f64 {
        let n = self.scaled_normal();
        0.5 * n.iter().map(|x| x * x).sum::<f64>().sqrt()
    }

    fn area_ramps(&self, cell: &Aabb, axis: usize, out: &mut Vec<AreaRamp>) {
        let Some(b) = self.clipped_bounds(cell) else { return };
        let lo = f64::from(b.min[axis]) - f64::from(cell.min[axis]);
        let hi = f64::from(b.max[axis]) - f64::from(cell.min[axis]);
        let area = self.area();
        if hi > lo {
            out.push(AreaRamp { x: lo, width: area / (hi - lo), ..Default::default() });
            out.push(AreaRamp { x: hi, width: -area / (hi - lo), ..Default::default() });
        } else {
            out.push(AreaRamp { x: lo, step: area, ..Default::default() });
        }
    }

    fn intersect(&self, ray: &PreparedRay, sides: Sides) -> Option<Crossing> {
        let [kx, ky, kz] = ray.k;
        let [sx, sy, sz] = ray.shear;
        let sheared = self.vertices.map(|p| {
            let d = [
                f64::from(p[kx]) - ray.origin[kx],
                f64::from(p[ky]) - ray.origin[ky],
                f64::from(p[kz]) - ray.origin[kz],
            ];
            [d[0] - sx * d[2], d[1] - sy * d[2], sz * d[2]]
        });
        let [a, b, c] = sheared;
        let u = c[0] * b[1] - c[1] * b[0];
        let v = a[0] * c[1] - a[1] * c[0];
        let w = b[0] * a[1] - b[1] * a[0];
        let det = u + v + w;
        if det == 0.0 || (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        if !sides.accepts(-det) {
            return None;
        }
        let t = ((u * a[2] + v * b[2] + w * c[2]) / det) as f32;
        ray.accepts(t).then(|| Crossing { t, u: (v / det) as f32, v: (w / det) as f32 })
    }

    fn normals(&self, _point: [f64; 3], _crossing: Crossing) -> SurfaceNormals {
        let n = self.scaled_normal();
        let len = n.iter().map(|x| x * x).sum::<f64>().sqrt();
        let n = n.map(|x| x / len);
        SurfaceNormals { geometric: n, shading: n }
    }

    fn is_degenerate(&self) -> bool {
        self.scaled_normal() == [0.0; 3]
    }
}

impl Triangle {
    /// Twice the area times the unit normal.
    pub fn scaled_normal(&self) -> [f64; 3] {
        let [a, b, c] = self.vertices.map(|p| p.map(f64::from));
        let e = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
        let f = [c[0] - a[0], c[1] - a[1], c[2] - a[2]];
        [e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]]
    }
}
