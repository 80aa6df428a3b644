//! How many primitives a ray hits.

#![allow(unsafe_code)]

use super::{BatchQuery, Clear};
use crate::geometry::Geometry;
use crate::kernel::exact::Exact;
use crate::kernel::level::Simd;
use crate::kernel::slot::Slot;
use crate::ray::Hit;
use crate::wide::ID_MASK;

/// The number of hits of each ray, each primitive counted once. Parameters are worked out only where
/// a hit or its place in the range is in doubt.
pub struct Count<'a> {
    counts: &'a mut [u32],
    geometry: &'a Geometry,
    /// Primitives that each slot has found.
    found: Vec<Vec<u32>>,
    /// Triangles that each slot's ray meets so close to an edge that it may touch it.
    close: Vec<u32>,
    /// Rays that may touch several, which must be asked for their lists.
    unsure: Vec<u32>,
}

/// A weight of a vertex below which a hit may lie on the opposite edge: weights are rounded to `f32`.
const CLOSE: f32 = 1.0 / (1 << 20) as f32;

impl<'a> Count<'a> {
    /// Counts go to `counts`; there are `slots` slots.
    pub fn new(counts: &'a mut [u32], geometry: &'a Geometry, slots: usize) -> Self {
        let (found, close) = (vec![Vec::new(); slots], vec![0; slots]);
        Count { counts, geometry, found, close, unsure: Vec::new() }
    }

    /// The rays that have been counted with all triangles that they touch.
    pub fn into_unsure(self) -> Vec<u32> {
        self.unsure
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

    /// All hits on edges come here: there the filter is never sure.
    fn take(&mut self, k: usize, _slot: &mut Slot, hit: &Hit, _exact: &Exact<'_>) {
        self.found[k].push(hit.prim_id);
        let close = hit.u.min(hit.v).min(1.0 - hit.u - hit.v) < CLOSE;
        if close && self.geometry.triangle(hit.prim_id).is_some() {
            self.close[k] += 1;
        }
    }

    fn finish(&mut self, k: usize, slot: &mut Slot, _exact: &Exact<'_>) {
        let found = &mut self.found[k];
        found.sort_unstable();
        found.dedup();
        self.counts[slot.ray as usize] = found.len() as u32;
        found.clear();
        if std::mem::take(&mut self.close[k]) > 1 {
            self.unsure.push(slot.ray);
        }
    }

    fn miss(&mut self, index: usize) {
        self.counts[index] = 0;
    }
}
