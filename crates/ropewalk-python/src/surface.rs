//! What is known of a hit beyond its parameter, worked out when it is asked for.

use crate::faces::Part;
use ropewalk::primitive::Primitive;
use ropewalk::ray::PreparedRay;
use ropewalk::{Geometry, Ray, Sides};

/// What is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Surface {
    /// Barycentric weights of vertices 1 and 2, on quads see [`Part::coordinates`]; 0 on what is neither.
    Coordinates,
    /// Unit normal, to the side from which vertices run counter-clockwise.
    Normal,
    /// The point; on triangles from their vertices, which is nearer to them than origin and direction
    /// lead.
    Position,
}

impl Surface {
    /// By its name in Python.
    pub fn named(name: &str) -> Surface {
        match name {
            "uv" => Surface::Coordinates,
            "normal" => Surface::Normal,
            _ => Surface::Position,
        }
    }

    /// Numbers a hit.
    pub fn width(self) -> usize {
        if self == Surface::Coordinates { 2 } else { 3 }
    }
}

/// Writes to `value` what is asked about the hit of a ray whose range holds its parameter alone; false
/// if the ray does not hit the primitive there on a side that counts.
pub fn look(
    geometry: &Geometry,
    surface: Surface,
    ray: &Ray,
    (prim, part, sides): (u32, Part, Sides),
    value: &mut [f32],
) -> bool {
    let Some(prepared) = PreparedRay::new(ray) else { return false };
    let Some(hit) = geometry.intersect(prim, &prepared) else { return false };
    // Both triangles of a quad may be hit there, one of them on the other side.
    if part != Part::Whole
        && sides != Sides::Both
        && geometry.shape(prim).intersect(&prepared, sides).is_none()
    {
        return false;
    }
    let write = |value: &mut [f32], p: [f64; 3]| value.copy_from_slice(&p.map(|x| x as f32));
    match surface {
        Surface::Coordinates => value.copy_from_slice(&part.coordinates([hit.u, hit.v])),
        Surface::Normal => write(value, geometry.normals(ray, &hit).geometric),
        Surface::Position => match geometry.triangle(prim) {
            Some(triangle) => {
                let [a, b, c] = triangle.vertices.map(|p| p.map(f64::from));
                let (u, v) = (f64::from(hit.u), f64::from(hit.v));
                let point = |i| a[i] + u * (b[i] - a[i]) + v * (c[i] - a[i]);
                write(value, std::array::from_fn(point));
            }
            None => write(value, ray.at(hit.t)),
        },
    }
    true
}
