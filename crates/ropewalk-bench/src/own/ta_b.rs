//! The reference path: the binary BSP, one ray at a time, one triangle at a time, in `f64`. What a
//! textbook kd-tree does.

use crate::answer::{BenchHit, HitLists};
use crate::harness::{Builder, Built, Clock, Engine, Family};
use crate::scene::Mesh;
use crate::workload::{FIRST_HITS, Question};
use ropewalk::build::{BuildSettings, build};
use ropewalk::primitive::Triangle;
use ropewalk::traverse::{ClosestHit, NoCounts, Occluded, Query, ta_b};
use ropewalk::tree::BspTree;
use ropewalk::{Geometry, Hit, Ray, Sides};

/// The tree of the default settings, walked by TA-B.
pub struct TaB {
    geometry: Geometry,
    tree: BspTree,
}

impl TaB {
    /// Builds a tree with `threads` threads.
    ///
    /// # Errors
    /// What the builder says.
    pub fn build(mesh: &Mesh, threads: usize) -> anyhow::Result<Self> {
        Self::over(geometry(mesh)?, threads)
    }

    fn over(geometry: Geometry, threads: usize) -> anyhow::Result<Self> {
        let settings = BuildSettings { threads, ..BuildSettings::default() };
        let (tree, _) = build(&geometry, &settings, &())?;
        Ok(TaB { geometry, tree })
    }

    fn ask<Q: Query>(&self, ray: &Ray) -> Q::Answer {
        ta_b::<Q, _>(&self.geometry, &self.tree, ray, &mut NoCounts)
    }

    fn lists<const K: usize>(&self, rays: &[Ray], out: &mut HitLists) {
        out.clear();
        for ray in rays {
            out.push_unordered(&mut self.ask::<FirstHits<K>>(ray), K);
        }
    }
}

/// The triangles of a mesh, face `i` as primitive `i`, hit on both sides.
///
/// # Errors
/// What [`Geometry::push`] says.
pub fn geometry(mesh: &Mesh) -> anyhow::Result<Geometry> {
    let mut geometry = Geometry::new();
    for face in 0..mesh.faces.len() as u32 {
        geometry.push(Triangle { vertices: mesh.triangle(face) }, Sides::Both)?;
    }
    Ok(geometry)
}

fn convert(hit: Option<Hit>) -> BenchHit {
    hit.map_or(BenchHit::MISS, |h| BenchHit { t: h.t, prim: h.prim_id })
}

/// The first `K` hits; with `usize::MAX` all of them, unordered and with repetitions.
#[derive(Default)]
struct FirstHits<const K: usize> {
    found: Vec<BenchHit>,
}

impl<const K: usize> Query for FirstHits<K> {
    type Answer = Vec<BenchHit>;

    fn offer(&mut self, hit: Hit) {
        let hit = BenchHit { t: hit.t, prim: hit.prim_id };
        if K == usize::MAX {
            self.found.push(hit);
        } else if let Err(place) = self.found.binary_search_by(|h| h.order(&hit)) {
            self.found.insert(place, hit);
            self.found.truncate(K);
        }
    }

    fn done_at(&self, t: f64) -> bool {
        self.found.len() == K && f64::from(self.found[K - 1].t) < t
    }

    fn answer(self) -> Vec<BenchHit> {
        self.found
    }
}

impl Engine for TaB {
    fn name(&self) -> String {
        "ropewalk-ta-b".into()
    }

    fn family(&self) -> Family {
        Family::Own
    }

    fn level(&self) -> &str {
        "scalar"
    }

    fn supports(&self, question: Question) -> bool {
        question != Question::Build
    }

    fn closest(&self, rays: &[Ray], out: &mut [BenchHit]) {
        for (ray, hit) in rays.iter().zip(out) {
            *hit = convert(self.ask::<ClosestHit>(ray));
        }
    }

    fn occluded(&self, rays: &[Ray], out: &mut [bool]) {
        for (ray, flag) in rays.iter().zip(out) {
            *flag = self.ask::<Occluded>(ray);
        }
    }

    fn hits(&self, rays: &[Ray], limit: usize, out: &mut HitLists) {
        if limit == FIRST_HITS {
            self.lists::<FIRST_HITS>(rays, out)
        } else {
            debug_assert_eq!(limit, usize::MAX);
            self.lists::<{ usize::MAX }>(rays, out)
        }
    }
}

/// Times builds of the reference tree.
pub struct TaBBuilder<'a>(pub &'a Mesh);

impl Builder for TaBBuilder<'_> {
    fn name(&self) -> String {
        "ropewalk-bsp".into()
    }

    fn family(&self) -> Family {
        Family::Own
    }

    fn build(&self, threads: usize) -> anyhow::Result<Built> {
        let geometry = geometry(self.0)?;
        let triangles = geometry.len() * size_of::<Triangle>();
        let clock = Clock::start();
        let built = TaB::over(geometry, threads)?;
        let (cpu, wall_seconds) = clock.elapsed();
        let seconds = if threads == 1 { cpu } else { wall_seconds };
        let tree = &built.tree;
        let bytes = size_of_val(tree.nodes()) + tree.reference_count() * size_of::<u32>();
        Ok(Built { seconds, wall_seconds, bytes: Some(bytes + triangles) })
    }
}
