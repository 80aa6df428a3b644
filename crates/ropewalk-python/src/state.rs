//! A geometry as arrays, for pickling.

use ropewalk::Geometry;
use ropewalk::file::{ShapeRows, read_shapes, write_shapes};

/// Kinds with sides, ends of the rows, and their numbers. Nothing in Python makes shapes that have none.
pub fn write(geometry: &Geometry) -> ShapeRows {
    let rows = write_shapes(geometry);
    debug_assert!(rows.is_ok(), "a shape that Python cannot make");
    rows.unwrap_or_default()
}

/// The geometry of such arrays; `None` if they are none.
pub fn read(kinds: &[u8], ends: &[u64], numbers: &[f32]) -> Option<Geometry> {
    read_shapes(kinds, ends, numbers).ok()
}
