//! What a batch looks for. A query sees hits and lowers the slot's limit.

#![allow(unsafe_code)]

use super::exact::{At, Exact, place};
use super::level::{Range, Simd};
use super::slot::Slot;
use crate::ray::Hit;
use crate::wide::{Block, ID_MASK};

/// The lanes of a block that the filter is sure of: each is hit at a parameter in `range`, all of
/// which the ray accepts.
pub struct Clear<'a> {
    /// The lanes.
    pub lanes: u32,
    /// Bounds of the parameters.
    pub range: &'a Range,
    /// The block.
    pub block: &'a Block,
    /// The line at which it lies.
    pub line: usize,
}

/// A question asked of every ray of a batch.
pub trait BatchQuery {
    /// True if the first hit ends a ray.
    const ANY: bool;

    /// Takes hits whose exact parameters may not matter; the lanes for which they do are returned
    /// and come again by [`BatchQuery::take`].
    ///
    /// # Safety
    /// The machine must have the features of `L`, and the caller must enable them.
    unsafe fn take_clear<L: Simd>(&mut self, slot: &mut Slot, hits: &Clear<'_>) -> u32;

    /// Takes a hit in the ray's range for the slot numbered `k`.
    fn take(&mut self, k: usize, slot: &mut Slot, hit: &Hit, exact: &Exact<'_>);

    /// The ray of slot `k` has seen every cell that matters.
    fn finish(&mut self, k: usize, slot: &mut Slot, exact: &Exact<'_>);

    /// Ray `index` misses the scene's box or is invalid.
    fn miss(&mut self, index: usize);

    /// No more rays come.
    fn end(&mut self, _exact: &Exact<'_>) {}
}

/// The first hit; ties to the lowest primitive.
pub struct Closest<'a> {
    t: &'a mut [f32],
    prim: &'a mut [u32],
    /// Finished rays whose hit is known but not its exact parameter, and where it lies.
    pending: [(u32, At); PENDING],
    count: usize,
}

/// Exact parameters are worked out for so many rays at once: these do not wait for each other.
const PENDING: usize = 32;

impl<'a> Closest<'a> {
    /// Hits go to `t`, infinite for a miss, and `prim`, `u32::MAX` for a miss.
    pub fn new(t: &'a mut [f32], prim: &'a mut [u32]) -> Self {
        Closest { t, prim, pending: [(0, 0); PENDING], count: 0 }
    }

    /// Finds the exact parameter of the best hit so far.
    #[cold]
    fn settle(slot: &mut Slot, exact: &Exact<'_>) {
        if slot.best_at != u32::MAX
            && let Some(hit) = exact.hit(slot.ray, slot.best_at)
        {
            debug_assert!(slot.best_low <= hit.t && hit.t <= slot.limit);
            slot.set_best(hit.t, hit.prim_id);
        }
    }

    #[inline(always)]
    fn settle_pending(&mut self, exact: &Exact<'_>) {
        for &(ray, at) in &self.pending[..self.count] {
            let hit = exact.hit(ray, at);
            debug_assert!(hit.is_some(), "a clear hit is a hit");
            let (t, prim) = hit.map_or((f32::INFINITY, u32::MAX), |hit| (hit.t, hit.prim_id));
            self.t[ray as usize] = t;
            self.prim[ray as usize] = prim;
        }
        self.count = 0;
    }
}

impl BatchQuery for Closest<'_> {
    const ANY: bool = false;

    #[inline(always)]
    unsafe fn take_clear<L: Simd>(&mut self, slot: &mut Slot, hits: &Clear<'_>) -> u32 {
        // SAFETY: passed on to the caller.
        let (nearest, others) =
            unsafe { (L::nearest(hits.lanes, hits.range), L::others(hits.block, slot.best_id)) };
        // Without branches, since whether a block holds a nearer hit cannot be predicted.
        let nearer = nearest.high < slot.best_low;
        let unclear = if nearer { nearest.rivals } else { hits.lanes & others };
        let nearer = nearer & (unclear == 0);
        let select = std::hint::select_unpredictable::<u32>;
        let lane = nearest.lane;
        slot.limit = f32::from_bits(select(nearer, nearest.high.to_bits(), slot.limit.to_bits()));
        let low = hits.range.low[lane].to_bits();
        slot.best_low = f32::from_bits(select(nearer, low, slot.best_low.to_bits()));
        slot.best_id = select(nearer, hits.block.id[lane] & ID_MASK, slot.best_id);
        slot.best_at = select(nearer, place(hits.line, lane), slot.best_at);
        if unclear == 0 { 0 } else { hits.lanes }
    }

    #[inline(always)]
    fn take(&mut self, _k: usize, slot: &mut Slot, hit: &Hit, exact: &Exact<'_>) {
        if hit.t > slot.limit {
            return;
        }
        if hit.t >= slot.best_low {
            Self::settle(slot, exact);
        }
        if hit.t < slot.limit || (hit.t == slot.limit && hit.prim_id < slot.best_id) {
            slot.set_best(hit.t, hit.prim_id);
        }
    }

    #[inline(always)]
    fn finish(&mut self, _k: usize, slot: &mut Slot, exact: &Exact<'_>) {
        let hit = slot.best_id != u32::MAX;
        self.t[slot.ray as usize] = if hit { slot.limit } else { f32::INFINITY };
        self.prim[slot.ray as usize] = slot.best_id;
        self.pending[self.count % PENDING] = (slot.ray, slot.best_at);
        self.count += usize::from(slot.best_at != u32::MAX);
        if self.count == PENDING {
            self.settle_pending(exact);
        }
    }

    fn miss(&mut self, index: usize) {
        self.t[index] = f32::INFINITY;
        self.prim[index] = u32::MAX;
    }

    #[inline(always)]
    fn end(&mut self, exact: &Exact<'_>) {
        self.settle_pending(exact);
    }
}

/// Whether anything is hit.
pub struct Any<'a> {
    /// One flag a ray.
    pub hit: &'a mut [bool],
}

impl BatchQuery for Any<'_> {
    const ANY: bool = true;

