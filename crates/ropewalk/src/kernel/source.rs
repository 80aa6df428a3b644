//! In which order rays enter a wave, and where in the tree.

#![allow(unsafe_code)]

use super::entry::Path;
use super::events::Events;
use super::level::Simd;
use crate::ray::Ray;
use crate::wide::WideTree;

/// Hands out the rays of a batch, each once.
pub trait Source {
    /// The next ray and the cell from which it is to be walked, `None` after the last one; rays of
    /// which it is known that they hit nothing are put to `miss` instead.
    ///
    /// # Safety
    /// The machine must have the features of `L`, and the caller must enable them; `tree` and
    /// `rays` must be those that the source was made for.
    unsafe fn next<L: Simd, E: Events>(
        &mut self,
        tree: &WideTree,
        rays: &[Ray],
        miss: impl FnMut(usize),
        events: &mut E,
    ) -> Option<(usize, u32)>;
}

/// Rays from the root.
pub struct FromRoot<'a> {
    /// Indices of the rays still to come.
    order: &'a [u32],
}

impl<'a> FromRoot<'a> {
    /// The rays with these indices, in this order.
    pub fn new(order: &'a [u32]) -> Self {
        FromRoot { order }
    }
}

impl Source for FromRoot<'_> {
    #[inline(always)]
    unsafe fn next<L: Simd, E: Events>(
        &mut self,
        tree: &WideTree,
        _rays: &[Ray],
        _miss: impl FnMut(usize),
        _events: &mut E,
    ) -> Option<(usize, u32)> {
        let (&index, rest) = self.order.split_first()?;
        self.order = rest;
        Some((index as usize, tree.root()))
    }
}

/// All rays in order, each from its entry, searched for from where the ray before was.
pub struct FromEntry {
    next: usize,
    path: Path,
}

impl FromEntry {
    /// From the first ray on; `path` belongs to the tree.
    pub fn new(path: Path) -> Self {
        FromEntry { next: 0, path }
    }
}

impl Source for FromEntry {
    #[inline(always)]
    unsafe fn next<L: Simd, E: Events>(
        &mut self,
        tree: &WideTree,
        rays: &[Ray],
        mut miss: impl FnMut(usize),
        events: &mut E,
    ) -> Option<(usize, u32)> {
        while let Some(ray) = rays.get(self.next) {
            let index = self.next;
            self.next += 1;
            // SAFETY: passed on to the caller.
            match unsafe { self.path.enter::<L, E>(tree, ray, events) } {
                Some(code) => return Some((index, code)),
                None => miss(index),
            }
        }
        None
    }
}
