//! The batch calls, whatever the type of the filter: kernel and level picked, work shared out over threads.
//!
//! Nothing that a user brings along makes another type here, so the kernels are compiled once, in this crate, and not
//! anew in each crate that casts rays. The exception is [`Engine::run_lanes`].

#![allow(unsafe_code)]

use super::batch::{AllHits, Start};
use super::beam::{BatchReport, BeamQuery, Walk};
use super::entry::{Climb, Path};
use super::entry_packet::Packets;
use super::events::{BatchEvents, Events, NoEvents};
use super::exact::Exact;
use super::launch::{run_beams, run_single, run_wave};
use super::leaf::Leaves;
use super::level::{Level, Root};
use super::query::{Accepts, Any, BatchQuery, Closest, Count, Every, Filtered};
use super::room::{Room, with_room};
use super::scalar::Scalar;
use super::scanlines::{Scanlines, Tiles};
use super::single::with_slot;
use super::slot::Slot;
use super::sorted::{GROUP, SMALLEST, Sorter, Sorting};
use super::source::{FromEntry, FromRoot, Search, Source};
use super::wave::WAVE;
use super::width::wave_width;
use crate::geometry::Geometry;
use crate::point::Cell;
use crate::point::cells::locate;
use crate::ray::{Hit, PreparedRay, Ray};
use crate::touch;
use crate::wide::WideTree;
use rayon::prelude::*;
use std::ops::Range;

/// Rays that one task of a parallel batch traces.
pub const TASK: usize = 4096;

/// One ray in so many is tried before a batch is started, [`MAX_SAMPLE`] at most.
const RAYS_PER_SAMPLE: usize = 256;

/// See [`RAYS_PER_SAMPLE`].
const MAX_SAMPLE: usize = 64;

/// The share of rays that the entry search must answer to be worth its time: measured, it loses at
/// .15 and .24 and wins at .47 and above.
const WORTHWHILE: f64 = 0.4;

/// Room for so many hits, eight bytes each, is kept by a thread between batches.
const KEPT_HITS: usize = 1 << 22;

/// Where the rays of a batch start, decided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// At the root.
    Root,
    /// At their entries, searched for one after the other.
    Entry,
    /// At their entries, searched for from the cells given.
    Cells,
}

/// How batches are answered; the public calls are those of [`BatchCaster`](super::BatchCaster).
#[derive(Clone, Copy)]
pub struct Engine<'a> {
    pub tree: &'a WideTree,
    pub geometry: &'a Geometry,
    pub root: Root,
    pub level: Level,
    pub threads: usize,
    pub beams: bool,
    pub start: Start,
    pub sorting: Sorting,
    /// One a ray.
    pub cells: Option<&'a [Option<Cell>]>,
    /// Decides which hits count, if that is wanted.
    pub filter: Option<&'a dyn Accepts>,
}

impl<'a> Engine<'a> {
    pub fn new(tree: &'a WideTree, geometry: &'a Geometry) -> Self {
        Engine {
            tree,
            geometry,
            root: Root::new(tree.bounds(), tree.root()),
            level: Level::best(),
            threads: 0,
            beams: true,
            start: Start::Automatic,
            sorting: Sorting::Automatic,
            cells: None,
            filter: None,
        }
    }

    pub fn cells_at(&self, rays: &[Ray], t: &[f32]) -> Vec<Option<Cell>> {
        let cell = |(ray, t): (&Ray, &f32)| locate(self.tree, ray.at(*t));
        if self.is_serial(rays) {
            return rays.iter().zip(t).map(cell).collect();
        }
        rays.par_iter().zip(t).with_min_len(TASK).map(cell).collect()
    }

    pub fn closest_hit_into(
        &self,
        rays: &[Ray],
        t: &mut [f32],
        prim_id: &mut [u32],
    ) -> BatchReport {
        if self.is_serial(rays) {
            return self.run_coherent(rays, 0, Closest::new(t, prim_id));
        }
        let task = self.task(rays);
        let chunks = t.par_chunks_mut(task).zip(prim_id.par_chunks_mut(task));
        let chunks = rays.par_chunks(task).zip(chunks).enumerate();
        let run = |(i, (rays, (t, prim)))| self.run_coherent(rays, i * task, Closest::new(t, prim));
        chunks.map(run).reduce(BatchReport::default, |a, b| a + b)
    }

