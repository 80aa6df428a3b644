//! The batch calls: level and kernel picked once, work shared out over threads.

#![allow(unsafe_code)]

use super::beam::{self, Answers, BatchReport, BeamQuery, Walk, beams};
use super::entry::{Climb, Path};
use super::events::{BatchEvents, Events, NoEvents};
use super::exact::Exact;
use super::lanes::{Crowd, Lanes};
use super::leaf::Leaves;
use super::level::{Level, Root};
use super::query::{Any, BatchQuery, Closest, Count, Every, Filtered, HitFilter, NoFilter};
use super::scalar::Scalar;
use super::single::{single, with_slot};
use super::slot::Slot;
use super::sorted::{GROUP, SMALLEST, Sorter, Sorting};
use super::source::{FromCells, FromEntry, FromRoot, Source};
use super::wave::{WAVE, wave};
use crate::geometry::Geometry;
use crate::point::Cell;
use crate::point::cells::locate;
use crate::ray::{Hit, PreparedRay, Ray};
use crate::wide::WideTree;
use rayon::prelude::*;
use std::cell::Cell as Kept;

/// Rays that one task of a parallel batch traces.
pub(super) const TASK: usize = 4096;

/// One ray in so many is tried before a batch is started, [`MAX_SAMPLE`] at most.
const RAYS_PER_SAMPLE: usize = 256;

/// See [`RAYS_PER_SAMPLE`].
const MAX_SAMPLE: usize = 64;

/// The share of rays that the entry search must answer to be worth its time: measured, it loses at
/// .15 and .24 and wins at .47 and above.
const WORTHWHILE: f64 = 0.4;

/// Room for so many hits, eight bytes each, is kept by a thread between batches.
const KEPT_HITS: usize = 1 << 22;

/// The hits of a batch: one entry a ray.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BatchHit {
    /// Parameter of the hit; infinite for a miss.
    pub t: Vec<f32>,
    /// Primitive of the hit; `u32::MAX` for a miss.
    pub prim_id: Vec<u32>,
}

/// All hits of a batch in compressed rows: those of ray `i` are `offsets[i]..offsets[i + 1]`, in
/// order of `(t, prim_id)`, each once.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AllHits {
    /// Row starts; one more than there are rays.
    pub offsets: Vec<usize>,
    /// Parameters.
    pub t: Vec<f32>,
    /// Primitives.
    pub prim_id: Vec<u32>,
}

/// Where the rays of a batch start; it changes no answer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Start {
    /// At their entries if a sample of them says that this pays, else at the root.
    #[default]
    Automatic,
    /// At the root.
    Root,
    /// At the smallest treelet that holds all that they can hit, searched for from where the ray
    /// before was: for short rays that follow each other, such as the segments of a walk. Rays near
    /// which there is nothing end there.
    Entry,
}

/// Where the rays of a batch start, decided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Way {
    /// At the root.
    Root,
    /// At their entries, searched for one after the other.
    Entry,
    /// At their entries, searched for from the cells given.
    Cells,
}

/// Answers batches of rays over a wide tree.
#[derive(Clone, Copy)]
pub struct BatchCaster<'a, F = NoFilter> {
    tree: &'a WideTree,
    geometry: &'a Geometry,
    root: Root,
    level: Level,
    threads: usize,
    beams: bool,
    start: Start,
    sorting: Sorting,
    /// One a ray.
    cells: Option<&'a [Option<Cell>]>,
    filter: F,
}

impl<'a> BatchCaster<'a> {
    /// A caster at the best level of this machine, on all threads of the current rayon pool.
    pub fn new(tree: &'a WideTree, geometry: &'a Geometry) -> Self {
        BatchCaster {
            tree,
            geometry,
            root: Root::new(tree.bounds(), tree.root()),
            level: Level::best(),
            threads: 0,
            beams: true,
            start: Start::Automatic,
            sorting: Sorting::Automatic,
            cells: None,
            filter: NoFilter,
        }
    }
}

