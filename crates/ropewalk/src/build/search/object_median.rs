//! The median of the primitives' centroids, axes in turn.

use super::{NodeView, PlaneSearch, SearchBuffers, axes_in_turn, direct_plane, object_median};
use crate::build::plane::{CellAreas, Plane, Pricing};

/// Cuts at the median of the centroids, axes in turn x, y, z; an axis on which that makes no
/// progress is passed over.
pub(crate) struct ObjectMedian {
    pub pricing: Pricing,
}

impl PlaneSearch for ObjectMedian {
    fn uses_events(&self) -> bool {
        false
    }

    fn best_plane(&self, node: &NodeView<'_>, buffers: &mut SearchBuffers) -> Option<Plane> {
        axes_in_turn(node.depth).find_map(|axis| {
            let areas = CellAreas::new(&node.cell, axis)?;
            let position = object_median(node, axis, &mut buffers.centroids);
            direct_plane(node, &areas, axis, position, &self.pricing)
        })
    }
}
