//! Trees with their geometry as the bytes of a file: made, and used where they lie.
//!
//! [`write()`] makes them; [`open()`] takes them from whoever owns them, a mapped file above all, checks
//! their structure and gives a tree and a geometry that read them in place. There is no I/O here; the
//! crate `ropewalk-file` saves and maps files. docs/file-format.md draws the layout and says, field by
//! field, why no altered byte can lead a query out of bounds or into an endless loop.

mod error;
mod figures;
mod header;
mod links;
mod open;
mod shapes;
mod write;

pub use error::{FileError, Part, WriteError};
pub use figures::Figures;
pub(crate) use header::Header;
pub use header::{
    FORMAT_VERSION, HEADER_BYTES, LAYOUT_VERSION, MAGIC, MAX_SECTIONS, SECTION_ALIGNMENT,
    SHAPES_LAYOUT_VERSION, Section, Tag,
};
pub use open::{AnyOpened, Check, Extra, Opened, OpenedDouble, open, open_any, open_monitored};
pub use shapes::{ShapeRows, read_shapes, write_shapes};
pub use write::{Contents, Primitives, Written, write, write_monitored};

use crate::build::Monitor;
use crate::geometry::Geometry;

/// A hash of 32 bytes: BLAKE3.
pub type Hash = [u8; 32];

/// What tells geometries apart: primitives, their order, the bits of their numbers, and the sides on which
/// they are hit.
///
/// # Errors
/// [`WriteError`] if the geometry cannot be saved.
pub fn geometry_hash(geometry: &Geometry) -> Result<Hash, WriteError> {
    write::geometry_hash(geometry)
}

/// The [`geometry_hash()`] of triangles that are hit on both sides.
pub fn triangles_hash(triangles: impl IntoIterator<Item = [[f32; 3]; 3]>) -> Hash {
    write::triangles_hash(triangles)
}

/// The hash of a geometry in `f64`: of its vertices and faces as they were given.
///
/// # Errors
/// [`WriteError::Cancelled`] once the monitor says so.
pub fn mesh_hash(
    vertices: &[[f64; 3]],
    faces: &[[u32; 3]],
    monitor: &dyn Monitor,
) -> Result<Hash, WriteError> {
    write::mesh_hash(vertices, faces, monitor)
}

/// A hash in hexadecimal, its first eight bytes.
pub fn short(hash: &Hash) -> String {
    hash[..8].iter().map(|byte| format!("{byte:02x}")).collect()
}
