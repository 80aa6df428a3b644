//! Triangles that lie in somebody else's bytes, as a saved scene holds them.

use crate::kernel::Memory;
use crate::primitive::{Shape, Sides, Triangle};
use std::sync::OnceLock;

/// Bytes of a triangle: nine `f32`.
pub const TRIANGLE_BYTES: usize = size_of::<[[f32; 3]; 3]>();

/// Triangles as rows of nine `f32`, and the sides on which they are hit.
///
/// Any bytes are allowed: rows that are no numbers make triangles that nothing sensible can be said of.
pub struct StoredTriangles {
    rows: Memory,
    /// One byte a triangle, `None` if all are hit on both sides.
    sides: Option<Memory>,
    /// All of them as shapes, once somebody has asked for one.
    shapes: OnceLock<Vec<Shape>>,
}

/// The byte of a triangle that is hit on its front only.
pub const FRONT: u8 = 1;
/// The byte of a triangle that is hit on its back only.
pub const BACK: u8 = 2;

impl StoredTriangles {
    /// `None` if the lengths do not fit each other, or rows are not aligned as `f32` are.
    pub fn new(rows: Memory, sides: Option<Memory>) -> Option<Self> {
        let triangles = bytemuck::try_cast_slice::<u8, [[f32; 3]; 3]>(rows.bytes()).ok()?.len();
        let fits = sides.as_ref().is_none_or(|sides| sides.bytes().len() == triangles);
        fits.then_some(StoredTriangles { rows, sides, shapes: OnceLock::new() })
    }

    pub fn bytes(&self) -> usize {
        self.rows.bytes().len() + self.sides.as_ref().map_or(0, |sides| sides.bytes().len())
    }

    pub fn len(&self) -> usize {
        self.rows.bytes().len() / TRIANGLE_BYTES
    }

    pub fn triangle(&self, i: usize) -> Option<Triangle> {
        let row = self.rows.bytes().get(i * TRIANGLE_BYTES..(i + 1) * TRIANGLE_BYTES)?;
        Some(Triangle { vertices: *bytemuck::from_bytes(row) })
    }

    pub fn sides(&self, i: usize) -> Sides {
        match self.sides.as_ref().map(|sides| sides.bytes()[i]) {
            Some(FRONT) => Sides::Front,
            Some(BACK) => Sides::Back,
            _ => Sides::Both,
        }
    }

    /// All triangles as shapes, made when first asked for.
    pub fn shapes(&self) -> &[Shape] {
        self.shapes.get_or_init(|| {
            let rows: &[[[f32; 3]; 3]] = bytemuck::cast_slice(self.rows.bytes());
            rows.iter().map(|&vertices| Shape::Triangle(Triangle { vertices })).collect()
        })
    }
}
