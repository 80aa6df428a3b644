//! The walk of Sung and Shirley 1992, "Ray Tracing with the BSP Tree" (Graphics Gems III): the
//! recursive walk unrolled with a stack of entry and exit distances.

use crate::geometry::Geometry;
use crate::ray::Ray;
use crate::traverse::closed_ray::ClosedRay;
use crate::traverse::stack::{Pending, Stack};
use crate::traverse::{Counters, Query};
use crate::tree::{BspTree, NodeKind};

/// Walks the tree from the root, near child first, by distances along the ray.
///
/// At each inner node the distance to the plane is compared with the entry and exit distances:
/// beyond the exit only the near child is visited, before the entry only the far child, otherwise
/// both, the far one from the stack.
///
/// `Deviation:` the article names the near child by the side on which the origin lies, and divides
/// by the direction even where it is 0: an origin in the plane has no side, and 0/0 no order. Here
/// the sign of the direction names the near child, which is the origin's side for every plane
/// ahead of the origin; all comparisons are closed with the slack of docs/numerics.md, and a
/// parallel ray within the slack of the plane visits both children over its whole interval.
///
/// # Panics
/// If the tree refers to primitives that `geometry` does not have.
pub fn sung_shirley<Q: Query, C: Counters>(
    geometry: &Geometry,
    tree: &BspTree,
    ray: &Ray,
    counters: &mut C,
) -> Q::Answer {
    let mut query = Q::default();
    let Some(closed) = ClosedRay::new(ray, &tree.bounds()) else { return query.answer() };
    let mut stack = Stack::new();
    let mut next = Some(Pending { node: BspTree::ROOT, from: closed.from, to: closed.to });
    while let Some(Pending { mut node, from, mut to }) = next {
        // Skip what begins behind the best hit; entries below it may still begin before.
        if ClosedRay::settled(&query, from) {
            next = stack.pop();
            continue;
        }
        let refs = loop {
            let (axis, split, left, right) = match tree.kind(node) {
                NodeKind::Leaf { first, count } => break tree.leaf_refs(first, count),
                NodeKind::Inner { axis, split, left, right } => (axis, split, left, right),
            };
            counters.traversal_step();
            // How far the plane lies from the origin.
            let above = f64::from(split) - closed.ray.origin[axis];
            let (near, far) =
                if closed.ray.dir[axis] >= 0.0 { (left, right) } else { (right, left) };
            if closed.is_parallel(axis) {
                if above > closed.slack {
                    node = left;
                } else if above < -closed.slack {
                    node = right;
                } else {
                    stack.push(Pending { node: far, from, to });
                    node = near;
                }
                continue;
            }
            let t = above * closed.ray.inv[axis];
            let (first, last) = (t - closed.t_slack[axis], t + closed.t_slack[axis]);
            if first > to {
                node = near;
            } else if last < from {
                node = far;
            } else {
                stack.push(Pending { node: far, from: from.max(first), to });
                (node, to) = (near, to.min(last));
            }
        };
        if closed.test_leaf(geometry, refs, &mut query, counters) {
            break;
        }
        next = stack.pop();
    }
    query.answer()
}