impl<'a, F: HitFilter> BatchCaster<'a, F> {
    /// The same with a filter that decides which hits count: a closure of the ray's index in the
    /// batch and the hit, or [`Masks`](super::Masks) or [`Opacity`](super::Opacity) from arrays. It
    /// runs inside the traversal; see [`HitFilter`] for what it may rely on.
    pub fn with_filter<G: HitFilter>(self, filter: G) -> BatchCaster<'a, G> {
        let BatchCaster { tree, geometry, root, level, threads, beams, start, .. } = self;
        let BatchCaster { sorting, cells, .. } = self;
        BatchCaster { tree, geometry, root, level, threads, beams, start, sorting, cells, filter }
    }

    /// The same with another level, or `None` if this machine lacks it.
    pub fn with_level(self, level: Level) -> Option<Self> {
        level.is_available().then_some(BatchCaster { level, ..self })
    }

    /// The same on the calling thread only (`1`) or on the current rayon pool (`0`).
    pub fn with_threads(self, threads: usize) -> Self {
        BatchCaster { threads, ..self }
    }

    /// The same with all rays in the wave (`false`), or with coherent ones in beams (`true`, the
    /// default). The answers are the same.
    pub fn with_beams(self, beams: bool) -> Self {
        BatchCaster { beams, ..self }
    }

    /// The same with rays started there.
    pub fn with_start(self, start: Start) -> Self {
        BatchCaster { start, ..self }
    }

    /// The same with a cell for each ray of the batch, from which its walk may start: that of its origin,
    /// say from [`BatchCaster::cells_at`] or [`PointQueries::locate`](crate::point::PointQueries::locate).
    /// It changes no answer: from a cell that a ray is not near to, or that is none of this tree, a walk
    /// starts higher up or at the root. Rays beyond the end of `cells` have none.
    ///
    /// Cells are used if the tree has its table ([`WideTree::link_up`]) and, unless [`Start::Entry`] is set,
    /// if a sample of the rays says that it pays.
    pub fn with_cells(self, cells: &'a [Option<Cell>]) -> Self {
        BatchCaster { cells: Some(cells), ..self }
    }

    /// The cells in which rays are at some parameters, as those of their hits; `None` outside of the
    /// tree's box, and for a miss.
    ///
    /// # Panics
    /// If there are not as many parameters as rays.
    pub fn cells_at(&self, rays: &[Ray], t: &[f32]) -> Vec<Option<Cell>> {
        assert!(t.len() == rays.len(), "one entry a ray");
        let cell = |(ray, t): (&Ray, &f32)| locate(self.tree, ray.at(*t));
        if self.is_serial(rays) {
            return rays.iter().zip(t).map(cell).collect();
        }
        rays.par_iter().zip(t).with_min_len(TASK).map(cell).collect()
    }

    /// The same with incoherent rays sorted by where they start, or not. The answers are the same.
    pub fn with_sorting(self, sorting: Sorting) -> Self {
        BatchCaster { sorting, ..self }
    }

    /// The level in use.
    pub fn level(&self) -> Level {
        self.level
    }

    /// The first hit of each ray.
    pub fn closest_hit(&self, rays: &[Ray]) -> BatchHit {
        let mut hit = BatchHit { t: vec![0.0; rays.len()], prim_id: vec![0; rays.len()] };
        self.closest_hit_into(rays, &mut hit.t, &mut hit.prim_id);
        hit
    }

    /// The first hit of each ray, into arrays of the same length as `rays`.
    ///
    /// # Panics
    /// If the lengths differ.
    pub fn closest_hit_into(
        &self,
        rays: &[Ray],
        t: &mut [f32],
        prim_id: &mut [u32],
    ) -> BatchReport {
        assert!(t.len() == rays.len() && prim_id.len() == rays.len(), "one entry a ray");
        if self.is_serial(rays) {
            return self.run_coherent(rays, 0, Closest::new(t, prim_id));
        }
        let task = self.task(rays);
        let chunks = t.par_chunks_mut(task).zip(prim_id.par_chunks_mut(task));
        let chunks = rays.par_chunks(task).zip(chunks).enumerate();
        let run = |(i, (rays, (t, prim)))| self.run_coherent(rays, i * task, Closest::new(t, prim));
        chunks.map(run).reduce(BatchReport::default, |a, b| a + b)
    }

    /// Whether each ray hits anything.
    pub fn occluded(&self, rays: &[Ray]) -> Vec<bool> {
        let mut hit = vec![false; rays.len()];
        self.occluded_into(rays, &mut hit);
        hit
    }

    /// Whether each ray hits anything, into an array of the same length as `rays`.
    ///
    /// # Panics
    /// If the lengths differ.
    pub fn occluded_into(&self, rays: &[Ray], hit: &mut [bool]) -> BatchReport {
        assert!(hit.len() == rays.len(), "one entry a ray");
        if self.is_serial(rays) {
            return self.run_coherent(rays, 0, Any { hit });
        }
        let task = self.task(rays);
        let chunks = rays.par_chunks(task).zip(hit.par_chunks_mut(task)).enumerate();
        let run = |(i, (rays, hit))| self.run_coherent(rays, i * task, Any { hit });
        chunks.map(run).reduce(BatchReport::default, |a, b| a + b)
    }

    /// The first hit of one ray, `None` for a miss: for rays that depend on each other, at a fraction of
    /// the cost of a batch of one. A filter sees ray 0. Rays that are there together are faster in a
    /// batch.
    pub fn closest_hit_one(&self, ray: &Ray) -> Option<Hit> {
        let leaves = self.leaves(ray);
        with_slot(|slot| {
            let query = Closest::one();
            if !self.run_one(&leaves, slot, query) || slot.best_id == u32::MAX {
                return None;
            }
            if slot.best_at != u32::MAX {
                return leaves.exact.hit(0, slot.best_at);
            }
            // Only its parameter is known.
            self.geometry.intersect(slot.best_id, &PreparedRay::new(ray)?)
        })
    }

    /// Whether one ray hits anything; see [`BatchCaster::closest_hit_one`].
    pub fn occluded_one(&self, ray: &Ray) -> bool {
        let leaves = self.leaves(ray);
        with_slot(|slot| {
            self.run_one(&leaves, slot, Any { hit: &mut [] }) && slot.best_id != u32::MAX
        })
    }

    /// The number of primitives that each ray hits.
    pub fn count_hits(&self, rays: &[Ray]) -> Vec<u32> {
        let mut counts = vec![0; rays.len()];
        if self.is_serial(rays) {
            self.run(rays, 0, Count::new(&mut counts, WAVE), |_| ());
            return counts;
        }
        let chunks = rays.par_chunks(TASK).zip(counts.par_chunks_mut(TASK));
        chunks.enumerate().for_each(|(i, (rays, counts))| {
            self.run(rays, i * TASK, Count::new(counts, WAVE), |_| ());
        });
        counts
    }

    /// All hits of each ray, in order, each once.
    pub fn all_hits(&self, rays: &[Ray]) -> AllHits {
        self.first_hits(rays, usize::MAX)
    }

    /// The same, written over what `all` holds: its memory is used again.
    pub fn all_hits_into(&self, rays: &[Ray], all: &mut AllHits) {
        self.first_hits_into(rays, usize::MAX, all);
    }

    /// The first `k` hits of each ray, in order, each once.
    pub fn first_hits(&self, rays: &[Ray], k: usize) -> AllHits {
        let mut all = AllHits::default();
        self.first_hits_into(rays, k, &mut all);
        all
    }

    /// The same, written over what `all` holds: its memory is used again.
    pub fn first_hits_into(&self, rays: &[Ray], k: usize, all: &mut AllHits) {
        all.offsets.clear();
        all.offsets.resize(rays.len() + 1, 0);
        all.t.clear();
        all.prim_id.clear();
        if k == 0 {
            return;
        }
        let gather = |(i, rays): (usize, &[Ray])| {
            let mut every = with_room(|room| std::mem::take(&mut room.every));
            every.start(k, rays.len(), WAVE);
            self.run(rays, i * TASK, every, |every| every)
        };
        let parts: Vec<Every> = if self.is_serial(rays) {
            vec![gather((0, rays))]
        } else {
            rays.par_chunks(TASK).enumerate().map(gather).collect()
        };
        let total = parts.iter().map(|part| part.len()).sum();
        all.t.resize(total, 0.0);
        all.prim_id.resize(total, 0);
        let (mut offset, mut ends) = (0, &mut all.offsets[1..]);
        let (mut t, mut prim) = (&mut all.t[..], &mut all.prim_id[..]);
        let rows = parts.into_iter().map(|part| {
            let start = offset;
            offset += part.len();
            let rows = (
                split(&mut ends, part.rays()),
                split(&mut t, part.len()),
                split(&mut prim, part.len()),
            );
            (part, start, rows)
        });
        let copy = |(part, offset, (ends, t, prim)): (Every, usize, Rows<'_>)| {
            part.copy(offset, ends, t, prim);
            if part.room() <= KEPT_HITS {
                with_room(|room| room.every = part);
            }
        };
        if self.is_serial(rays) {
            rows.for_each(copy);
        } else {
            rows.collect::<Vec<_>>().into_par_iter().for_each(copy);
        }
    }

    /// What the batch of [`BatchCaster::closest_hit`] does, counted, on one thread.
    pub fn closest_hit_events(&self, rays: &[Ray]) -> BatchEvents {
        let (mut t, mut prim) = (vec![0.0; rays.len()], vec![0; rays.len()]);
        let mut events = BatchEvents::default();
        self.run_counted(rays, &mut Closest::new(&mut t, &mut prim), &mut events);
        events
    }

    /// What the batch of [`BatchCaster::occluded`] does, counted, on one thread.
    pub fn occluded_events(&self, rays: &[Ray]) -> BatchEvents {
        let (mut hit, mut events) = (vec![false; rays.len()], BatchEvents::default());
        self.run_counted(rays, &mut Any { hit: &mut hit }, &mut events);
        events
    }

    /// What the batch of [`BatchCaster::all_hits`] does, counted, on one thread.
    pub fn all_hits_events(&self, rays: &[Ray]) -> BatchEvents {
        let mut events = BatchEvents::default();
        let mut every = Every::default();
        every.start(usize::MAX, rays.len(), WAVE);
        self.run_counted(rays, &mut every, &mut events);
        events
    }

    /// What the batch of [`BatchCaster::closest_hit_one`] does, counted.
    pub fn closest_hit_one_events(&self, ray: &Ray) -> BatchEvents {
        let (leaves, mut events) = (self.leaves(ray), BatchEvents::default());
        let query = Closest::one();
        with_slot(|slot| self.run_one_counted(&leaves, slot, query, &mut events));
        events
    }

    fn leaves<'r>(&self, ray: &'r Ray) -> Leaves<'r>
    where
        'a: 'r,
    {
        let exact = Exact { lines: self.tree.lines(), rays: std::slice::from_ref(ray) };
        Leaves { tree: self.tree, geometry: self.geometry, exact }
    }

    fn is_serial(&self, rays: &[Ray]) -> bool {
        self.threads == 1 || rays.len() <= TASK
    }

    /// Coherent rays in beams, the others in the wave.
    fn run_coherent<Q: BeamQuery>(&self, rays: &[Ray], first_ray: usize, query: Q) -> BatchReport {
        let way = self.way(rays, first_ray);
        if way != Way::Root || F::FILTERS || !self.beams || self.tree.has_shapes() {
            let mut filtered = Filtered { query, filter: &self.filter, first_ray };
            return self.run_wave(rays, way, first_ray, &mut filtered, &mut NoEvents);
        }
        let mut query = query;
        with_room(|room| {
            room.order.clear();
            let (order, room_for_beams) = (&mut room.order, &mut *room.beam);
            let (tree, query) = (self.tree, &mut query);
            let report = match self.level {
                // SAFETY: portable code.
                Level::Scalar => unsafe {
                    beams::<super::scalar::Scalar, Q>(tree, rays, query, room_for_beams, order)
                },
                // SAFETY: `with_level` and `Level::best` give only levels this machine has.
                #[cfg(target_arch = "x86_64")]
                Level::Avx2 => unsafe { beams_avx2(tree, rays, query, room_for_beams, order) },
                // SAFETY: as above.
                #[cfg(target_arch = "x86_64")]
                Level::Avx512 => unsafe { beams_avx512(tree, rays, query, room_for_beams, order) },
                #[cfg(not(target_arch = "x86_64"))]
                _ => unreachable!("only available levels can be chosen"),
            };
            let wave_rays = room.order.len() as u64;
            if self.sorts(rays, &room.order) {
                let Room { order, all, slots, sorter, answers, .. } = room;
                for order in order.chunks(GROUP) {
                    sorter.sort(self.tree.bounds(), rays, order);
                    all.extend(all.len() as u32..order.len() as u32);
                    let order = &all[..order.len()];
                    let walk = Moved { caster: self, rays: &sorter.rays, order, slots };
                    query.ask_moved(&sorter.stood, answers, walk);
                }
                return BatchReport { wave_rays, sorted_rays: wave_rays, ..report };
            }
            let width = room.order.len().min(WAVE);
            let (slots, source) = (&mut room.slots[..width], &mut FromRoot::new(rays, &room.order));
            self.wave::<Q, _, _, false>(slots, query, source, &mut NoEvents);
            BatchReport { wave_rays, ..report }
        })
    }

    /// Rays of a task: few, for balance, or as many as are worth sorting.
    fn task(&self, rays: &[Ray]) -> usize {
        let sorts = self.sorting == Sorting::Automatic && self.tree.bytes() >= SMALLEST;
        let share = rays.len() / (4 * rayon::current_num_threads());
        if sorts { share.clamp(TASK, GROUP) } else { TASK }
    }

    /// True if the rays left to the wave are to be sorted.
    fn sorts(&self, rays: &[Ray], order: &[u32]) -> bool {
        match self.sorting {
            Sorting::Always => true,
            Sorting::Never => false,
            Sorting::Automatic => Sorter::pays(self.tree.bounds(), self.tree.bytes(), rays, order),
        }
    }

    /// Puts `rays`, the first of which is `first_ray` in the batch, to `query` in the wave.
    fn run<Q: BatchQuery, T>(
        &self,
        rays: &[Ray],
        first_ray: usize,
        query: Q,
        answer: impl FnOnce(Q) -> T,
    ) -> T {
        let mut filtered = Filtered { query, filter: &self.filter, first_ray };
        let way = self.way(rays, first_ray);
        self.run_wave(rays, way, first_ray, &mut filtered, &mut NoEvents);
        answer(filtered.query)
    }

    /// Puts one ray to `query`; see [`single`].
    fn run_one<Q: BatchQuery>(&self, leaves: &Leaves<'_>, slot: &mut Slot, query: Q) -> bool {
        self.run_one_counted(leaves, slot, query, &mut NoEvents)
    }

    fn run_one_counted<Q: BatchQuery, E: Events>(
        &self,
        leaves: &Leaves<'_>,
        slot: &mut Slot,
        query: Q,
        events: &mut E,
    ) -> bool {
        let query = &mut Filtered { query, filter: &self.filter, first_ray: 0 };
        if self.tree.has_shapes() {
            self.one::<_, E, true>(leaves, slot, query, events)
        } else {
            self.one::<_, E, false>(leaves, slot, query, events)
        }
    }

    /// One ray at the level in use.
    fn one<Q: BatchQuery, E: Events, const SHAPES: bool>(
        &self,
        leaves: &Leaves<'_>,
        slot: &mut Slot,
        query: &mut Q,
        events: &mut E,
    ) -> bool {
        let root = &self.root;
        match self.level {
            // SAFETY: portable code.
            Level::Scalar => unsafe {
                single::<Scalar, Q, E, SHAPES>(leaves, root, slot, query, events)
            },
            // SAFETY: `with_level` and `Level::best` give only levels this machine has.
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => unsafe {
                single_avx2::<Q, E, SHAPES>(leaves, root, slot, query, events)
            },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => unsafe {
                single_avx512::<Q, E, SHAPES>(leaves, root, slot, query, events)
            },
            #[cfg(not(target_arch = "x86_64"))]
            _ => unreachable!("only available levels can be chosen"),
        }
    }

    fn run_counted<Q: BatchQuery, E: Events>(&self, rays: &[Ray], query: &mut Q, events: &mut E) {
        self.run_wave(rays, self.way(rays, 0), 0, query, events);
    }

    /// All rays in the wave, the first of which is `first_ray` in the batch.
    pub(super) fn run_wave<Q: BatchQuery, E: Events>(
        &self,
        rays: &[Ray],
        way: Way,
        first_ray: usize,
        query: &mut Q,
        events: &mut E,
    ) -> BatchReport {
        let report = BatchReport { wave_rays: rays.len() as u64, ..BatchReport::default() };
        with_room(|room| {
            let width = rays.len().min(WAVE);
            let slots = &mut room.slots[..width];
            if way == Way::Cells
                && let Some(climb) = Climb::new(self.tree)
            {
                let mut source = FromCells::new(rays, self.cells_from(first_ray), climb);
                self.run_source(slots, query, &mut source, events);
                let Climb { started, climbed, .. } = source.into_climb();
                return BatchReport { cell_rays: started, climbed_rays: climbed, ..report };
            }
            if way == Way::Entry
                && let Some(path) = Path::new(self.tree)
            {
                let mut source = FromEntry::new(rays, path);
                self.run_source(slots, query, &mut source, events);
                return BatchReport { entry_rays: report.wave_rays, ..report };
            }
            room.order.clear();
            room.order.extend(0..rays.len() as u32);
            let mut source = FromRoot::new(rays, &room.order);
            self.run_source(slots, query, &mut source, events);
            report
        })
    }

    /// The cells of the rays from `first_ray` on.
    fn cells_from(&self, first_ray: usize) -> &'a [Option<Cell>] {
        self.cells.and_then(|cells| cells.get(first_ray..)).unwrap_or(&[])
    }

    /// All particles of some lanes, until each has come to its end; `query` is that of the lanes.
    pub(crate) fn run_lanes<Q: BatchQuery, C: Crowd<Q>>(
        &self,
        width: usize,
        query: &mut Q,
        lanes: &mut Lanes<C>,
    ) {
        with_room(|room| self.run_source(&mut room.slots[..width], query, lanes, &mut NoEvents));
    }

    /// The tree.
    pub(crate) fn tree(&self) -> &'a WideTree {
        self.tree
    }

    /// See [`BatchCaster::with_threads`].
    pub(crate) fn threads(&self) -> usize {
        self.threads
    }

    fn run_source<Q: BatchQuery, S: Source<Q>, E: Events>(
        &self,
        slots: &mut [Slot],
        query: &mut Q,
        source: &mut S,
        events: &mut E,
    ) {
        if self.tree.has_shapes() {
            self.wave::<Q, S, E, true>(slots, query, source, events);
        } else {
            self.wave::<Q, S, E, false>(slots, query, source, events);
        }
    }

    /// Where the rays are to start, the first of which is `first_ray` in the batch.
    ///
    /// Searching for entries, from cells or from where the ray before was, pays where it answers many rays
    /// by itself, so some of them are tried.
    fn way(&self, rays: &[Ray], first_ray: usize) -> Way {
        let cells = self.cells_from(first_ray);
        let climb = if cells.is_empty() { None } else { Climb::new(self.tree) };
        let way = if climb.is_some() { Way::Cells } else { Way::Entry };
        match self.start {
            Start::Root => return Way::Root,
            Start::Entry => return way,
            Start::Automatic => {}
        }
        let sample = (rays.len() / RAYS_PER_SAMPLE).min(MAX_SAMPLE);
        if sample == 0 {
            return if climb.is_some() { way } else { Way::Root };
        }
        let tried = || (0..rays.len()).step_by(rays.len() / sample).take(sample);
        let finite = |i: &usize| rays[*i].t_max < f32::INFINITY;
        let skipped = if let Some(mut climb) = climb {
            let ends = |i: &usize| {
                let cell = cells.get(*i).copied().flatten();
                // SAFETY: portable code; the table is that of the tree.
                let code =
                    unsafe { climb.enter::<Scalar, _>(self.tree, &rays[*i], cell, &mut NoEvents) };
                code.is_none()
            };
            tried().filter(finite).filter(ends).count()
        } else {
            let Some(mut path) = Path::new(self.tree) else { return Way::Root };
            let ends = |i: &usize| {
                // SAFETY: portable code; the path is that of the tree.
                let code = unsafe { path.enter::<Scalar, _>(self.tree, &rays[*i], &mut NoEvents) };
                code.is_none()
            };
            tried().filter(finite).filter(ends).count()
        };
        if skipped as f64 >= WORTHWHILE * sample as f64 { way } else { Way::Root }
    }

    /// The rays of `source` in the wave.
    fn wave<Q: BatchQuery, S: Source<Q>, E: Events, const SHAPES: bool>(
        &self,
        slots: &mut [Slot],
        query: &mut Q,
        source: &mut S,
        events: &mut E,
    ) {
        let (tree, geometry) = (self.tree, self.geometry);
        match self.level {
            // SAFETY: portable code.
            Level::Scalar => unsafe {
                wave::<super::scalar::Scalar, Q, S, E, SHAPES>(
                    tree, geometry, slots, query, source, events,
                );
            },
            // SAFETY: `with_level` and `Level::best` give only levels this machine has.
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => unsafe {
                wave_avx2::<Q, S, E, SHAPES>(tree, geometry, slots, query, source, events);
            },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => unsafe {
                wave_avx512::<Q, S, E, SHAPES>(tree, geometry, slots, query, source, events);
            },
            #[cfg(not(target_arch = "x86_64"))]
            _ => unreachable!("only available levels can be chosen"),
        }
    }
}

