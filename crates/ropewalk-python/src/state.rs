//! A geometry as arrays, for pickling.
//!
//! A primitive is a byte, its kind in the low four bits and the sides on which it is hit above them,
//! and a row of numbers.

use ropewalk::primitive::{Cone, Patch, Primitive, Sphere, Triangle};
use ropewalk::{Geometry, Shape, Sides};

const TRIANGLE: u8 = 0;
const SPHERE: u8 = 1;
const CONE: u8 = 2;
const POLYGON: u8 = 3;
const PATCH: u8 = 4;

const SIDES: [Sides; 3] = [Sides::Front, Sides::Back, Sides::Both];

/// Kinds with sides, ends of the rows, and their numbers. Nothing in Python makes other shapes than
/// those known here.
pub fn write(geometry: &Geometry) -> (Vec<u8>, Vec<u64>, Vec<f32>) {
    let count = geometry.len();
    let (mut kinds, mut ends) = (Vec::with_capacity(count), Vec::with_capacity(count));
    let mut numbers: Vec<f32> = Vec::with_capacity(9 * count);
    for prim in 0..count as u32 {
        let kind = match geometry.shape(prim) {
            Shape::Triangle(p) => {
                numbers.extend(p.vertices.as_flattened());
                TRIANGLE
            }
            Shape::Sphere(p) => {
                numbers.extend(p.center);
                numbers.push(p.radius);
                SPHERE
            }
            Shape::Cone(p) => {
                numbers.extend(p.base);
                numbers.extend(p.apex);
                numbers.extend([p.base_radius, p.apex_radius]);
                CONE
            }
            Shape::Polygon(p) => {
                numbers.extend(p.vertices().as_flattened());
                POLYGON
            }
            Shape::Patch(p) => {
                numbers.extend(p.vertices().as_flattened());
                numbers.extend(p.vertex_normals().as_flattened());
                PATCH
            }
            other => {
                debug_assert!(other.is_degenerate(), "a shape that Python cannot make");
                TRIANGLE
            }
        };
        let sides = SIDES.iter().position(|&s| s == geometry.sides(prim)).unwrap_or(2) as u8;
        kinds.push(kind | sides << 4);
        ends.push(numbers.len() as u64);
    }
    (kinds, ends, numbers)
}

/// The geometry of such arrays; `None` if they are none.
pub fn read(kinds: &[u8], ends: &[u64], numbers: &[f32]) -> Option<Geometry> {
    if kinds.len() != ends.len() || ends.last().copied().unwrap_or(0) != numbers.len() as u64 {
        return None;
    }
    let (mut geometry, mut start) = (Geometry::new(), 0);
    for (&kind, &end) in kinds.iter().zip(ends) {
        let row = numbers.get(start..usize::try_from(end).ok()?)?;
        start = end as usize;
        let sides = *SIDES.get(usize::from(kind >> 4))?;
        let shape = match (kind & 15, row) {
            (TRIANGLE, &[a, b, c, d, e, f, g, h, i]) => {
                Triangle::new([[a, b, c], [d, e, f], [g, h, i]]).ok()?.into()
            }
            (SPHERE, &[x, y, z, radius]) => Sphere::new([x, y, z], radius).ok()?.into(),
            (CONE, &[a, b, c, d, e, f, base, apex]) => {
                Cone::new([a, b, c], base, [d, e, f], apex).ok()?.into()
            }
            (POLYGON, row) if row.len() % 3 == 0 => Shape::polygon(points(row)).ok()?,
            (PATCH, row) if row.len() % 6 == 0 => {
                let (vertices, normals) = row.split_at(row.len() / 2);
                Patch::new(points(vertices), points(normals)).ok()?.into()
            }
            _ => return None,
        };
        geometry.push(shape, sides).ok()?;
    }
    Some(geometry)
}

fn points(row: &[f32]) -> Vec<[f32; 3]> {
    row.as_chunks::<3>().0.to_vec()
}
