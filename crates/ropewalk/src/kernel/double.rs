//! Rays in `f64` in the wave: what it finds is decided in `f64`.

#![allow(unsafe_code)]

use super::batch::{BatchCaster, TASK, Way};
use super::beam::Doubles;
use super::events::{Events, NoEvents};
use super::exact::{Exact, meet};
use super::level::{Level, Simd};
use super::query::{BatchQuery, Clear, NoFilter};
use super::slot::Slot;
use super::wave::WAVE;
use super::{BatchEvents, Start};
use crate::double::{DoubleGeometry, DoubleHit, DoubleRay, DoubleTree, Narrowed, Place};
use crate::ray::{Hit, Ray};
use crate::wide::{ID_MASK, WIDTH};
use rayon::prelude::*;

/// The hits of a batch: one entry a ray.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DoubleBatchHit {
    /// Parameter of the hit; infinite for a miss.
    pub t: Vec<f64>,
    /// Triangle of the hit; `u32::MAX` for a miss.
    pub prim_id: Vec<u32>,
}

/// All hits of a batch in compressed rows: those of ray `i` are `offsets[i]..offsets[i + 1]`, in order of
/// `(t, prim_id)`, each once.
#[derive(Clone, Debug, PartialEq)]
pub struct DoubleAllHits {
    /// Row starts; one more than there are rays.
    pub offsets: Vec<usize>,
    /// Parameters.
    pub t: Vec<f64>,
    /// Triangles.
    pub prim_id: Vec<u32>,
}

/// Decides which hits count; see [`HitFilter`](super::HitFilter) for what it may rely on.
pub trait DoubleFilter: Sync {
    /// False if nothing is ever refused; then it is not asked.
    const FILTERS: bool = true;

    /// True if the hit of the ray with this index in the batch counts.
    fn accepts(&self, ray: usize, hit: &DoubleHit) -> bool;
}

impl DoubleFilter for NoFilter {
    const FILTERS: bool = false;

    fn accepts(&self, _ray: usize, _hit: &DoubleHit) -> bool {
        true
    }
}

impl<F: Fn(usize, &DoubleHit) -> bool + Sync> DoubleFilter for F {
    fn accepts(&self, ray: usize, hit: &DoubleHit) -> bool {
        self(ray, hit)
    }
}

/// Answers batches of `f64` rays over a [`DoubleTree`].
#[derive(Clone, Copy)]
pub struct DoubleCaster<'a, F = NoFilter> {
    caster: BatchCaster<'a>,
    geometry: &'a DoubleGeometry,
    filter: F,
}

impl<'a> DoubleCaster<'a> {
    /// A caster at the best level of this machine, on all threads of the current rayon pool. `tree` must
    /// have been built over `geometry`.
    pub fn new(tree: &'a DoubleTree, geometry: &'a DoubleGeometry) -> Self {
        let caster = BatchCaster::new(tree.wide(), geometry.none()).with_start(Start::Root);
        DoubleCaster { caster, geometry, filter: NoFilter }
    }
}