    pub fn occluded_into(&self, rays: &[Ray], hit: &mut [bool]) -> BatchReport {
        if self.is_serial(rays) {
            return self.run_coherent(rays, 0, Any { hit });
        }
        let task = self.task(rays);
        let chunks = rays.par_chunks(task).zip(hit.par_chunks_mut(task)).enumerate();
        let run = |(i, (rays, hit))| self.run_coherent(rays, i * task, Any { hit });
        chunks.map(run).reduce(BatchReport::default, |a, b| a + b)
    }

    pub fn closest_hit_one(&self, ray: &Ray) -> Option<Hit> {
        let leaves = self.leaves(ray);
        with_slot(|slot| {
            if !self.run_one(&leaves, slot, Closest::one(), &mut NoEvents)
                || slot.best_id == u32::MAX
            {
                return None;
            }
            if slot.best_at != u32::MAX {
                return leaves.exact.hit(0, slot.best_at);
            }
            // Only its parameter is known.
            self.geometry.intersect(slot.best_id, &PreparedRay::new(ray)?)
        })
    }

    pub fn occluded_one(&self, ray: &Ray) -> bool {
        let leaves = self.leaves(ray);
        with_slot(|slot| {
            self.run_one(&leaves, slot, Any { hit: &mut [] }, &mut NoEvents)
                && slot.best_id != u32::MAX
        })
    }

    pub fn count_hits(&self, rays: &[Ray]) -> Vec<u32> {
        let mut counts = vec![0; rays.len()];
        if self.is_serial(rays) {
            self.count(rays, 0, &mut counts);
            return counts;
        }
        let chunks = rays.par_chunks(TASK).zip(counts.par_chunks_mut(TASK));
        chunks.enumerate().for_each(|(i, (rays, counts))| self.count(rays, i * TASK, counts));
        counts
    }

    fn count(&self, rays: &[Ray], first_ray: usize, counts: &mut [u32]) {
        let mut count = Count::new(counts, self.geometry, WAVE);
        self.run(rays, first_ray, &mut count);
        for ray in count.into_unsure() {
            let index = ray as usize;
            counts[index] = self.list(&rays[index], first_ray + index).len() as u32;
        }
    }

