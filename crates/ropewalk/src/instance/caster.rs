//! Batches of rays over instances, in passes.

use super::scene::FACES;
use super::{InstanceHit, InstancedScene};
use crate::double::{DoubleCaster, DoubleFilter, DoubleHit, DoubleRay};
use crate::kernel::{Level, NoFilter};
use rayon::prelude::*;

/// Rays that are answered together: many, since those of an instance make a batch.
const TASK: usize = 16_384;

/// The hits of a batch: one entry a ray.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InstanceBatchHit {
    /// Parameter of the hit; infinite for a miss.
    pub t: Vec<f64>,
    /// Instance of the hit; `u32::MAX` for a miss.
    pub instance: Vec<u32>,
    /// Triangle of the hit within its object; `u32::MAX` for a miss.
    pub prim_id: Vec<u32>,
}

/// All hits of a batch in compressed rows: those of ray `i` are `offsets[i]..offsets[i + 1]`, in order of
/// `(t, instance, prim_id)`, each once.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InstanceAllHits {
    /// Row starts; one more than there are rays.
    pub offsets: Vec<usize>,
    /// Parameters.
    pub t: Vec<f64>,
    /// Instances.
    pub instance: Vec<u32>,
    /// Triangles within their objects.
    pub prim_id: Vec<u32>,
}

/// Decides which hits count; see [`HitFilter`](crate::kernel::HitFilter) for what it may rely on.
pub trait InstanceFilter: Sync {
    /// False if nothing is ever refused; then it is not asked.
    const FILTERS: bool = true;

    /// True if the hit of the ray with this index in the batch counts.
    fn accepts(&self, ray: usize, hit: &InstanceHit) -> bool;

    /// False if the ray hits nothing of the instance, which then is not visited.
    fn visits(&self, _ray: usize, _instance: u32) -> bool {
        true
    }
}

impl InstanceFilter for NoFilter {
    const FILTERS: bool = false;

    fn accepts(&self, _ray: usize, _hit: &InstanceHit) -> bool {
        true
    }
}

impl<F: Fn(usize, &InstanceHit) -> bool + Sync> InstanceFilter for F {
    fn accepts(&self, ray: usize, hit: &InstanceHit) -> bool {
        self(ray, hit)
    }
}

/// Answers batches of rays over an [`InstancedScene`].
#[derive(Clone, Copy)]
pub struct InstanceCaster<'a, F = NoFilter> {
    scene: &'a InstancedScene,
    level: Level,
    threads: usize,
    filter: F,
}

impl<'a> InstanceCaster<'a> {
    /// A caster at the best level of this machine, on all threads of the current rayon pool.
    pub fn new(scene: &'a InstancedScene) -> Self {
        InstanceCaster { scene, level: Level::best(), threads: 0, filter: NoFilter }
    }
}

impl<'a, F> InstanceCaster<'a, F> {
    /// The same with a filter that decides which hits count.
    pub fn with_filter<G: InstanceFilter>(self, filter: G) -> InstanceCaster<'a, G> {
        let InstanceCaster { scene, level, threads, .. } = self;
        InstanceCaster { scene, level, threads, filter }
    }
}

/// The interval in which a ray may be in the box of an instance.
#[derive(Clone, Copy)]
struct Visit {
    enter: f64,
    leave: f64,
    instance: u32,
}

