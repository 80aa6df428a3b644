//! A tree from parts that were made elsewhere.

use super::{BspTree, MAX_DEPTH, Node, NodeKind};
use crate::aabb::Aabb;

/// Why [`BspTree::from_nodes`] refused its parts.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TreeError {
    /// A node is missing, reached twice, or never reached.
    #[error(
        "node {node}: the nodes do not form one tree in depth-first order (left child after its parent, right child after the left subtree)"
    )]
    Layout {
        /// The first node at fault.
        node: usize,
    },
    /// A leaf lies too deep.
    #[error("node {node} lies at depth {depth}; the limit is {MAX_DEPTH}")]
    TooDeep {
        /// The node.
        node: usize,
        /// Its depth.
        depth: usize,
    },
    /// A cutting plane outside its cell.
    #[error(
        "node {node}: the split position {split} lies outside the node's cell {low} ..= {high}"
    )]
    SplitOutside {
        /// The node.
        node: usize,
        /// The position, as text: it may be NaN.
        split: String,
        /// Lower end of the cell on the split axis.
        low: String,
        /// Upper end of the cell on the split axis.
        high: String,
    },
    /// References that do not exist.
    #[error("node {node} refers to {first}..{end} of {len} references")]
    References {
        /// The leaf.
        node: usize,
        /// First reference.
        first: usize,
        /// One past the last reference.
        end: usize,
        /// How many there are.
        len: usize,
    },
    /// The root's box is not finite.
    #[error("the root's box must be empty or finite")]
    Bounds,
}

impl BspTree {
    /// A tree from its parts: what a walk relies on is checked, so that no walk over the result
    /// can fail or run for ever, whatever the parts. Whether the leaves hold the right primitives
    /// is not checked here.
    ///
    /// # Errors
    /// [`TreeError`] names the first node at fault.
    pub fn from_nodes(
        bounds: Aabb,
        nodes: Vec<Node>,
        refs: Vec<u32>,
    ) -> Result<BspTree, TreeError> {
        if !bounds.is_empty() && bounds.min.iter().chain(&bounds.max).any(|x| !x.is_finite()) {
            return Err(TreeError::Bounds);
        }
        // In depth-first order each node is either the left child of the one before or the right
        // child that the nearest open ancestor waits for.
        let mut open = vec![(bounds, 0usize, 0u32)];
        for (node, &packed) in nodes.iter().enumerate() {
            let Some((cell, depth, expected)) = open.pop() else {
                return Err(TreeError::Layout { node });
            };
            if expected as usize != node {
                return Err(TreeError::Layout { node });
            }
            if depth > MAX_DEPTH {
                return Err(TreeError::TooDeep { node, depth });
            }
            match packed.kind(node as u32) {
                NodeKind::Leaf { first, count } => {
                    let (first, end) = (first as usize, first as usize + count as usize);
                    if end > refs.len() {
                        return Err(TreeError::References { node, first, end, len: refs.len() });
                    }
                }
                NodeKind::Inner { axis, split, left, right } => {
                    let (low, high) = (cell.min[axis], cell.max[axis]);
                    if !(low <= split && split <= high) {
                        let [split, low, high] = [split, low, high].map(|x| x.to_string());
                        return Err(TreeError::SplitOutside { node, split, low, high });
                    }
                    let (below, above) = cell.split(axis, split);
                    open.push((above, depth + 1, right));
                    open.push((below, depth + 1, left));
                }
            }
        }
        match open.is_empty() && !nodes.is_empty() {
            true => Ok(BspTree::from_parts(bounds, nodes, refs)),
            false => Err(TreeError::Layout { node: nodes.len() }),
        }
    }
}
