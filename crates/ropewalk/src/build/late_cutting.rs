//! Late cutting of empty space (Havran 1997, Figure 2).

use super::fragment::Fragment;
use super::plane::{CellAreas, Pricing};
use crate::aabb::Aabb;
use crate::tree::MAX_DEPTH;

/// One slab cut off a leaf: an inner node with one empty child.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Slab {
    pub axis: usize,
    pub position: f32,
    /// The lower child holds the primitives, the upper one is empty; else the reverse.
    pub keep_left: bool,
}

/// The slabs to cut off the box of a would-be leaf at `depth`, outermost first.
///
/// Greedily takes the slab that leaves the smallest area, for as long as the surface-area measure
/// says that it pays: `traversal_cost + (A_child / A) f_C(N) < f_C(N)`. Only [`MAX_DEPTH`] bounds
/// the depth of the new nodes, since these are no subdivision of the primitives.
pub(crate) fn slabs(
    fragments: &[Fragment],
    mut cell: Aabb,
    depth: usize,
    pricing: &Pricing,
) -> Vec<Slab> {
    let mut cuts = Vec::new();
    let leaf_cost = pricing.leaf_cost.leaf(fragments.len());
    if leaf_cost <= pricing.traversal_cost {
        return cuts;
    }
    let tight = fragments.iter().fold(Aabb::EMPTY, |b, f| b.union(&f.bounds()));
    while depth + cuts.len() < MAX_DEPTH {
        let mut best: Option<(f64, Slab)> = None;
        for axis in 0..3 {
            let Some(areas) = CellAreas::new(&cell, axis) else { continue };
            for (position, keep_left) in [(tight.min[axis], false), (tight.max[axis], true)] {
                let (below, above) = areas.parts(position);
                let ratio = if keep_left { below } else { above } / areas.area;
                let cuts_something = cell.min[axis] < position && position < cell.max[axis]
                    || position == cell.max[axis] && !keep_left
                    || position == cell.min[axis] && keep_left;
                if cuts_something && best.is_none_or(|(r, _)| ratio < r) {
                    best = Some((ratio, Slab { axis, position, keep_left }));
                }
            }
        }
        let Some((ratio, slab)) = best else { break };
        if pricing.traversal_cost + ratio * leaf_cost >= leaf_cost {
            break;
        }
        let (below, above) = cell.split(slab.axis, slab.position);
        cell = if slab.keep_left { below } else { above };
        cuts.push(slab);
    }
    cuts
}
