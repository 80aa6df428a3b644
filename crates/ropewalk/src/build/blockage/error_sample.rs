//! How far an estimator is off, measured on the finished tree.

use super::{AreaSweep, Blockage, ends_of_sides, sampled_ends};
use crate::aabb::Aabb;
use crate::build::plane::{CellAreas, Plane};
use crate::geometry::Geometry;
use crate::tree::{BspTree, NodeKind};

/// Nodes from the root down to this depth are looked at.
const SAMPLED_DEPTH: usize = 3;

/// Nodes with fewer references below them on both sides are left out.
const LEAST_REFERENCES: usize = 16;

/// Lines for each true probability: its standard error is at most 0.022.
const TRUTH_LINES: u32 = 512;

/// Seed of the truth; no estimator uses the same lines.
const TRUTH_SEED: u64 = 0x7472_7574_6800_0001;

/// Estimated probabilities of termination against sampled truth, over the cuts of the topmost
/// nodes (depth 0 to 3 with at least 16 references; both sides of each cut, flat children left
/// out).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EstimatorStats {
    /// Number of probabilities compared.
    pub count: usize,
    /// Mean of `|estimate - truth|`; about 0.01 of it is the noise of the sampled truth.
    pub mean_abs_error: f64,
    /// Mean of the estimates.
    pub mean_estimate: f64,
    /// Mean of the sampled truth.
    pub mean_truth: f64,
}

/// Compares on the cuts of a finished tree, which also answers the sampled lines.
pub(in crate::build) fn estimator_stats(
    geometry: &Geometry,
    tree: &BspTree,
    blockage: &Blockage<'_>,
) -> EstimatorStats {
    let mut stats = EstimatorStats::default();
    let mut stack = vec![(BspTree::ROOT, tree.bounds(), 0)];
    while let Some((node, cell, depth)) = stack.pop() {
        let NodeKind::Inner { axis, split, left, right } = tree.kind(node) else { continue };
        let (below, above) = cell.split(axis, split);
        let seed = TRUTH_SEED.wrapping_add(u64::from(node) << 8);
        let (ids_left, ids_right) = (prims_under(tree, left), prims_under(tree, right));
        if ids_left.len() + ids_right.len() < LEAST_REFERENCES {
            continue;
        }
        let truth = sampled_ends(geometry, tree, &cell, axis, split, TRUTH_LINES, seed);
        if let Some((true_left, true_right)) = truth {
            let plane = Plane {
                axis,
                position: split,
                planar_left: true,
                cost: 0.0,
                left: ids_left.len(),
                right: ids_right.len(),
            };
            let (p_left, p_right) = estimate(blockage, &cell, &plane, &ids_left, &ids_right);
            for (estimate, truth) in [(p_left, true_left), (p_right, true_right)] {
                stats.count += 1;
                stats.mean_abs_error += (estimate - truth).abs();
                stats.mean_estimate += estimate;
                stats.mean_truth += truth;
            }
        }
        if depth < SAMPLED_DEPTH {
            stack.push((right, above, depth + 1));
            stack.push((left, below, depth + 1));
        }
    }
    let count = stats.count.max(1) as f64;
    stats.mean_abs_error /= count;
    stats.mean_estimate /= count;
    stats.mean_truth /= count;
    stats
}

/// What the builder would have taken for `p_L` and `p_R` of this cut.
fn estimate(
    blockage: &Blockage<'_>,
    cell: &Aabb,
    plane: &Plane,
    ids_left: &[u32],
    ids_right: &[u32],
) -> (f64, f64) {
    if blockage.samples_nodes_of(ids_left.len().max(ids_right.len()))
        && let Some(ends) = blockage.sampled_ends(cell, plane)
    {
        return ends;
    }
    let Some(areas) = CellAreas::new(cell, plane.axis) else { return (0.0, 0.0) };
    let (below, above) = cell.split(plane.axis, plane.position);
    let mut ramps = Vec::new();
    let mut area = |ids: &[u32], part: &Aabb| {
        blockage.collect_ramps(ids.iter().copied(), part, plane.axis, &mut ramps);
        AreaSweep::total(&ramps, part.extent(plane.axis))
    };
    let (area_left, area_right) = (area(ids_left, &below), area(ids_right, &above));
    ends_of_sides(blockage, &areas, plane.position, area_left, area_right)
}

/// The primitives in the leaves under a node, each once, in ascending order.
fn prims_under(tree: &BspTree, node: u32) -> Vec<u32> {
    let mut prims = Vec::new();
    let mut stack = vec![node];
    while let Some(node) = stack.pop() {
        match tree.kind(node) {
            NodeKind::Inner { left, right, .. } => stack.extend([left, right]),
            NodeKind::Leaf { first, count } => prims.extend(tree.leaf_refs(first, count)),
        }
    }
    prims.sort_unstable();
    prims.dedup();
    prims
}