impl<F: InstanceFilter> InstanceCaster<'_, F> {
    /// The same with another level, or `None` if this machine lacks it.
    pub fn with_level(self, level: Level) -> Option<Self> {
        level.is_available().then_some(InstanceCaster { level, ..self })
    }

    /// The same on the calling thread only (`1`) or on the current rayon pool (`0`).
    pub fn with_threads(self, threads: usize) -> Self {
        InstanceCaster { threads, ..self }
    }

    /// The first hit of each ray.
    pub fn closest_hit(&self, rays: &[DoubleRay]) -> InstanceBatchHit {
        let n = rays.len();
        let mut hit =
            InstanceBatchHit { t: vec![0.0; n], instance: vec![0; n], prim_id: vec![0; n] };
        self.closest_hit_into(rays, &mut hit.t, &mut hit.instance, &mut hit.prim_id);
        hit
    }

    /// The first hit of each ray, into arrays of the same length as `rays`.
    ///
    /// # Panics
    /// If the lengths differ.
    pub fn closest_hit_into(
        &self,
        rays: &[DoubleRay],
        t: &mut [f64],
        instance: &mut [u32],
        prim_id: &mut [u32],
    ) {
        let n = rays.len();
        assert!(t.len() == n && instance.len() == n && prim_id.len() == n, "one entry a ray");
        let out = t.chunks_mut(TASK).zip(instance.chunks_mut(TASK)).zip(prim_id.chunks_mut(TASK));
        self.each(rays, out.collect(), |rays, first, ((t, instance), prim_id)| {
            t.fill(f64::INFINITY);
            instance.fill(u32::MAX);
            prim_id.fill(u32::MAX);
            let mut passes = self.passes(rays, first);
            while passes.advance(|ray, visit| visit.enter <= t[ray]) {
                for group in passes.groups() {
                    // Ranges end at the best hit so far, where ties still count.
                    let asked = self.rays(rays, group, |ray| t[ray]);
                    let hits = self.ask(group, first, |caster| caster.closest_hit(&asked));
                    for (&(i, ray), (new_t, id)) in
                        group.iter().zip(hits.t.iter().zip(hits.prim_id))
                    {
                        let ray = ray as usize;
                        let best = InstanceHit {
                            t: t[ray],
                            instance: instance[ray],
                            prim_id: prim_id[ray],
                        };
                        let hit = InstanceHit { t: *new_t, instance: i, prim_id: id };
                        if id != u32::MAX && hit.is_before(&best) {
                            (t[ray], instance[ray], prim_id[ray]) = (hit.t, i, id);
                        }
                    }
                }
            }
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
        self.each(rays, hit.chunks_mut(TASK).collect(), |rays, first, hit: &mut [bool]| {
            hit.fill(false);
            let mut passes = self.passes(rays, first);
            while passes.advance(|ray, _| !hit[ray]) {
                for group in passes.groups() {
                    let asked = self.rays(rays, group, |_| f64::INFINITY);
                    let hits = self.ask(group, first, |caster| caster.occluded(&asked));
                    for (&(_, ray), is_hit) in group.iter().zip(hits) {
                        hit[ray as usize] |= is_hit;
                    }
                }
            }
        });
    }

    /// The number of triangles that each ray hits.
    pub fn count_hits(&self, rays: &[DoubleRay]) -> Vec<u32> {
        let mut counts = vec![0; rays.len()];
        self.each(rays, counts.chunks_mut(TASK).collect(), |rays, first, counts: &mut [u32]| {
            let mut passes = self.passes(rays, first);
            while passes.advance(|_, _| true) {
                for group in passes.groups() {
                    let asked = self.rays(rays, group, |_| f64::INFINITY);
                    let found = self.ask(group, first, |caster| caster.count_hits(&asked));
                    for (&(_, ray), found) in group.iter().zip(found) {
                        counts[ray as usize] += found;
                    }
                }
            }
        });
        counts
    }

    /// All hits of each ray, in order, each once.
    pub fn all_hits(&self, rays: &[DoubleRay]) -> InstanceAllHits {
        self.first_hits(rays, usize::MAX)
    }

    /// The first `k` hits of each ray, in order, each once.
    pub fn first_hits(&self, rays: &[DoubleRay], k: usize) -> InstanceAllHits {
        let mut all = InstanceAllHits { offsets: vec![0], ..InstanceAllHits::default() };
        if k == 0 {
            all.offsets.resize(rays.len() + 1, 0);
            return all;
        }
        let tasks = vec![(); rays.len().div_ceil(TASK)];
        let parts = self.each(rays, tasks, |rays, first, ()| {
            let mut found: Vec<Vec<InstanceHit>> = vec![Vec::new(); rays.len()];
            // Hits behind this one no longer matter.
            let mut limit = vec![f64::INFINITY; rays.len()];
            let mut passes = self.passes(rays, first);
            while passes.advance(|ray, visit| visit.enter <= limit[ray]) {
                for group in passes.groups() {
                    let asked = self.rays(rays, group, |ray| limit[ray]);
                    let hits = self.ask(group, first, |caster| caster.first_hits(&asked, k));
                    for (j, &(instance, ray)) in group.iter().enumerate() {
                        let row = hits.offsets[j]..hits.offsets[j + 1];
                        let found = &mut found[ray as usize];
                        found.extend(row.map(|h| InstanceHit {
                            t: hits.t[h],
                            instance,
                            prim_id: hits.prim_id[h],
                        }));
                        if found.len() >= k {
                            found.sort_unstable_by(InstanceHit::order);
                            found.truncate(k);
                            limit[ray as usize] = found[k - 1].t;
                        }
                    }
                }
            }
            found.iter_mut().for_each(|hits| hits.sort_unstable_by(InstanceHit::order));
            found
        });
        for hits in parts.iter().flatten() {
            for hit in hits {
                all.t.push(hit.t);
                all.instance.push(hit.instance);
                all.prim_id.push(hit.prim_id);
            }
            all.offsets.push(all.t.len());
        }
        all
    }

    /// Does the work for each [`TASK`] rays, the index of the first of them and their part of the answers.
    fn each<A: Send, T: Send>(
        &self,
        rays: &[DoubleRay],
        answers: Vec<A>,
        work: impl Fn(&[DoubleRay], usize, A) -> T + Sync,
    ) -> Vec<T> {
        let work = |(i, (rays, answer)): (usize, (&[DoubleRay], A))| work(rays, i * TASK, answer);
        if self.threads == 1 || rays.len() <= TASK {
            return rays.chunks(TASK).zip(answers).enumerate().map(work).collect();
        }
        rays.par_chunks(TASK).zip(answers).enumerate().map(work).collect()
    }

    /// The rays of a group in the space of its object, none beyond a limit.
    fn rays(
        &self,
        rays: &[DoubleRay],
        group: &[(u32, u32)],
        limit: impl Fn(usize) -> f64,
    ) -> Vec<DoubleRay> {
        let transform = &self.scene.instances()[group[0].0 as usize].transform;
        let moved = |&(_, ray): &(u32, u32)| {
            let moved = transform.ray_to_object(&rays[ray as usize]);
            DoubleRay { t_max: moved.t_max.min(limit(ray as usize)), ..moved }
        };
        group.iter().map(moved).collect()
    }

    /// Asks the object of a group, hits filtered where that is wanted.
    fn ask<T>(
        &self,
        group: &[(u32, u32)],
        first: usize,
        ask: impl FnOnce(DoubleCaster<'_, Grouped<'_, F>>) -> T,
    ) -> T {
        let instance = group[0].0;
        let object = &self.scene.instances()[instance as usize].object;
        let caster = DoubleCaster::new(&object.tree, &object.geometry).with_threads(1);
        let caster = caster.with_level(self.level).expect("the level has been checked");
        ask(caster.with_filter(Grouped { group, first, filter: &self.filter }))
    }

    /// Which instances the rays come to, from near to far.
    fn passes(&self, rays: &[DoubleRay], first: usize) -> Passes {
        let mut passes = Passes {
            visits: Vec::new(),
            rest: Vec::with_capacity(rays.len()),
            under_way: Vec::with_capacity(rays.len()),
            pairs: Vec::new(),
        };
        let Some(top) = self.scene.top() else { return passes };
        let whole = |ray: &DoubleRay| ray.with_range(f64::NEG_INFINITY, f64::INFINITY);
        let lines: Vec<DoubleRay> = rays.iter().map(whole).collect();
        let caster = DoubleCaster::new(&top.tree, &top.geometry).with_threads(1);
        let caster = caster.with_level(self.level).expect("the level has been checked");
        // Also of boxes that the ray only touches.
        let walls = caster.all_touched(&lines);
        let mut row: Vec<Visit> = Vec::new();
        for (i, ray) in rays.iter().enumerate() {
            row.clear();
            if ray.is_valid() && self.scene.is_far(ray) {
                let (enter, leave) = (f64::NEG_INFINITY, f64::INFINITY);
                let all = 0..self.scene.instances().len() as u32;
                row.extend(all.map(|instance| Visit { enter, leave, instance }));
            } else if ray.is_valid() {
                let hits = walls.offsets[i]..walls.offsets[i + 1];
                row.extend(hits.map(|h| {
                    let (t, instance) = (walls.t[h], walls.prim_id[h] / FACES);
                    Visit { enter: t, leave: t, instance }
                }));
                row.sort_by_key(|visit| visit.instance);
                row.dedup_by(|wall, visit| {
                    let same = wall.instance == visit.instance;
                    if same {
                        visit.enter = visit.enter.min(wall.enter);
                        visit.leave = visit.leave.max(wall.leave);
                    }
                    same
                });
                row.retain(|visit| visit.enter <= ray.t_max && ray.t_min <= visit.leave);
                row.sort_by(|a, b| a.enter.total_cmp(&b.enter));
            }
            if F::FILTERS {
                row.retain(|visit| self.filter.visits(first + i, visit.instance));
            }
            let from = passes.visits.len();
            passes.visits.extend_from_slice(&row);
            passes.rest.push((from, passes.visits.len()));
            passes.under_way.push(i as u32);
        }
        passes
    }
}

/// A filter as the object of a group sees it.
struct Grouped<'a, F> {
    group: &'a [(u32, u32)],
    first: usize,
    filter: &'a F,
}

