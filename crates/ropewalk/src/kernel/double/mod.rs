//! Rays in `f64` in the wave: what it finds is decided in `f64`.

mod decide;
mod gather;

use super::BatchEvents;
use super::engine::{Engine, TASK};
use super::events::{Events, NoEvents};
use super::level::Level;
use super::query::NoFilter;
use crate::double::{DoubleGeometry, DoubleHit, DoubleRay, DoubleTree, Narrowed, Place};
use crate::ray::Ray;
use crate::touch::double_tie;
use decide::Decide;
use gather::{Any, Closest, Every, Gather};
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

/// A filter of any type, as the kernels see it.
trait Accepts: Sync {
    fn accepts(&self, ray: usize, hit: &DoubleHit) -> bool;
}

impl<F: DoubleFilter> Accepts for F {
    fn accepts(&self, ray: usize, hit: &DoubleHit) -> bool {
        DoubleFilter::accepts(self, ray, hit)
    }
}

/// Answers batches of `f64` rays over a [`DoubleTree`].
#[derive(Clone, Copy)]
pub struct DoubleCaster<'a, F = NoFilter> {
    /// Without a filter.
    asker: Asker<'a>,
    filter: F,
}

impl<'a> DoubleCaster<'a> {
    /// A caster at the best level of this machine, on all threads of the current rayon pool. `tree` must
    /// have been built over `geometry`.
    pub fn new(tree: &'a DoubleTree, geometry: &'a DoubleGeometry) -> Self {
        let engine = Engine::new(tree.wide(), geometry.none());
        DoubleCaster { asker: Asker { engine, geometry, filter: None }, filter: NoFilter }
    }
}

impl<'a, F: DoubleFilter> DoubleCaster<'a, F> {
    /// The same with a filter that decides which hits count.
    pub fn with_filter<G: DoubleFilter>(self, filter: G) -> DoubleCaster<'a, G> {
        DoubleCaster { asker: self.asker, filter }
    }

    /// The same with another level, or `None` if this machine lacks it.
    pub fn with_level(self, level: Level) -> Option<Self> {
        let engine = Engine { level, ..self.asker.engine };
        level.is_available().then_some(self.with_engine(engine))
    }

    /// The same on the calling thread only (`1`) or on the current rayon pool (`0`).
    pub fn with_threads(self, threads: usize) -> Self {
        let engine = Engine { threads, ..self.asker.engine };
        self.with_engine(engine)
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
        self.ask(|asker| asker.closest_hit_into(rays, t, prim_id));
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
        self.ask(|asker| asker.occluded_into(rays, hit));
    }

    /// The number of hits that [`DoubleCaster::all_hits`] lists for each ray.
    pub fn count_hits(&self, rays: &[DoubleRay]) -> Vec<u32> {
        self.ask(|asker| asker.count_hits(rays))
    }

    /// All hits of each ray, in order, each once; at edges and vertices each crossing once (docs/numerics.md).
    pub fn all_hits(&self, rays: &[DoubleRay]) -> DoubleAllHits {
        self.first_hits(rays, usize::MAX)
    }

    /// The first `k` hits of each ray, in order, each once.
    pub fn first_hits(&self, rays: &[DoubleRay], k: usize) -> DoubleAllHits {
        self.ask(|asker| asker.first_hits(rays, k))
    }

    /// What the batch of [`DoubleCaster::closest_hit`] does, counted, on one thread.
    pub fn closest_hit_events(&self, rays: &[DoubleRay]) -> BatchEvents {
        self.ask(|asker| asker.closest_hit_events(rays))
    }

    /// All triangles that each ray meets or touches, in order: also those that do not count in lists.
    pub(crate) fn all_touched(&self, rays: &[DoubleRay]) -> DoubleAllHits {
        self.ask(|asker| asker.lists(rays, usize::MAX, |_, _, every| every))
    }

    fn with_engine(self, engine: Engine<'a>) -> Self {
        DoubleCaster { asker: Asker { engine, ..self.asker }, ..self }
    }

    /// Has the filter told to who asks, if there is one.
    fn ask<T>(&self, ask: impl FnOnce(&Asker<'_>) -> T) -> T {
        if F::FILTERS {
            ask(&Asker { filter: Some(&self.filter), ..self.asker })
        } else {
            ask(&self.asker)
        }
    }
}

/// Puts batches, whatever the type of the filter; see [`Engine`].
#[derive(Clone, Copy)]
struct Asker<'a> {
    engine: Engine<'a>,
    geometry: &'a DoubleGeometry,
    filter: Option<&'a dyn Accepts>,
}

