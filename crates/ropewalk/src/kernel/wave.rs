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
use super::exact::Exact;
use super::extreme;
use super::leaf::Leaves;
use super::level::{Root, Simd};
use super::list::{List, Lists};
use super::query::BatchQuery;
use super::slot::{Loaded, STACK, Slot};
use super::source::Source;
use crate::geometry::Geometry;
use crate::wide::{BLOCK_LINES, COUNT_OVERFLOW, LINE, WIDTH, WideTree, code_line, code_offset};

/// Most rays in flight on a core.
pub const WAVE: usize = 32;

/// The share of blocks that must be hit for a test in full at once to be worth its time: measured,
/// it wins at .4 and above and loses at .3.
const WORTHWHILE: f64 = 0.375;

/// Most blocks tested at a time: two for each ray.
const TESTS: usize = 64;

const _: () = assert!(2 * WAVE <= TESTS);

/// Blocks to be tested, each with a number: how many of its leaf are left, or which lanes.
struct Tests {
    slot: [u32; TESTS],
    line: [u32; TESTS],
    number: [u32; TESTS],
    len: usize,
}

impl Tests {
    const EMPTY: Tests = Tests { slot: [0; TESTS], line: [0; TESTS], number: [0; TESTS], len: 0 };

    /// Adds an entry, or only writes it where the next one goes.
    #[inline(always)]
    fn add(&mut self, k: u32, line: u32, number: u32, stays: bool) {
        let i = self.len % TESTS;
        (self.slot[i], self.line[i], self.number[i]) = (k, line, number);
        self.len += usize::from(stays);
    }

    #[inline(always)]
    fn get(&self, i: usize) -> (u32, u32, u32) {
        (self.slot[i % TESTS], self.line[i % TESTS], self.number[i % TESTS])
    }
}

/// What is under test in a leaf phase; kept, since clearing it would cost as much as a block.
struct Phase {
    /// Blocks to be looked at, with the number of their leaf that are left.
    tests: Tests,
    /// Of these, the first of two that are looked at side by side.
    twos: Tests,
    /// Those to be looked at alone.
    ones: Tests,
    /// Blocks to be tested in full, with the lanes.
    met: Tests,
    /// Blocks with lanes to be decided.
    open: Tests,
}

impl Phase {
    const EMPTY: Phase = Phase {
        tests: Tests::EMPTY,
        twos: Tests::EMPTY,
        ones: Tests::EMPTY,
        met: Tests::EMPTY,
        open: Tests::EMPTY,
    };
}

/// A batch on its way.
struct Wave<'a, Q, S, E> {
    tree: &'a WideTree,
    geometry: &'a Geometry,
    root: Root,
    slots: &'a mut [Slot],
    query: &'a mut Q,
    source: &'a mut S,
    events: &'a mut E,
    lists: Lists,
    /// Blocks looked at.
    tested: u64,
    /// Those of them with a triangle that is hit or may be.
    struck: u64,
    /// Rays with the cells that they go to, before they are put on the lists.
    moved: List,
    phase: Phase,
}

/// Runs the rays of `source` through `slots.len()` slots, [`WAVE`] at most.
///
/// # Safety
/// The machine must have the features of `L`, and the caller must enable them: everything here is
/// inlined into it.
#[inline(always)]
pub unsafe fn wave<L: Simd, Q: BatchQuery, S: Source<Q>, E: Events, const SHAPES: bool>(
    tree: &WideTree,
    geometry: &Geometry,
    slots: &mut [Slot],
    query: &mut Q,
    source: &mut S,
    events: &mut E,
) {
    if tree.root() == 0 {
        // SAFETY: passed on to the caller.
        while let Some((index, _)) = unsafe { source.next::<L, E>(0, tree, query, events) } {
            query.miss(index);
        }
        return;
    }
    let width = slots.len().min(WAVE);
    let slots = &mut slots[..width];
    let root = Root::new(tree.bounds(), tree.root());
    let mut lists = Lists { stepping: List::EMPTY, waiting: List::EMPTY, free: List::EMPTY };
    (0..width as u32).for_each(|k| lists.free.push(k, 0));
    let mut wave = Wave {
        tree,
        geometry,
        root,
        slots,
        query,
        source,
        events,
        lists,
        tested: 0,
        struck: 0,
        moved: List::EMPTY,
        phase: Phase::EMPTY,
    };
    loop {
        // SAFETY: passed on to the caller.
        unsafe {
            if wave.lists.free.len > 0 {
                wave.refill::<L>();
            }
            if wave.lists.stepping.len + wave.lists.waiting.len == 0 {
                let exact = Exact { lines: tree.lines(), rays: wave.source.rays() };
                wave.query.settle::<L>(&exact, true);
                return;
            }
            wave.step_phase::<L>();
            if wave.lists.waiting.len * 2 >= width || wave.lists.stepping.len == 0 {
                wave.leaf_phase::<L, SHAPES>();
            }
        }
    }
}

