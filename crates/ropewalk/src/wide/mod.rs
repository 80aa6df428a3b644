//! The wide tree: the binary BSP compiled for the batch kernels.
//!
//! Three binary levels make one [`Treelet`] of a cache line, the primitives of a leaf make
//! [`Block`]s of eight; an empty leaf costs nothing but a zero. The binary tree stays the reference:
//! a wide tree holds the same cells, and `validate` checks it against the tree it came from.

mod block;
mod compile;
mod treelet;
mod validate;

pub use block::{Block, ID_MASK, NO_ID, SIDES_BACK, SIDES_BOTH, SIDES_FRONT, WIDTH};
pub use treelet::{
    COUNT_BITS, COUNT_OVERFLOW, LEAF, MAX_BLOCKS, ORDER, OrderTable, Treelet, leaf_code, leaf_parts,
};
pub use validate::WideFault;

use crate::aabb::Aabb;

/// Largest number of treelets on a path; sizes the stacks of the kernels.
pub const MAX_WIDE_DEPTH: usize = crate::tree::MAX_DEPTH.div_ceil(3);

/// A compiled tree.
#[derive(Clone, Debug)]
pub struct WideTree {
    bounds: Aabb,
    root: u32,
    treelets: Vec<Treelet>,
    blocks: Vec<Block>,
    overflow: Vec<(u32, u32)>,
    has_shapes: bool,
}

/// Why a tree cannot be compiled.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CompileError {
    /// More blocks than a leaf code can address.
    #[error(
        "the tree needs {needed} leaf blocks, at most {max} can be addressed; lower max_duplication"
    )]
    TooManyBlocks {
        /// Blocks needed.
        needed: usize,
        /// The limit.
        max: usize,
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

    /// All treelets.
    pub fn treelets(&self) -> &[Treelet] {
        &self.treelets
    }

    /// All leaf blocks.
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// First block and number of blocks of a leaf code.
    #[inline(always)]
    pub fn leaf_blocks(&self, code: u32) -> (u32, u32) {
        let (first, count) = leaf_parts(code);
        if count == COUNT_OVERFLOW { (first, self.overflow_count(first)) } else { (first, count) }
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

    /// Bytes of treelets and blocks.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.treelets[..]) + size_of_val(&self.blocks[..])
    }
}
