//! What is known of a hit beyond its parameter, worked out when it is asked for.

use ropewalk::ray::PreparedRay;
use ropewalk::{Geometry, Ray};

/// What is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Surface {
    /// Barycentric weights of vertices 1 and 2; 0 on what is no triangle.
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
/// if the ray does not hit the primitive there.
pub fn look(
    geometry: &Geometry,
    surface: Surface,
    ray: &Ray,
    prim: u32,
    value: &mut [f32],
) -> bool {
    let hit = PreparedRay::new(ray).and_then(|ray| geometry.intersect(prim, &ray));
    let Some(hit) = hit else { return false };
    let write = |value: &mut [f32], p: [f64; 3]| value.copy_from_slice(&p.map(|x| x as f32));
    match surface {
        Surface::Coordinates => value.copy_from_slice(&[hit.u, hit.v]),
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
