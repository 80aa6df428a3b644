//! The wave: many rays in flight, in phases of like work.
//!
//! ```text
//! repeat
//!     step phase   every ray whose next cell is a treelet steps once; the next cell is prefetched
//!     leaf phase   once half of the rays wait at leaves, or none can step: each of them tests its
//!                  leaf's blocks, and goes on, or finishes and is replaced by the next ray
//! until no ray is left
//! ```
//! The SIMD block test is a filter in `f32` that lets no hit pass by; what it lets through is decided
//! by the reference kernels in `f64`. So a batch answers bit for bit as the reference walks do, at
//! every level.
//!
//! The lists of waiting rays are updated without branches, so that the phases mispredict only where
//! they end. A lone ray is bound by latency, a wave by the throughput of its steps.

#![allow(unsafe_code)]

use super::events::Events;
use super::exact::{Exact, place};
use super::extreme;
use super::level::{Found, Range, Root, Simd};
use super::list::{List, Lists};
use super::query::{BatchQuery, Clear};
use super::slot::{Loaded, STACK, Slot, earlier};
use super::source::Source;
use crate::geometry::Geometry;
use crate::ray::{PreparedRay, Ray};
use crate::wide::{BLOCK_LINES, Block, ID_MASK, LINE, WIDTH, WideTree, code_line, code_offset};

/// Rays in flight on a core.
pub const WAVE: usize = 24;

/// Blocks to be tested, each with a number: how many of its leaf are left, or which lanes.
struct Tests {
    slot: [u32; 32],
    line: [u32; 32],
    number: [u32; 32],
    len: usize,
}

impl Tests {
    const EMPTY: Tests = Tests { slot: [0; 32], line: [0; 32], number: [0; 32], len: 0 };

    #[inline(always)]
    fn set(&mut self, i: usize, k: u32, line: u32, number: u32) {
        self.slot[i & 31] = k;
        self.line[i & 31] = line;
        self.number[i & 31] = number;
    }

    #[inline(always)]
    fn get(&self, i: usize) -> (u32, u32, u32) {
        (self.slot[i & 31], self.line[i & 31], self.number[i & 31])
    }
}

/// A batch on its way.
struct Wave<'a, Q, S, E> {
    tree: &'a WideTree,
    geometry: &'a Geometry,
    exact: Exact<'a>,
    root: Root,
    slots: &'a mut [Slot],
    query: &'a mut Q,
    source: &'a mut S,
    events: &'a mut E,
    /// True once the source has no more rays.
    exhausted: bool,
    lists: Lists,
    /// Rays with the cells that they go to, before they are put on the lists.
    moved: List,
}

/// Runs the rays of `source` through `slots.len()` slots, [`WAVE`] at most.
///
/// # Safety
/// The machine must have the features of `L`, and the caller must enable them: everything here is
/// inlined into it.
#[inline(always)]
pub unsafe fn wave<L: Simd, Q: BatchQuery, S: Source, E: Events, const SHAPES: bool>(
    tree: &WideTree,
    geometry: &Geometry,
    rays: &[Ray],
    slots: &mut [Slot],
    query: &mut Q,
    source: &mut S,
    events: &mut E,
) {
    if tree.root() == 0 {
        // SAFETY: passed on to the caller.
        while let Some((index, _)) = unsafe { source.next::<L, E>(tree, rays, |_| (), events) } {
            query.miss(index);
        }
        return;
    }
    let width = slots.len().min(WAVE);
    let slots = &mut slots[..width];
    let exact = Exact { lines: tree.lines(), rays };
    let root = Root::new(tree.bounds(), tree.root());
    let mut lists = Lists { stepping: List::EMPTY, waiting: List::EMPTY, free: List::EMPTY };
    (0..width as u32).for_each(|k| lists.free.push(k, 0));
    let mut wave = Wave {
        tree,
        geometry,
        exact,
        root,
        slots,
        query,
        source,
        events,
        exhausted: false,
        lists,
        moved: List::EMPTY,
    };
    loop {
        // SAFETY: passed on to the caller.
        unsafe { wave.refill::<L>() };
        while wave.lists.free.len == 0 || wave.exhausted {
            if wave.lists.stepping.len + wave.lists.waiting.len == 0 {
                // SAFETY: passed on to the caller.
                unsafe { wave.query.settle::<L>(&exact, true) };
                return;
            }
            // SAFETY: passed on to the caller.
            unsafe {
                wave.step_phase::<L>();
                if wave.lists.waiting.len * 2 >= width || wave.lists.stepping.len == 0 {
                    wave.leaf_phase::<L, SHAPES>();
                }
            }
        }
    }
}

