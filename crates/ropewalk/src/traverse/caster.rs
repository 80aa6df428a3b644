//! The two questions a renderer asks, whatever answers them.

use crate::ray::{Hit, Ray};
use crate::traverse::{Counters, LeafId};

/// Anything that answers rays: brute force, or a tree with one of the walks.
pub trait RayCaster: Sync {
    /// The first hit in the ray's range.
    fn closest_hit<C: Counters>(&self, ray: &Ray, counters: &mut C) -> Option<Hit>;
    /// True if anything is hit in the ray's range.
    fn occluded<C: Counters>(&self, ray: &Ray, counters: &mut C) -> bool;

    /// The first hit of a ray that starts in the leaf `start`, and the leaf of the hit where the
    /// caster knows it: the right start for the rays that leave from there. A wrong or missing
    /// start never changes the answer; casters that walk from the root ignore it.
    fn closest_hit_from<C: Counters>(
        &self,
        ray: &Ray,
        _start: Option<LeafId>,
        counters: &mut C,
    ) -> (Option<Hit>, Option<LeafId>) {
        (self.closest_hit(ray, counters), None)
    }

    /// True if anything is hit by a ray that starts in the leaf `start` (see
    /// [`RayCaster::closest_hit_from`]).
    fn occluded_from<C: Counters>(
        &self,
        ray: &Ray,
        _start: Option<LeafId>,
        counters: &mut C,
    ) -> bool {
        self.occluded(ray, counters)
    }
}