impl<Q: BatchQuery, S: Source<Q>, E: Events> Wave<'_, Q, S, E> {
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
            // Eight at a time, the last of them perhaps left from before: a loop of few rounds is guessed wrong
            // less often where it ends.
            for i in (0..n).step_by(8) {
                for i in i..i + 8 {
                    L::prefetch(self.address(self.moved.get(i).1));
                }
            }
            L::add(&mut self.lists, &self.moved, n);
            for i in (waiting..self.lists.waiting.len).step_by(4) {
                for i in i..i + 4 {
                    let code = self.lists.waiting.get(i).1;
                    let block = self.address(code);
                    for line in 1..BLOCK_LINES {
                        L::prefetch(block.wrapping_add(line * LINE));
                    }
                    if L::TWO {
                        // Of leaves of one block the same once more: how many they have cannot be predicted.
                        let several = code & COUNT_OVERFLOW > 1;
                        let second = std::hint::select_unpredictable(several, BLOCK_LINES, 0);
                        for line in second..second + BLOCK_LINES {
                            L::prefetch(block.wrapping_add(line * LINE));
                        }
                    }
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
                let ended = slot.pop(Q::ANY);
                let code = *slot.code.get_unchecked(slot.sp as usize);
                self.moved.set(i, k, std::hint::select_unpredictable(ended, 0, code));
            }
        }
        let free = self.lists.free.len;
        // SAFETY: passed on to the caller.
        unsafe { self.enlist::<L>(n) };
        let exact = Exact { lines: self.tree.lines(), rays: self.source.rays() };
        for i in free..self.lists.free.len {
            let (k, _) = self.lists.free.get(i);
            self.query.finish(k as usize, &mut self.slots[k as usize], &exact);
        }
        // SAFETY: passed on to the caller.
        unsafe { self.query.settle::<L>(&exact, S::WAITS) };
    }

    /// Tests the leaves of the first `n` waiting rays: all first blocks, all second blocks, and so
    /// on, so that no test waits for the outcome of the one before.
    ///
    /// Each block is only looked at first, two of a leaf side by side where the level does that faster; few of
    /// them hold a triangle that the ray may hit, and those are tested again in full. Where a query takes all hits and most blocks have some, they are
    /// tested in full at once.
    #[inline(always)]
    unsafe fn test_leaves<L: Simd, const SHAPES: bool>(&mut self, n: usize) {
        let exact = Exact { lines: self.tree.lines(), rays: self.source.rays() };
        let leaves = Leaves { tree: self.tree, geometry: self.geometry, exact };
        let slots = self.slots.as_mut_ptr();
        let Phase { tests, twos, ones, met, open } = &mut self.phase;
        let many = Q::MANY && self.struck as f64 >= WORTHWHILE * self.tested as f64;
        let by_two = L::TWO && !SHAPES && !many;
        tests.len = 0;
        for i in 0..n {
            let (k, code) = self.lists.waiting.get(i);
            let count = self.tree.block_count(code);
            tests.add(k, code_line(code) as u32, count, count > 0);
        }
        for _ in 0..tests.len {
            self.events.leaf();
        }
        while tests.len > 0 {
            let n = std::mem::take(&mut tests.len);
            (met.len, open.len) = (0, 0);
            if by_two {
                (twos.len, ones.len) = (0, 0);
                for i in 0..n {
                    let (k, line, left) = tests.get(i);
                    twos.add(k, line, left, left > 1);
                    ones.add(k, line, left, left == 1);
                }
                for i in 0..twos.len {
                    let (k, line, left) = twos.get(i);
                    self.events.block();
                    self.events.block();
                    // SAFETY: lists hold numbers of slots, the codes of a tree lead to its blocks; the
                    // rest passed on to the caller.
                    let lanes =
                        unsafe { leaves.meet_two::<L, Q>(&*slots.add(k as usize), line as usize) };
                    let (first, second) = (lanes & 0xFF, lanes >> WIDTH);
                    let block = BLOCK_LINES as u32;
                    met.add(k, line, first, first != 0);
                    met.add(k, line + block, second, second != 0);
                    tests.add(k, line + 2 * block, left - 2, left > 2);
                }
                for i in 0..ones.len {
                    let (k, line, _) = ones.get(i);
                    self.events.block();
                    // SAFETY: as above.
                    let lanes = unsafe {
                        leaves.meet::<L, Q, SHAPES>(&*slots.add(k as usize), line as usize)
                    };
                    met.add(k, line, lanes, lanes != 0);
                }
                if Q::MANY {
                    self.tested += (2 * twos.len + ones.len) as u64;
                }
            } else {
                for i in 0..n {
                    let (k, line, left) = tests.get(i);
                    self.events.block();
                    // SAFETY: as above.
                    let lanes = unsafe {
                        let (slot, line) = (&mut *slots.add(k as usize), line as usize);
                        if many {
                            let slot = (k, slot);
                            let (open, struck) = leaves.test_all::<L, Q, E, SHAPES>(
                                slot,
                                line,
                                self.query,
                                self.events,
                            );
                            self.struck += u64::from(struck);
                            open
                        } else {
                            leaves.meet::<L, Q, SHAPES>(slot, line)
                        }
                    };
                    met.add(k, line, lanes, lanes != 0);
                    tests.add(k, line + BLOCK_LINES as u32, left - 1, left > 1);
                }
                if Q::MANY {
                    self.tested += n as u64;
                }
            }
            let ahead = if by_two { 2 * BLOCK_LINES } else { BLOCK_LINES };
            for i in (0..tests.len).step_by(4) {
                for i in i..i + 4 {
                    let (_, line, _) = tests.get(i);
                    let block = self.tree.lines().as_ptr().wrapping_add(line as usize * LINE);
                    for line in 0..ahead {
                        // SAFETY: passed on to the caller.
                        unsafe { L::prefetch(block.wrapping_add(line * LINE)) };
                    }
                }
            }
            for i in 0..if many { 0 } else { met.len } {
                let (k, line, lanes) = met.get(i);
                // SAFETY: as above.
                let (lanes, struck) = unsafe {
                    let slot = (k, &mut *slots.add(k as usize));
                    let line = line as usize;
                    leaves.test::<L, Q, E, SHAPES>(slot, line, lanes, self.query, self.events)
                };
                if Q::MANY {
                    self.struck += u64::from(struck);
                }
                open.add(k, line, lanes, lanes != 0);
            }
            let undecided = if many { &*met } else { &*open };
            for i in 0..undecided.len {
                let (k, line, lanes) = undecided.get(i);
                let slot = (k, &mut self.slots[k as usize]);
                leaves.decide(slot, line as usize, lanes, self.query);
            }
        }
    }

    /// Puts the next rays that may hit anything into the free slots.
    #[inline(always)]
    unsafe fn refill<L: Simd>(&mut self) {
        let mut n = 0;
        while self.lists.free.len > 0 {
            let (k, _) = self.lists.free.get(self.lists.free.len - 1);
            let (source, query, events) = (&mut *self.source, &mut *self.query, &mut *self.events);
            // SAFETY: passed on to the caller; the codes that come back are those of the tree.
            let next = unsafe { source.next::<L, E>(k as usize, self.tree, query, events) };
            let Some((index, code)) = next else {
                // There is nothing more for this slot.
                self.lists.free.len -= 1;
                continue;
            };
            let (ray, slot) = (&self.source.rays()[index], &mut self.slots[k as usize]);
            // SAFETY: passed on to the caller.
            let loaded = unsafe { L::load(slot, ray, index as u32, &self.root) };
            if loaded == Loaded::Extreme {
                self.walk_extreme(k);
                continue;
            }
            let ready = usize::from(loaded == Loaded::Ready);
            if Q::MANY {
                // Without a branch, since which chords miss the scene's box cannot be predicted: the
                // next ray overwrites what such a ray leaves, and hits overwrite this.
                self.query.miss(index);
            } else if ready == 0 {
                self.query.miss(index);
                continue;
            }
            slot.code[1] = code;
            let mut top = code;
            if Q::ANY {
                // SAFETY: passed on to the caller; the ray has just been loaded.
                unsafe { self.source.enter::<L, E>(index, slot, self.tree, self.events) };
                top = slot.code[slot.sp as usize % STACK];
            }
            self.events.rays(ready);
            if Q::ANY && slot.sp == 0 {
                self.query.miss(index);
                continue;
            }
            self.moved.set(n, k, top);
            (n, self.lists.free.len) = (n + ready, self.lists.free.len - ready);
        }
        // SAFETY: passed on to the caller.
        unsafe { self.enlist::<L>(n) };
    }

    /// Answers the ray of slot `k` without the filters.
    #[cold]
    fn walk_extreme(&mut self, k: u32) {
        let slot = &mut self.slots[k as usize];
        let exact = Exact { lines: self.tree.lines(), rays: self.source.rays() };
        if Q::CANDIDATES {
            self.query.gather(self.tree, k as usize);
        } else {
            extreme::walk(self.tree, self.geometry, &exact, (k as usize, slot), self.query);
        }
        self.query.finish(k as usize, slot, &exact);
    }
}