impl<F: InstanceFilter> DoubleFilter for Grouped<'_, F> {
    const FILTERS: bool = F::FILTERS;

    fn accepts(&self, index: usize, hit: &DoubleHit) -> bool {
        let (instance, ray) = self.group[index];
        let hit = InstanceHit { t: hit.t, instance, prim_id: hit.prim_id };
        self.filter.accepts(self.first + ray as usize, &hit)
    }
}

/// Rays on their way from instance to instance.
struct Passes {
    /// The instances that each ray comes to, from near to far.
    visits: Vec<Visit>,
    /// Where those still to be visited by a ray begin and end.
    rest: Vec<(usize, usize)>,
    /// Rays that have some left.
    under_way: Vec<u32>,
    /// Instances and the rays that visit them in this pass, in order.
    pairs: Vec<(u32, u32)>,
}

impl Passes {
    /// Sends each ray to its next instance, unless that is not `wanted`, when the ray ends; false once all
    /// have ended.
    fn advance(&mut self, wanted: impl Fn(usize, &Visit) -> bool) -> bool {
        self.pairs.clear();
        let Passes { visits, rest, under_way, pairs } = self;
        under_way.retain(|&ray| {
            let (next, end) = &mut rest[ray as usize];
            let Some(visit) = visits[*next..*end].first() else { return false };
            let goes = wanted(ray as usize, visit);
            if goes {
                pairs.push((visit.instance, ray));
                *next += 1;
            }
            goes
        });
        pairs.sort_unstable();
        !pairs.is_empty()
    }

    /// The rays of this pass by instance.
    fn groups(&self) -> impl Iterator<Item = &[(u32, u32)]> {
        self.pairs.chunk_by(|a, b| a.0 == b.0)
    }
}
