//! One ray by itself: what the wave does, without lists.
//!
//! ```text
//! repeat
//!     step until a leaf is on top of the stack
//!     test its blocks
//!     take it off the stack
//! until nothing is left that matters
//! ```
//! A lone ray waits for its own steps, so what counts here is what comes after what, not how much is
//! done: blocks hold no hit more often than not, and while the processor guesses so, it goes on.

#![allow(unsafe_code)]

use super::events::Events;
use super::extreme;
use super::leaf::Leaves;
use super::level::{Root, Simd};
use super::query::BatchQuery;
use super::slot::{Loaded, Slot};
use crate::wide::{BLOCK_LINES, LEAF, Treelet, code_line, code_offset};
use std::cell::{Cell, UnsafeCell};

/// Puts ray 0 to `query` in `slot`, whose state then holds the answer; false if the ray cannot hit
/// anything, so that the state means nothing.
///
/// # Safety
/// The machine must have the features of `L`, and the caller must enable them: everything here is
/// inlined into it. `root` must be that of the tree.
#[inline(always)]
pub unsafe fn single<L: Simd, Q: BatchQuery, E: Events, const SHAPES: bool>(
    leaves: &Leaves<'_>,
    root: &Root,
    slot: &mut Slot,
    query: &mut Q,
    events: &mut E,
) -> bool {
    if root.code == 0 {
        return false;
    }
    let (tree, ray) = (leaves.tree, &leaves.exact.rays[0]);
    // SAFETY: passed on to the caller.
    match unsafe { L::load(slot, ray, 0, root) } {
        Loaded::Ready => events.rays(1),
        Loaded::Misses => return false,
        Loaded::Extreme => {
            extreme::walk(tree, leaves.geometry, &leaves.exact, (0, slot), query);
            return true;
        }
    }
    let lines = tree.lines().as_ptr();
    loop {
        // SAFETY: the stack holds codes of the tree, and its pointer stays on it.
        let code = unsafe {
            let mut sp = slot.sp as usize;
            let mut code = *slot.code.get_unchecked(sp);
            while code & LEAF == 0 {
                events.step();
                let treelet = &*lines.add(code_offset(code)).cast::<Treelet>();
                // All that may come next, as long as the step still computes what does.
                for child in treelet.child {
                    L::prefetch(lines.wrapping_add(code_offset(child)));
                }
                sp = L::step(slot, treelet, sp);
                code = *slot.code.get_unchecked(sp);
            }
            slot.sp = sp as u32;
            code
        };
        let (first, count) = (code_line(code), tree.block_count(code) as usize);
        if count > 0 {
            events.leaf();
        }
        let mut line = first;
        for _ in 0..count {
            events.block();
            // SAFETY: the codes of a tree lead to its blocks; the rest passed on to the caller.
            unsafe {
                let lanes = leaves.meet::<L, Q, SHAPES>(slot, line);
                if lanes != 0 {
                    let (open, _) =
                        leaves.test::<L, Q, E, SHAPES>((0, &mut *slot), line, lanes, query, events);
                    if open != 0 {
                        leaves.decide((0, &mut *slot), line, open, query);
                    }
                }
            }
            line += BLOCK_LINES;
        }
        if slot.pop(Q::ANY) {
            return true;
        }
    }
}

/// A slot that is lent out once at a time.
struct Kept {
    lent: Cell<bool>,
    slot: UnsafeCell<Slot>,
}

/// Takes the slot back, also if the work panics.
struct Loan<'a>(&'a Cell<bool>);

impl Drop for Loan<'_> {
    fn drop(&mut self) {
        self.0.set(false);
    }
}

/// Lends out the slot that a thread keeps; a filter that casts rays itself gets a new one.
#[inline(always)]
pub fn with_slot<T>(work: impl FnOnce(&mut Slot) -> T) -> T {
    thread_local! {
        static KEPT: Kept =
            const { Kept { lent: Cell::new(false), slot: UnsafeCell::new(Slot::new()) } };
    }
    // Only the address is taken in the closure, so that the work is not called through it.
    // SAFETY: what a thread keeps without a destructor is there until the thread ends.
    let kept = unsafe { &*KEPT.with(std::ptr::from_ref) };
    if kept.lent.replace(true) {
        return work(&mut Slot::new());
    }
    let _loan = Loan(&kept.lent);
    // SAFETY: it is lent to nobody else: only this thread sees it, and the mark was not set.
    work(unsafe { &mut *kept.slot.get() })
}
