//! Where short occlusion rays of one neighbourhood enter the tree: at up to eight cells, found once for many rays.
//!
//! ```text
//! a box around the first ray, a little larger than the ray is long
//! the cells with primitives that it reaches, the shallowest divided first while there are no more than eight
//! each ray that lies in the box: one look at these cells in place of the steps that lead to them
//! ```
//! A cell's interval follows from the planes of its sides by the arithmetic of the step, so that a ray reaches the same cells
//! as from the root. They are not in order: that is for queries that any hit ends.

#![allow(unsafe_code)]

use super::entry::{Corners, Segment, WIDER, outer_corners, slack_of};
use super::events::Events;
use super::level::Simd;
use super::slot::Slot;
use crate::ray::Ray;
use crate::wide::{LEAF, Treelet, WIDTH, WideTree, code_offset};

/// Cells by the planes of their sides.
#[repr(C, align(64))]
#[derive(Clone)]
pub struct Cells {
    /// Lower and upper sides by axis.
    pub side: [[[f32; WIDTH]; 2]; 3],
    /// Codes, 0 for lanes that are not in use.
    pub code: [u32; WIDTH],
}

/// A box, and the cells of a tree that it reaches.
pub struct Vicinity {
    around: Corners,
    cells: Cells,
    slack: f32,
    /// Rays answered from these cells.
    served: u64,
    /// Rays answered from other cells before.
    before: u64,
    /// True if there are no cells whose use could tell whether others will pay.
    is_new: bool,
    /// Rays to be left to the root before another box is tried, and after the next box that serves too few.
    skip: u32,
    next: u32,
}

/// The box around a ray reaches so many times its length from its origin.
const MARGIN: f32 = 1.2;

/// Fewest rays that are worth a box.
const WORTHWHILE: u64 = 16;

/// Most rays in a row that are left to the root.
const LONGEST: u32 = 4096;

/// Fewest steps that lead from the root to any of the cells.
const DEEP: u32 = 2;

/// Most treelets looked at for a box.
const LOOKS: u32 = 32;

impl Vicinity {
    /// None in this tree so far; `None` if its root is not a treelet.
    pub fn new(tree: &WideTree) -> Option<Vicinity> {
        if tree.root() == 0 || tree.root() & LEAF != 0 {
            return None;
        }
        let cells = Cells { side: [[[0.0; WIDTH]; 2]; 3], code: [0; WIDTH] };
        let (around, slack) = (Corners::NOTHING, slack_of(tree));
        let (served, before, is_new, skip, next) = (0, 0, true, 0, 1);
        Some(Vicinity { around, cells, slack, served, before, is_new, skip, next })
    }

    /// Rays that started from cells near them.
    pub fn near_rays(&self) -> u64 {
        self.before + self.served
    }

    /// Replaces the root on the stack of a slot by the cells that its ray reaches, or leaves it there.
    ///
    /// # Safety
    /// The machine must have the features of `L`, and the caller must enable them; `tree` must be
    /// that of this vicinity, and the slot must hold `ray` and the root alone.
    #[inline(always)]
    pub unsafe fn enter<L: Simd, E: Events>(
        &mut self,
        tree: &WideTree,
        ray: &Ray,
        slot: &mut Slot,
        events: &mut E,
    ) {
        if self.skip > 0 {
            self.skip -= 1;
            return;
        }
        // SAFETY: passed on to the caller.
        unsafe {
            if !L::lies_in(&L::segment(ray, self.slack), &self.around) {
                let moved = self.move_to::<L, E>(tree, ray, events);
                if !(moved && L::lies_in(&L::segment(ray, self.slack), &self.around)) {
                    return;
                }
            }
            self.served += 1;
            events.step();
            slot.sp = L::enter(slot, &self.cells) as u32;
        }
    }

