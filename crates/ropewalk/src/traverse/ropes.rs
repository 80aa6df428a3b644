//! The walk from leaf to leaf along ropes or rope trees.

use crate::aabb::Aabb;
use crate::geometry::Geometry;
use crate::ray::Ray;
use crate::rope::{Cell, Cells, Link, RopeTrees, Ropes, Target, Threads};
use crate::traverse::closed_ray::ClosedRay;
use crate::traverse::ta_b;
use crate::traverse::{Counters, LeafId, Query};
use crate::tree::{BspTree, NodeKind};

/// Walks along single links: across each face to the neighbour, or to a tree node above all
/// neighbours and down from there. See [`rope_trees`] for the rest, which is the same.
///
/// # Panics
/// As [`rope_trees`].
pub fn ropes<Q: Query, C: Counters>(
    geometry: &Geometry,
    tree: &BspTree,
    ropes: &Ropes,
    ray: &Ray,
    start: Option<LeafId>,
    counters: &mut C,
) -> (Q::Answer, Option<LeafId>) {
    walk::<Q, C>(geometry, tree, ropes.threads(), ray, start, counters)
}

/// Walks along rope trees: across each face and down the face's own two-dimensional BSP.
///
/// `start` may name the leaf in which the range of the ray begins; where it does not, the leaf is
/// found from the root (counted as traversal steps). Returned beside the answer is the leaf in
/// which the walk ended: for a closest hit the leaf that holds it, the right `start` for rays that
/// leave from there. It is `None` if the walk was finished from the root, left the scene or never
/// reached it.
///
/// # Panics
/// If the links are those of another tree, or the tree that of another geometry: use
/// [`Accelerator`](crate::Accelerator), which joins only what belongs together.
pub fn rope_trees<Q: Query, C: Counters>(
    geometry: &Geometry,
    tree: &BspTree,
    rope_trees: &RopeTrees,
    ray: &Ray,
    start: Option<LeafId>,
    counters: &mut C,
) -> (Q::Answer, Option<LeafId>) {
    walk::<Q, C>(geometry, tree, rope_trees.threads(), ray, start, counters)
}

/// A crossing that links cannot decide: the ray touches an edge, a corner or a plane that it runs
/// in, so that cells off the chain may touch it too.
struct Degenerate;

/// Where the walk came from: the crossing by which it entered a leaf.
#[derive(Clone, Copy)]
struct Crossing {
    /// Axis of the crossed plane; `None` where the range begins inside the leaf.
    axis: Option<usize>,
    /// Parameter up to which the crossed plane is within the slack.
    clear: f64,
}

/// The way out of a leaf.
struct Exit {
    axis: usize,
    t: f64,
    /// No other leaf is touched before this parameter.
    alone_until: f64,
    /// True if another plane of the leaf is within the slack where the ray crosses this one.
    degenerate: bool,
}

/// Links decide a crossing only where the ray is clear of all other planes there. The walk
/// therefore keeps, per leaf, the interval in which no other leaf can be touched; where planes
/// come too close it leaves the rest of the range, from the end of what is settled, to TA-B.
/// docs/numerics.md proves that this finds all that TA-B alone would find.
///
/// `Deviation:` the usual walk sets the crossing point on the plane, clamps it into the face and
/// decides ties by a half-open rule, which loses primitives in cells that the ray only touches.
/// Here the point of a crossing that is not degenerate lies inside the face by the slack, no tie
/// is left to decide, and the entry face cannot be crossed again for only faces ahead are tried.
fn walk<Q: Query, C: Counters>(
    geometry: &Geometry,
    tree: &BspTree,
    threads: &Threads,
    ray: &Ray,
    start: Option<LeafId>,
    counters: &mut C,
) -> (Q::Answer, Option<LeafId>) {
    let mut query = Q::default();
    let Some(mut closed) = ClosedRay::new(ray, &tree.bounds()) else {
        return (query.answer(), None);
    };
    let mut settled = closed.from;
    let mut place = enter(tree, threads, &closed, start, counters);
    // Each leaf is met at most once; the bound holds even should rounding contradict the proof.
    for _ in 0..threads.cells.cells.len() {
        let Ok((leaf, crossing)) = place else { break };
        let cell = &threads.cells.cells[leaf as usize];
        // 1. Find the exit, and turn back to the root if the entry is not clear of it.
        let Some(exit) = exit(&closed, &cell.bounds) else { break };
        if crossing.axis != Some(exit.axis) && exit.alone_until <= crossing.clear {
            break;
        }
        // 2. Test the leaf; it alone holds what lies before `alone_until`.
        let refs = tree.leaf_refs(cell.first, cell.count);
        let stop = closed.test_leaf(geometry, refs, &mut query, counters);
        settled = exit.alone_until;
        if stop || settled > closed.to || ClosedRay::settled(&query, settled) {
            return (query.answer(), Some(LeafId(cell.node)));
        }
        if exit.degenerate {
            break;
        }
        // 3. Cross the face.
        match cross(tree, threads, &closed, cell, &exit, counters) {
            Ok(Some(next)) => {
                let clear = exit.t + closed.t_slack[exit.axis];
                place = Ok((next, Crossing { axis: Some(exit.axis), clear }));
            }
            Ok(None) => return (query.answer(), None),
            Err(Degenerate) => break,
        }
    }
    counters.restart();
    closed.from = settled.max(closed.from);
    ta_b::resume(geometry, tree, &closed, &mut query, counters);
    (query.answer(), None)
}

