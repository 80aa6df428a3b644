//! The middle of the cell, axes in turn.

use super::{NodeView, PlaneSearch, SearchBuffers, axes_in_turn, direct_plane, spatial_median};
use crate::build::plane::{CellAreas, Plane, Pricing};

/// Halves the cell, axes in turn x, y, z; an axis on which that makes no progress is passed over.
pub(crate) struct SpatialMedian {
    pub pricing: Pricing,
}

impl PlaneSearch for SpatialMedian {
    fn uses_events(&self) -> bool {
        false
    }

    fn best_plane(&self, node: &NodeView<'_>, _buffers: &mut SearchBuffers) -> Option<Plane> {
        axes_in_turn(node.depth).find_map(|axis| {
            let areas = CellAreas::new(&node.cell, axis)?;
            direct_plane(node, &areas, axis, spatial_median(&node.cell, axis), &self.pricing)
        })
    }
}
