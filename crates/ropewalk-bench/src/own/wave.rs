//! The fast path: the wide tree and the batch kernels.

use super::ta_b::geometry;
use crate::answer::{BenchHit, HitLists};
use crate::harness::{Builder, Built, Clock, Engine, Family};
use crate::scene::Mesh;
use crate::workload::Question;
use ropewalk::build::{BuildSettings, Preset};
use ropewalk::kernel::{AllHits, BatchCaster};
use ropewalk::point::PointQueries;
use ropewalk::wide::WideTree;
use ropewalk::{Geometry, Ray};
use std::cell::RefCell;
use std::sync::Arc;

/// The wide tree, one batch call a workload, at the best SIMD level of the machine.
#[derive(Clone)]
pub struct Wave {
    geometry: Arc<Geometry>,
    tree: Arc<WideTree>,
}

/// The default preset of the wide tree.
pub fn settings(threads: usize) -> BuildSettings {
    BuildSettings { threads, ..BuildSettings::preset(Preset::Balanced) }
}

impl Wave {
    /// Builds a tree with `threads` threads.
    ///
    /// # Errors
    /// What the builder or the compiler says.
    pub fn build(mesh: &Mesh, threads: usize) -> anyhow::Result<Self> {
        Self::with_settings(mesh, &settings(threads))
    }

    /// Builds a tree with these settings.
    ///
    /// # Errors
    /// What the builder or the compiler says.
    pub fn with_settings(mesh: &Mesh, settings: &BuildSettings) -> anyhow::Result<Self> {
        Self::over(geometry(mesh)?, settings)
    }

    /// Builds a tree over primitives.
    ///
    /// # Errors
    /// What the builder or the compiler says.
    pub fn over(geometry: Geometry, settings: &BuildSettings) -> anyhow::Result<Self> {
        let (tree, _) = WideTree::build(&geometry, settings, &())?;
        Ok(Wave { geometry: Arc::new(geometry), tree: Arc::new(tree) })
    }

    /// The triangles.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// The tree.
    pub fn tree(&self) -> &WideTree {
        &self.tree
    }

    /// Bytes of the tree, its own triangles included.
    pub fn bytes(&self) -> usize {
        self.tree.bytes()
    }

    /// The caster on one thread.
    pub fn caster(&self) -> BatchCaster<'_> {
        BatchCaster::new(&self.tree, &self.geometry).with_threads(1)
    }

    /// The queries about points on one thread.
    ///
    /// # Errors
    /// If the tree holds anything but triangles.
    pub fn points(&self) -> anyhow::Result<PointQueries<'_>> {
        Ok(PointQueries::new(&*self.tree, &*self.geometry)?.with_threads(1))
    }
}

impl Engine for Wave {
    fn name(&self) -> String {
        "ropewalk-wave".into()
    }

    fn family(&self) -> Family {
        Family::Own
    }

    fn level(&self) -> &str {
        self.caster().level().name()
    }

    fn supports(&self, question: Question) -> bool {
        question != Question::Build
    }

    fn closest(&self, rays: &[Ray], out: &mut [BenchHit]) {
        // Arrays are kept, as a caller that asks often keeps its own.
        thread_local! {
            static HITS: RefCell<(Vec<f32>, Vec<u32>)> = const { RefCell::new((vec![], vec![])) };
        }
        HITS.with_borrow_mut(|(t, prim)| {
            t.resize(rays.len(), 0.0);
            prim.resize(rays.len(), 0);
            self.caster().closest_hit_into(rays, t, prim);
            for ((out, &t), &prim) in out.iter_mut().zip(&*t).zip(&*prim) {
                *out = BenchHit { t, prim };
            }
        });
    }

    fn occluded(&self, rays: &[Ray], out: &mut [bool]) {
        self.caster().occluded_into(rays, out);
    }

    fn hits(&self, rays: &[Ray], limit: usize, out: &mut HitLists) {
        let HitLists { offsets, t, prim } = std::mem::take(out);
        let mut all = AllHits { offsets, t, prim_id: prim };
        self.caster().first_hits_into(rays, limit, &mut all);
        *out = HitLists { offsets: all.offsets, t: all.t, prim: all.prim_id };
    }
}

/// The same tree, one call a ray.
pub struct Single(pub Wave);

impl Engine for Single {
    fn name(&self) -> String {
        "ropewalk-single".into()
    }

    fn family(&self) -> Family {
        Family::Own
    }

    fn level(&self) -> &str {
        self.0.level()
    }

    fn supports(&self, question: Question) -> bool {
        matches!(question, Question::Closest | Question::Occluded | Question::Walk)
    }

    fn closest(&self, rays: &[Ray], out: &mut [BenchHit]) {
        let caster = self.0.caster();
        for (ray, out) in rays.iter().zip(out) {
            let hit = caster.closest_hit_one(ray);
            *out = hit.map_or(BenchHit::MISS, |hit| BenchHit { t: hit.t, prim: hit.prim_id });
        }
    }

    fn occluded(&self, rays: &[Ray], out: &mut [bool]) {
        let caster = self.0.caster();
        for (ray, out) in rays.iter().zip(out) {
            *out = caster.occluded_one(ray);
        }
    }
}

/// Times builds of the wide tree, the binary tree included.
pub struct WaveBuilder<'a>(pub &'a Mesh);

impl Builder for WaveBuilder<'_> {
    fn name(&self) -> String {
        "ropewalk-wide".into()
    }

    fn family(&self) -> Family {
        Family::Own
    }

    fn build(&self, threads: usize) -> anyhow::Result<Built> {
        let geometry = geometry(self.0)?;
        let clock = Clock::start();
        let built = Wave::over(geometry, &settings(threads))?;
        let (cpu, wall_seconds) = clock.elapsed();
        let seconds = if threads == 1 { cpu } else { wall_seconds };
        Ok(Built { seconds, wall_seconds, bytes: Some(built.bytes()) })
    }
}
