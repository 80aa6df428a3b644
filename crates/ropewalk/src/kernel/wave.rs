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

use super::exact::{Exact, place};
use super::extreme;
use super::level::{Found, Range, Simd};
use super::query::{BatchQuery, ClearHit};
use super::slot::{Loaded, Slot, earlier};
use crate::geometry::Geometry;
use crate::ray::{PreparedRay, Ray};
use crate::wide::{Block, COUNT_BITS, ID_MASK, LEAF, WIDTH, WideTree};

/// Rays in flight on a core.
pub const WAVE: usize = 24;

/// Bytes of a cache line.
const LINE: usize = 64;

/// A list of slot numbers; 32 entries, so that a masked index needs no bounds check.
#[derive(Clone, Copy)]
struct List {
    slot: [u8; 32],
    len: usize,
}

impl List {
    const EMPTY: List = List { slot: [0; 32], len: 0 };

    /// Writes `k` behind the list and keeps it if `keep` is 1: no branch.
    #[inline(always)]
    fn push_if(&mut self, k: u8, keep: usize) {
        self.slot[self.len & 31] = k;
        self.len += keep;
    }

    #[inline(always)]
    fn get(&self, i: usize) -> u8 {
        self.slot[i & 31]
    }
}

/// A batch on its way.
struct Wave<'a, Q> {
    tree: &'a WideTree,
    geometry: &'a Geometry,
    exact: Exact<'a>,
    slots: &'a mut [Slot],
    query: &'a mut Q,
    next: usize,
    stepping: List,
    waiting: List,
}

/// Runs a batch through `slots.len()` slots, [`WAVE`] at most.
///
/// # Safety
/// The machine must have the features of `L`, and the caller must enable them: everything here is
/// inlined into it.
#[inline(always)]
pub unsafe fn wave<L: Simd, Q: BatchQuery, const SHAPES: bool>(
    tree: &WideTree,
    geometry: &Geometry,
    rays: &[Ray],
    slots: &mut [Slot],
    query: &mut Q,
) {
    let width = slots.len().min(WAVE);
    let slots = &mut slots[..width];
    let (stepping, waiting) = (List::EMPTY, List::EMPTY);
    let exact = Exact { blocks: tree.blocks(), rays };
    let mut wave = Wave { tree, geometry, exact, slots, query, next: 0, stepping, waiting };
    for k in 0..width as u8 {
        // SAFETY: passed on to the caller.
        unsafe { wave.refill::<L>(k) };
    }
    while wave.stepping.len + wave.waiting.len > 0 {
        // SAFETY: passed on to the caller.
        unsafe {
            wave.step_phase::<L>();
            if wave.waiting.len * 2 >= width || wave.stepping.len == 0 {
                wave.leaf_phase::<L, SHAPES>();
            }
        }
    }
}

