//! What rays start from: a surface and a view of it.

use crate::vector::{cross, dot, sub};
use ropewalk::{Aabb, Geometry, Ray, ray::PreparedRay};

/// From where a scene is seen, and where its light stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Eye point.
    pub eye: [f32; 3],
    /// Point looked at.
    pub at: [f32; 3],
    /// Up direction; any direction that is not parallel to the view.
    pub up: [f32; 3],
    /// Full view angle in degrees; the picture is square.
    pub fov_degrees: f32,
    /// Point light for shadow rays.
    pub light: [f32; 3],
}

/// Primitives that rays bounce off.
pub trait Surface {
    /// The box of all primitives.
    fn bounds(&self) -> Aabb;
    /// The unit normal where `ray` hits a primitive, on the side that it arrives from; `None` where
    /// there is none.
    fn facing_normal(&self, prim: u32, ray: &Ray) -> Option<[f64; 3]>;
}

impl Surface for Geometry {
    fn bounds(&self) -> Aabb {
        Geometry::bounds(self)
    }

    fn facing_normal(&self, prim: u32, ray: &Ray) -> Option<[f64; 3]> {
        let hit = self.intersect(prim, &PreparedRay::new(ray)?)?;
        let normal = self.normals(ray, &hit).geometric;
        let scale = if dot(normal, ray.dir.map(f64::from)) > 0.0 { -1.0 } else { 1.0 };
        let normal = normal.map(|x| scale * x);
        normal.iter().all(|x| x.is_finite()).then_some(normal)
    }
}

/// The unit normal of a triangle on the side that a ray arrives from; `None` without area.
pub fn triangle_normal(corners: [[f32; 3]; 3], ray: &Ray) -> Option<[f64; 3]> {
    let [a, b, c] = corners.map(|v| v.map(f64::from));
    let normal = cross(sub(b, a), sub(c, a));
    let length = dot(normal, normal).sqrt();
    let facing = dot(normal, ray.dir.map(f64::from));
    let scale = if facing > 0.0 { -1.0 } else { 1.0 } / length;
    (length > 0.0).then(|| normal.map(|x| x * scale))
}
