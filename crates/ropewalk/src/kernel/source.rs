//! In which order rays enter a wave, and where in the tree.

#![allow(unsafe_code)]

use super::entry::Climb;
use super::entry_packet::{PACKET, Packets};
use super::events::Events;
use super::level::{Root, Simd};
use super::prefetch_line;
use super::query::BatchQuery;
use super::slot::Slot;
use super::vicinity::Vicinity;
use crate::point::Cell;
use crate::ray::Ray;
use crate::wide::{LINE, WIDTH, WideTree};

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

/// So many rays are looked at ahead of their turn.
const AHEAD_RAYS: usize = 64;

/// Looking ahead pays where it leaves out at least one ray of so many; if it does not, it is tried again after
/// [`RESTS`] times as many rays.
const PAYING: usize = 8;

/// See [`PAYING`].
const RESTS: u32 = 15;

/// Rays from the root. Those that pass the scene's box by are left out eight at a time, as long as that pays: which of
/// them do cannot be predicted, and putting one into a slot takes as long as a step.
pub struct FromRoot<'a> {
    rays: &'a [Ray],
    /// Indices of the rays still to come.
    order: &'a [u32],
    root: Root,
    /// Indices of the rays that come next: `next..len` are left.
    ready: [u32; AHEAD_RAYS],
    next: usize,
    len: usize,
    /// So many times the next rays are taken without a look.
    rests: u32,
    vicinity: Option<Vicinity>,
}

impl<'a> FromRoot<'a> {
    /// The rays with these indices, in this order.
    pub fn new(tree: &WideTree, rays: &'a [Ray], order: &'a [u32]) -> Self {
        let root = Root::new(tree.bounds(), tree.root());
        let ready = [0; AHEAD_RAYS];
        FromRoot { rays, order, root, ready, next: 0, len: 0, rests: 0, vicinity: None }
    }

    /// Gets the next rays ready.
    ///
    /// # Safety
    /// As for [`Source::next`].
    #[inline(always)]
    unsafe fn look_ahead<L: Simd, Q: BatchQuery>(&mut self, query: &mut Q) {
        let (order, rest) = self.order.split_at(self.order.len().min(AHEAD_RAYS));
        (self.order, self.next, self.len) = (rest, 0, 0);
        if self.rests > 0 {
            self.rests -= 1;
            self.len = order.len();
            self.ready[..order.len()].copy_from_slice(order);
            return;
        }
        let mut index = [0; WIDTH];
        for eight in order.chunks(WIDTH) {
            // The rest is left from before, or the first ray: looked at in vain.
            index[..eight.len()].copy_from_slice(eight);
            // SAFETY: passed on to the caller.
            let misses = unsafe { L::miss_box(self.rays, &index, &self.root) };
            for (lane, &index) in eight.iter().enumerate() {
                self.ready[self.len % AHEAD_RAYS] = index;
                self.len += 1 - (misses >> lane & 1) as usize;
                // Without a branch: those that are not left out are answered later on.
                query.miss(index as usize);
            }
        }
        if (order.len() - self.len) * PAYING < order.len() {
            self.rests = RESTS;
        }
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
        _tree: &WideTree,
        query: &mut Q,
        _events: &mut E,
    ) -> Option<(usize, u32)> {
        while self.next == self.len {
            if self.order.is_empty() {
                return None;
            }
            // SAFETY: passed on to the caller.
            unsafe { self.look_ahead::<L, Q>(query) };
        }
        let index = self.ready[self.next % AHEAD_RAYS];
        self.next += 1;
        Some((index as usize, self.root.code))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::aabb::Aabb;
    use crate::kernel::level::Level;
    use crate::kernel::random::Random;
    use crate::kernel::slot::Loaded;

    /// Rays about a box, every seventh of them odd.
    fn rays(random: &mut Random) -> Vec<Ray> {
        let odd = [0.0, -0.0, f32::NAN, f32::INFINITY, 1e13, -1e13, 1e-13, 1e-40, f32::MAX, 1.0];
        let mut draw = |i: usize, scale: f32| {
            let pick = (random.signed().abs() * odd.len() as f32) as usize % odd.len();
            if i.is_multiple_of(7) && random.signed() > 0.3 {
                odd[pick]
            } else {
                random.signed() * scale
            }
        };
        (0..8 * 2000)
            .map(|i| {
                let (origin, dir) = ([0; 3].map(|_| draw(i, 3.0)), [0; 3].map(|_| draw(i, 1.0)));
                let (t_min, t_max) = (draw(i, 1.0), 1.0 + draw(i, 6.0));
                let t_max = if i % 3 == 0 { f32::INFINITY } else { t_max };
                Ray::new(origin, dir).with_range(t_min, t_max)
            })
            .collect()
    }

    /// # Safety
    /// The machine must have the features of `L`.
    unsafe fn check<L: Simd>(all: bool) {
        let mut random = Random(9);
        let bounds = Aabb { min: [-1.0, -0.5, -1.5], max: [1.0, 0.75, 0.0] };
        let (root, rays) = (Root::new(&bounds, 16), rays(&mut random));
        let mut slot = Slot::new();
        let (mut left_out, mut met) = (0, 0);
        for first in (0..rays.len() as u32).step_by(WIDTH) {
            let index = std::array::from_fn(|lane| (first + 5 * lane as u32) % rays.len() as u32);
            // SAFETY: passed on to the caller.
            let misses = unsafe { L::miss_box(&rays, &index, &root) };
            for (lane, &i) in index.iter().enumerate() {
                let ray = &rays[i as usize];
                // SAFETY: as above.
                let loaded = unsafe { L::load(&mut slot, ray, i, &root) };
                let misses = misses >> lane & 1 == 1;
                assert!(!misses || loaded == Loaded::Misses, "{ray:?} {loaded:?}");
                // Odd ones may be looked at for nothing.
                if all && i % 7 != 0 && ray.t_min <= ray.t_max {
                    assert_eq!(misses, loaded == Loaded::Misses, "{ray:?}");
                }
                left_out += u32::from(misses);
                met += u32::from(loaded == Loaded::Ready);
            }
        }
        assert!(met > 500 && (!all || left_out > 5000), "{met} {left_out}");
    }

    #[test]
    fn rays_that_are_left_out_miss_the_box() {
        for level in Level::ALL.into_iter().filter(|level| level.is_available()) {
            // SAFETY: the level is available.
            unsafe {
                match level {
                    Level::Scalar => check::<crate::kernel::scalar::Scalar>(false),
                    #[cfg(target_arch = "x86_64")]
                    Level::Avx2 => check::<crate::kernel::avx2::Avx2>(true),
                    #[cfg(target_arch = "x86_64")]
                    Level::Avx512 => check::<crate::kernel::avx512::Avx512>(true),
                    #[cfg(not(target_arch = "x86_64"))]
                    _ => {}
                }
            }
        }
    }
}