impl<'a, F: DoubleFilter> DoubleCaster<'a, F> {
    /// The same with a filter that decides which hits count.
    pub fn with_filter<G: DoubleFilter>(self, filter: G) -> DoubleCaster<'a, G> {
        DoubleCaster { caster: self.caster, geometry: self.geometry, filter }
    }

    /// The same with another level, or `None` if this machine lacks it.
    pub fn with_level(self, level: Level) -> Option<Self> {
        Some(DoubleCaster { caster: self.caster.with_level(level)?, ..self })
    }

    /// The same on the calling thread only (`1`) or on the current rayon pool (`0`).
    pub fn with_threads(self, threads: usize) -> Self {
        DoubleCaster { caster: self.caster.with_threads(threads), ..self }
    }

    /// The first hit of each ray.
    pub fn closest_hit(&self, rays: &[DoubleRay]) -> DoubleBatchHit {
        let mut hit = DoubleBatchHit { t: vec![0.0; rays.len()], prim_id: vec![0; rays.len()] };
        self.closest_hit_into(rays, &mut hit.t, &mut hit.prim_id);
        hit
    }

    /// The first hit of each ray, into arrays of the same length as `rays`.
    ///
    /// # Panics
    /// If the lengths differ.
    pub fn closest_hit_into(&self, rays: &[DoubleRay], t: &mut [f64], prim_id: &mut [u32]) {
        assert!(t.len() == rays.len() && prim_id.len() == rays.len(), "one entry a ray");
        let chunks = t.chunks_mut(TASK).zip(prim_id.chunks_mut(TASK));
        self.each(rays, chunks.collect(), |rays, first, (t, prim_id)| {
            self.run(rays, first, Closest { best: [NO_HIT; WAVE], t, prim_id }, &mut NoEvents);
        });
    }

    /// Whether each ray hits anything.
    pub fn occluded(&self, rays: &[DoubleRay]) -> Vec<bool> {
        let mut hit = vec![false; rays.len()];
        self.occluded_into(rays, &mut hit);
        hit
    }

    /// Whether each ray hits anything, into an array of the same length as `rays`.
    ///
    /// # Panics
    /// If the lengths differ.
    pub fn occluded_into(&self, rays: &[DoubleRay], hit: &mut [bool]) {
        assert!(hit.len() == rays.len(), "one entry a ray");
        self.each(rays, hit.chunks_mut(TASK).collect(), |rays, first, hit| {
            self.run(rays, first, Any { found: [false; WAVE], hit }, &mut NoEvents);
        });
    }

    /// The number of triangles that each ray hits.
    pub fn count_hits(&self, rays: &[DoubleRay]) -> Vec<u32> {
        let mut counts = vec![0; rays.len()];
        self.each(rays, counts.chunks_mut(TASK).collect(), |rays, first, counts: &mut [u32]| {
            let every = self.run(rays, first, Every::new(usize::MAX, rays.len()), &mut NoEvents);
            for (count, &(_, len)) in counts.iter_mut().zip(&every.range) {
                *count = len as u32;
            }
        });
        counts
    }

    /// All hits of each ray, in order, each once.
    pub fn all_hits(&self, rays: &[DoubleRay]) -> DoubleAllHits {
        self.first_hits(rays, usize::MAX)
    }

    /// The first `k` hits of each ray, in order, each once.
    pub fn first_hits(&self, rays: &[DoubleRay], k: usize) -> DoubleAllHits {
        let mut offsets = Vec::with_capacity(rays.len() + 1);
        offsets.push(0);
        let (mut t, mut prim_id) = (Vec::new(), Vec::new());
        if k == 0 {
            offsets.resize(rays.len() + 1, 0);
            return DoubleAllHits { offsets, t, prim_id };
        }
        let tasks = vec![(); rays.len().div_ceil(TASK)];
        let parts = self.each(rays, tasks, |rays, first, ()| {
            self.run(rays, first, Every::new(k, rays.len()), &mut NoEvents)
        });
        let total = parts.iter().map(|part| part.hits.len()).sum();
        t.reserve_exact(total);
        prim_id.reserve_exact(total);
        for part in parts {
            for (start, len) in part.range {
                let hits = &part.hits[start..start + len];
                t.extend(hits.iter().map(|hit| hit.0));
                prim_id.extend(hits.iter().map(|hit| hit.1));
                offsets.push(t.len());
            }
        }
        DoubleAllHits { offsets, t, prim_id }
    }

    /// What the batch of [`DoubleCaster::closest_hit`] does, counted, on one thread.
    pub fn closest_hit_events(&self, rays: &[DoubleRay]) -> BatchEvents {
        let (mut t, mut prim_id) = (vec![0.0; rays.len()], vec![0; rays.len()]);
        let mut events = BatchEvents::default();
        let gather = Closest { best: [NO_HIT; WAVE], t: &mut t, prim_id: &mut prim_id };
        self.run(rays, 0, gather, &mut events);
        events
    }

    /// Does the work for each [`TASK`] rays, the index of the first of them and their part of the answers.
    fn each<A: Send, T: Send>(
        &self,
        rays: &[DoubleRay],
        answers: Vec<A>,
        work: impl Fn(&[DoubleRay], usize, A) -> T + Sync,
    ) -> Vec<T> {
        let work = |(i, (rays, answer)): (usize, (&[DoubleRay], A))| work(rays, i * TASK, answer);
        if self.caster.threads() == 1 || rays.len() <= TASK {
            return rays.chunks(TASK).zip(answers).enumerate().map(work).collect();
        }
        rays.par_chunks(TASK).zip(answers).enumerate().map(work).collect()
    }

    /// Puts rays, the first of which is `first_ray` in the batch, to `gather`.
    fn run<G: Gather, E: Events>(
        &self,
        rays: &[DoubleRay],
        first_ray: usize,
        gather: G,
        events: &mut E,
    ) -> G {
        const NOWHERE: Ray = Ray::new([0.0; 3], [0.0; 3]);
        let mut beyond = Vec::new();
        let mut narrowed = Vec::with_capacity(rays.len());
        let mut places = Vec::with_capacity(rays.len());
        for (i, ray) in rays.iter().enumerate() {
            let (ray, place) = match self.geometry.narrow(ray) {
                Narrowed::Ray(ray, place) => (ray, place),
                Narrowed::Misses => (NOWHERE, Place::default()),
                Narrowed::Beyond => {
                    beyond.push(i);
                    (NOWHERE, Place::default())
                }
            };
            narrowed.push(ray);
            places.push(place);
        }
        let mut decide = Decide {
            geometry: self.geometry,
            rays,
            places: &places,
            first_ray,
            filter: &self.filter,
            notes: std::array::from_fn(|_| Vec::new()),
            finished: Vec::new(),
            pending: Vec::new(),
            t: Vec::new(),
            pairs: Pairs::EMPTY,
            gather,
        };
        self.caster.run_wave(&narrowed, Way::Root, 0, &mut decide, events);
        for index in beyond {
            for id in 0..self.geometry.len() as u32 {
                if decide.offer(0, index, id).is_some() && G::ANY {
                    break;
                }
            }
            let known = decide.gather.finish(0);
            decide.gather.answer(index, known, std::iter::empty());
        }
        decide.gather
    }
}

