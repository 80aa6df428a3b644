//! The binary BSP tree as plain data: the reference from which everything else is made.

mod checked;
mod node;
mod stats;
mod validate;

pub use checked::TreeError;
pub use node::{Node, NodeKind};
pub use stats::{LEAF_SIZE_BINS, TreeStats};
pub use validate::TreeFault;

use crate::aabb::Aabb;

/// Largest depth of a leaf (the root has depth 0). Traversal stacks are sized by it and so can
/// neither overflow nor allocate.
pub const MAX_DEPTH: usize = 96;

/// A binary BSP tree: nodes in depth-first order (the left child follows its parent), and the
/// references of all leaves one after the other.
#[derive(Clone, Debug, PartialEq)]
pub struct BspTree {
    bounds: Aabb,
    nodes: Vec<Node>,
    refs: Vec<u32>,
}

impl BspTree {
    /// Index of the root.
    pub const ROOT: u32 = 0;

    /// A tree from its parts. Nothing is checked here: `validate` does.
    pub(crate) fn from_parts(bounds: Aabb, nodes: Vec<Node>, refs: Vec<u32>) -> Self {
        BspTree { bounds, nodes, refs }
    }

    /// The root's box.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// All nodes, the root first.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// What node `index` is.
    #[inline]
    pub fn kind(&self, index: u32) -> NodeKind {
        self.nodes[index as usize].kind(index)
    }

    /// The primitives of a leaf, in ascending order of id.
    #[inline]
    pub fn leaf_refs(&self, first: u32, count: u32) -> &[u32] {
        &self.refs[first as usize..][..count as usize]
    }

    /// Total number of references in leaves.
    pub fn reference_count(&self) -> usize {
        self.refs.len()
    }

    /// Calls `visit(node, kind, box, depth)` for every node, parents first, left before right.
    pub fn for_each_node(&self, mut visit: impl FnMut(u32, NodeKind, &Aabb, usize)) {
        let mut stack = vec![(Self::ROOT, self.bounds, 0)];
        while let Some((index, cell, depth)) = stack.pop() {
            let kind = self.kind(index);
            visit(index, kind, &cell, depth);
            if let NodeKind::Inner { axis, split, left, right } = kind {
                let (lo, hi) = cell.split(axis, split);
                stack.push((right, hi, depth + 1));
                stack.push((left, lo, depth + 1));
            }
        }
    }
}
