//! Spheres.

use super::{AreaRamp, Crossing, Primitive, Sides, SurfaceNormals};
use crate::aabb::Aabb;
use crate::ray::PreparedRay;

/// A sphere by centre and positive radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Centre.
    pub center: [f32; 3],
    /// Radius, positive.
    pub radius: f32,
}

impl Primitive for Sphere {
    fn bounds(&self) -> Aabb {
        let (c, r) = (self.center, self.radius);
        Aabb::new(c.map(|x| (x - r).next_down()), c.map(|x| (x + r).next_up()))
    }

    fn clipped_bounds(&self, cell: &Aabb) -> Option<Aabb> {
        let b = self.bounds().intersection(cell);
        (!b.is_empty()).then_some(b)
    }

    fn area(&self) -> f64 {
        4.0 * std::f64::consts::PI * f64::from(self.radius).powi(2)
    }

    fn area_ramps(&self, cell: &Aabb, axis: usize, out: &mut Vec<AreaRamp>) {
        let (c, r) = (f64::from(self.center[axis]), f64::from(self.radius));
        let lo = c - r - f64::from(cell.min[axis]);
        let width = 2.0 * std::f64::consts::PI * r;
        out.push(AreaRamp { x: lo, width, ..Default::default() });
        out.push(AreaRamp { x: lo + 2.0 * r, width: -width, ..Default::default() });
    }

    fn intersect(&self, ray: &PreparedRay, sides: Sides) -> Option<Crossing> {
        let c = self.center.map(f64::from);
        let l: [f64; 3] = std::array::from_fn(|a| c[a] - ray.origin[a]);
        let dot = |p: [f64; 3], q: [f64; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
        let dd = dot(ray.dir, ray.dir);
        let mid = dot(l, ray.dir) / dd;
        let foot: [f64; 3] = std::array::from_fn(|a| l[a] - mid * ray.dir[a]);
        let disc = f64::from(self.radius).powi(2) - dot(foot, foot);
        if disc < 0.0 {
            return None;
        }
        let half = (disc / dd).sqrt();
        let roots = [(mid - half, -1.0), (mid + half, 1.0)];
        roots.into_iter().find_map(|(t, facing)| {
            let t = t as f32;
            (sides.accepts(facing) && ray.accepts(t)).then_some(Crossing { t, u: 0.0, v: 0.0 })
        })
    }

    fn normals(&self, point: [f64; 3], _crossing: Crossing) -> SurfaceNormals {
        let d: [f64; 3] = std::array::from_fn(|a| point[a] - f64::from(self.center[a]));
        let len = d.iter().map(|x| x * x).sum::<f64>().sqrt();
        let n = d.map(|x| x / len);
        SurfaceNormals { geometric: n, shading: n }
    }

    fn is_degenerate(&self) -> bool {
        self.radius == 0.0
    }
}
