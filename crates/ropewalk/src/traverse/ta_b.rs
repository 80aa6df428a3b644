//! Havran's TA-B: "Fast Robust BSP Tree Traversal Algorithm for Ray Tracing" (Havran, Kopal,
//! Bittner, Zara 1997, Journal of Graphics Tools 2(4)).

use crate::geometry::Geometry;
use crate::ray::Ray;
use crate::traverse::closed_ray::ClosedRay;
use crate::traverse::stack::{Pending, Stack};
use crate::traverse::{Counters, Query};
use crate::tree::{BspTree, NodeKind};

/// Walks the tree from the root by the coordinates of the entry and exit points.
///
/// On the axis of the plane the two coordinates are compared with its position: both below visits
/// the left child alone (cases N1 to N3, P5), both above the right child alone (P1 to P3, N5).
/// Only where the points lie on different sides (P4, N4), or one of them in the plane (Z1 to Z3),
/// is the crossing computed and are both children visited. Nothing depends on the origin's side or
/// on a quotient by zero.
///
/// `Deviation:` the original lets a point in the plane choose one child (with the printed
/// condition of case Z1 testing the exit point where the entry point is meant); here it visits
/// both, with the slack of docs/numerics.md, for a primitive may touch the plane from either side.
/// Points are computed anew when a subtree is taken from the stack instead of being stored there.
///
/// # Panics
/// If the tree refers to primitives that `geometry` does not have.
pub fn ta_b<Q: Query, C: Counters>(
    geometry: &Geometry,
    tree: &BspTree,
    ray: &Ray,
    counters: &mut C,
) -> Q::Answer {
    let mut query = Q::default();
    if let Some(closed) = ClosedRay::new(ray, &tree.bounds()) {
        resume(geometry, tree, &closed, &mut query, counters);
    }
    query.answer()
}

/// The walk proper, over `closed.from ..= closed.to`, into a query that may hold hits already.
pub(crate) fn resume<Q: Query, C: Counters>(
    geometry: &Geometry,
    tree: &BspTree,
    closed: &ClosedRay,
    query: &mut Q,
    counters: &mut C,
) {
    let mut stack = Stack::new();
    let mut next = Some(Pending { node: BspTree::ROOT, from: closed.from, to: closed.to });
    while let Some(Pending { mut node, from, mut to }) = next {
        // Skip what begins behind the best hit; entries below it may still begin before.
        if ClosedRay::settled(query, from) {
            next = stack.pop();
            continue;
        }
        let (entry, mut exit) = (closed.point(from), closed.point(to));
        let refs = loop {
            let (axis, split, left, right) = match tree.kind(node) {
                NodeKind::Leaf { first, count } => break tree.leaf_refs(first, count),
                NodeKind::Inner { axis, split, left, right } => {
                    (axis, f64::from(split), left, right)
                }
            };
            counters.traversal_step();
            let (low, high) = (split - closed.slack, split + closed.slack);
            if entry[axis] < low {
                if exit[axis] < low {
                    node = left;
                    continue;
                }
            } else if entry[axis] > high && exit[axis] > high {
                node = right;
                continue;
            }
            // Both children: the one that the ray leaves first now, the other from the stack.
            let (near, far) =
                if closed.ray.dir[axis] >= 0.0 { (left, right) } else { (right, left) };
            node = near;
            if closed.is_parallel(axis) {
                stack.push(Pending { node: far, from, to });
                continue;
            }
            let t = closed.t_at(axis, split);
            let (first, last) = (t - closed.t_slack[axis], t + closed.t_slack[axis]);
            // The walk may come here by the slack alone: keep both parts non-empty.
            stack.push(Pending { node: far, from: first.clamp(from, to), to });
            if last < to {
                to = last.max(from);
                exit = closed.point(to);
            }
        };
        if closed.test_leaf(geometry, refs, query, counters) {
            return;
        }
        next = stack.pop();
    }
}