    /// All hits of a ray that count, by itself; `index` is its number in the batch.
    fn list(&self, ray: &Ray, index: usize) -> Vec<Hit> {
        let mut every = Every::default();
        every.start(usize::MAX, 1, WAVE);
        self.run(std::slice::from_ref(ray), index, &mut every);
        let (mut t, mut prim_id) = (vec![0.0; every.len()], vec![0; every.len()]);
        every.copy(0, &mut [0], &mut t, &mut prim_id);
        let mut hits = hits_of(&t, &prim_id);
        self.geometry.leave_out(ray, &mut hits);
        hits
    }

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
            self.run(rays, i * TASK, &mut every);
            every
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
        self.leave_out(rays, k, all);
    }

    /// Leaves out of the first `k` hits of rays what does not count; see [`touch`](crate::touch).
    fn leave_out(&self, rays: &[Ray], k: usize, all: &mut AllHits) {
        let settle = |i: usize| {
            let row = all.offsets[i]..all.offsets[i + 1];
            let (t, prim_id) = (&all.t[row.clone()], &all.prim_id[row]);
            if !self.geometry.may_leave_out(&rays[i], t, prim_id) {
                return None;
            }
            let mut hits = hits_of(t, prim_id);
            if !self.geometry.leave_out(&rays[i], &mut hits) {
                return None;
            }
            if t.len() == k {
                // There may be others in their place.
                hits = self.list(&rays[i], i);
                hits.truncate(k);
            }
            Some((i, hits))
        };
        let settle_all = |rays: Range<usize>| {
            let first = all.offsets[rays.start];
            let (mut changed, mut next) = (Vec::new(), rays.start);
            for tie in touch::near_ties(&all.t[first..all.offsets[rays.end]]) {
                let at = first + tie;
                if at < all.offsets[next] {
                    continue;
                }
                let ray = next + all.offsets[next + 1..=rays.end].partition_point(|&end| end <= at);
                // Between the hits of two rays there is nothing to settle.
                if at + 1 < all.offsets[ray + 1] {
                    changed.extend(settle(ray));
                    next = ray + 1;
                }
            }
            changed
        };
        let changed: Vec<(usize, Vec<Hit>)> = if self.is_serial(rays) {
            settle_all(0..rays.len())
        } else {
            let tasks: Vec<_> = (0..rays.len()).step_by(TASK).collect();
            let task = |&start: &usize| settle_all(start..rays.len().min(start + TASK));
            tasks.par_iter().flat_map_iter(task).collect()
        };
        if changed.is_empty() {
            return;
        }
        let (mut changed, mut from, mut to) = (changed.iter().peekable(), 0, 0);
        for i in 0..rays.len() {
            let end = all.offsets[i + 1];
            if let Some((_, hits)) = changed.next_if(|(ray, _)| *ray == i) {
                for (j, hit) in hits.iter().enumerate() {
                    (all.t[to + j], all.prim_id[to + j]) = (hit.t, hit.prim_id);
                }
                to += hits.len();
            } else {
                all.t.copy_within(from..end, to);
                all.prim_id.copy_within(from..end, to);
                to += end - from;
            }
            from = end;
            all.offsets[i + 1] = to;
        }
        all.t.truncate(to);
        all.prim_id.truncate(to);
    }

    pub fn closest_hit_events(&self, rays: &[Ray]) -> BatchEvents {
        let (mut t, mut prim) = (vec![0.0; rays.len()], vec![0; rays.len()]);
        self.counted(rays, &mut Closest::new(&mut t, &mut prim))
    }

    pub fn occluded_events(&self, rays: &[Ray]) -> BatchEvents {
        let mut hit = vec![false; rays.len()];
        self.counted(rays, &mut Any { hit: &mut hit })
    }

    pub fn all_hits_events(&self, rays: &[Ray]) -> BatchEvents {
        let mut every = Every::default();
        every.start(usize::MAX, rays.len(), WAVE);
        self.counted(rays, &mut every)
    }

    pub fn closest_hit_one_events(&self, ray: &Ray) -> BatchEvents {
        let (leaves, mut events) = (self.leaves(ray), BatchEvents::default());
        with_slot(|slot| self.run_one(&leaves, slot, Closest::one(), &mut events));
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
    fn run_coherent<Q: BeamQuery>(
        &self,
        rays: &[Ray],
        first_ray: usize,
        mut query: Q,
    ) -> BatchReport {
        let way = self.way(rays, first_ray);
        let query = &mut query;
        if way != Way::Root || self.filter.is_some() || !self.beams || self.tree.has_shapes() {
            return self.run_filtered(rays, way, first_ray, query);
        }
        match Scanlines::of(rays) {
            Some(rows) => self.run_rows(rows, rays, query),
            None => self.run_beams(rays, query),
        }
    }

    /// Rays of a picture in rows, tile by tile.
    fn run_rows<Q: BeamQuery>(&self, rows: Scanlines, rays: &[Ray], query: &mut Q) -> BatchReport {
        let mut tiles = with_room(|room| std::mem::take(&mut room.tiles));
        let mut report = BatchReport { tiled_rays: rays.len() as u64, ..BatchReport::default() };
        tiles.start(rows);
        while tiles.advance(rows, rays) {
            let Tiles { rays, stood, answers, .. } = &mut tiles;
            query.ask_moved(stood, answers, Tiled { engine: self, rays, report: &mut report });
        }
        with_room(|room| room.tiles = tiles);
        report
    }

    /// Coherent rays in beams, the others in the wave from the root.
    fn run_beams<Q: BeamQuery>(&self, rays: &[Ray], query: &mut Q) -> BatchReport {
        with_room(|room| {
            room.order.clear();
            let Room { order, all, slots, sorter, answers, beam, .. } = room;
            let report = run_beams(self.level, self.tree, rays, query, beam, order);
            let wave_rays = order.len() as u64;
            if self.sorts(rays, order) {
                for order in order.chunks(GROUP) {
                    sorter.sort(self.tree.bounds(), rays, order);
                    all.extend(all.len() as u32..order.len() as u32);
                    let order = &all[..order.len()];
                    let walk = Moved { engine: self, rays: &sorter.rays, order, slots };
                    query.ask_moved(&sorter.stood, answers, walk);
                }
                return BatchReport { wave_rays, sorted_rays: wave_rays, ..report };
            }
            let width = order.len().min(wave_width());
            let mut source = self.rays_from_root::<Q>(rays, order);
            self.wave::<Q, _, _, false>(&mut slots[..width], query, &mut source, &mut NoEvents);
            BatchReport { wave_rays, near_rays: source.near_rays(), ..report }
        })
    }

    /// Rays of a task: few, for balance, or as many as are worth sorting.
    fn task(&self, rays: &[Ray]) -> usize {
        let sorts = self.sorting == Sorting::Automatic && self.tree.bytes() >= SMALLEST;
        let share = rays.len() / (4 * rayon::current_num_threads());
        let task = if sorts { share.clamp(TASK, GROUP) } else { TASK };
        let bands = Scanlines::of(rays).map_or(task, |rows| rows.bands(task));
        // Whole rows of a picture, unless there would be too few tasks.
        if bands <= 2 * share.max(TASK) { bands } else { task }
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
    fn run<Q: BatchQuery>(&self, rays: &[Ray], first_ray: usize, query: &mut Q) {
        self.run_filtered(rays, self.way(rays, first_ray), first_ray, query);
    }

    /// The same by a way that has been chosen.
    fn run_filtered<Q: BatchQuery>(
        &self,
        rays: &[Ray],
        way: Way,
        first_ray: usize,
        query: &mut Q,
    ) -> BatchReport {
        let Some(filter) = self.filter else {
            return self.run_wave(rays, way, first_ray, query, &mut NoEvents);
        };
        let query = &mut Filtered { query, filter, first_ray };
        self.run_wave(rays, way, first_ray, query, &mut NoEvents)
    }

    /// Puts one ray to `query`; see [`single`](super::single::single).
    #[inline(always)]
    fn run_one<Q: BatchQuery, E: Events>(
        &self,
        leaves: &Leaves<'_>,
        slot: &mut Slot,
        mut query: Q,
        events: &mut E,
    ) -> bool {
        let query = &mut query;
        match self.filter {
            None => self.one(leaves, slot, query, events),
            Some(filter) => {
                self.one(leaves, slot, &mut Filtered { query, filter, first_ray: 0 }, events)
            }
        }
    }

    #[inline(always)]
    fn one<Q: BatchQuery, E: Events>(
        &self,
        leaves: &Leaves<'_>,
        slot: &mut Slot,
        query: &mut Q,
        events: &mut E,
    ) -> bool {
        let (level, root) = (self.level, &self.root);
        if self.tree.has_shapes() {
            run_single::<_, _, true>(level, leaves, root, slot, query, events)
        } else {
            run_single::<_, _, false>(level, leaves, root, slot, query, events)
        }
    }

    /// What the wave does with the rays, without a filter.
    fn counted<Q: BatchQuery>(&self, rays: &[Ray], query: &mut Q) -> BatchEvents {
        let mut events = BatchEvents::default();
        self.run_wave(rays, self.way(rays, 0), 0, query, &mut events);
        events
    }

    /// All rays in the wave, the first of which is `first_ray` in the batch.
    fn run_wave<Q: BatchQuery, E: Events>(
        &self,
        rays: &[Ray],
        way: Way,
        first_ray: usize,
        query: &mut Q,
        events: &mut E,
    ) -> BatchReport {
        let report = BatchReport { wave_rays: rays.len() as u64, ..BatchReport::default() };
        let search = match way {
            Way::Root => None,
            Way::Entry => Packets::new(self.tree).map(|packets| Search::Path(Box::new(packets))),
            Way::Cells => {
                Climb::new(self.tree).map(|climb| Search::Cells(self.cells_from(first_ray), climb))
            }
        };
        let Some(search) = search else {
            self.run_from_root(rays, query, events);
            return report;
        };
        with_room(|room| {
            let slots = &mut room.slots[..rays.len().min(wave_width())];
            let mut source = FromEntry::new(rays, search);
            self.run_source(slots, query, &mut source, events);
            match source.into_search() {
                Search::Path(_) => BatchReport { entry_rays: report.wave_rays, ..report },
                Search::Cells(_, Climb { started, climbed, .. }) => {
                    BatchReport { cell_rays: started, climbed_rays: climbed, ..report }
                }
            }
        })
    }

    /// All rays in the wave, from the root.
    pub fn run_from_root<Q: BatchQuery, E: Events>(
        &self,
        rays: &[Ray],
        query: &mut Q,
        events: &mut E,
    ) {
        with_room(|room| {
            let slots = &mut room.slots[..rays.len().min(wave_width())];
            room.order.clear();
            room.order.extend(0..rays.len() as u32);
            let mut source = self.rays_from_root::<Q>(rays, &room.order);
            self.run_source(slots, query, &mut source, events);
        });
    }

    /// Rays from the root, or from cells near them where any hit ends them.
    fn rays_from_root<'r, Q: BatchQuery>(&self, rays: &'r [Ray], order: &'r [u32]) -> FromRoot<'r> {
        let source = FromRoot::new(self.tree, rays, order);
        let near = Q::ANY && !Q::ROUNDED && self.start == Start::Automatic;
        if near { source.with_vicinity(self.tree) } else { source }
    }

    /// The cells of the rays from `first_ray` on.
    fn cells_from(&self, first_ray: usize) -> &'a [Option<Cell>] {
        self.cells.and_then(|cells| cells.get(first_ray..)).unwrap_or(&[])
    }

    /// All segments of some particles, in `width` slots; `query` is that of the lanes.
    ///
    /// Particles of any type are part of the kernel's loop, since asking one through a pointer would take as long as the
    /// segment itself where there is nothing near: crates with particles of their own compile it for them.
    pub fn run_lanes<Q: BatchQuery, S: Source<Q>>(
        &self,
        width: usize,
        query: &mut Q,
        lanes: &mut S,
    ) {
        with_room(|room| self.run_source(&mut room.slots[..width], query, lanes, &mut NoEvents));
    }

    fn run_source<Q: BatchQuery, S: Source<Q>, E: Events>(
        &self,
        slots: &mut [Slot],
        query: &mut Q,
        source: &mut S,
        events: &mut E,
    ) {
        if Q::TRIANGLES {
            debug_assert!(!self.tree.has_shapes());
            self.wave::<Q, S, E, false>(slots, query, source, events);
        } else if self.tree.has_shapes() {
            self.wave::<Q, S, E, true>(slots, query, source, events);
        } else {
            self.wave::<Q, S, E, false>(slots, query, source, events);
        }
    }

    /// The rays of `source` in the wave.
    fn wave<Q: BatchQuery, S: Source<Q>, E: Events, const SHAPES: bool>(
        &self,
        slots: &mut [Slot],
        query: &mut Q,
        source: &mut S,
        events: &mut E,
    ) {
        let scene = (self.tree, self.geometry);
        run_wave::<Q, S, E, SHAPES>(self.level, scene, slots, query, source, events);
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
}

/// A row as hits without weights.
fn hits_of(t: &[f32], prim_id: &[u32]) -> Vec<Hit> {
    let hit = |(&t, &prim_id)| Hit { t, prim_id, u: 0.0, v: 0.0 };
    t.iter().zip(prim_id).map(hit).collect()
}

/// Ends, parameters and primitives of the rows of some rays.
type Rows<'a> = (&'a mut [usize], &'a mut [f32], &'a mut [u32]);