/// Ends, parameters and primitives of the rows of some rays.
type Rows<'a> = (&'a mut [usize], &'a mut [f32], &'a mut [u32]);

/// Splits `n` entries off the front.
fn split<'a, T>(row: &mut &'a mut [T], n: usize) -> &'a mut [T] {
    row.split_off_mut(..n).expect("rows are as long as their parts together")
}

/// What a thread keeps between batches.
struct Room {
    slots: Vec<Slot>,
    beam: Box<beam::Room>,
    order: Vec<u32>,
    every: Every,
    sorter: Sorter,
    answers: Answers,
    /// 0, 1, 2 and so on, as far as it was needed.
    all: Vec<u32>,
}

/// Rays that have been moved, to be walked in their new order.
struct Moved<'a, 'c, F> {
    caster: &'a BatchCaster<'c, F>,
    rays: &'a [Ray],
    /// All indices of `rays`, ascending.
    order: &'a [u32],
    slots: &'a mut [Slot],
}

impl<F: HitFilter> Walk for Moved<'_, '_, F> {
    fn walk<Q: BatchQuery>(self, query: &mut Q) {
        let slots = &mut self.slots[..self.rays.len().min(WAVE)];
        let source = &mut FromRoot::new(self.rays, self.order);
        self.caster.wave::<Q, _, _, false>(slots, query, source, &mut NoEvents);
    }
}

