//! The crate `obvhs`: an eight-wide compressed tree (CWBVH) with pre-split triangles.

use crate::answer::{BenchHit, HitLists};
use crate::harness::{Builder, Built, Clock, Engine, Family};
use crate::scene::Mesh;
use crate::workload::Question;
use glam::Vec3A;
use obvhs::BvhBuildParams;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::RayHit;
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;
use ropewalk::Ray;
use std::time::Duration;

/// A built tree; the triangles lie in the order of its leaves, as in the crate's own examples.
pub struct ObvhsPeer {
    tree: CwBvh,
    triangles: Vec<RtTriangle>,
}

/// The preset that a fair comparison with Embree's high quality asks for: with spatial pre-splits.
const PRESET: BvhBuildParams = BvhBuildParams::slow_build();

impl ObvhsPeer {
    /// Builds a tree.
    pub fn build(mesh: &Mesh) -> Self {
        Self::from_triangles(&triangles(mesh))
    }

    fn from_triangles(triangles: &[Triangle]) -> Self {
        let tree = build_cwbvh_from_tris(triangles, PRESET, &mut Duration::default());
        let order = tree.primitive_indices.iter();
        let triangles = order.map(|&i| RtTriangle::from(&triangles[i as usize])).collect();
        ObvhsPeer { tree, triangles }
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.tree.nodes[..])
            + size_of_val(&self.tree.primitive_indices[..])
            + size_of_val(&self.triangles[..])
    }
}

fn triangles(mesh: &Mesh) -> Vec<Triangle> {
    let corners = |f: usize| mesh.triangle(f as u32).map(Vec3A::from);
    (0..mesh.faces.len())
        .map(|f| {
            let [v0, v1, v2] = corners(f);
            Triangle { v0, v1, v2 }
        })
        .collect()
}

fn convert(ray: &Ray) -> obvhs::ray::Ray {
    obvhs::ray::Ray::new(ray.origin.into(), ray.dir.into(), ray.t_min, ray.t_max)
}

impl Engine for ObvhsPeer {
    fn name(&self) -> String {
        "obvhs".into()
    }

    fn family(&self) -> Family {
        Family::Peer
    }

    fn supports(&self, question: Question) -> bool {
        question != Question::Build
    }

    fn closest(&self, rays: &[Ray], out: &mut [BenchHit]) {
        for (ray, hit) in rays.iter().zip(out) {
            let mut found = RayHit::none();
            let test = |r: &obvhs::ray::Ray, id: usize| self.triangles[id].intersect(r);
            let any = self.tree.ray_traverse(convert(ray), &mut found, test);
            *hit = if any {
                let prim = self.tree.primitive_indices[found.primitive_id as usize];
                BenchHit { t: found.t, prim }
            } else {
                BenchHit::MISS
            };
        }
    }

    fn occluded(&self, rays: &[Ray], out: &mut [bool]) {
        for (ray, flag) in rays.iter().zip(out) {
            let test = |r: &obvhs::ray::Ray, id: usize| self.triangles[id].intersect(r);
            *flag = !self.tree.ray_traverse_miss(convert(ray), test);
        }
    }

    fn hits(&self, rays: &[Ray], limit: usize, out: &mut HitLists) {
        out.clear();
        let mut found = Vec::new();
        for ray in rays {
            self.tree.ray_traverse_anyhit(convert(ray), |r, id| {
                let t = self.triangles[id].intersect(r);
                if t < f32::INFINITY {
                    found.push(BenchHit { t, prim: self.tree.primitive_indices[id] });
                }
            });
            out.push_unordered(&mut found, limit);
        }
    }
}

/// Times builds, one thread (the crate's parallel feature is off).
pub struct ObvhsBuilder<'a>(pub &'a Mesh);

impl Builder for ObvhsBuilder<'_> {
    fn name(&self) -> String {
        "obvhs".into()
    }

    fn family(&self) -> Family {
        Family::Peer
    }

    fn is_parallel(&self) -> bool {
        false
    }

    fn build(&self, threads: usize) -> anyhow::Result<Built> {
        anyhow::ensure!(threads == 1, "built without its parallel feature");
        let input = triangles(self.0);
        let clock = Clock::start();
        let built = ObvhsPeer::from_triangles(&input);
        let (seconds, wall_seconds) = clock.elapsed();
        Ok(Built { seconds, wall_seconds, bytes: Some(built.bytes()) })
    }
}