    /// Makes a box around a ray; false if that does not pay.
    #[inline(always)]
    unsafe fn move_to<L: Simd, E: Events>(
        &mut self,
        tree: &WideTree,
        ray: &Ray,
        events: &mut E,
    ) -> bool {
        let squares = ray.dir.iter().fold(0.0, |sum, d| sum + d * d);
        let longest = ray.t_max.abs().max(ray.t_min.abs());
        let reach = MARGIN * (longest * squares.sqrt());
        // Rays in the box may lie outside of the tree's: their ends are rounded by their own size.
        let size = ray.origin.iter().fold(0.0f32, |size, x| size.max(x.abs())) + reach;
        self.slack = slack_of(tree).max(WIDER * size);
        let reach = reach + 4.0 * self.slack;
        // SAFETY: passed on to the caller.
        let pays = (self.is_new || self.served >= WORTHWHILE)
            && reach.is_finite()
            && unsafe { self.surround::<L, E>(tree, ray.origin, reach, events) };
        if self.served >= WORTHWHILE {
            self.next = 1;
        }
        (self.before, self.served) = (self.before + self.served, 0);
        self.is_new = !pays;
        if !pays {
            (self.skip, self.next) = (self.next, (2 * self.next).min(LONGEST));
            self.around = Corners::NOTHING;
        }
        pays
    }

    /// Finds the cells that a box around a point reaches; false if they are near the root.
    #[inline(always)]
    unsafe fn surround<L: Simd, E: Events>(
        &mut self,
        tree: &WideTree,
        middle: [f32; 3],
        reach: f32,
        events: &mut E,
    ) -> bool {
        let [x, y, z] = middle;
        let (low, minus_high) = (|x: f32| x - reach, |x: f32| -(x + reach));
        let none = f32::NEG_INFINITY;
        self.around = Corners([
            low(x),
            low(y),
            low(z),
            none,
            minus_high(x),
            minus_high(y),
            minus_high(z),
            none,
        ]);
        let segment = Segment { corners: self.around, end: [0.0; 4] };
        let mut found = [(outer_corners(tree), tree.root(), 0u32); WIDTH];
        let (mut count, mut whole) = (1, 0u32);
        for _ in 0..LOOKS {
            let mut least = (u32::MAX, 0);
            for (i, &(_, code, depth)) in found[..count].iter().enumerate() {
                if code & LEAF == 0 && whole >> i & 1 == 0 && depth < least.0 {
                    least = (depth, i);
                }
            }
            let (depth, i) = least;
            if depth == u32::MAX {
                break;
            }
            let (cell, code, _) = found[i];
            events.looked();
            // SAFETY: the codes of a tree lead to its treelets; the rest passed on to the caller.
            let treelet =
                unsafe { &*tree.lines().as_ptr().add(code_offset(code)).cast::<Treelet>() };
            // SAFETY: passed on to the caller.
            let mut reached = unsafe { L::reached(&segment, treelet) };
            if count - 1 + reached.count_ones() as usize > WIDTH {
                whole |= 1 << i;
                continue;
            }
            // The last cell moves up; those behind it come after.
            count -= 1;
            found[i] = found[count];
            whole = whole & !(1 << i) | (whole >> count & 1) << i;
            whole &= !(u32::MAX << count);
            while reached != 0 {
                let child = reached.trailing_zeros() as usize & 7;
                reached &= reached - 1;
                // SAFETY: passed on to the caller.
                let cell = unsafe { L::narrow(&cell, treelet, child) };
                found[count] = (cell, treelet.child[child], depth + 1);
                count += 1;
            }
        }
        self.cells.code = [0; WIDTH];
        let mut deep = true;
        for (i, (cell, code, depth)) in found[..count].iter().enumerate() {
            self.cells.code[i] = *code;
            deep &= *depth >= DEEP || code & LEAF != 0;
            for a in 0..3 {
                self.cells.side[a][0][i] = cell.0[a];
                self.cells.side[a][1][i] = -cell.0[a + 4];
            }
        }
        deep
    }
}
