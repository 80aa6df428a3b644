//! How many primitives a ray hits.

#![allow(unsafe_code)]

use super::{BatchQuery, Clear};
use crate::kernel::exact::Exact;
use crate::kernel::level::Simd;
use crate::kernel::slot::Slot;
use crate::ray::Hit;
use crate::wide::ID_MASK;

/// The number of hits of each ray, each primitive counted once. Parameters are worked out only where
/// a hit or its place in the range is in doubt.
pub struct Count<'a> {
    counts: &'a mut [u32],
    /// Primitives that each slot has found.
    found: Vec<Vec<u32>>,
}

impl<'a> Count<'a> {
    /// Counts go to `counts`; there are `slots` slots.
    pub fn new(counts: &'a mut [u32], slots: usize) -> Self {
        Count { counts, found: vec![Vec::new(); slots] }
    }
}

impl BatchQuery for Count<'_> {
    const ANY: bool = false;

    #[inline(always)]
    unsafe fn take_clear<L: Simd>(
        &mut self,
        k: usize,
        _slot: &mut Slot,
        hits: &Clear<'_>,
        _exact: &Exact<'_>,
    ) -> u32 {
        let mut lanes = hits.lanes;
        while lanes != 0 {
            self.found[k].push(hits.block.id[lanes.trailing_zeros() as usize & 7] & ID_MASK);
            lanes &= lanes - 1;
        }
        0
    }

    fn take(&mut self, k: usize, _slot: &mut Slot, hit: &Hit, _exact: &Exact<'_>) {
        self.found[k].push(hit.prim_id);
    }

    fn finish(&mut self, k: usize, slot: &mut Slot, _exact: &Exact<'_>) {
        let found = &mut self.found[k];
        found.sort_unstable();
        found.dedup();
        self.counts[slot.ray as usize] = found.len() as u32;
        found.clear();
    }

    fn miss(&mut self, index: usize) {
        self.counts[index] = 0;
    }
}
