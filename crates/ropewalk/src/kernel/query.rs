//! What a batch looks for. A query sees hits and lowers the slot's limit.

use super::exact::{At, Exact};
use super::slot::Slot;
use crate::ray::Hit;

/// A hit of which the filter is sure: `t` lies in `low ..= high`, all of which the ray accepts.
#[derive(Clone, Copy, Debug)]
pub struct ClearHit {
    /// The primitive.
    pub prim_id: u32,
    /// Where the triangle lies.
    pub at: At,
    /// Lower bound of the parameter.
    pub low: f32,
    /// Upper bound of the parameter.
    pub high: f32,
}

/// A question asked of every ray of a batch.
pub trait BatchQuery {
    /// True if the first hit ends a ray.
    const ANY: bool;
    /// Takes a hit whose exact parameter may not matter. False if it does: then the hit comes again
    /// by [`BatchQuery::take`].
    fn take_clear(&mut self, k: usize, slot: &mut Slot, hit: &ClearHit) -> bool;
    /// Takes a hit in the ray's range for the slot numbered `k`.
    fn take(&mut self, k: usize, slot: &mut Slot, hit: &Hit, exact: &Exact<'_>);
    /// The ray of slot `k` has seen every cell that matters.
    fn finish(&mut self, k: usize, slot: &mut Slot, exact: &Exact<'_>);
    /// Ray `index` misses the scene's box or is invalid.
    fn miss(&mut self, index: usize);
}

/// The first hit; ties to the lowest primitive.
pub struct Closest<'a> {
    /// Parameter of each ray's hit, infinite for a miss.
    pub t: &'a mut [f32],
    /// Primitive of each ray's hit, `u32::MAX` for a miss.
    pub prim: &'a mut [u32],
}

impl Closest<'_> {
    /// Finds the exact parameter of the best hit so far.
    #[inline(always)]
    fn settle(slot: &mut Slot, exact: &Exact<'_>) {
        if slot.best_at != u32::MAX {
            let hit = exact.hit(slot.ray, slot.best_at);
            debug_assert!(hit.is_some_and(|h| slot.best_low <= h.t && h.t <= slot.limit));
            if let Some(hit) = hit {
                slot.set_best(hit.t, hit.prim_id);
            }
        }
    }
}

impl BatchQuery for Closest<'_> {
    const ANY: bool = false;

    #[inline(always)]
    fn take_clear(&mut self, _k: usize, slot: &mut Slot, hit: &ClearHit) -> bool {
        if hit.high < slot.best_low {
            slot.best_low = hit.low;
            slot.best_at = hit.at;
            slot.best_id = hit.prim_id;
            slot.limit = hit.high;
            return true;
        }
        // The same triangle in another cell.
        hit.prim_id == slot.best_id
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
        Self::settle(slot, exact);
        let hit = slot.best_id != u32::MAX;
        self.t[slot.ray as usize] = if hit { slot.limit } else { f32::INFINITY };
        self.prim[slot.ray as usize] = slot.best_id;
    }

    fn miss(&mut self, index: usize) {
        self.t[index] = f32::INFINITY;
        self.prim[index] = u32::MAX;
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
    fn take_clear(&mut self, _k: usize, slot: &mut Slot, _hit: &ClearHit) -> bool {
        slot.best_id = 0;
        true
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
    fn take_clear(&mut self, _k: usize, _slot: &mut Slot, _hit: &ClearHit) -> bool {
        false
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