/// The first leaf of the walk: `start` if the range begins well inside it, else by descent.
fn enter<C: Counters>(
    tree: &BspTree,
    threads: &Threads,
    closed: &ClosedRay,
    start: Option<LeafId>,
    counters: &mut C,
) -> Result<(u32, Crossing), Degenerate> {
    let inside = Crossing { axis: None, clear: closed.from };
    if let Some(leaf) = start.and_then(|start| number(&threads.cells, start)) {
        let cell = &threads.cells.cells[leaf as usize];
        if begins_inside(closed, &cell.bounds) {
            return Ok((leaf, inside));
        }
    }
    let bounds = tree.bounds();
    if begins_inside(closed, &bounds) {
        let point = closed.point(closed.from);
        let leaf = descend(
            tree,
            threads,
            closed,
            BspTree::ROOT,
            point,
            [closed.slack; 3],
            None,
            counters,
        )?;
        return Ok((leaf, inside));
    }
    // The face by which the ray enters the box; all other planes must be behind by then.
    let (mut axis, mut t) = (None, f64::NEG_INFINITY);
    for a in 0..3 {
        let (behind, _) = planes(closed, &bounds, a);
        if closed.is_parallel(a) {
            clear_of_parallel(closed, &bounds, a)?;
        } else if closed.t_at(a, behind) > t {
            (axis, t) = (Some(a), closed.t_at(a, behind));
        }
    }
    let axis = axis.ok_or(Degenerate)?;
    for a in (0..3).filter(|&a| a != axis && !closed.is_parallel(a)) {
        let (behind, _) = planes(closed, &bounds, a);
        if closed.t_at(a, behind) + closed.t_slack[a] >= t - closed.t_slack[axis] {
            return Err(Degenerate);
        }
    }
    let clear = t + closed.t_slack[axis];
    let margins = margins(closed, axis);
    let point = closed.point(t);
    let leaf = descend(tree, threads, closed, BspTree::ROOT, point, margins, Some(axis), counters)?;
    Ok((leaf, Crossing { axis: Some(axis), clear }))
}

fn number(cells: &Cells, leaf: LeafId) -> Option<u32> {
    cells.number.get(leaf.0 as usize).copied().filter(|&number| number != Cells::NONE)
}

/// The planes of a box on one axis: the one that the ray meets first, and the one it meets last.
#[inline]
fn planes(closed: &ClosedRay, bounds: &Aabb, axis: usize) -> (f64, f64) {
    let (low, high) = (f64::from(bounds.min[axis]), f64::from(bounds.max[axis]));
    if closed.goes_up(axis) { (low, high) } else { (high, low) }
}

/// An error if a ray parallel to the planes of `axis` runs within the slack of one of the box.
#[inline]
fn clear_of_parallel(closed: &ClosedRay, bounds: &Aabb, axis: usize) -> Result<(), Degenerate> {
    let o = closed.ray.origin[axis];
    let (low, high) = (f64::from(bounds.min[axis]), f64::from(bounds.max[axis]));
    let clear = o > low + closed.slack && o < high - closed.slack;
    if clear { Ok(()) } else { Err(Degenerate) }
}

