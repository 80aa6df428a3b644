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
    found: Vec<Found>,
    /// Hits of finished rays, in the order in which they finished.
    pub done: Vec<(f32, u32)>,
    /// Where each ray's hits stand in `done`, and how many there are.
    pub range: Vec<(usize, u32)>,
}

/// The hits of a ray.
#[derive(Clone, Default)]
struct Found {
    /// Primitives that are hit for sure, and where their triangles lie.
    open: Vec<(u32, At)>,
    /// Keys of the hits whose parameters are known.
    keys: Vec<u64>,
}

/// How many of the last primitives found are looked at for the same one in another cell; those that
/// slip through are dropped later.
const RECENT: usize = 8;

/// A number that orders hits as they are to be ordered.
#[inline(always)]
fn key(t: f32, prim_id: u32) -> u64 {
    // -0.0 and 0.0 are one parameter; bits of negative numbers run backwards.
    let bits = (t + 0.0).to_bits();
    let ordered = bits ^ ((bits as i32 >> 31) as u32 | 1 << 31);
    u64::from(ordered) << 32 | u64::from(prim_id)
}

/// The hit that a key stands for.
#[inline(always)]
fn hit_of(key: u64) -> (f32, u32) {
    let ordered = (key >> 32) as u32;
    let bits = ordered ^ (!(ordered as i32 >> 31) as u32 | 1 << 31);
    (f32::from_bits(bits), key as u32)
}

impl Every {
    /// The first `first` hits of `rays` rays, at least one, through `slots` slots.
    pub fn new(first: usize, rays: usize, slots: usize) -> Self {
        Every {
            first,
            found: vec![Found::default(); slots],
            done: Vec::with_capacity(rays),
            range: vec![(0, 0); rays],
        }
    }

    /// Puts the hits of a ray in order, each once, and drops those beyond the first.
    #[inline(always)]
    fn settle(&mut self, k: usize, ray: u32, exact: &Exact<'_>) {
        let Found { open, keys } = &mut self.found[k];
        for &(_, at) in &open[..] {
            let hit = exact.hit(ray, at);
            debug_assert!(hit.is_some(), "a clear hit is a hit");
            keys.extend(hit.map(|hit| key(hit.t, hit.prim_id)));
        }
        open.clear();
        keys.sort_unstable();
        keys.dedup();
        keys.truncate(self.first);
    }

    /// Lowers the limit once there are enough hits.
    #[inline(always)]
    fn limit(&mut self, k: usize, slot: &mut Slot, exact: &Exact<'_>) {
        let Found { open, keys } = &self.found[k];
        if open.len() + keys.len() >= self.first.saturating_mul(2) {
            self.settle(k, slot.ray, exact);
            if let Some(&last) = self.found[k].keys.get(self.first - 1) {
                slot.limit = hit_of(last).0;
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
        let open = &mut self.found[k].open;
        let mut lanes = hits.lanes;
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize & 7;
            lanes &= lanes - 1;
            let prim_id = hits.block.id[lane] & ID_MASK;
            let recent = &open[open.len().saturating_sub(RECENT)..];
            if recent.iter().all(|&(id, _)| id != prim_id) {
                open.push((prim_id, place(hits.line, lane)));
            }
        }
        self.limit(k, slot, exact);
        0
    }

    fn take(&mut self, k: usize, slot: &mut Slot, hit: &Hit, exact: &Exact<'_>) {
        self.found[k].keys.push(key(hit.t, hit.prim_id));
        self.limit(k, slot, exact);
    }

    fn finish(&mut self, k: usize, slot: &mut Slot, exact: &Exact<'_>) {
        self.settle(k, slot.ray, exact);
        let keys = &mut self.found[k].keys;
        self.range[slot.ray as usize] = (self.done.len(), keys.len() as u32);
        self.done.extend(keys.drain(..).map(hit_of));
    }

    fn miss(&mut self, index: usize) {
        self.range[index] = (0, 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_order_hits() {
        let ordered =
            [f32::NEG_INFINITY, -2.5, -1e-40, 0.0, 1e-40, 1.0, 1.0000001, 3e38, f32::INFINITY];
        for (i, &a) in ordered.iter().enumerate() {
            assert_eq!(hit_of(key(a, 7)), (a, 7));
            for &b in &ordered[i + 1..] {
                assert!(key(a, u32::MAX) < key(b, 0), "{a} {b}");
            }
        }
        assert_eq!(key(-0.0, 1), key(0.0, 1));
        assert!(key(1.0, 1) < key(1.0, 2));
    }
}
