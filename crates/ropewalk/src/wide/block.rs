//! Leaf blocks: eight primitives a block, triangles as structure of arrays.

use crate::primitive::Sides;

/// Lanes of a block.
pub const WIDTH: usize = 8;

/// Eight primitives.
///
/// ```text
/// bytes   0..288  vertex[i][axis][lane]   coordinates of the triangles' vertices
/// bytes 288..320  id[lane]                bits 29..0 primitive, bits 31..30 sides (see SIDES_*)
/// ```
/// A lane that holds no primitive has NaN vertices and [`NO_ID`]; a triangle that is never hit has NaN vertices and
/// its id. NaN vertices never test as hit.
///
/// Primitives of other kinds lie in blocks of their own, from lane 0 on: each has NaN for the first vertex's x, and
/// in the other eight places, in their order, its [`Bound`](super::Bound): centre, radius, axis, thickness.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Block {
    /// Vertex coordinates.
    pub vertex: [[[f32; WIDTH]; 3]; 3],
    /// Primitives and the sides on which they can be hit.
    pub id: [u32; WIDTH],
}

const _: () = assert!(size_of::<Block>() == 320);

/// Bits of the primitive in `Block::id`.
pub const ID_MASK: u32 = (1 << 30) - 1;
/// The id of a lane without a primitive.
pub const NO_ID: u32 = ID_MASK;
/// Both sides can be hit.
pub const SIDES_BOTH: u32 = 0;
/// Only the front can be hit.
pub const SIDES_FRONT: u32 = 1 << 30;
/// Only the back can be hit.
pub const SIDES_BACK: u32 = 2 << 30;

impl Block {
    /// A block without primitives.
    pub const EMPTY: Block = Block { vertex: [[[f32::NAN; WIDTH]; 3]; 3], id: [NO_ID; WIDTH] };

    /// The sides on which the primitive of a lane can be hit.
    #[inline(always)]
    pub fn sides(&self, lane: usize) -> Sides {
        match self.id[lane] & !ID_MASK {
            SIDES_FRONT => Sides::Front,
            SIDES_BACK => Sides::Back,
            _ => Sides::Both,
        }
    }

    /// The lanes that hold primitives other than triangles.
    pub fn shape_lanes(&self) -> u32 {
        if !self.holds_shapes() {
            return 0;
        }
        (0..WIDTH).map(|lane| u32::from(self.id[lane] & ID_MASK != NO_ID) << lane).sum()
    }
}
