//! The batch calls as users see them.

use super::beam::BatchReport;
use super::engine::Engine;
use super::events::BatchEvents;
use super::level::Level;
use super::query::{BatchQuery, HitFilter, NoFilter};
use super::sorted::Sorting;
use super::source::Source;
use crate::geometry::Geometry;
use crate::point::Cell;
use crate::ray::{Hit, Ray};
use crate::wide::WideTree;

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

/// Answers batches of rays over a wide tree.
#[derive(Clone, Copy)]
pub struct BatchCaster<'a, F = NoFilter> {
    /// Without a filter.
    engine: Engine<'a>,
    filter: F,
}

impl<'a> BatchCaster<'a> {
    /// A caster at the best level of this machine, on all threads of the current rayon pool.
    pub fn new(tree: &'a WideTree, geometry: &'a Geometry) -> Self {
        BatchCaster { engine: Engine::new(tree, geometry), filter: NoFilter }
    }
}

impl<'a, F: HitFilter> BatchCaster<'a, F> {
    /// The same with a filter that decides which hits count: a closure of the ray's index in the
    /// batch and the hit, or [`Masks`](super::Masks) or [`Opacity`](super::Opacity) from arrays. It
    /// runs inside the traversal; see [`HitFilter`] for what it may rely on.
    pub fn with_filter<G: HitFilter>(self, filter: G) -> BatchCaster<'a, G> {
        BatchCaster { engine: self.engine, filter }
    }

    /// The same with another level, or `None` if this machine lacks it.
    pub fn with_level(self, level: Level) -> Option<Self> {
        level
            .is_available()
            .then_some(BatchCaster { engine: Engine { level, ..self.engine }, ..self })
    }

    /// The same on the calling thread only (`1`) or on the current rayon pool (`0`).
    pub fn with_threads(self, threads: usize) -> Self {
        BatchCaster { engine: Engine { threads, ..self.engine }, ..self }
    }

    /// The same with all rays in the wave (`false`), or with coherent ones in beams (`true`, the
    /// default). The answers are the same.
    pub fn with_beams(self, beams: bool) -> Self {
        BatchCaster { engine: Engine { beams, ..self.engine }, ..self }
    }

    /// The same with rays started there.
    pub fn with_start(self, start: Start) -> Self {
        BatchCaster { engine: Engine { start, ..self.engine }, ..self }
    }

    /// The same with a cell for each ray of the batch, from which its walk may start: that of its origin,
    /// say from [`BatchCaster::cells_at`] or [`PointQueries::locate`](crate::point::PointQueries::locate).
    /// It changes no answer: from a cell that a ray is not near to, or that is none of this tree, a walk
    /// starts higher up or at the root. Rays beyond the end of `cells` have none.
    ///
    /// Cells are used if the tree has its table ([`WideTree::link_up`]) and, unless [`Start::Entry`] is set,
    /// if a sample of the rays says that it pays.
    pub fn with_cells(self, cells: &'a [Option<Cell>]) -> Self {
        BatchCaster { engine: Engine { cells: Some(cells), ..self.engine }, ..self }
    }

    /// The cells in which rays are at some parameters, as those of their hits; `None` outside of the
    /// tree's box, and for a miss.
    ///
    /// # Panics
    /// If there are not as many parameters as rays.
    pub fn cells_at(&self, rays: &[Ray], t: &[f32]) -> Vec<Option<Cell>> {
        assert!(t.len() == rays.len(), "one entry a ray");
        self.engine.cells_at(rays, t)
    }

    /// The same with incoherent rays sorted by where they start, or not. The answers are the same.
    pub fn with_sorting(self, sorting: Sorting) -> Self {
        BatchCaster { engine: Engine { sorting, ..self.engine }, ..self }
    }

    /// The level in use.
    pub fn level(&self) -> Level {
        self.engine.level
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
        self.ask(|engine| engine.closest_hit_into(rays, t, prim_id))
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
        self.ask(|engine| engine.occluded_into(rays, hit))
    }

    /// The first hit of one ray, `None` for a miss: for rays that depend on each other, at a fraction of
    /// the cost of a batch of one. A filter sees ray 0. Rays that are there together are faster in a
    /// batch.
    pub fn closest_hit_one(&self, ray: &Ray) -> Option<Hit> {
        self.ask(|engine| engine.closest_hit_one(ray))
    }

    /// Whether one ray hits anything; see [`BatchCaster::closest_hit_one`].
    pub fn occluded_one(&self, ray: &Ray) -> bool {
        self.ask(|engine| engine.occluded_one(ray))
    }

    /// The number of hits that [`BatchCaster::all_hits`] lists for each ray.
    pub fn count_hits(&self, rays: &[Ray]) -> Vec<u32> {
        self.ask(|engine| engine.count_hits(rays))
    }

    /// All hits of each ray, in order, each once. Where a ray meets an edge or a vertex exactly, each crossing of the surface
    /// there has one, not each triangle (docs/numerics.md); [`Geometry::all_hits`] is the definition.
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
        self.ask(|engine| engine.first_hits_into(rays, k, all));
    }

    /// What the batch of [`BatchCaster::closest_hit`] does, counted, on one thread.
    pub fn closest_hit_events(&self, rays: &[Ray]) -> BatchEvents {
        self.engine.closest_hit_events(rays)
    }

    /// What the batch of [`BatchCaster::occluded`] does, counted, on one thread.
    pub fn occluded_events(&self, rays: &[Ray]) -> BatchEvents {
        self.engine.occluded_events(rays)
    }

    /// What the batch of [`BatchCaster::all_hits`] does, counted, on one thread.
    pub fn all_hits_events(&self, rays: &[Ray]) -> BatchEvents {
        self.engine.all_hits_events(rays)
    }

    /// What the batch of [`BatchCaster::closest_hit_one`] does, counted.
    pub fn closest_hit_one_events(&self, ray: &Ray) -> BatchEvents {
        self.ask(|engine| engine.closest_hit_one_events(ray))
    }

    /// See [`Engine::run_lanes`].
    pub(crate) fn run_lanes<Q: BatchQuery, S: Source<Q>>(
        &self,
        width: usize,
        query: &mut Q,
        lanes: &mut S,
    ) {
        self.engine.run_lanes(width, query, lanes);
    }

    /// The tree.
    pub(crate) fn tree(&self) -> &'a WideTree {
        self.engine.tree
    }

    /// See [`BatchCaster::with_threads`].
    pub(crate) fn threads(&self) -> usize {
        self.engine.threads
    }

    /// Has the filter told to the engine, if there is one.
    fn ask<T>(&self, ask: impl FnOnce(&Engine<'_>) -> T) -> T {
        if F::FILTERS {
            ask(&Engine { filter: Some(&self.filter), ..self.engine })
        } else {
            ask(&self.engine)
        }
    }
}
