//! The heuristic of MacDonald and Booth as published.

use super::{NodeView, PlaneSearch, SearchBuffers, direct_plane, object_median, spatial_median};
use crate::build::plane::{CellAreas, Plane, Pricing};

/// Planes looked at on each axis.
const SAMPLES: usize = 9;

/// The cheapest of nine planes, evenly spaced from the spatial median to the object median with
/// both included, on each of the three axes (MacDonald and Booth 1990, who show that the optimum
/// lies between the two).
pub(crate) struct MacDonaldBooth1990 {
    pub pricing: Pricing,
}

impl PlaneSearch for MacDonaldBooth1990 {
    fn uses_events(&self) -> bool {
        false
    }

    fn best_plane(&self, node: &NodeView<'_>, buffers: &mut SearchBuffers) -> Option<Plane> {
        let mut best: Option<Plane> = None;
        for axis in 0..3 {
            let Some(areas) = CellAreas::new(&node.cell, axis) else { continue };
            let from = f64::from(spatial_median(&node.cell, axis));
            let to = f64::from(object_median(node, axis, &mut buffers.centroids));
            for i in 0..SAMPLES {
                let position = from + (to - from) * i as f64 / (SAMPLES - 1) as f64;
                let plane = direct_plane(node, &areas, axis, position as f32, &self.pricing);
                if plane.is_some_and(|p| best.is_none_or(|b| p.cost < b.cost)) {
                    best = plane;
                }
            }
        }
        best
    }
}