impl<Q: BatchQuery, S: Source, E: Events> Wave<'_, Q, S, E> {
    /// Every stepping ray replaces its treelet by the children it reaches.
    ///
    /// Two loops: what a step leaves on the stack is looked at only after all have stepped, so that
    /// no step waits for the stores of the one before.
    #[inline(always)]
    unsafe fn step_phase<L: Simd>(&mut self) {
        let slots = self.slots.as_mut_ptr();
        let lines = self.tree.lines().as_ptr();
        let n = std::mem::take(&mut self.lists.stepping.len);
        for i in 0..n {
            let (k, code) = self.lists.stepping.get(i);
            self.events.step();
            // SAFETY: lists hold numbers of slots and codes of the tree, whose links are valid.
            unsafe {
                let slot = &mut *slots.add(k as usize);
                let treelet = &*lines.add(code_offset(code)).cast();
                let sp = L::step(slot, treelet, slot.sp as usize);
                slot.sp = sp as u32;
                self.moved.set(i, k, *slot.code.get_unchecked(sp));
            }
        }
        // SAFETY: passed on to the caller.
        unsafe { self.enlist::<L>(n) };
    }

    /// Puts the first `n` moved rays on the lists of their kinds and asks for their cells.
    #[inline(always)]
    unsafe fn enlist<L: Simd>(&mut self, n: usize) {
        let waiting = self.lists.waiting.len;
        // SAFETY: passed on to the caller.
        unsafe {
            for i in 0..n {
                L::prefetch(self.address(self.moved.get(i).1));
            }
            L::add(&mut self.lists, &self.moved, n);
            for i in waiting..self.lists.waiting.len {
                let block = self.address(self.lists.waiting.get(i).1);
                for line in 1..BLOCK_LINES {
                    L::prefetch(block.wrapping_add(line * LINE));
                }
            }
        }
    }

    /// Where a cell lies in memory.
    #[inline(always)]
    fn address(&self, code: u32) -> *const u8 {
        self.tree.lines().as_ptr().wrapping_add(code_offset(code))
    }

    /// Every waiting ray tests its leaf and goes on, or makes room for the next ray.
    #[inline(always)]
    unsafe fn leaf_phase<L: Simd, const SHAPES: bool>(&mut self) {
        let n = std::mem::take(&mut self.lists.waiting.len);
        // SAFETY: passed on to the caller.
        unsafe { self.test_leaves::<L, SHAPES>(n) };
        for i in 0..n {
            let (k, _) = self.lists.waiting.get(i);
            // SAFETY: lists hold numbers of slots; the stack pointer stays on the stack.
            unsafe {
                let slot = &mut *self.slots.as_mut_ptr().add(k as usize);
                let ended = Self::pop(slot);
                let code = *slot.code.get_unchecked(slot.sp as usize);
                self.moved.set(i, k, std::hint::select_unpredictable(ended, 0, code));
            }
        }
        let free = self.lists.free.len;
        // SAFETY: passed on to the caller.
        unsafe { self.enlist::<L>(n) };
        for i in free..self.lists.free.len {
            let (k, _) = self.lists.free.get(i);
            self.query.finish(k as usize, &mut self.slots[k as usize], &self.exact);
        }
        // SAFETY: passed on to the caller.
        unsafe { self.query.settle::<L>(&self.exact, false) };
    }

    /// Takes the cell just visited off the stack; true if nothing is left that matters.
    ///
    /// Cells are popped in the order in which the ray enters them, so one that starts behind the
    /// limit ends the ray; except that a ray in a cutting plane is in the cells on both sides at
    /// once, and then only each cell by itself can be dropped.
    #[inline(always)]
    fn pop(slot: &mut Slot) -> bool {
        let mut below = (slot.sp as usize).saturating_sub(1).min(STACK - 1);
        if slot.may_lie_in_plane {
            while below > 0 && earlier(slot.enter[below]) - slot.near_zero > slot.limit {
                below -= 1;
            }
        }
        slot.sp = below as u32;
        let behind = earlier(slot.enter[below]) - slot.near_zero > slot.limit;
        (below == 0) | behind | (Q::ANY & (slot.best_id != u32::MAX))
    }

    /// Tests the leaves of the first `n` waiting rays: all first blocks, all second blocks, and so
    /// on, so that no test waits for the outcome of the one before.
    ///
    /// Each block is only looked at first; few of them hold a triangle that the ray may hit, and
    /// those are tested again in full.
    #[inline(always)]
    unsafe fn test_leaves<L: Simd, const SHAPES: bool>(&mut self, n: usize) {
        let mut tests = Tests::EMPTY;
        for i in 0..n {
            let (k, code) = self.lists.waiting.get(i);
            let count = self.tree.block_count(code);
            tests.set(tests.len, k, code_line(code) as u32, count);
            tests.len += usize::from(count > 0);
        }
        for _ in 0..tests.len {
            self.events.leaf();
        }
        while tests.len > 0 {
            let n = std::mem::take(&mut tests.len);
            let (mut met, mut meeting) = (Tests::EMPTY, 0);
            for i in 0..n {
                let (k, line, left) = tests.get(i);
                // SAFETY: the codes of a tree lead to its blocks; the rest passed on to the caller.
                let lanes = unsafe {
                    if Q::MANY {
                        self.test_all::<L, SHAPES>(k, line as usize)
                    } else {
                        self.meet_block::<L, SHAPES>(k, line as usize)
                    }
                };
                met.set(meeting, k, line, lanes);
                meeting += usize::from(lanes != 0);
                tests.set(tests.len, k, line + BLOCK_LINES as u32, left - 1);
                tests.len += usize::from(left > 1);
            }
            for i in 0..tests.len {
                let (_, line, _) = tests.get(i);
                let block = self.tree.lines().as_ptr().wrapping_add(line as usize * LINE);
                for line in 0..BLOCK_LINES {
                    // SAFETY: passed on to the caller.
                    unsafe { L::prefetch(block.wrapping_add(line * LINE)) };
                }
            }
            if Q::MANY {
                for i in 0..meeting {
                    let (k, line, lanes) = met.get(i);
                    self.decide(k, line as usize, lanes);
                }
                continue;
            }
            let (mut open, mut unsettled) = (Tests::EMPTY, 0);
            for i in 0..meeting {
                let (k, line, lanes) = met.get(i);
                // SAFETY: as above.
                let lanes = unsafe { self.test_block::<L>(k, line as usize, lanes) };
                open.set(unsettled, k, line, lanes);
                unsettled += usize::from(lanes != 0);
            }
            for i in 0..unsettled {
                let (k, line, lanes) = open.get(i);
                self.decide(k, line as usize, lanes);
            }
        }
    }

    /// The lanes of a block that the ray of slot `k` may hit: triangles in bits 7..0, others in
    /// bits 15..8.
    #[inline(always)]
    unsafe fn meet_block<L: Simd, const SHAPES: bool>(&mut self, k: u32, line: usize) -> u32 {
        // SAFETY: the caller vouches for the slot, the line and the features.
        unsafe {
            let slot = &*self.slots.as_ptr().add(k as usize);
            let block = &*self.tree.lines().as_ptr().add(line * LINE).cast::<Block>();
            let lanes = L::meets(slot, block);
            self.events.block();
            if SHAPES { lanes | block.shape_lanes() << WIDTH } else { lanes }
        }
    }

    /// Tests a block in full at once; the lanes that need a decision in `f64`.
    #[inline(always)]
    unsafe fn test_all<L: Simd, const SHAPES: bool>(&mut self, k: u32, line: usize) -> u32 {
        self.events.block();
        let shapes = if SHAPES { self.tree.lines().block(line).shape_lanes() } else { 0 };
        // SAFETY: passed on to the caller.
        unsafe { self.test_block::<L>(k, line, shapes << WIDTH) }
    }

    /// Tests a block that the ray of slot `k` meets; the lanes that need a decision in `f64`.
    ///
    /// No branches: which blocks hold a hit cannot be predicted, and a wrong guess would cost more
    /// than a test.
    #[inline(always)]
    unsafe fn test_block<L: Simd>(&mut self, k: u32, line: usize, lanes: u32) -> u32 {
        // SAFETY: the caller vouches for the slot, the line and the features.
        unsafe {
            let slot = &mut *self.slots.as_mut_ptr().add(k as usize);
            let block = &*self.tree.lines().as_ptr().add(line * LINE).cast::<Block>();
            let mut range = Range::default();
            let Found { clear, open } = L::test(slot, block, &mut range);
            self.events.found(clear, open);
            let hits = Clear { lanes: clear, range: &range, block, line };
            open | self.query.take_clear::<L>(k as usize, slot, &hits, &self.exact)
                | lanes >> WIDTH << WIDTH
        }
    }

    /// Decides the lanes of a block exactly: triangles in bits 7..0, others in bits 15..8.
    #[cold]
    fn decide(&mut self, k: u32, line: usize, mut lanes: u32) {
        if lanes >> WIDTH != 0 {
            self.test_shapes(k, line);
            lanes &= (1 << WIDTH) - 1;
        }
        let slot = &mut self.slots[k as usize];
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize;
            if let Some(hit) = self.exact.hit(slot.ray, place(line, lane)) {
                self.query.take(k as usize, slot, &hit, &self.exact);
            }
            lanes &= lanes - 1;
        }
    }

    /// Tests the primitives of a block that are no triangles.
    fn test_shapes(&mut self, k: u32, line: usize) {
        let slot = &mut self.slots[k as usize];
        let block = self.tree.lines().block(line);
        // `load` has refused what cannot be prepared.
        let Some(ray) = PreparedRay::new(&self.exact.rays[slot.ray as usize]) else { return };
        let mut lanes = block.shape_lanes();
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize & (WIDTH - 1);
            lanes &= lanes - 1;
            if let Some(hit) = self.geometry.intersect(block.id[lane] & ID_MASK, &ray) {
                self.query.take(k as usize, slot, &hit, &self.exact);
            }
        }
    }

    /// Puts the next rays that may hit anything into the free slots.
    #[inline(always)]
    unsafe fn refill<L: Simd>(&mut self) {
        let mut n = 0;
        while self.lists.free.len > 0 {
            let (rays, miss) = (self.exact.rays, |index| self.query.miss(index));
            // SAFETY: passed on to the caller; the codes that come back are those of the tree.
            let next = unsafe { self.source.next::<L, E>(self.tree, rays, miss, self.events) };
            let Some((index, code)) = next else {
                self.exhausted = true;
                break;
            };
            let (k, _) = self.lists.free.get(self.lists.free.len - 1);
            let (ray, slot) = (&rays[index], &mut self.slots[k as usize]);
            // SAFETY: passed on to the caller.
            match unsafe { L::load(slot, ray, index as u32, &self.root) } {
                Loaded::Ready => {
                    self.events.ray();
                    self.lists.free.len -= 1;
                    slot.code[1] = code;
                    self.moved.set(n, k, code);
                    n += 1;
                }
                Loaded::Misses => self.query.miss(index),
                Loaded::Extreme => self.walk_extreme(k),
            }
        }
        // SAFETY: passed on to the caller.
        unsafe { self.enlist::<L>(n) };
    }

    /// Answers the ray of slot `k` without the filters.
    #[cold]
    fn walk_extreme(&mut self, k: u32) {
        let slot = &mut self.slots[k as usize];
        extreme::walk(self.tree, self.geometry, &self.exact, (k as usize, slot), self.query);
        self.query.finish(k as usize, slot, &self.exact);
    }
}