/// Splits `n` entries off the front.
fn split<'a, T>(row: &mut &'a mut [T], n: usize) -> &'a mut [T] {
    row.split_off_mut(..n).expect("rows are as long as their parts together")
}

/// Rays that have been moved, to be walked in their new order.
struct Moved<'a, 'e> {
    engine: &'a Engine<'e>,
    rays: &'a [Ray],
    /// All indices of `rays`, ascending.
    order: &'a [u32],
    slots: &'a mut [Slot],
}

impl Walk for Moved<'_, '_> {
    fn walk<Q: BeamQuery>(self, query: &mut Q) {
        let slots = &mut self.slots[..self.rays.len().min(wave_width())];
        let mut source = self.engine.rays_from_root::<Q>(self.rays, self.order);
        self.engine.wave::<Q, _, _, false>(slots, query, &mut source, &mut NoEvents);
    }
}

/// Rays of a picture that have been moved into tiles.
struct Tiled<'a, 'e> {
    engine: &'a Engine<'e>,
    rays: &'a [Ray],
    report: &'a mut BatchReport,
}

impl Walk for Tiled<'_, '_> {
    fn walk<Q: BeamQuery>(self, query: &mut Q) {
        *self.report = *self.report + self.engine.run_beams(self.rays, query);
    }
}