/// A triangle that a ray hits for sure.
#[derive(Clone, Copy)]
struct Note {
    prim_id: u32,
    /// Bounds of the parameter, in the numbers of the search.
    low: f32,
    high: f32,
}

/// So many pairs of ray and triangle at least are decided at once, so that their triangles come from memory
/// side by side.
const PENDING: usize = 64;

/// Decides in `f64` what the search finds, and puts it to a [`Gather`].
///
/// What is hit for sure is only noted, as bounds: most of it lies behind something else in the end. The
/// parameters of the rest are worked out for many finished rays at once, eight at a time.
struct Decide<'a, G: Gather, F> {
    geometry: &'a DoubleGeometry,
    rays: &'a [DoubleRay],
    places: &'a [Place],
    first_ray: usize,
    filter: &'a F,
    /// What each slot has found.
    notes: [Vec<Note>; WAVE],
    /// Rays with what is known of them, and where their pairs end in `pending`.
    finished: Vec<(u32, G::Known, usize)>,
    /// Pairs of a ray and a triangle that it hits for sure.
    pending: Vec<(u32, u32)>,
    /// Their parameters.
    t: Vec<f64>,
    pairs: Pairs,
    gather: G,
}

/// Rays and triangles, one pair a lane, in the axis order of the ray's shear.
#[repr(C, align(64))]
struct Pairs {
    /// Coordinates by vertex and axis.
    corner: [[[f64; WIDTH]; 3]; 3],
    origin: [[f64; WIDTH]; 3],
    dir: [[f64; WIDTH]; 3],
}

impl Pairs {
    const EMPTY: Pairs =
        Pairs { corner: [[[0.0; WIDTH]; 3]; 3], origin: [[0.0; WIDTH]; 3], dir: [[0.0; WIDTH]; 3] };

    #[inline(always)]
    fn set(&mut self, lane: usize, ray: &DoubleRay, corners: [&[f64; 3]; 3]) {
        let lane = lane % WIDTH;
        let size = ray.dir.map(f64::abs);
        let y = usize::from(size[1] > size[0]);
        let kz = if size[2] > size[y] { 2 } else { y };
        // The winding does not matter.
        let k = [[1, 2, 0], [2, 0, 1], [0, 1, 2]][kz];
        for a in 0..3 {
            for (row, corner) in self.corner.iter_mut().zip(corners) {
                row[a][lane] = corner[k[a]];
            }
            self.origin[a][lane] = ray.origin[k[a]];
            self.dir[a][lane] = ray.dir[k[a]];
        }
    }

