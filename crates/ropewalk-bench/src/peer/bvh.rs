//! The crate `bvh`: a binary tree in `f32`, walked by its own iterators.
//!
//! Its own triangle test culls back faces; a two-sided one (Möller and Trumbore 1997) stands in.

use crate::answer::{BenchHit, HitLists};
use crate::harness::{Builder, Built, Clock, Engine, Family};
use crate::scene::Mesh;
use crate::workload::Question;
use bvh::aabb::{Aabb, Bounded};
use bvh::bounding_hierarchy::BHShape;
use bvh::bvh::{Bvh, BvhNode};
use nalgebra::{Point3, Vector3};
use ropewalk::Ray;

struct Shape {
    corners: [Point3<f32>; 3],
    prim: u32,
    node: usize,
}

impl Bounded<f32, 3> for Shape {
    fn aabb(&self) -> Aabb<f32, 3> {
        let [a, b, c] = self.corners;
        Aabb::with_bounds(a.inf(&b).inf(&c), a.sup(&b).sup(&c))
    }
}

impl BHShape<f32, 3> for Shape {
    fn set_bh_node_index(&mut self, index: usize) {
        self.node = index;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

impl Shape {
    /// The parameter of a hit from either side within the range.
    fn intersect(&self, ray: &Ray) -> Option<f32> {
        let (origin, dir) = (Point3::from(ray.origin), Vector3::from(ray.dir));
        let [a, b, c] = self.corners;
        let (ab, ac) = (b - a, c - a);
        let p = dir.cross(&ac);
        let inv = 1.0 / ab.dot(&p);
        let s = origin - a;
        let u = s.dot(&p) * inv;
        let q = s.cross(&ab);
        let v = dir.dot(&q) * inv;
        let t = ac.dot(&q) * inv;
        let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0;
        (inside && t >= ray.t_min && t <= ray.t_max).then_some(t)
    }
}

/// A built tree.
pub struct BvhPeer {
    tree: Bvh<f32, 3>,
    shapes: Vec<Shape>,
}

impl BvhPeer {
    /// Builds a tree.
    pub fn build(mesh: &Mesh) -> Self {
        let mut shapes = shapes(mesh);
        BvhPeer { tree: Bvh::build(&mut shapes), shapes }
    }
}

fn shapes(mesh: &Mesh) -> Vec<Shape> {
    (0..mesh.faces.len() as u32)
        .map(|prim| Shape { corners: mesh.triangle(prim).map(Point3::from), prim, node: 0 })
        .collect()
}

fn convert(ray: &Ray) -> bvh::ray::Ray<f32, 3> {
    bvh::ray::Ray::new(ray.origin.into(), ray.dir.into())
}

impl Engine for BvhPeer {
    fn name(&self) -> String {
        "bvh".into()
    }

    fn family(&self) -> Family {
        Family::Peer
    }

    fn supports(&self, question: Question) -> bool {
        question != Question::Build
    }

    /// Leaves come by distance of their boxes, so the search ends at the first box beyond the
    /// best hit or the end of the ray.
    fn closest(&self, rays: &[Ray], out: &mut [BenchHit]) {
        for (ray, hit) in rays.iter().zip(out) {
            let (query, mut best) = (convert(ray), BenchHit { t: ray.t_max, ..BenchHit::MISS });
            for shape in self.tree.nearest_traverse_iterator(&query, &self.shapes) {
                let entry = query.intersection_slice_for_aabb(&shape.aabb());
                if entry.is_some_and(|(near, _)| near > best.t) {
                    break;
                }
                if let Some(t) = shape.intersect(ray)
                    && (t < best.t || !best.is_hit())
                {
                    best = BenchHit { t, prim: shape.prim };
                }
            }
            *hit = if best.is_hit() { best } else { BenchHit::MISS };
        }
    }

    fn occluded(&self, rays: &[Ray], out: &mut [bool]) {
        for (ray, flag) in rays.iter().zip(out) {
            let query = convert(ray);
            let mut leaves = self.tree.traverse_iterator(&query, &self.shapes);
            *flag = leaves.any(|shape| shape.intersect(ray).is_some());
        }
    }

    fn hits(&self, rays: &[Ray], limit: usize, out: &mut HitLists) {
        out.clear();
        let mut found = Vec::new();
        for ray in rays {
            let query = convert(ray);
            let leaves = self.tree.traverse_iterator(&query, &self.shapes);
            found.extend(leaves.filter_map(|shape| {
                shape.intersect(ray).map(|t| BenchHit { t, prim: shape.prim })
            }));
            out.push_unordered(&mut found, limit);
        }
    }
}

/// Times builds.
pub struct BvhBuilder<'a>(pub &'a Mesh);

impl Builder for BvhBuilder<'_> {
    fn name(&self) -> String {
        "bvh".into()
    }

    fn family(&self) -> Family {
        Family::Peer
    }

    fn build(&self, threads: usize) -> anyhow::Result<Built> {
        let mut shapes = shapes(self.0);
        let clock = Clock::start();
        let tree = if threads == 1 {
            Bvh::build(&mut shapes)
        } else {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
            pool.install(|| Bvh::build_with_executor(&mut shapes, bvh::bvh::rayon_executor))
        };
        let (cpu, wall_seconds) = clock.elapsed();
        let bytes = tree.nodes.len() * size_of::<BvhNode<f32, 3>>() + size_of_val(&shapes[..]);
        let seconds = if threads == 1 { cpu } else { wall_seconds };
        Ok(Built { seconds, wall_seconds, bytes: Some(bytes) })
    }
}