impl<Q: BatchQuery> Wave<'_, Q> {
    /// Every stepping ray replaces its treelet by the children it reaches.
    #[inline(always)]
    unsafe fn step_phase<L: Simd>(&mut self) {
        let n = std::mem::take(&mut self.stepping.len);
        for i in 0..n {
            let k = self.stepping.get(i);
            let slot = &mut self.slots[k as usize];
            let sp = slot.sp as usize;
            let treelet = &self.tree.treelets()[slot.code[sp] as usize];
            // SAFETY: passed on to the caller.
            let sp = unsafe { L::step(slot, treelet, sp) };
            slot.sp = sp as u32;
            let code = slot.code[sp];
            // SAFETY: passed on to the caller.
            unsafe { self.enlist::<L>(k, code) };
        }
    }

    /// Puts slot `k`, whose next cell is `code`, on the list of its kind and prefetches the cell.
    #[inline(always)]
    unsafe fn enlist<L: Simd>(&mut self, k: u8, code: u32) {
        let leaf = (code >> 31) as usize;
        let first = ((code & !LEAF) >> COUNT_BITS) as usize;
        let block = self.tree.blocks().as_ptr().wrapping_add(first).cast::<u8>();
        let treelet = self.tree.treelets().as_ptr().wrapping_add(code as usize).cast::<u8>();
        let address = std::hint::select_unpredictable(leaf == 1, block, treelet);
        // SAFETY: passed on to the caller.
        unsafe { L::prefetch(address) };
        self.waiting.push_if(k, leaf);
        self.stepping.push_if(k, 1 - leaf);
    }

    /// Every waiting ray tests its leaf and goes on, or makes room for the next ray.
    #[inline(always)]
    unsafe fn leaf_phase<L: Simd, const SHAPES: bool>(&mut self) {
        let visit = std::mem::replace(&mut self.waiting, List::EMPTY);
        for i in 0..visit.len {
            let slot = &self.slots[visit.get(i) as usize];
            let (first, _) = self.tree.leaf_blocks(slot.code[slot.sp as usize]);
            let block = self.tree.blocks().as_ptr().wrapping_add(first as usize).cast::<u8>();
            for line in 1..size_of::<Block>() / LINE {
                // SAFETY: passed on to the caller.
                unsafe { L::prefetch(block.wrapping_add(line * LINE)) };
            }
        }
        let mut done = List::EMPTY;
        for i in 0..visit.len {
            let k = visit.get(i);
            let slot = &mut self.slots[k as usize];
            let sp = slot.sp as usize;
            let (first, count) = self.tree.leaf_blocks(slot.code[sp]);
            for index in first as usize..(first + count) as usize {
                // SAFETY: passed on to the caller.
                unsafe { self.test_block::<L, SHAPES>(k, index) };
            }
            let slot = &mut self.slots[k as usize];
            // Cells are popped in the order in which the ray enters them, so one that starts
            // behind the limit ends the ray; except that a ray in a cutting plane is in the cells
            // on both sides at once, and then only each cell by itself can be dropped.
            let mut below = sp.saturating_sub(1);
            let behind = |cell: usize| earlier(slot.enter[cell]) > slot.limit;
            if slot.may_lie_in_plane {
                while below > 0 && behind(below) {
                    below -= 1;
                }
            }
            let ended = below == 0 || behind(below) || (Q::ANY && slot.best_id != u32::MAX);
            slot.sp = below as u32;
            let code = slot.code[below];
            done.push_if(k, usize::from(ended));
            if !ended {
                // SAFETY: passed on to the caller.
                unsafe { self.enlist::<L>(k, code) };
            }
        }
        for i in 0..done.len {
            let k = done.get(i);
            self.query.finish(k as usize, &mut self.slots[k as usize], &self.exact);
            // SAFETY: passed on to the caller.
            unsafe { self.refill::<L>(k) };
        }
    }

    /// Tests the primitives of a block against the ray of slot `k`.
    #[inline(always)]
    unsafe fn test_block<L: Simd, const SHAPES: bool>(&mut self, k: u8, index: usize) {
        let slot = &mut self.slots[k as usize];
        let block = &self.exact.blocks[index];
        let mut range = Range::default();
        // SAFETY: passed on to the caller.
        let Found { mut clear, mut open } = unsafe { L::test(slot, block, &mut range) };
        while clear != 0 {
            let lane = clear.trailing_zeros() as usize & (WIDTH - 1);
            let hit = ClearHit {
                prim_id: block.id[lane] & ID_MASK,
                at: place(index, lane),
                low: range.low[lane],
                high: range.high[lane],
            };
            if !self.query.take_clear(k as usize, slot, &hit) {
                open |= 1 << lane;
            }
            clear &= clear - 1;
        }
        while open != 0 {
            let lane = open.trailing_zeros() as usize & (WIDTH - 1);
            if let Some(hit) = self.exact.hit(slot.ray, place(index, lane)) {
                self.query.take(k as usize, slot, &hit, &self.exact);
            }
            open &= open - 1;
        }
        if SHAPES && block.shape_lanes() != 0 {
            self.test_shapes(k, index);
        }
    }

    /// Tests the primitives of a block that are no triangles.
    fn test_shapes(&mut self, k: u8, index: usize) {
        let slot = &mut self.slots[k as usize];
        let block = &self.exact.blocks[index];
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

    /// Puts the next ray that reaches the scene's box into slot `k`.
    #[inline(always)]
    unsafe fn refill<L: Simd>(&mut self, k: u8) {
        let (bounds, root) = (self.tree.bounds(), self.tree.root());
        while self.next < self.exact.rays.len() {
            let index = self.next;
            self.next += 1;
            if root == 0 {
                self.query.miss(index);
                continue;
            }
            let ray = &self.exact.rays[index];
            match self.slots[k as usize].load(ray, index as u32, bounds, root) {
                Loaded::Ready => {
                    // SAFETY: passed on to the caller.
                    unsafe { self.enlist::<L>(k, root) };
                    return;
                }
                Loaded::Misses => self.query.miss(index),
                Loaded::Extreme => self.walk_extreme(k),
            }
        }
    }

    /// Answers the ray of slot `k` without the filters.
    #[cold]
    fn walk_extreme(&mut self, k: u8) {
        let slot = &mut self.slots[k as usize];
        extreme::walk(self.tree, self.geometry, &self.exact, (k as usize, slot), self.query);
        self.query.finish(k as usize, slot, &self.exact);
    }
}