/// Works in the room of the calling thread, or in another one where that is taken: filters and particles may
/// put batches themselves.
fn with_room<T>(work: impl FnOnce(&mut Room) -> T) -> T {
    thread_local! {
        static ROOM: Kept<Option<Box<Room>>> = const { Kept::new(None) };
    }
    let mut room = ROOM.take().unwrap_or_else(|| {
        Box::new(Room {
            slots: (0..WAVE).map(|_| Slot::new()).collect(),
            beam: Box::new(beam::Room::new()),
            order: Vec::new(),
            every: Every::default(),
            sorter: Sorter::default(),
            answers: Answers::default(),
            all: Vec::new(),
        })
    });
    let answer = work(&mut room);
    ROOM.set(Some(room));
    answer
}

macro_rules! instantiate {
    ($wave:ident, $beams:ident, $single:ident, $level:ty, $features:literal) => {
        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = $features)]
        fn $wave<Q: BatchQuery, S: Source<Q>, E: Events, const SHAPES: bool>(
            tree: &WideTree,
            geometry: &Geometry,
            slots: &mut [Slot],
            query: &mut Q,
            source: &mut S,
            events: &mut E,
        ) {
            // SAFETY: this function enables the level's features.
            unsafe { wave::<$level, Q, S, E, SHAPES>(tree, geometry, slots, query, source, events) }
        }

        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = $features)]
        fn $beams<Q: BeamQuery>(
            tree: &WideTree,
            rays: &[Ray],
            query: &mut Q,
            room: &mut beam::Room,
            left: &mut Vec<u32>,
        ) -> BatchReport {
            // SAFETY: this function enables the level's features.
            unsafe { beams::<$level, Q>(tree, rays, query, room, left) }
        }

        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = $features)]
        fn $single<Q: BatchQuery, E: Events, const SHAPES: bool>(
            leaves: &Leaves<'_>,
            root: &Root,
            slot: &mut Slot,
            query: &mut Q,
            events: &mut E,
        ) -> bool {
            // SAFETY: this function enables the level's features; the caller's root is the tree's.
            unsafe { single::<$level, Q, E, SHAPES>(leaves, root, slot, query, events) }
        }
    };
}
instantiate!(
    wave_avx2,
    beams_avx2,
    single_avx2,
    super::avx2::Avx2,
    "avx2,fma,bmi1,bmi2,popcnt,lzcnt"
);
instantiate!(
    wave_avx512,
    beams_avx512,
    single_avx512,
    super::avx512::Avx512,
    "avx2,fma,bmi1,bmi2,popcnt,lzcnt,avx512f,avx512vl,avx512bw,avx512dq"
);
