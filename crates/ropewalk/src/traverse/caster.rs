//! The two questions a renderer asks, whatever answers them.

use crate::ray::{Hit, Ray};
use crate::traverse::Counters;

/// Anything that answers rays: brute force, or a tree with one of the walks.
pub trait RayCaster: Sync {
    /// The first hit in the ray's range.
    fn closest_hit<C: Counters>(&self, ray: &Ray, counters: &mut C) -> Option<Hit>;
    /// True if anything is hit in the ray's range.
    fn occluded<C: Counters>(&self, ray: &Ray, counters: &mut C) -> bool;
}
