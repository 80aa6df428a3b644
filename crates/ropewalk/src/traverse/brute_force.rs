//! The naive search: every primitive against every ray. The oracle of all tests.

use crate::geometry::Geometry;
use crate::ray::{Hit, PreparedRay, Ray};
use crate::traverse::{ClosestHit, Counters, Occluded, Query, RayCaster};

/// Answers rays by testing all primitives in order of id; O(N) per ray.
#[derive(Clone, Copy)]
pub struct BruteForce<'a> {
    /// What is tested.
    pub geometry: &'a Geometry,
}

/// Tests every primitive in turn until the query is satisfied.
pub fn brute_force<Q: Query, C: Counters>(
    geometry: &Geometry,
    ray: &Ray,
    counters: &mut C,
) -> Q::Answer {
    let mut query = Q::default();
    let Some(ray) = PreparedRay::new(ray) else { return query.answer() };
    for prim_id in 0..geometry.len() as u32 {
        counters.intersection_test();
        if let Some(hit) = geometry.intersect(prim_id, &ray) {
            query.offer(hit);
            if query.done_at(f64::NEG_INFINITY) {
                break;
            }
        }
    }
    query.answer()
}

impl RayCaster for BruteForce<'_> {
    fn closest_hit<C: Counters>(&self, ray: &Ray, counters: &mut C) -> Option<Hit> {
        brute_force::<ClosestHit, C>(self.geometry, ray, counters)
    }

    fn occluded<C: Counters>(&self, ray: &Ray, counters: &mut C) -> bool {
        brute_force::<Occluded, C>(self.geometry, ray, counters)
    }
}