    /// Writes the parameters of the hits; returns the lanes that the reference must be asked about.
    ///
    /// # Safety
    /// As for [`meet`].
    #[inline(always)]
    unsafe fn meet<D: Doubles>(&self, t: &mut [f64]) -> u32 {
        let mut hit = 0;
        for first in (0..WIDTH).step_by(D::LANES) {
            // SAFETY: passed on to the caller; `LANES` divides `WIDTH`.
            unsafe {
                let [a, b, c] = &self.corner;
                let corners = [load::<D>(a, first), load::<D>(b, first), load::<D>(c, first)];
                let (origin, dir) = (load::<D>(&self.origin, first), load::<D>(&self.dir, first));
                let met = meet(origin, dir, corners);
                met.t.store(&mut t[first..]);
                hit |= met.hit << first;
            }
        }
        !hit & ((1 << WIDTH) - 1)
    }
}

/// The lanes of three rows from `first` on.
///
/// # Safety
/// As for [`meet`].
#[inline(always)]
unsafe fn load<D: Doubles>([x, y, z]: &[[f64; WIDTH]; 3], first: usize) -> [D; 3] {
    // SAFETY: passed on to the caller.
    unsafe { [D::load(&x[first..]), D::load(&y[first..]), D::load(&z[first..])] }
}

impl<G: Gather, F: DoubleFilter> Decide<'_, G, F> {
    /// Tests a triangle; the limit of what still matters, if it is hit.
    fn offer(&mut self, k: usize, index: usize, prim_id: u32) -> Option<f64> {
        let hit = self.geometry.intersect(prim_id, &self.rays[index])?;
        let accepted = !F::FILTERS || self.filter.accepts(self.first_ray + index, &hit);
        accepted.then(|| self.gather.take(k, (hit.t, hit.prim_id)))
    }

    fn test(&mut self, k: usize, slot: &mut Slot, prim_id: u32) {
        let index = slot.ray as usize;
        if let Some(limit) = self.offer(k, index, prim_id) {
            slot.limit = slot.limit.min(self.places[index].after(limit));
            slot.best_id = prim_id;
        }
    }

    /// Works out the parameters of all pairs and answers the rays.
    ///
    /// # Safety
    /// As for [`BatchQuery::take_clear`].
    #[inline(always)]
    unsafe fn answer<L: Simd>(&mut self) {
        const NOTHING: [f64; 3] = [f64::NAN; 3];
        let (faces, vertices) = (self.geometry.faces(), self.geometry.vertices());
        // An altered file may name what is not there.
        let face = |id: u32| faces.get(id as usize).unwrap_or(&[u32::MAX; 3]);
        let corner = |i: u32| vertices.get(i as usize).unwrap_or(&NOTHING);
        for &(_, id) in &self.pending {
            // SAFETY: passed on to the caller.
            unsafe { L::prefetch((&raw const *face(id)).cast()) };
        }
        for &(_, id) in &self.pending {
            for &vertex in face(id) {
                // SAFETY: passed on to the caller.
                unsafe { L::prefetch((&raw const *corner(vertex)).cast()) };
            }
        }
        let groups = self.pending.chunks(WIDTH);
        self.t.resize(groups.len() * WIDTH, 0.0);
        for (pending, t) in groups.zip(self.t.chunks_exact_mut(WIDTH)) {
            for (lane, &(index, id)) in pending.iter().enumerate() {
                let &[a, b, c] = face(id);
                let corners = [corner(a), corner(b), corner(c)];
                self.pairs.set(lane, &self.rays[index as usize], corners);
            }
            // SAFETY: passed on to the caller.
            let open = unsafe { self.pairs.meet::<L::Doubles>(t) };
            for (lane, &(index, id)) in pending.iter().enumerate() {
                if open >> lane & 1 == 1 {
                    let hit = self.geometry.intersect(id, &self.rays[index as usize]);
                    // A clear hit is a hit, but for a tree that does not fit the geometry.
                    t[lane] = hit.map_or(f64::INFINITY, |hit| hit.t);
                }
                t[lane] += 0.0;
            }
        }
        let mut from = 0;
        for (index, known, end) in self.finished.drain(..) {
            let ids = self.pending[from..end].iter().map(|&(_, id)| id);
            let hits = self.t[from..end].iter().copied().zip(ids).filter(|hit| hit.0.is_finite());
            self.gather.answer(index as usize, known, hits);
            from = end;
        }
        self.pending.clear();
    }
}

