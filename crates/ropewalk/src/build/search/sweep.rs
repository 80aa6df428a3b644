//! The exact sweep over all event planes (Wald and Havran 2006).

use super::{NodeView, PlaneSearch, SearchBuffers};
use crate::build::blockage::{AreaSweep, Blockage, ends_of_sides};
use crate::build::event::{Event, EventKind};
use crate::build::plane::{CellAreas, Counts, Plane, Pricing};
use crate::cost::CostModel;

/// How many of the best planes by surface area are judged again by sampled lines.
const SHORTLIST: usize = 8;

/// Minimises a cost model over all planes through the faces of the fragments' boxes. Between them
/// the measure of MacDonald and Booth is linear, so for it this is the optimum over all planes.
///
/// Linear in the number of events, plus the sorting of the area functions where the model uses the
/// probabilities of termination. All events of a position are taken together; fragments in the
/// plane are tried on both sides. On ties the first axis, the lowest position and the left side
/// win.
pub(crate) struct Sweep<'a, M> {
    pub model: M,
    pub pricing: Pricing,
    /// Where `p_L` and `p_R` come from; without it both are 0.
    pub blockage: Option<&'a Blockage<'a>>,
}

impl<M: CostModel> PlaneSearch for Sweep<'_, M> {
    fn uses_events(&self) -> bool {
        true
    }

    fn best_plane(&self, node: &NodeView<'_>, buffers: &mut SearchBuffers) -> Option<Plane> {
        let count = node.fragments.len();
        let sampled = self.blockage.filter(|b| b.samples_nodes_of(count));
        let mut best = Shortlist::new(if sampled.is_some() { SHORTLIST } else { 1 });
        for axis in 0..3 {
            let Some(areas) = CellAreas::new(&node.cell, axis) else { continue };
            match self.blockage {
                Some(blockage) => {
                    self.sweep_with_termination(blockage, node, &areas, axis, buffers, &mut best);
                }
                None => for_each_position(node.events[axis], count, |position, counts| {
                    let candidate = Candidate { areas: &areas, axis, position, counts, count };
                    self.consider(&candidate, |_| (0.0, 0.0), &mut best);
                }),
            }
        }
        match sampled {
            Some(blockage) => self.judge_by_lines(blockage, node, &best),
            None => best.planes.first().copied(),
        }
    }
}

/// A position to be tried, with what lies around it.
struct Candidate<'a> {
    areas: &'a CellAreas,
    axis: usize,
    position: f32,
    counts: Counts,
    /// Fragments of the node.
    count: usize,
}

impl<M: CostModel> Sweep<'_, M> {
    /// Offers the plane, with the fragments in it on the one and on the other side, to `best`.
    /// `ends` gives `p_L` and `p_R` for either.
    #[inline]
    fn consider(
        &self,
        candidate: &Candidate<'_>,
        ends: impl Fn(bool) -> (f64, f64),
        best: &mut Shortlist,
    ) {
        let &Candidate { areas, axis, position, counts, count } = candidate;
        let mut offer = |planar_left: bool| {
            let (left, right) = counts.children(planar_left);
            if !areas.makes_progress(position, left, right, count) {
                return;
            }
            let (p, children) = (ends(planar_left), (left, right));
            let cost = self.pricing.price(&self.model, areas, position, count, children, p);
            if cost < best.limit {
                best.insert(Plane { axis, position, planar_left, cost, left, right });
            }
        };
        offer(true);
        if counts.planar > 0 {
            offer(false);
        }
    }

    /// The sweep of one axis with the areas on both sides kept along.
    fn sweep_with_termination(
        &self,
        blockage: &Blockage<'_>,
        node: &NodeView<'_>,
        areas: &CellAreas,
        axis: usize,
        buffers: &mut SearchBuffers,
        best: &mut Shortlist,
    ) {
        let ramps = &mut buffers.ramps;
        let prims = node.fragments.iter().map(|f| f.prim());
        blockage.collect_ramps(prims, &node.cell, axis, ramps);
        let total = AreaSweep::total(ramps, node.cell.extent(axis));
        let mut sweep = AreaSweep::new(ramps);
        let count = node.fragments.len();
        for_each_position(node.events[axis], count, |position, counts| {
            let x = areas.local(position);
            let below = sweep.below(x);
            let in_plane = if counts.planar > 0 { sweep.in_plane(x) } else { 0.0 };
            let ends = |planar_left: bool| {
                let left = if planar_left { below + in_plane } else { below };
                ends_of_sides(blockage, areas, position, left, total - left)
            };
            self.consider(&Candidate { areas, axis, position, counts, count }, ends, best);
        });
    }

    /// Prices the shortlisted planes anew with `p` from sampled lines and takes the cheapest.
    fn judge_by_lines(
        &self,
        blockage: &Blockage<'_>,
        node: &NodeView<'_>,
        shortlist: &Shortlist,
    ) -> Option<Plane> {
        let mut best = Shortlist::new(1);
        for &plane in &shortlist.planes {
            let mut plane = plane;
            if let Some(ends) = blockage.sampled_ends(&node.cell, &plane)
                && let Some(areas) = CellAreas::new(&node.cell, plane.axis)
            {
                let (total, children) = (node.fragments.len(), (plane.left, plane.right));
                plane.cost =
                    self.pricing.price(&self.model, &areas, plane.position, total, children, ends);
            }
            best.offer(plane);
        }
        best.planes.first().copied()
    }
}

/// The cheapest planes seen, cheapest first; the earlier one on ties.
struct Shortlist {
    planes: Vec<Plane>,
    capacity: usize,
    /// Cost that a plane must undercut to get in.
    limit: f64,
}

impl Shortlist {
    fn new(capacity: usize) -> Self {
        Shortlist { planes: Vec::new(), capacity, limit: f64::INFINITY }
    }

    #[inline]
    fn offer(&mut self, plane: Plane) {
        if plane.cost < self.limit {
            self.insert(plane);
        }
    }

    /// Takes a plane that costs less than the limit.
    fn insert(&mut self, plane: Plane) {
        if self.capacity == 1 {
            self.limit = plane.cost;
            self.planes.clear();
            self.planes.push(plane);
            return;
        }
        self.planes.truncate(self.capacity - 1);
        let at = self.planes.partition_point(|p| p.cost <= plane.cost);
        self.planes.insert(at, plane);
        if self.planes.len() == self.capacity {
            self.limit = self.planes[self.capacity - 1].cost;
        }
    }
}

/// Calls `visit` at each distinct position with what lies below, in and above it.
#[inline]
fn for_each_position(events: &[Event], fragments: usize, mut visit: impl FnMut(f32, Counts)) {
    let (mut left, mut right) = (0, fragments);
    let mut i = 0;
    while i < events.len() {
        let (first, start) = (events[i], i);
        // Counted without branches: the kinds come at random.
        let (mut ends, mut starts) = (0, 0);
        while let Some(event) = events.get(i).filter(|e| e.position_key() == first.position_key()) {
            ends += usize::from(event.kind_index() == EventKind::End as usize);
            starts += usize::from(event.kind_index() == EventKind::Start as usize);
            i += 1;
        }
        let planar = i - start - ends - starts;
        right -= ends + planar;
        visit(first.position(), Counts { left, planar, right });
        left += starts + planar;
    }
}

#[cfg(test)]
mod tests;
