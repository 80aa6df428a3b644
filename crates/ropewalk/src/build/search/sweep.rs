//! The exact sweep over all event planes (Wald and Havran 2006).

use super::{NodeView, PlaneSearch, SearchBuffers};
use crate::build::event::Event;
use crate::build::plane::{CellAreas, Counts, Plane, Pricing};
use crate::cost::CostModel;

/// Minimises a cost model over all planes through the faces of the fragments' boxes. Between them
/// the measure of MacDonald and Booth is linear, so for it this is the optimum over all planes.
///
/// Linear in the number of events. All events of a position are taken together; fragments in the
/// plane are tried on both sides. On ties the first axis, the lowest position and the left side
/// win.
pub(crate) struct Sweep<M> {
    pub model: M,
    pub pricing: Pricing,
}

impl<M: CostModel> PlaneSearch for Sweep<M> {
    fn uses_events(&self) -> bool {
        true
    }

    fn best_plane(&self, node: &NodeView<'_>, _buffers: &mut SearchBuffers) -> Option<Plane> {
        let mut best: Option<Plane> = None;
        for axis in 0..3 {
            let Some(areas) = CellAreas::new(&node.cell, axis) else { continue };
            for_each_position(node.events[axis], node.fragments.len(), |position, counts| {
                self.consider(node, &areas, axis, position, counts, &mut best);
            });
        }
        best
    }
}

impl<M: CostModel> Sweep<M> {
    #[inline]
    fn consider(
        &self,
        node: &NodeView<'_>,
        areas: &CellAreas,
        axis: usize,
        position: f32,
        counts: Counts,
        best: &mut Option<Plane>,
    ) {
        let sides = if counts.planar > 0 { &[true, false][..] } else { &[true][..] };
        for &planar_left in sides {
            let (left, right) = counts.children(planar_left);
            if !areas.makes_progress(position, left, right, node.fragments.len()) {
                continue;
            }
            let cost = self.pricing.price(&self.model, areas, position, (left, right), (0.0, 0.0));
            if best.is_none_or(|b| cost < b.cost) {
                *best = Some(Plane { axis, position, planar_left, cost, left, right });
            }
        }
    }
}

/// Calls `visit` at each distinct position with what lies below, in and above it.
#[inline]
pub(super) fn for_each_position(
    events: &[Event],
    fragments: usize,
    mut visit: impl FnMut(f32, Counts),
) {
    let (mut left, mut right) = (0, fragments);
    let mut i = 0;
    while i < events.len() {
        let first = events[i];
        let mut kinds = [0usize; 4];
        while i < events.len() && events[i].position_key() == first.position_key() {
            kinds[events[i].kind_index()] += 1;
            i += 1;
        }
        let [ends, planar, starts, _] = kinds;
        right -= ends + planar;
        visit(first.position(), Counts { left, planar, right });
        left += starts + planar;
    }
}