/// True if the ray's range begins inside the box and clear of its planes.
fn begins_inside(closed: &ClosedRay, bounds: &Aabb) -> bool {
    (0..3).all(|a| {
        if closed.is_parallel(a) {
            return clear_of_parallel(closed, bounds, a).is_ok();
        }
        let (behind, ahead) = planes(closed, bounds, a);
        closed.t_at(a, behind) + closed.t_slack[a] < closed.from
            && closed.t_at(a, ahead) - closed.t_slack[a] > closed.from
    })
}

/// The nearest of the three planes ahead. `None` where a parallel ray runs in a plane of the leaf.
#[inline]
fn exit(closed: &ClosedRay, bounds: &Aabb) -> Option<Exit> {
    for a in (0..3).filter(|&a| closed.is_parallel(a)) {
        clear_of_parallel(closed, bounds, a).ok()?;
    }
    let ahead: [f64; 3] = std::array::from_fn(|a| match closed.is_parallel(a) {
        true => f64::INFINITY,
        false => closed.t_at(a, planes(closed, bounds, a).1),
    });
    let mut axis = usize::from(ahead[1] < ahead[0]);
    axis = if ahead[2] < ahead[axis] { 2 } else { axis };
    let t = ahead[axis];
    // The bands of all three planes: one may begin before that of the exit ends, its own.
    let first: [f64; 3] = std::array::from_fn(|a| ahead[a] - closed.t_slack[a]);
    let last = t + closed.t_slack[axis];
    let near: u32 = first.map(|first| u32::from(first <= last)).into_iter().sum();
    let alone_until = first[0].min(first[1]).min(first[2]);
    Some(Exit { axis, t, alone_until, degenerate: near != 1 })
}

/// How far, per axis, a crossing of a plane of `axis` must stay clear of other planes: the slack
/// there, and what the ray travels while it is within the slack of the crossed plane.
#[inline]
fn margins(closed: &ClosedRay, axis: usize) -> [f64; 3] {
    closed.ray.dir.map(|d| closed.slack + closed.t_slack[axis] * d.abs())
}

/// Follows the link of the exit face; `None` outside of the scene.
#[inline]
fn cross<C: Counters>(
    tree: &BspTree,
    threads: &Threads,
    closed: &ClosedRay,
    cell: &Cell,
    exit: &Exit,
    counters: &mut C,
) -> Result<Option<u32>, Degenerate> {
    let link = cell.links[2 * exit.axis + usize::from(closed.goes_up(exit.axis))];
    if link == Link::OUTSIDE {
        return Ok(None);
    }
    counters.rope_crossing();
    if let Target::Leaf(leaf) = link.target() {
        return Ok(Some(leaf));
    }
    let (point, margins) = (closed.point(exit.t), margins(closed, exit.axis));
    let mut link = link;
    loop {
        match link.target() {
            Target::Outside => return Ok(None),
            Target::Leaf(leaf) => return Ok(Some(leaf)),
            Target::Node(node) => {
                let axis = Some(exit.axis);
                return descend(tree, threads, closed, node, point, margins, axis, counters)
                    .map(Some);
            }
            Target::Split { axis, node } => {
                counters.rope_tree_step();
                let node = &threads.nodes[node as usize];
                let above = point[axis] - f64::from(node.split);
                if above.abs() <= margins[axis] {
                    return Err(Degenerate);
                }
                link = if above < 0.0 { node.below } else { node.above };
            }
        }
    }
}

/// Descends the tree to the leaf at `point`. Planes of the crossed axis have their adjacent side
/// towards the ray's origin; of all others the point must be clear.
#[allow(clippy::too_many_arguments)]
fn descend<C: Counters>(
    tree: &BspTree,
    threads: &Threads,
    closed: &ClosedRay,
    mut node: u32,
    point: [f64; 3],
    margins: [f64; 3],
    crossed: Option<usize>,
    counters: &mut C,
) -> Result<u32, Degenerate> {
    while let NodeKind::Inner { axis, split, left, right } = tree.kind(node) {
        counters.traversal_step();
        let above = point[axis] - f64::from(split);
        node = if crossed == Some(axis) {
            if closed.goes_up(axis) { left } else { right }
        } else if above.abs() <= margins[axis] {
            return Err(Degenerate);
        } else if above < 0.0 {
            left
        } else {
            right
        };
    }
    Ok(threads.cells.number[node as usize])
}
