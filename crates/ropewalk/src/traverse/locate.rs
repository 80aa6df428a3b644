//! Finding the leaf that holds a point.

use crate::tree::{BspTree, NodeKind};

/// A leaf of one tree, as a hint where to start a walk. A hint for another tree, or a number that
/// is no leaf at all, costs time and never changes an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct LeafId(
    /// Index of the leaf among the tree's nodes.
    pub u32,
);

/// The leaf whose cell holds `point`; a point in a cutting plane belongs to the upper child.
/// `None` outside the tree's box, and for NaN.
pub fn locate(tree: &BspTree, point: [f32; 3]) -> Option<LeafId> {
    if !tree.bounds().contains_point(point) {
        return None;
    }
    let mut node = BspTree::ROOT;
    while let NodeKind::Inner { axis, split, left, right } = tree.kind(node) {
        node = if point[axis] < split { left } else { right };
    }
    Some(LeafId(node))
}
