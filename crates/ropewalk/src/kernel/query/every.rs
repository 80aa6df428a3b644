//! All hits of each ray in order, or the first few.

#![allow(unsafe_code)]

use super::{BatchQuery, Clear};
use crate::kernel::exact::{At, Exact, place};
use crate::kernel::level::Simd;
use crate::kernel::slot::Slot;
use crate::ray::Hit;
use crate::wide::ID_MASK;

/// All hits in order, or the first `k`: by parameter, and at equal parameters by primitive.
///
/// A primitive that several cells reference is found in each; it has the same hit in all of them and
/// is kept once. Exact parameters are worked out when a ray ends, or sooner where `k` hits can limit
/// the ray.
pub struct Every {
    first: usize,
    /// Hits gathered by each slot.
    found: Vec<Vec<Found>>,
    /// Hits of finished rays, in the order in which they finished.
    pub done: Vec<(f32, u32)>,
    /// Where each ray's hits stand in `done`, and how many there are.
    pub range: Vec<(usize, u32)>,
}

/// A hit: its parameter, or where its triangle lies as long as that is not known.
#[derive(Clone, Copy)]
struct Found {
    prim_id: u32,
    at: At,
    t: f32,
}

/// The place of a hit whose parameter is known.
const SETTLED: At = u32::MAX;

impl Every {
    /// The first `first` hits of `rays` rays, at least one, through `slots` slots.
    pub fn new(first: usize, rays: usize, slots: usize) -> Self {
        Every { first, found: vec![Vec::new(); slots], done: Vec::new(), range: vec![(0, 0); rays] }
    }

    /// Puts the hits of a ray in order, each once, and drops those beyond the first.
    fn settle(&mut self, k: usize, ray: u32, exact: &Exact<'_>) {
        let found = &mut self.found[k];
        found.sort_unstable_by_key(|hit| (hit.prim_id, hit.at != SETTLED));
        found.dedup_by_key(|hit| hit.prim_id);
        for hit in found.iter_mut().filter(|hit| hit.at != SETTLED) {
            let settled = exact.hit(ray, hit.at);
            debug_assert!(settled.is_some(), "a clear hit is a hit");
            // -0.0 and 0.0 are one parameter.
            hit.t = settled.map_or(f32::INFINITY, |hit| hit.t + 0.0);
            hit.at = SETTLED;
        }
        found.sort_unstable_by(|a, b| a.t.total_cmp(&b.t).then(a.prim_id.cmp(&b.prim_id)));
        found.truncate(self.first);
    }

    /// Lowers the limit once there are enough hits.
    fn limit(&mut self, k: usize, slot: &mut Slot, exact: &Exact<'_>) {
        if self.found[k].len() >= self.first.saturating_mul(2) {
            self.settle(k, slot.ray, exact);
            if self.found[k].len() == self.first {
                slot.limit = self.found[k][self.first - 1].t;
            }
        }
    }
}

impl BatchQuery for Every {
    const ANY: bool = false;

    #[inline(always)]
    unsafe fn take_clear<L: Simd>(
        &mut self,
        k: usize,
        slot: &mut Slot,
        hits: &Clear<'_>,
        exact: &Exact<'_>,
    ) -> u32 {
        let mut lanes = hits.lanes;
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize & 7;
            lanes &= lanes - 1;
            let prim_id = hits.block.id[lane] & ID_MASK;
            self.found[k].push(Found { prim_id, at: place(hits.line, lane), t: 0.0 });
        }
        self.limit(k, slot, exact);
        0
    }

    fn take(&mut self, k: usize, slot: &mut Slot, hit: &Hit, exact: &Exact<'_>) {
        self.found[k].push(Found { prim_id: hit.prim_id, at: SETTLED, t: hit.t + 0.0 });
        self.limit(k, slot, exact);
    }

    fn finish(&mut self, k: usize, slot: &mut Slot, exact: &Exact<'_>) {
        self.settle(k, slot.ray, exact);
        let found = &mut self.found[k];
        self.range[slot.ray as usize] = (self.done.len(), found.len() as u32);
        self.done.extend(found.drain(..).map(|hit| (hit.t, hit.prim_id)));
    }

    fn miss(&mut self, index: usize) {
        self.range[index] = (0, 0);
    }
}
