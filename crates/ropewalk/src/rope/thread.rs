//! Passing ropes down a tree: six links per node, pushed towards the leaves that they serve.

use crate::aabb::Aabb;
use crate::tree::{BspTree, NodeKind};

/// Index of a node that may be missing: beyond a face of the scene's box there is nothing.
pub(crate) type Neighbour = Option<u32>;

/// Which child of a split covers a face.
pub(crate) enum Side {
    Lower,
    Upper,
    /// The plane cuts the face.
    Both,
}

/// Which side of the plane `axis = split` holds what touches, from across, the face `face` of
/// `cell`. Across an upper face the lower child is adjacent. A plane along an edge of the face
/// does not cut it: what lies beyond touches in the edge alone.
pub(crate) fn side_of_face(cell: &Aabb, face: usize, axis: usize, split: f32) -> Side {
    if axis == face / 2 {
        return if face % 2 == 1 { Side::Lower } else { Side::Upper };
    }
    if split <= cell.min[axis] {
        Side::Upper
    } else if split >= cell.max[axis] {
        Side::Lower
    } else {
        Side::Both
    }
}

/// The smallest node below `node` that covers all that touches the face.
pub(crate) fn push_down(tree: &BspTree, mut node: u32, cell: &Aabb, face: usize) -> u32 {
    while let NodeKind::Inner { axis, split, left, right } = tree.kind(node) {
        node = match side_of_face(cell, face, axis, split) {
            Side::Lower => left,
            Side::Upper => right,
            Side::Both => break,
        };
    }
    node
}

/// Calls `visit(node, box, ropes)` for each leaf, in depth-first order, with its six single links
/// pushed down as far as they go.
pub(crate) fn for_each_leaf(tree: &BspTree, mut visit: impl FnMut(u32, &Aabb, [Neighbour; 6])) {
    let mut stack = vec![(BspTree::ROOT, tree.bounds(), [None; 6])];
    while let Some((node, cell, mut ropes)) = stack.pop() {
        for (face, rope) in ropes.iter_mut().enumerate() {
            *rope = rope.map(|target| push_down(tree, target, &cell, face));
        }
        match tree.kind(node) {
            NodeKind::Leaf { .. } => visit(node, &cell, ropes),
            NodeKind::Inner { axis, split, left, right } => {
                let (below, above) = cell.split(axis, split);
                let (mut lower, mut upper) = (ropes, ropes);
                lower[2 * axis + 1] = Some(right);
                upper[2 * axis] = Some(left);
                stack.push((right, above, upper));
                stack.push((left, below, lower));
            }
        }
    }
}
