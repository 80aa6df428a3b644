//! The definition of the answers: every triangle against every ray.

use super::{DoubleGeometry, DoubleHit, DoubleRay};

/// Answers rays by testing all triangles in order of id; O(N) per ray.
#[derive(Clone, Copy)]
pub struct DoubleBruteForce<'a> {
    /// What is tested.
    pub geometry: &'a DoubleGeometry,
}

impl DoubleBruteForce<'_> {
    /// The first hit; of hits at equal `t` the one with the lowest id.
    pub fn closest_hit(&self, ray: &DoubleRay) -> Option<DoubleHit> {
        self.hits(ray).reduce(|best, hit| if hit.is_before(&best) { hit } else { best })
    }

    /// Whether anything is hit.
    pub fn occluded(&self, ray: &DoubleRay) -> bool {
        self.hits(ray).next().is_some()
    }

    /// All hits in order.
    pub fn all_hits(&self, ray: &DoubleRay) -> Vec<DoubleHit> {
        let mut hits: Vec<DoubleHit> = self.hits(ray).collect();
        DoubleHit::sort(&mut hits);
        self.geometry.leave_out(ray, &mut hits);
        hits
    }

    fn hits(&self, ray: &DoubleRay) -> impl Iterator<Item = DoubleHit> {
        (0..self.geometry.len() as u32).filter_map(|id| self.geometry.intersect(id, ray))
    }
}
