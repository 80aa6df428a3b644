//! Static figures of a tree and what the surface-area measure predicts from them.

use super::{BspTree, NodeKind};
use crate::aabb::Aabb;

/// Leaves with this many references or more share the last bin of [`TreeStats::leaf_sizes`].
pub const LEAF_SIZE_BINS: usize = 64;

/// Havran's minimum output on a tree (thesis, section 3.5), and the predicted cost of a uniform
/// line that hits the root's box and ends nowhere (MacDonald and Booth 1990).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TreeStats {
    /// Inner nodes, `N_IN`.
    pub inner_nodes: usize,
    /// Leaves, `N_L`, empty ones included.
    pub leaves: usize,
    /// Empty leaves, `N_EL`.
    pub empty_leaves: usize,
    /// References in leaves, `N_REF`.
    pub references: usize,
    /// Depth of the deepest leaf; the root has depth 0.
    pub max_depth: usize,
    /// Mean depth of the leaves.
    pub mean_depth: f64,
    /// Memory of nodes and references.
    pub bytes: usize,
    /// Inner nodes visited per line, `S_IN = sum A_i / A` over inner nodes.
    pub predicted_inner_visits: f64,
    /// Leaves visited per line, `S_L = 1 + sum A^c_i / A` over inner nodes.
    pub predicted_leaf_visits: f64,
    /// Empty leaves visited per line.
    pub predicted_empty_leaf_visits: f64,
    /// Intersection tests per line without mailboxes: `sum N A_leaf / A` over leaves.
    pub predicted_intersection_tests: f64,
    /// Number of leaves by number of references; the last of [`LEAF_SIZE_BINS`] bins holds all
    /// larger leaves.
    pub leaf_sizes: Vec<u64>,
}

impl TreeStats {
    /// Measures a tree in one walk.
    pub fn of(tree: &BspTree) -> Self {
        let mut stats = TreeStats {
            references: tree.reference_count(),
            bytes: size_of_val(tree.nodes()) + tree.reference_count() * size_of::<u32>(),
            predicted_leaf_visits: 1.0,
            leaf_sizes: vec![0; LEAF_SIZE_BINS],
            ..TreeStats::default()
        };
        let measure = AreaMeasure::new(&tree.bounds());
        tree.for_each_node(|_, kind, cell, depth| {
            let area = measure.ratio(cell);
            match kind {
                NodeKind::Inner { axis, split, .. } => {
                    let (below, above) = cell.split(axis, split);
                    let cut = measure.ratio(&below) + measure.ratio(&above) - area;
                    stats.inner_nodes += 1;
                    stats.predicted_inner_visits += area;
                    stats.predicted_leaf_visits += cut;
                }
                NodeKind::Leaf { count, .. } => {
                    let count = count as usize;
                    stats.leaves += 1;
                    stats.max_depth = stats.max_depth.max(depth);
                    stats.mean_depth += depth as f64;
                    stats.leaf_sizes[count.min(LEAF_SIZE_BINS - 1)] += 1;
                    stats.predicted_intersection_tests += area * count as f64;
                    if count == 0 {
                        stats.empty_leaves += 1;
                        stats.predicted_empty_leaf_visits += area;
                    }
                }
            }
        });
        stats.mean_depth /= stats.leaves.max(1) as f64;
        stats
    }
}

/// Areas of cells in units of the root's area. Where the root has no area, lengths stand for
/// areas; where it has no length, every cell counts 1.
struct AreaMeasure {
    root: f64,
    by_length: bool,
}

impl AreaMeasure {
    fn new(root: &Aabb) -> Self {
        let by_length = root.area() <= 0.0;
        AreaMeasure { root: if by_length { length(root) } else { root.area() }, by_length }
    }

    fn ratio(&self, cell: &Aabb) -> f64 {
        if self.root <= 0.0 {
            return 1.0;
        }
        (if self.by_length { length(cell) } else { cell.area() }) / self.root
    }
}

fn length(cell: &Aabb) -> f64 {
    (0..3).map(|axis| cell.extent(axis).max(0.0)).sum()
}