impl Asker<'_> {
    fn closest_hit_into(&self, rays: &[DoubleRay], t: &mut [f64], prim_id: &mut [u32]) {
        let chunks = t.chunks_mut(TASK).zip(prim_id.chunks_mut(TASK));
        self.each(rays, chunks.collect(), |rays, first, (t, prim_id)| {
            self.run(rays, first, Closest::new(t, prim_id), &mut NoEvents);
        });
    }

    fn occluded_into(&self, rays: &[DoubleRay], hit: &mut [bool]) {
        self.each(rays, hit.chunks_mut(TASK).collect(), |rays, first, hit| {
            self.run(rays, first, Any::new(hit), &mut NoEvents);
        });
    }

    fn count_hits(&self, rays: &[DoubleRay]) -> Vec<u32> {
        let mut counts = vec![0; rays.len()];
        self.each(rays, counts.chunks_mut(TASK).collect(), |rays, first, counts: &mut [u32]| {
            let every = self.every(rays, first, usize::MAX);
            let every = self.leave_out(rays, first, usize::MAX, every);
            for (count, hits) in counts.iter_mut().zip(every.rows()) {
                *count = hits.len() as u32;
            }
        });
        counts
    }

    fn first_hits(&self, rays: &[DoubleRay], k: usize) -> DoubleAllHits {
        self.lists(rays, k, |rays, first, every| self.leave_out(rays, first, k, every))
    }

    /// The first `k` hits of rays, the first of which is `first_ray` in the batch.
    fn every(&self, rays: &[DoubleRay], first_ray: usize, k: usize) -> Every {
        self.run(rays, first_ray, Every::new(k, rays.len()), &mut NoEvents)
    }

    /// Leaves out of the first `k` hits of rays what does not count; see [`touch`](crate::touch).
    fn leave_out(&self, rays: &[DoubleRay], first_ray: usize, k: usize, mut every: Every) -> Every {
        let hit = |&(t, prim_id): &(f64, u32)| DoubleHit { t, prim_id, u: 0.0, v: 0.0 };
        for (i, ray) in rays.iter().enumerate() {
            let row = every.row(i);
            if !row.windows(2).any(|pair| double_tie(pair[0].0, pair[1].0)) {
                continue;
            }
            let mut hits: Vec<DoubleHit> = row.iter().map(hit).collect();
            if !self.geometry.leave_out(ray, &mut hits) {
                continue;
            }
            if row.len() == k {
                // There may be others in their place.
                let whole = self.every(&rays[i..=i], first_ray + i, usize::MAX);
                hits = whole.row(0).iter().map(hit).collect();
                self.geometry.leave_out(ray, &mut hits);
                hits.truncate(k);
            }
            every.shorten(i, hits.iter().map(|hit| (hit.t, hit.prim_id)));
        }
        every
    }

    /// The first `k` hits of each ray, once `settle` is done with those of each task.
    fn lists(
        &self,
        rays: &[DoubleRay],
        k: usize,
        settle: impl Fn(&[DoubleRay], usize, Every) -> Every + Sync,
    ) -> DoubleAllHits {
        let mut offsets = Vec::with_capacity(rays.len() + 1);
        offsets.push(0);
        let (mut t, mut prim_id) = (Vec::new(), Vec::new());
        if k == 0 {
            offsets.resize(rays.len() + 1, 0);
            return DoubleAllHits { offsets, t, prim_id };
        }
        let tasks = vec![(); rays.len().div_ceil(TASK)];
        let parts = self
            .each(rays, tasks, |rays, first, ()| settle(rays, first, self.every(rays, first, k)));
        let total = parts.iter().flat_map(Every::rows).map(<[_]>::len).sum();
        t.reserve_exact(total);
        prim_id.reserve_exact(total);
        for part in &parts {
            for hits in part.rows() {
                t.extend(hits.iter().map(|hit| hit.0));
                prim_id.extend(hits.iter().map(|hit| hit.1));
                offsets.push(t.len());
            }
        }
        DoubleAllHits { offsets, t, prim_id }
    }

    fn closest_hit_events(&self, rays: &[DoubleRay]) -> BatchEvents {
        let (mut t, mut prim_id) = (vec![0.0; rays.len()], vec![0; rays.len()]);
        let mut events = BatchEvents::default();
        self.run(rays, 0, Closest::new(&mut t, &mut prim_id), &mut events);
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
        if self.engine.threads == 1 || rays.len() <= TASK {
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
        let scene = (self.geometry, self.filter);
        let mut decide = Decide::new(scene, (rays, &places, first_ray), gather);
        self.engine.run_from_root(&narrowed, &mut decide, events);
        for index in beyond {
            decide.answer_alone(index);
        }
        decide.into_gather()
    }
}
