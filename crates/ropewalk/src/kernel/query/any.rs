//! Whether a ray hits anything.

#![allow(unsafe_code)]

use super::{BatchQuery, Clear};
use crate::kernel::exact::Exact;
use crate::kernel::level::Simd;
use crate::kernel::slot::Slot;
use crate::ray::Hit;

/// Whether anything is hit.
pub struct Any<'a> {
    /// One flag a ray.
    pub hit: &'a mut [bool],
}

impl BatchQuery for Any<'_> {
    const ANY: bool = true;

    #[inline(always)]
    unsafe fn take_clear<L: Simd>(
        &mut self,
        _k: usize,
        slot: &mut Slot,
        hits: &Clear<'_>,
        _exact: &Exact<'_>,
    ) -> u32 {
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
