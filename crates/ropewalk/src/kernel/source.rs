//! In which order rays enter a wave, and where in the tree.

#![allow(unsafe_code)]

use super::entry::{Climb, Path};
use super::events::Events;
use super::level::Simd;
use super::query::BatchQuery;
use crate::point::Cell;
use crate::ray::Ray;
use crate::wide::WideTree;

/// Hands out the rays of a batch, each once.
pub trait Source<Q: BatchQuery> {
    /// True if what becomes of a ray decides which one comes next: answers are not put off then.
    const WAITS: bool = false;

    /// The rays by their indices; those under way stay as they are.
    fn rays(&self) -> &[Ray];

    /// The next ray for the free slot `k` and the cell from which it is to be walked, `None` if there
    /// are no more for this slot; rays of which it is known that they hit nothing are put to
    /// [`BatchQuery::miss`] or to whoever asked instead.
    ///
    /// # Safety
    /// The machine must have the features of `L`, and the caller must enable them; `tree` must be that
    /// which the source was made for.
    unsafe fn next<L: Simd, E: Events>(
        &mut self,
        k: usize,
        tree: &WideTree,
        query: &mut Q,
        events: &mut E,
    ) -> Option<(usize, u32)>;
}

/// Rays from the root.
pub struct FromRoot<'a> {
    rays: &'a [Ray],
    /// Indices of the rays still to come.
    order: &'a [u32],
}

impl<'a> FromRoot<'a> {
    /// The rays with these indices, in this order.
    pub fn new(rays: &'a [Ray], order: &'a [u32]) -> Self {
        FromRoot { rays, order }
    }
}

impl<Q: BatchQuery> Source<Q> for FromRoot<'_> {
    #[inline(always)]
    fn rays(&self) -> &[Ray] {
        self.rays
    }

    #[inline(always)]
    unsafe fn next<L: Simd, E: Events>(
        &mut self,
        _k: usize,
        tree: &WideTree,
        _query: &mut Q,
        _events: &mut E,
    ) -> Option<(usize, u32)> {
        let (&index, rest) = self.order.split_first()?;
        self.order = rest;
        Some((index as usize, tree.root()))
    }
}

/// All rays in order, each from its entry.
pub struct FromEntry<'a> {
    rays: &'a [Ray],
    next: usize,
    search: Search<'a>,
}

/// From where entries are searched for: one type, so that the wave is compiled for one.
pub enum Search<'a> {
    /// From where the ray before was.
    Path(Box<Path>),
    /// From the cell that is given for each ray; rays beyond the end of these have none.
    Cells(&'a [Option<Cell>], Climb<'a>),
}

impl<'a> FromEntry<'a> {
    /// From the first ray on; what is searched belongs to the tree.
    pub fn new(rays: &'a [Ray], search: Search<'a>) -> Self {
        FromEntry { rays, next: 0, search }
    }

    /// How the rays went.
    pub fn into_search(self) -> Search<'a> {
        self.search
    }
}

impl<Q: BatchQuery> Source<Q> for FromEntry<'_> {
    #[inline(always)]
    fn rays(&self) -> &[Ray] {
        self.rays
    }

    #[inline(always)]
    unsafe fn next<L: Simd, E: Events>(
        &mut self,
        _k: usize,
        tree: &WideTree,
        query: &mut Q,
        events: &mut E,
    ) -> Option<(usize, u32)> {
        while let Some(ray) = self.rays.get(self.next) {
            let index = self.next;
            self.next += 1;
            // SAFETY: passed on to the caller.
            let entry = unsafe {
                match &mut self.search {
                    Search::Path(path) => path.enter::<L, E>(tree, ray, events),
                    Search::Cells(cells, climb) => {
                        let cell = cells.get(index).copied().flatten();
                        climb.enter::<L, E>(tree, ray, cell, events)
                    }
                }
            };
            match entry {
                Some(code) => return Some((index, code)),
                None => query.miss(index),
            }
        }
        None
    }
}
