//! When a node becomes a leaf.

use super::plane::{Plane, Pricing};
use super::settings::Termination;
use crate::tree::MAX_DEPTH;

/// Why a node became a leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum StopReason {
    Empty,
    LeafSize,
    Depth,
    Cost,
    NoPlane,
    Budget,
}

/// The termination criteria with all limits worked out for a number of primitives.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stopping {
    termination: Termination,
    max_depth: usize,
    /// Failed splits allowed on a path (automatic termination only).
    allowed_failures: u32,
}

impl Stopping {
    pub fn new(termination: Termination, primitives: usize) -> Self {
        // 1.2 log2 N + const, after Havran and Bittner 2002.
        let automatic =
            |constant: f64| (1.2 * (primitives.max(1) as f64).log2() + constant) as usize;
        let max_depth = match termination {
            Termination::Fixed { max_depth, .. } => {
                max_depth.map_or(automatic(2.0), |d| d as usize)
            }
            Termination::Automatic { .. } => automatic(2.0),
            Termination::Cost { max_depth } => max_depth.map_or(automatic(8.0), |d| d as usize),
        }
        .min(MAX_DEPTH);
        Stopping { termination, max_depth, allowed_failures: 1 + (0.2 * max_depth as f64) as u32 }
    }

    /// Decides without a plane: `Some` if the node is a leaf in any case.
    pub fn before_search(
        &self,
        count: usize,
        depth: usize,
        pricing: &Pricing,
    ) -> Option<StopReason> {
        if count == 0 {
            return Some(StopReason::Empty);
        }
        if depth >= self.max_depth {
            return Some(StopReason::Depth);
        }
        match self.termination {
            Termination::Fixed { leaf_size, .. } => {
                (count <= leaf_size as usize).then_some(StopReason::LeafSize)
            }
            // A traversal step alone costs as much as the leaf: no split can pay, here or below.
            Termination::Automatic { .. } | Termination::Cost { .. } => {
                (pricing.leaf_cost.leaf(count) <= pricing.traversal_cost)
                    .then_some(StopReason::Cost)
            }
        }
    }

    /// Decides on the best plane. `failures` counts the failed splits on the path from the root.
    pub fn after_search(
        &self,
        plane: &Plane,
        count: usize,
        failures: &mut u32,
        pricing: &Pricing,
    ) -> Option<StopReason> {
        let leaf_cost = pricing.leaf_cost.leaf(count);
        match self.termination {
            Termination::Fixed { .. } => None,
            Termination::Automatic { max_ratio } => {
                *failures += u32::from(plane.cost > max_ratio * leaf_cost);
                (*failures > self.allowed_failures).then_some(StopReason::Cost)
            }
            Termination::Cost { .. } => (plane.cost >= leaf_cost).then_some(StopReason::Cost),
        }
    }
}
