//! What a build did.

use super::blockage::EstimatorStats;
use super::settings::BuildSettings;
use super::stopping::StopReason;
use crate::tree::TreeStats;

/// How many leaves each rule made, and how many slabs were cut off leaves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StopCounts {
    /// No primitives left.
    pub empty: u64,
    /// Few enough primitives.
    pub leaf_size: u64,
    /// The depth limit.
    pub depth: u64,
    /// No split pays, or too many failed on the path.
    pub cost: u64,
    /// No plane makes progress.
    pub no_plane: u64,
    /// The best split would have exceeded the node's share of the references.
    pub budget: u64,
    /// Empty slabs cut off leaves; each is an inner node and an empty leaf not counted above.
    pub late_cuts: u64,
}

impl StopCounts {
    pub(super) fn count(&mut self, reason: StopReason) {
        *match reason {
            StopReason::Empty => &mut self.empty,
            StopReason::LeafSize => &mut self.leaf_size,
            StopReason::Depth => &mut self.depth,
            StopReason::Cost => &mut self.cost,
            StopReason::NoPlane => &mut self.no_plane,
            StopReason::Budget => &mut self.budget,
        } += 1;
    }

    pub(super) fn add(&mut self, other: &StopCounts) {
        self.empty += other.empty;
        self.leaf_size += other.leaf_size;
        self.depth += other.depth;
        self.cost += other.cost;
        self.no_plane += other.no_plane;
        self.budget += other.budget;
        self.late_cuts += other.late_cuts;
    }
}

/// What a build did, and the figures of the tree that came out.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct BuildReport {
    /// The settings in effect: as given, but `clipping` off for the 1990 measure.
    pub settings: BuildSettings,
    /// Primitives of the geometry, degenerate ones included.
    pub primitives: usize,
    /// Primitives without area; they are in the tree and never hit.
    pub degenerate: usize,
    /// Static and predicted figures of the tree.
    pub tree: TreeStats,
    /// References per primitive; 0 without primitives.
    pub duplication: f64,
    /// Why nodes became leaves.
    pub stops: StopCounts,
    /// Exponent of the surface-area estimator, given or calibrated; `None` where none is used.
    pub beta: Option<f64>,
    /// The estimator's error; `None` where the measure uses no estimator.
    pub estimator: Option<EstimatorStats>,
    /// Wall-clock time of the build, calibration included, this report not.
    pub seconds: f64,
}
