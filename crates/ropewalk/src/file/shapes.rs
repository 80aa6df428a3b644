//! Primitives of all kinds as arrays: a byte each, its kind in the low four bits and the sides on which it
//! is hit above them, and a row of numbers.

use super::WriteError;
use crate::geometry::Geometry;
use crate::primitive::{Cone, Patch, Shape, Sides, Sphere, Triangle};

const TRIANGLE: u8 = 0;
const SPHERE: u8 = 1;
const CONE: u8 = 2;
const POLYGON: u8 = 3;
const PATCH: u8 = 4;

const SIDES: [Sides; 3] = [Sides::Front, Sides::Back, Sides::Both];

/// Kinds with sides, ends of the rows, and their numbers.
pub type ShapeRows = (Vec<u8>, Vec<u64>, Vec<f32>);

/// The primitives of a geometry as arrays.
///
/// # Errors
/// [`WriteError::Custom`].
pub fn write_shapes(geometry: &Geometry) -> Result<ShapeRows, WriteError> {
    let count = geometry.len();
    let (mut kinds, mut ends) = (Vec::with_capacity(count), Vec::with_capacity(count));
    let mut numbers: Vec<f32> = Vec::with_capacity(9 * count);
    for prim in 0..count as u32 {
        let kind = if let Some(triangle) = geometry.triangle(prim) {
            numbers.extend(triangle.vertices.as_flattened());
            TRIANGLE
        } else {
            curved(geometry.shape(prim), &mut numbers).ok_or(WriteError::Custom { index: prim })?
        };
        let sides = SIDES.iter().position(|&s| s == geometry.sides(prim)).unwrap_or(2) as u8;
        kinds.push(kind | sides << 4);
        ends.push(numbers.len() as u64);
    }
    Ok((kinds, ends, numbers))
}

/// Appends the numbers of what is no triangle; its kind.
fn curved(shape: &Shape, numbers: &mut Vec<f32>) -> Option<u8> {
    Some(match shape {
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
        _ => return None,
    })
}

/// The geometry of such arrays; the number of the first primitive that is none if they are not.
///
/// # Errors
/// That number; the number of primitives if the arrays differ in length.
pub fn read_shapes(kinds: &[u8], ends: &[u64], numbers: &[f32]) -> Result<Geometry, usize> {
    let (mut geometry, mut start) = (Geometry::new(), 0);
    if kinds.len() != ends.len() || ends.last().copied().unwrap_or(0) != numbers.len() as u64 {
        return Err(kinds.len());
    }
    for (i, (&kind, &end)) in kinds.iter().zip(ends).enumerate() {
        let row = usize::try_from(end).ok().and_then(|end| numbers.get(start..end)).ok_or(i)?;
        start += row.len();
        let sides = *SIDES.get(usize::from(kind >> 4)).ok_or(i)?;
        let shape = shape(kind & 15, row).ok_or(i)?;
        geometry.push(shape, sides).map_err(|_| i)?;
    }
    Ok(geometry)
}

fn shape(kind: u8, row: &[f32]) -> Option<Shape> {
    Some(match (kind, row) {
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
    })
}

fn points(row: &[f32]) -> Vec<[f32; 3]> {
    row.as_chunks::<3>().0.to_vec()
}
