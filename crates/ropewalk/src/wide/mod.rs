//! The wide tree: the binary BSP compiled for the batch kernels.
//!
//! Three binary levels make one [`Treelet`] of a cache line, the primitives of a leaf make
//! [`Block`]s of eight; an empty leaf costs nothing but a zero. The binary tree stays the reference:
//! a wide tree holds the same cells, and `validate` checks it against the tree it came from.

mod block;
mod bound;
mod compile;
mod lines;
mod treelet;
mod up;
mod validate;

pub use block::{Block, ID_MASK, NO_ID, SIDES_BACK, SIDES_BOTH, SIDES_FRONT, WIDTH};
pub use bound::Bound;
pub use lines::{BLOCK_LINES, LINE, Lines};
pub use treelet::{
    AXIS_SHIFTS, COUNT_BITS, COUNT_OVERFLOW, Flips, LEAF, LEVELS, MAX_LINES, ORDER, OrderTable,
    Treelet, code_line, code_offset, leaf_code, treelet_code,
};
pub use up::{Above, UpTable};
pub use validate::WideFault;

use crate::aabb::Aabb;
use crate::file::Header;
use std::sync::OnceLock;

/// Largest number of treelets on a path; sizes the stacks of the kernels.
pub const MAX_WIDE_DEPTH: usize = crate::tree::MAX_DEPTH.div_ceil(LEVELS);

/// A compiled tree.
#[derive(Debug)]
pub struct WideTree {
    bounds: Aabb,
    root: u32,
    lines: Lines,
    treelets: usize,
    blocks: usize,
    overflow: Vec<(u32, u32)>,
    has_shapes: bool,
    up: OnceLock<UpTable>,
}

/// Why a tree cannot be compiled.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CompileError {
    /// More cache lines than a code can address.
    #[error(
        "the tree needs {needed} cache lines, at most {max} can be addressed; lower max_duplication"
    )]
    TooLarge {
        /// Lines needed.
        needed: usize,
        /// The limit.
        max: usize,
    },
    /// The system has not enough memory.
    #[error("the tree needs {bytes} bytes, which the system refused: {reason}")]
    Memory {
        /// Bytes needed.
        bytes: usize,
        /// What the system said.
        reason: String,
    },
}

impl WideTree {
    /// Box of the root cell.
    pub fn bounds(&self) -> &Aabb {
        &self.bounds
    }

    /// Code of the root: a treelet, a leaf, or 0 for an empty tree.
    pub fn root(&self) -> u32 {
        self.root
    }

    /// The tree of a file; links and overflow list have been checked.
    pub(crate) fn of_file(header: &Header, lines: Lines, overflow: Vec<(u32, u32)>) -> WideTree {
        WideTree {
            bounds: header.tree_bounds,
            root: header.root,
            lines,
            treelets: header.treelets as usize,
            blocks: header.blocks as usize,
            overflow,
            has_shapes: header.has_shapes,
            up: OnceLock::new(),
        }
    }

    /// True if the tree lies in a file; see [`Lines::is_shared`].
    pub fn is_shared(&self) -> bool {
        self.lines.is_shared()
    }

    /// The leaves of [`COUNT_OVERFLOW`] blocks or more, by their first lines, in ascending order, and the
    /// numbers of their blocks.
    pub(crate) fn overflow(&self) -> &[(u32, u32)] {
        &self.overflow
    }

    /// Treelets and blocks as they lie in memory.
    #[inline(always)]
    pub fn lines(&self) -> &Lines {
        &self.lines
    }

    /// Makes the table by which queries start from cells, if it is not there yet: some 3 to 5 % of the
    /// tree's bytes.
    pub fn link_up(&self) -> &UpTable {
        self.up.get_or_init(|| UpTable::new(self, &self.outer_box()))
    }

    /// The table, if it was made; see [`WideTree::link_up`].
    #[inline(always)]
    pub fn up(&self) -> Option<&UpTable> {
        self.up.get()
    }

    /// The scene's box with half of its diagonal around it, so that segments may leave it: there is
    /// nothing outside that they could hit.
    pub(crate) fn outer_box(&self) -> Aabb {
        let margin = (self.bounds.diagonal() / 2.0) as f32;
        let mut outer = self.bounds;
        for a in 0..3 {
            outer.min[a] -= margin;
            outer.max[a] += margin;
        }
        outer
    }

    /// Number of treelets.
    pub fn treelets(&self) -> usize {
        self.treelets
    }

    /// Number of leaf blocks.
    pub fn blocks(&self) -> usize {
        self.blocks
    }

    /// Number of blocks of a leaf code.
    #[inline(always)]
    pub fn block_count(&self, code: u32) -> u32 {
        let count = code & COUNT_OVERFLOW;
        if count == COUNT_OVERFLOW { self.overflow_count(code_line(code) as u32) } else { count }
    }

    /// The lines on which the blocks of a leaf begin.
    pub fn block_lines(&self, code: u32) -> impl Iterator<Item = usize> + use<> {
        let first = code_line(code);
        (0..self.block_count(code) as usize).map(move |i| first + i * BLOCK_LINES)
    }

    #[cold]
    fn overflow_count(&self, first: u32) -> u32 {
        let found = self.overflow.binary_search_by_key(&first, |&(first, _)| first);
        found.map_or(0, |i| self.overflow[i].1)
    }

    /// True if a leaf holds anything but triangles.
    pub fn has_shapes(&self) -> bool {
        self.has_shapes
    }

    /// Bytes of the tree, its own copy of the triangles included, without the table of
    /// [`WideTree::link_up`].
    pub fn bytes(&self) -> usize {
        self.lines.len() * LINE + size_of_val(&self.overflow[..])
    }
}