impl<G: Gather, F: DoubleFilter> BatchQuery for Decide<'_, G, F> {
    const ANY: bool = G::ANY;
    const ROUNDED: bool = true;

    #[inline(always)]
    unsafe fn take_clear<L: Simd>(
        &mut self,
        k: usize,
        slot: &mut Slot,
        hits: &Clear<'_>,
        _exact: &Exact<'_>,
    ) -> u32 {
        if F::FILTERS {
            return hits.lanes;
        }
        let [inner_min, inner_max] = self.places[slot.ray as usize].inner;
        let (mut lanes, mut unclear) = (hits.lanes, 0);
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize % WIDTH;
            lanes &= lanes - 1;
            let (low, high) = (hits.range.low[lane], hits.range.high[lane]);
            if low < inner_min || high > inner_max {
                unclear |= 1 << lane;
                continue;
            }
            let prim_id = hits.block.id[lane] & ID_MASK;
            if G::ANY {
                slot.best_id = prim_id;
                self.gather.take(k, (0.0, prim_id));
            } else {
                self.notes[k].push(Note { prim_id, low, high });
                slot.limit = slot.limit.min(self.gather.limit(&mut self.notes[k]));
            }
        }
        unclear
    }

    #[inline(always)]
    fn decide(
        &mut self,
        k: usize,
        slot: &mut Slot,
        (line, lane): (usize, usize),
        exact: &Exact<'_>,
    ) {
        self.test(k, slot, exact.lines.block(line).id[lane] & ID_MASK);
    }

    fn take(&mut self, k: usize, slot: &mut Slot, hit: &Hit, _exact: &Exact<'_>) {
        // No shapes, and no ray of the search is extreme, but in altered files.
        self.test(k, slot, hit.prim_id);
    }

    #[inline(always)]
    fn finish(&mut self, k: usize, slot: &mut Slot, _exact: &Exact<'_>) {
        let known = self.gather.finish(k);
        let (limit, notes) = (slot.limit, &mut self.notes[k]);
        notes.retain(|note| note.low <= limit);
        if notes.len() > 1 {
            notes.sort_unstable_by_key(|note| note.prim_id);
            notes.dedup_by_key(|note| note.prim_id);
        }
        self.pending.extend(notes.drain(..).map(|note| (slot.ray, note.prim_id)));
        self.finished.push((slot.ray, known, self.pending.len()));
    }

    fn miss(&mut self, index: usize) {
        self.gather.miss(index);
    }

    #[inline(always)]
    unsafe fn settle<L: Simd>(&mut self, _exact: &Exact<'_>, all: bool) {
        if self.pending.len() >= PENDING || all {
            // SAFETY: passed on to the caller.
            unsafe { self.answer::<L>() };
        }
    }
}

/// What becomes of hits, each a parameter and a triangle.
trait Gather {
    /// True if the first hit ends a ray.
    const ANY: bool = false;
    /// Hits of a ray that are known exactly.
    type Known;

    /// Takes a hit of the ray in slot `k`, perhaps not for the first time; hits beyond the parameter that
    /// comes back no longer matter.
    fn take(&mut self, k: usize, hit: (f64, u32)) -> f64;

    /// Where hits behind all of these notes begin not to matter. Notes may be put in order, and repeated
    /// ones left out.
    fn limit(&mut self, notes: &mut Vec<Note>) -> f32;

    /// What slot `k` knows, which is made ready for the next ray.
    fn finish(&mut self, k: usize) -> Self::Known;

    /// Ray `index` has these hits and perhaps some that do not matter.
    fn answer(&mut self, index: usize, known: Self::Known, hits: impl Iterator<Item = (f64, u32)>);

    /// Ray `index` hits nothing.
    fn miss(&mut self, index: usize);
}

/// The nearer of two hits.
fn nearer(a: (f64, u32), b: (f64, u32)) -> (f64, u32) {
    if b.0 < a.0 || (b.0 == a.0 && b.1 < a.1) { b } else { a }
}

const NO_HIT: (f64, u32) = (f64::INFINITY, u32::MAX);

struct Closest<'a> {
    best: [(f64, u32); WAVE],
    t: &'a mut [f64],
    prim_id: &'a mut [u32],
}

