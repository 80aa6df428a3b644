//! The crate `parry3d`: its triangle mesh and the tree inside.

use crate::answer::{BenchHit, HitLists};
use crate::harness::{Builder, Built, Clock, Engine, Family};
use crate::scene::Mesh;
use crate::workload::Question;
use parry3d::math::Vector;
use parry3d::query::RayCast;
use parry3d::shape::{CompositeShapeRef, TriMesh};
use ropewalk::Ray;

/// A built mesh.
pub struct ParryPeer(TriMesh);

impl ParryPeer {
    /// Builds a mesh with its tree.
    ///
    /// # Errors
    /// If the crate refuses the mesh.
    pub fn build(mesh: &Mesh) -> anyhow::Result<Self> {
        let vertices = mesh.vertices.iter().map(|&v| Vector::from(v)).collect();
        Ok(ParryPeer(TriMesh::new(vertices, mesh.faces.clone())?))
    }
}

fn convert(ray: &Ray) -> parry3d::query::Ray {
    parry3d::query::Ray::new(Vector::from(ray.origin), Vector::from(ray.dir))
}

/// An unbounded ray ends here, as the crate's documentation asks.
fn end(ray: &Ray) -> f32 {
    ray.t_max.min(f32::MAX)
}

impl Engine for ParryPeer {
    fn name(&self) -> String {
        "parry3d".into()
    }

    fn family(&self) -> Family {
        Family::Peer
    }

    fn supports(&self, question: Question) -> bool {
        question != Question::Build
    }

    fn closest(&self, rays: &[Ray], out: &mut [BenchHit]) {
        for (ray, hit) in rays.iter().zip(out) {
            let found = CompositeShapeRef(&self.0).cast_local_ray(&convert(ray), end(ray), false);
            *hit = found.map_or(BenchHit::MISS, |(prim, t)| BenchHit { t, prim });
        }
    }

    /// The crate has no any-hit query; its nearest hit answers.
    fn occluded(&self, rays: &[Ray], out: &mut [bool]) {
        for (ray, flag) in rays.iter().zip(out) {
            *flag = self.0.cast_local_ray(&convert(ray), end(ray), false).is_some();
        }
    }

    fn hits(&self, rays: &[Ray], limit: usize, out: &mut HitLists) {
        out.clear();
        let mut found = Vec::new();
        for ray in rays {
            let (query, end) = (convert(ray), end(ray));
            for prim in self.0.bvh().leaves(|node| node.cast_ray(&query, end) < f32::MAX) {
                let triangle = self.0.triangle(prim);
                if let Some(t) = triangle.cast_local_ray(&query, end, false) {
                    found.push(BenchHit { t, prim });
                }
            }
            out.push_unordered(&mut found, limit);
        }
    }
}

/// Times builds.
pub struct ParryBuilder<'a>(pub &'a Mesh);

impl Builder for ParryBuilder<'_> {
    fn name(&self) -> String {
        "parry3d".into()
    }

    fn family(&self) -> Family {
        Family::Peer
    }

    fn is_parallel(&self) -> bool {
        false
    }

    fn build(&self, threads: usize) -> anyhow::Result<Built> {
        anyhow::ensure!(threads == 1, "the crate builds with one thread");
        let clock = Clock::start();
        let built = ParryPeer::build(self.0)?;
        let (seconds, wall_seconds) = clock.elapsed();
        Ok(Built { seconds, wall_seconds, bytes: Some(built.0.total_memory_size()) })
    }
}