    #[inline(always)]
    unsafe fn take_clear<L: Simd>(&mut self, slot: &mut Slot, hits: &Clear<'_>) -> u32 {
        slot.best_id = if hits.lanes != 0 { 0 } else { slot.best_id };
        0
    }

    #[inline(always)]
    fn take(&mut self, _k: usize, slot: &mut Slot, _hit: &Hit, _exact: &Exact<'_>) {
        slot.best_id = 0;
    }

    #[inline(always)]
    fn finish(&mut self, _k: usize, slot: &mut Slot, _exact: &Exact<'_>) {
        self.hit[slot.ray as usize] = slot.best_id != u32::MAX;
    }

    fn miss(&mut self, index: usize) {
        self.hit[index] = false;
    }
}

/// All hits in order, or the first `k`. A primitive that several cells reference is tested in each
/// with the same bits as result, so equal `(t, id)` are the same hit and are kept once.
pub struct Every {
    /// How many hits of a ray are wanted.
    pub first: usize,
    /// Hits gathered by each slot.
    pub found: Vec<Vec<(f32, u32)>>,
    /// Hits of finished rays, in the order in which they finished.
    pub done: Vec<(f32, u32)>,
    /// Where each ray's hits stand in `done`, and how many there are.
    pub range: Vec<(usize, u32)>,
}

impl Every {
    fn settle(found: &mut Vec<(f32, u32)>, first: usize) {
        found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        found.dedup();
        found.truncate(first);
    }
}

impl BatchQuery for Every {
    const ANY: bool = false;

    #[inline(always)]
    unsafe fn take_clear<L: Simd>(&mut self, _slot: &mut Slot, hits: &Clear<'_>) -> u32 {
        hits.lanes
    }

    #[inline(always)]
    fn take(&mut self, k: usize, slot: &mut Slot, hit: &Hit, _exact: &Exact<'_>) {
        let found = &mut self.found[k];
        // -0.0 and 0.0 are one parameter.
        found.push((hit.t + 0.0, hit.prim_id));
        if found.len() >= self.first.saturating_mul(2) {
            Self::settle(found, self.first);
            if found.len() == self.first {
                slot.limit = found[self.first - 1].0;
            }
        }
    }

    fn finish(&mut self, k: usize, slot: &mut Slot, _exact: &Exact<'_>) {
        let found = &mut self.found[k];
        Self::settle(found, self.first);
        self.range[slot.ray as usize] = (self.done.len(), found.len() as u32);
        self.done.append(found);
    }

    fn miss(&mut self, index: usize) {
        self.range[index] = (0, 0);
    }
}
