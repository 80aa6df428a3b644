//! What a batch looks for. A query sees hits and lowers the slot's limit.

use super::slot::Slot;
use crate::ray::Hit;

/// A question asked of every ray of a batch.
pub trait BatchQuery {
    /// True if the first hit ends a ray.
    const ANY: bool;
    /// Takes a hit at or before the limit for the slot numbered `k`.
    fn take(&mut self, k: usize, slot: &mut Slot, hit: &Hit);
    /// The ray of slot `k` has seen every cell that matters.
    fn finish(&mut self, k: usize, slot: &Slot);
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

impl BatchQuery for Closest<'_> {
    const ANY: bool = false;

    #[inline(always)]
    fn take(&mut self, _k: usize, slot: &mut Slot, hit: &Hit) {
        if hit.t < slot.limit || (hit.t == slot.limit && hit.prim_id < slot.best_id) {
            slot.set_limit(hit.t);
            slot.best_id = hit.prim_id;
        }
    }

    #[inline(always)]
    fn finish(&mut self, _k: usize, slot: &Slot) {
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
    fn take(&mut self, _k: usize, slot: &mut Slot, _hit: &Hit) {
        slot.best_id = 0;
    }

    #[inline(always)]
    fn finish(&mut self, _k: usize, slot: &Slot) {
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
    fn take(&mut self, k: usize, slot: &mut Slot, hit: &Hit) {
        let found = &mut self.found[k];
        // -0.0 and 0.0 are one parameter.
        found.push((hit.t + 0.0, hit.prim_id));
        if found.len() >= self.first.saturating_mul(2) {
            Self::settle(found, self.first);
            if found.len() == self.first {
                let last = found[self.first - 1].0;
                slot.set_limit(last);
            }
        }
    }

    fn finish(&mut self, k: usize, slot: &Slot) {
        let found = &mut self.found[k];
        Self::settle(found, self.first);
        self.range[slot.ray as usize] = (self.done.len(), found.len() as u32);
        self.done.append(found);
    }

    fn miss(&mut self, index: usize) {
        self.range[index] = (0, 0);
    }
}