impl Gather for Closest<'_> {
    type Known = (f64, u32);

    fn take(&mut self, k: usize, hit: (f64, u32)) -> f64 {
        self.best[k] = nearer(self.best[k], hit);
        self.best[k].0
    }

    #[inline(always)]
    fn limit(&mut self, notes: &mut Vec<Note>) -> f32 {
        notes.last().map_or(f32::INFINITY, |note| note.high)
    }

    #[inline(always)]
    fn finish(&mut self, k: usize) -> (f64, u32) {
        std::mem::replace(&mut self.best[k], NO_HIT)
    }

    #[inline(always)]
    fn answer(&mut self, index: usize, known: (f64, u32), hits: impl Iterator<Item = (f64, u32)>) {
        (self.t[index], self.prim_id[index]) = hits.fold(known, nearer);
    }

    fn miss(&mut self, index: usize) {
        (self.t[index], self.prim_id[index]) = NO_HIT;
    }
}

struct Any<'a> {
    found: [bool; WAVE],
    hit: &'a mut [bool],
}

impl Gather for Any<'_> {
    const ANY: bool = true;
    type Known = bool;

    #[inline(always)]
    fn take(&mut self, k: usize, _hit: (f64, u32)) -> f64 {
        self.found[k] = true;
        f64::NEG_INFINITY
    }

    fn limit(&mut self, _notes: &mut Vec<Note>) -> f32 {
        f32::INFINITY
    }

    #[inline(always)]
    fn finish(&mut self, k: usize) -> bool {
        std::mem::take(&mut self.found[k])
    }

    #[inline(always)]
    fn answer(&mut self, index: usize, known: bool, _hits: impl Iterator<Item = (f64, u32)>) {
        self.hit[index] = known;
    }

    fn miss(&mut self, index: usize) {
        self.hit[index] = false;
    }
}

/// All hits, or the first few.
struct Every {
    first: usize,
    /// Hits of each slot that are known exactly.
    known: Vec<Vec<(f64, u32)>>,
    /// Room for upper bounds in order.
    bounds: Vec<f32>,
    row: Vec<(f64, u32)>,
    /// Hits of answered rays.
    hits: Vec<(f64, u32)>,
    /// Where those of each ray begin, and how many there are.
    range: Vec<(usize, usize)>,
}

impl Every {
    fn new(first: usize, rays: usize) -> Self {
        let known = vec![Vec::new(); WAVE];
        let (bounds, row, hits) = (Vec::new(), Vec::new(), Vec::new());
        Every { first, known, bounds, row, hits, range: vec![(0, 0); rays] }
    }

    /// Puts the hits of a ray in order, each once, and keeps the first few.
    fn sort(hits: &mut Vec<(f64, u32)>, first: usize) {
        hits.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        hits.dedup_by_key(|hit| hit.1);
        hits.truncate(first);
    }
}

impl Gather for Every {
    type Known = Vec<(f64, u32)>;

    fn take(&mut self, k: usize, hit: (f64, u32)) -> f64 {
        let known = &mut self.known[k];
        known.push(hit);
        if known.len() >= self.first.saturating_mul(2) {
            Self::sort(known, self.first);
            if let Some(last) = known.get(self.first - 1) {
                return last.0;
            }
        }
        f64::INFINITY
    }

    /// The `first`-th upper bound, looked for whenever there are half as many notes more.
    fn limit(&mut self, notes: &mut Vec<Note>) -> f32 {
        let due = self.first.saturating_add(self.first / 2).max(1);
        if notes.len() < due {
            return f32::INFINITY;
        }
        notes.sort_unstable_by_key(|note| note.prim_id);
        notes.dedup_by_key(|note| note.prim_id);
        if notes.len() < self.first {
            return f32::INFINITY;
        }
        self.bounds.clear();
        self.bounds.extend(notes.iter().map(|note| note.high));
        let (_, &mut limit, _) = self.bounds.select_nth_unstable_by(self.first - 1, f32::total_cmp);
        notes.retain(|note| note.low <= limit);
        limit
    }

    #[inline(always)]
    fn finish(&mut self, k: usize) -> Vec<(f64, u32)> {
        std::mem::take(&mut self.known[k])
    }

    fn answer(
        &mut self,
        index: usize,
        known: Vec<(f64, u32)>,
        hits: impl Iterator<Item = (f64, u32)>,
    ) {
        self.row.clear();
        self.row.extend(known.into_iter().chain(hits));
        Self::sort(&mut self.row, self.first);
        self.range[index] = (self.hits.len(), self.row.len());
        self.hits.extend_from_slice(&self.row);
    }

    fn miss(&mut self, index: usize) {
        self.range[index] = (0, 0);
    }
}
