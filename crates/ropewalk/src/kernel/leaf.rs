//! The tests of a leaf's blocks, for a ray of the wave or a ray by itself.

#![allow(unsafe_code)]

use super::events::Events;
use super::exact::Exact;
use super::level::{Found, Range, Simd};
use super::query::{BatchQuery, Clear};
use super::slot::Slot;
use crate::geometry::Geometry;
use crate::ray::PreparedRay;
use crate::wide::{BLOCK_LINES, Block, ID_MASK, LINE, WIDTH, WideTree};

/// What a leaf is tested with besides the ray.
#[derive(Clone, Copy)]
pub struct Leaves<'a> {
    /// The tree.
    pub tree: &'a WideTree,
    /// What it was built over.
    pub geometry: &'a Geometry,
    /// Triangles and rays for exact tests.
    pub exact: Exact<'a>,
}

impl Leaves<'_> {
    #[inline(always)]
    unsafe fn block(&self, line: usize) -> &Block {
        // SAFETY: the caller vouches for the line.
        unsafe { &*self.tree.lines().as_ptr().add(line * LINE).cast::<Block>() }
    }

    /// The lanes of a block that the ray of a slot may hit: triangles in bits 7..0, others in
    /// bits 15..8.
    ///
    /// # Safety
    /// The machine must have the features of `L`, and the caller must enable them; a block of the tree
    /// must begin at `line`.
    #[inline(always)]
    pub unsafe fn meet<L: Simd, Q: BatchQuery, const SHAPES: bool>(
        &self,
        slot: &Slot,
        line: usize,
    ) -> u32 {
        // SAFETY: passed on to the caller.
        unsafe {
            let block = self.block(line);
            if SHAPES && block.holds_shapes() {
                return self.near::<L>(slot, block);
            }
            match (Q::ROUNDED, Q::MANY) {
                (false, false) => L::meets::<false, true>(slot, block),
                (false, true) => L::meets::<false, false>(slot, block),
                (true, false) => L::meets::<true, true>(slot, block),
                (true, true) => L::meets::<true, false>(slot, block),
            }
        }
    }

    /// [`Leaves::meet`] for two blocks of triangles in turn, the lanes of the second in bits 15..8.
    ///
    /// # Safety
    /// As for [`Leaves::meet`].
    #[inline(always)]
    pub unsafe fn meet_two<L: Simd, Q: BatchQuery>(&self, slot: &Slot, line: usize) -> u32 {
        // SAFETY: passed on to the caller.
        unsafe {
            let blocks = [self.block(line), self.block(line + BLOCK_LINES)];
            match (Q::ROUNDED, Q::MANY) {
                (false, false) => L::meets_two::<false, true>(slot, blocks),
                (false, true) => L::meets_two::<false, false>(slot, blocks),
                (true, false) => L::meets_two::<true, true>(slot, blocks),
                (true, true) => L::meets_two::<true, false>(slot, blocks),
            }
        }
    }

    /// The lanes of a block of other primitives than triangles that the ray of a slot may hit, in bits 15..8.
    ///
    /// # Safety
    /// As for [`Leaves::meet`].
    #[inline(always)]
    unsafe fn near<L: Simd>(&self, slot: &Slot, block: &Block) -> u32 {
        let ray = &self.exact.rays[slot.ray as usize];
        // SAFETY: passed on to the caller.
        unsafe { L::near(slot, ray, block) << WIDTH }
    }

    /// Tests a block all of whose lanes are asked about; see [`Leaves::test`].
    ///
    /// # Safety
    /// As for [`Leaves::meet`].
    #[inline(always)]
    pub unsafe fn test_all<L: Simd, Q: BatchQuery, E: Events, const SHAPES: bool>(
        &self,
        (k, slot): (u32, &mut Slot),
        line: usize,
        query: &mut Q,
        events: &mut E,
    ) -> (u32, bool) {
        // SAFETY: passed on to the caller.
        unsafe {
            let block = self.block(line);
            if SHAPES && block.holds_shapes() {
                return (self.near::<L>(slot, block), false);
            }
            self.test::<L, Q, E, SHAPES>((k, slot), line, 0, query, events)
        }
    }

    /// Tests a block that the ray of slot `k` meets in `lanes`; the lanes that need a decision in `f64`,
    /// and whether any triangle is hit or may be. Other primitives are all left to be decided.
    ///
    /// No branches: which blocks hold a hit cannot be predicted, and a wrong guess would cost more
    /// than a test.
    ///
    /// # Safety
    /// As for [`Leaves::meet`].
    #[inline(always)]
    pub unsafe fn test<L: Simd, Q: BatchQuery, E: Events, const SHAPES: bool>(
        &self,
        (k, slot): (u32, &mut Slot),
        line: usize,
        lanes: u32,
        query: &mut Q,
        events: &mut E,
    ) -> (u32, bool) {
        if SHAPES && lanes >> WIDTH != 0 {
            return (lanes, false);
        }
        // SAFETY: passed on to the caller.
        unsafe {
            let block = self.block(line);
            let mut range = Range::default();
            let Found { clear, open } = if Q::ROUNDED {
                L::test::<true>(slot, block, &mut range)
            } else {
                L::test::<false>(slot, block, &mut range)
            };
            events.found(clear, open);
            let lanes_of = if Q::CANDIDATES { clear | open } else { clear };
            let hits = Clear { lanes: lanes_of, range: &range, block, line };
            let unclear = query.take_clear::<L>(k as usize, slot, &hits, &self.exact);
            let open = if Q::CANDIDATES { 0 } else { open };
            (open | unclear, clear | open != 0)
        }
    }

    /// Decides the lanes of a block exactly: triangles in bits 7..0, others in bits 15..8.
    #[cold]
    pub fn decide<Q: BatchQuery>(
        &self,
        (k, slot): (u32, &mut Slot),
        line: usize,
        mut lanes: u32,
        query: &mut Q,
    ) {
        if lanes >> WIDTH != 0 {
            return self.test_shapes((k, slot), line, lanes >> WIDTH, query);
        }
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize;
            query.decide(k as usize, slot, (line, lane), &self.exact);
            lanes &= lanes - 1;
        }
    }

    /// Tests the primitives in some lanes of a block that are no triangles.
    fn test_shapes<Q: BatchQuery>(
        &self,
        (k, slot): (u32, &mut Slot),
        line: usize,
        mut lanes: u32,
        query: &mut Q,
    ) {
        let block = self.tree.lines().block(line);
        // `load` has refused what cannot be prepared.
        let Some(ray) = PreparedRay::new(&self.exact.rays[slot.ray as usize]) else { return };
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize & (WIDTH - 1);
            lanes &= lanes - 1;
            if let Some(hit) = self.geometry.intersect(block.id[lane] & ID_MASK, &ray) {
                query.take(k as usize, slot, &hit, &self.exact);
            }
        }
    }
}
