//! What a batch looks for. A query sees hits and lowers the slot's limit.

#![allow(unsafe_code)]

mod any;
mod closest;
mod count;
mod crossings;
mod every;
mod filtered;

pub use any::Any;
pub use closest::Closest;
pub use count::Count;
pub use crossings::Crossings;
pub use every::Every;
pub use filtered::{Accepts, Filtered, HitFilter, Masks, NoFilter, Opacity};

use super::exact::{Exact, place};
use super::level::{Range, Simd};
use super::slot::Slot;
use crate::ray::Hit;
use crate::wide::{Block, WideTree};

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
    /// True if rays and triangles have been rounded from `f64`: filters leave room for that, and every
    /// lane they let through comes to [`BatchQuery::decide`].
    const ROUNDED: bool = false;
    /// True if it is put to trees of triangles alone, so that kernels for other primitives need not be compiled for it.
    const TRIANGLES: bool = false;
    /// True if hits end no ray, so that blocks may well have several: they are tested in full at once
    /// where that pays.
    const MANY: bool = false;

    /// True if the query decides by itself: [`BatchQuery::take_clear`] then gets all lanes that may be
    /// hit, and nothing comes by [`BatchQuery::take`].
    const CANDIDATES: bool = false;

    /// Takes hits whose exact parameters may not matter for the slot numbered `k`; the lanes for which
    /// they do are returned and come again by [`BatchQuery::take`].
    ///
    /// # Safety
    /// The machine must have the features of `L`, and the caller must enable them.
    unsafe fn take_clear<L: Simd>(
        &mut self,
        k: usize,
        slot: &mut Slot,
        hits: &Clear<'_>,
        exact: &Exact<'_>,
    ) -> u32;

    /// Decides exactly whether the triangle in a lane of the block at `line` is hit.
    #[inline(always)]
    fn decide(
        &mut self,
        k: usize,
        slot: &mut Slot,
        (line, lane): (usize, usize),
        exact: &Exact<'_>,
    ) {
        if let Some(hit) = exact.hit(slot.ray, place(line, lane)) {
            self.take(k, slot, &hit, exact);
        }
    }

    /// Takes a hit in the ray's range for the slot numbered `k`.
    fn take(&mut self, k: usize, slot: &mut Slot, hit: &Hit, exact: &Exact<'_>);

    /// The ray of slot `k` has seen every cell that matters.
    fn finish(&mut self, k: usize, slot: &mut Slot, exact: &Exact<'_>);

    /// Ray `index` hits nothing, unless [`BatchQuery::finish`] says otherwise later on.
    fn miss(&mut self, index: usize);

    /// [`BatchQuery::miss`] for some rays in turn.
    #[inline(always)]
    fn miss_all(&mut self, rays: std::ops::Range<usize>) {
        for index in rays {
            self.miss(index);
        }
    }

    /// Collects all that the ray of slot `k` may hit by itself, its numbers being too large or too small
    /// for the filters; only asked where [`BatchQuery::CANDIDATES`] is set.
    #[cold]
    fn gather(&mut self, _tree: &WideTree, _k: usize) {}

    /// Some rays have finished, or all: answers that were put off may be worked out now, in the latter
    /// case they must be.
    ///
    /// # Safety
    /// As for [`BatchQuery::take_clear`].
    #[inline(always)]
    unsafe fn settle<L: Simd>(&mut self, _exact: &Exact<'_>, _all: bool) {}
}
