//! Hits that count only if a filter accepts them: cut-outs, masks, transparency.

#![allow(unsafe_code)]

use super::{BatchQuery, Clear};
use crate::kernel::exact::Exact;
use crate::kernel::level::Simd;
use crate::kernel::slot::Slot;
use crate::ray::Hit;

/// Decides which hits count.
///
/// It is asked inside the traversal, in no order, perhaps more than once for the same hit and for
/// hits behind the answer, from several threads: its answer must depend on its arguments alone.
pub trait HitFilter: Sync {
    /// False if nothing is ever refused; then it is not asked.
    const FILTERS: bool = true;

    /// True if the hit of the ray with this index in the batch counts.
    fn accepts(&self, ray: usize, hit: &Hit) -> bool;
}

/// Every hit counts.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoFilter;

impl HitFilter for NoFilter {
    const FILTERS: bool = false;

    fn accepts(&self, _ray: usize, _hit: &Hit) -> bool {
        true
    }
}

impl<F: Fn(usize, &Hit) -> bool + Sync> HitFilter for F {
    fn accepts(&self, ray: usize, hit: &Hit) -> bool {
        self(ray, hit)
    }
}

/// Hits count where the mask of the primitive and the mask of the ray have a bit in common.
#[derive(Clone, Copy, Debug)]
pub struct Masks<'a> {
    /// One mask a primitive; primitives beyond its end have all bits.
    pub primitive: &'a [u32],
    /// One mask a ray; rays beyond its end have all bits.
    pub ray: &'a [u32],
}

impl Masks<'_> {
    /// True if the masks of a ray and a primitive have a bit in common.
    pub(crate) fn match_up(&self, ray: usize, prim_id: u32) -> bool {
        let primitive = self.primitive.get(prim_id as usize).copied().unwrap_or(!0);
        primitive & self.ray.get(ray).copied().unwrap_or(!0) != 0
    }
}

impl HitFilter for Masks<'_> {
    fn accepts(&self, ray: usize, hit: &Hit) -> bool {
        self.match_up(ray, hit.prim_id)
    }
}

/// A hit counts with the probability that is its primitive's opacity: transparency without order.
/// The draw depends on ray, primitive and seed alone, so that answers do not depend on threads.
#[derive(Clone, Copy, Debug)]
pub struct Opacity<'a> {
    /// One opacity a primitive, 0 (never hit) to 1 (always); primitives beyond its end are opaque.
    pub primitive: &'a [f32],
    /// Another seed makes other draws.
    pub seed: u32,
}

impl HitFilter for Opacity<'_> {
    fn accepts(&self, ray: usize, hit: &Hit) -> bool {
        let opacity = self.primitive.get(hit.prim_id as usize).copied().unwrap_or(1.0);
        let key = (ray as u64) << 32 | u64::from(hit.prim_id);
        let draw = mix(key ^ u64::from(self.seed).wrapping_mul(0x9E37_79B9_7F4A_7C15)) >> 40;
        (draw as f32) < opacity * (1u32 << 24) as f32
    }
}

/// The finaliser of SplitMix64 (Steele, Lea and Flood 2014): every bit depends on every other.
fn mix(mut x: u64) -> u64 {
    x = (x ^ x >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    x = (x ^ x >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ x >> 31
}

/// A filter of any type, as the kernels see it.
pub trait Accepts: Sync {
    /// See [`HitFilter::accepts`].
    fn accepts(&self, ray: usize, hit: &Hit) -> bool;
}

impl<F: HitFilter> Accepts for F {
    fn accepts(&self, ray: usize, hit: &Hit) -> bool {
        HitFilter::accepts(self, ray, hit)
    }
}

/// A query that sees only hits that a filter accepts.
pub struct Filtered<'a, Q> {
    /// The query.
    pub query: &'a mut Q,
    /// The filter.
    pub filter: &'a dyn Accepts,
    /// Index in the batch of the first ray.
    pub first_ray: usize,
}

impl<Q: BatchQuery> BatchQuery for Filtered<'_, Q> {
    const ANY: bool = Q::ANY;
    const MANY: bool = Q::MANY;

    /// The filter sees exact hits only.
    #[inline(always)]
    unsafe fn take_clear<L: Simd>(
        &mut self,
        _k: usize,
        _slot: &mut Slot,
        hits: &Clear<'_>,
        _exact: &Exact<'_>,
    ) -> u32 {
        const { assert!(!Q::ROUNDED, "it sees hits in f32 alone") };
        hits.lanes
    }

    #[inline(always)]
    fn take(&mut self, k: usize, slot: &mut Slot, hit: &Hit, exact: &Exact<'_>) {
        if self.filter.accepts(self.first_ray + slot.ray as usize, hit) {
            self.query.take(k, slot, hit, exact);
        }
    }

    #[inline(always)]
    fn finish(&mut self, k: usize, slot: &mut Slot, exact: &Exact<'_>) {
        self.query.finish(k, slot, exact);
    }

    fn miss(&mut self, index: usize) {
        self.query.miss(index);
    }

    #[inline(always)]
    unsafe fn settle<L: Simd>(&mut self, exact: &Exact<'_>, all: bool) {
        // SAFETY: passed on to the caller.
        unsafe { self.query.settle::<L>(exact, all) }
    }
}
