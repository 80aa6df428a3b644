//! The first hit of each ray.

#![allow(unsafe_code)]

use super::{BatchQuery, Clear};
use crate::kernel::exact::{At, Exact, Pairs, Sheared, place};
use crate::kernel::level::Simd;
use crate::kernel::slot::Slot;
use crate::kernel::wave::WAVE;
use crate::ray::Hit;
use crate::wide::{ID_MASK, WIDTH};
use std::ops::Range;

/// The first hit; ties to the lowest primitive.
pub struct Closest<'a> {
    pub(in crate::kernel) t: &'a mut [f32],
    pub(in crate::kernel) prim: &'a mut [u32],
    /// None for a ray by itself, which does not wait.
    pending: Option<Box<Pending>>,
}

/// Finished rays whose hit is known but not its exact parameter.
struct Pending {
    /// The rays, and where their hits lie.
    rays: [(Sheared, At); 2 * PENDING],
    count: usize,
    /// The same eight at a time; lanes that are not in use hold anything.
    pairs: [Pairs; 2 * PENDING / WIDTH],
}

/// Exact parameters are worked out once so many rays at least wait for them: these do not wait for
/// each other. No more than as many again finish before that is done, since a wave is smaller.
const PENDING: usize = 32;

const _: () = assert!(WAVE <= PENDING);

impl<'a> Closest<'a> {
    /// Hits go to `t`, infinite for a miss, and `prim`, `u32::MAX` for a miss.
    pub fn new(t: &'a mut [f32], prim: &'a mut [u32]) -> Self {
        let pending = Pending {
            rays: [(Sheared::default(), 0); 2 * PENDING],
            count: 0,
            pairs: [Pairs::EMPTY; 2 * PENDING / WIDTH],
        };
        Closest { t, prim, pending: Some(Box::new(pending)) }
    }

    /// For one ray, whose slot has the answer: several KiB less to clear.
    pub fn one() -> Closest<'static> {
        Closest { t: &mut [], prim: &mut [], pending: None }
    }

    /// The answer to a ray, once it is settled.
    #[inline(always)]
    pub fn answer(&self, ray: usize) -> (f32, u32) {
        (self.t[ray], self.prim[ray])
    }

    /// Finds the exact parameter of the best hit so far.
    #[cold]
    fn settle(slot: &mut Slot, exact: &Exact<'_>) {
        if slot.best_at != u32::MAX
            && let Some(hit) = exact.hit(slot.ray, slot.best_at)
        {
            let within = slot.best_low <= hit.t && hit.t <= slot.limit;
            debug_assert!(within || exact.lines.is_shared(), "a clear hit lies in its interval");
            slot.set_best(hit.t, hit.prim_id);
        }
    }

    /// Works out the exact parameters of all rays that wait for them, eight at a time.
    ///
    /// # Safety
    /// As for [`BatchQuery::take_clear`].
    #[inline(always)]
    unsafe fn settle_pending<L: Simd>(&mut self, exact: &Exact<'_>) {
        let Some(Pending { rays, count, pairs }) = self.pending.as_deref_mut() else { return };
        let pending = &rays[..std::mem::take(count)];
        for (i, (ray, at)) in pending.iter().enumerate() {
            pairs[i / WIDTH].set(i, ray, exact.lines, *at);
        }
        for (pairs, pending) in pairs.iter().zip(pending.chunks(WIDTH)) {
            let mut t = [0.0; WIDTH];
            // SAFETY: passed on to the caller.
            let open = unsafe { pairs.meet::<L::Doubles>(&mut t) };
            for (lane, &(Sheared { ray, .. }, at)) in pending.iter().enumerate() {
                if open >> lane & 1 == 1 {
                    let hit = exact.hit(ray, at);
                    debug_assert!(hit.is_some() || exact.lines.is_shared(), "a clear hit is a hit");
                    t[lane] = hit.map_or(f32::INFINITY, |hit| hit.t);
                }
                self.t[ray as usize] = t[lane];
            }
        }
    }
}

impl BatchQuery for Closest<'_> {
    const ANY: bool = false;

    #[inline(always)]
    unsafe fn take_clear<L: Simd>(
        &mut self,
        _k: usize,
        slot: &mut Slot,
        hits: &Clear<'_>,
        _exact: &Exact<'_>,
    ) -> u32 {
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
        let Some(pending) = self.pending.as_deref_mut() else { return };
        let at = pending.count % (2 * PENDING);
        let (ray, place) = &mut pending.rays[at];
        ray.set(slot, exact.rays);
        *place = slot.best_at;
        pending.count += usize::from(slot.best_at != u32::MAX);
    }

    fn miss(&mut self, index: usize) {
        self.t[index] = f32::INFINITY;
        self.prim[index] = u32::MAX;
    }

    #[inline(always)]
    fn miss_all(&mut self, rays: Range<usize>) {
        self.t[rays.clone()].fill(f32::INFINITY);
        self.prim[rays].fill(u32::MAX);
    }

    #[inline(always)]
    unsafe fn settle<L: Simd>(&mut self, exact: &Exact<'_>, all: bool) {
        let count = self.pending.as_ref().map_or(0, |pending| pending.count);
        if count >= PENDING || (all && count > 0) {
            // SAFETY: passed on to the caller.
            unsafe { self.settle_pending::<L>(exact) };
        }
    }
}
