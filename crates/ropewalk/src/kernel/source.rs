//! In which order rays enter a wave, and where in the tree.

#![allow(unsafe_code)]

use super::entry::Climb;
use super::entry_packet::{PACKET, Packets};
use super::events::Events;
use super::level::Simd;
use super::prefetch_line;
use super::query::BatchQuery;
use super::slot::Slot;
use super::vicinity::Vicinity;
use crate::point::Cell;
use crate::ray::Ray;
use crate::wide::{LINE, WideTree};

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

    /// A ray has been put into a slot with its cell alone on the stack, for a query that any hit ends: others may take
    /// its place there.
    ///
    /// # Safety
    /// As for [`Source::next`]; the slot must hold the ray `index`.
    #[inline(always)]
    unsafe fn enter<L: Simd, E: Events>(
        &mut self,
        _index: usize,
        _slot: &mut Slot,
        _tree: &WideTree,
        _events: &mut E,
    ) {
    }
}

/// Rays from the root.
pub struct FromRoot<'a> {
    rays: &'a [Ray],
    /// Indices of the rays still to come.
    order: &'a [u32],
    vicinity: Option<Vicinity>,
}

impl<'a> FromRoot<'a> {
    /// The rays with these indices, in this order.
    pub fn new(rays: &'a [Ray], order: &'a [u32]) -> Self {
        FromRoot { rays, order, vicinity: None }
    }

    /// Short ones that any hit ends may start from cells near them.
    pub fn with_vicinity(self, tree: &WideTree) -> Self {
        FromRoot { vicinity: Vicinity::new(tree), ..self }
    }

    /// How many rays started from such cells.
    pub fn near_rays(&self) -> u64 {
        self.vicinity.as_ref().map_or(0, Vicinity::near_rays)
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

    #[inline(always)]
    unsafe fn enter<L: Simd, E: Events>(
        &mut self,
        index: usize,
        slot: &mut Slot,
        tree: &WideTree,
        events: &mut E,
    ) {
        if let Some(vicinity) = &mut self.vicinity {
            // SAFETY: passed on to the caller.
            unsafe { vicinity.enter::<L, E>(tree, &self.rays[index], slot, events) };
        }
    }
}

/// Rays are asked for so many bytes ahead: a packet in empty space takes less time than its rays take to come.
const AHEAD: usize = 32 * LINE;

/// All rays in order, each from its entry.
pub struct FromEntry<'a> {
    rays: &'a [Ray],
    next: usize,
    search: Search<'a>,
    packet: Packet,
}

/// Rays of which it is known where they enter.
struct Packet {
    first: usize,
    /// Those not yet handed out.
    left: u32,
    entries: [u32; PACKET],
}

/// From where entries are searched for: one type, so that the wave is compiled for one.
pub enum Search<'a> {
    /// From where the rays before were.
    Path(Box<Packets>),
    /// From the cell that is given for each ray; rays beyond the end of these have none.
    Cells(&'a [Option<Cell>], Climb<'a>),
}

impl<'a> FromEntry<'a> {
    /// From the first ray on; what is searched belongs to the tree.
    pub fn new(rays: &'a [Ray], search: Search<'a>) -> Self {
        let packet = Packet { first: 0, left: 0, entries: [0; PACKET] };
        FromEntry { rays, next: 0, search, packet }
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
        loop {
            let Packet { first, left, entries } = &mut self.packet;
            if *left != 0 {
                let i = left.trailing_zeros() as usize % PACKET;
                *left &= *left - 1;
                return Some((*first + i, entries[i]));
            }
            let (index, rays) = (self.next, self.rays.get(self.next..)?);
            let ray = rays.first()?;
            // SAFETY: passed on to the caller.
            let entry = unsafe {
                match &mut self.search {
                    Search::Path(packets) => {
                        if packets.is_due() {
                            let ahead = rays.as_ptr().cast::<u8>().wrapping_add(AHEAD);
                            for line in 0..PACKET * size_of::<Ray>() / LINE {
                                prefetch_line(ahead.wrapping_add(line * LINE));
                            }
                            let rays = &rays[..rays.len().min(PACKET)];
                            *left = packets.enter_packet::<L, E>(tree, rays, entries, events);
                            *first = index;
                            self.next += rays.len();
                            // Those that may hit something are answered later on.
                            query.miss_all(index..self.next);
                            continue;
                        }
                        packets.enter_one::<L, E>(tree, ray, events)
                    }
                    Search::Cells(cells, climb) => {
                        let cell = cells.get(index).copied().flatten();
                        climb.enter::<L, E>(tree, ray, cell, events)
                    }
                }
            };
            self.next += 1;
            match entry {
                Some(code) => return Some((index, code)),
                None => query.miss(index),
            }
        }
    }
}
