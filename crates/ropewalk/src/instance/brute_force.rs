//! The definition of the answers: every triangle of every instance.

use super::{InstanceHit, InstancedScene};
use crate::double::{DoubleBruteForce, DoubleRay};

/// Answers rays by testing all triangles of all instances.
#[derive(Clone, Copy)]
pub struct InstanceBruteForce<'a> {
    /// What is tested.
    pub scene: &'a InstancedScene,
}

impl InstanceBruteForce<'_> {
    /// All hits in order of `(t, instance, prim_id)`.
    pub fn all_hits(&self, ray: &DoubleRay) -> Vec<InstanceHit> {
        let mut hits = Vec::new();
        for (instance, placed) in self.scene.instances().iter().enumerate() {
            let ray = placed.transform.ray_to_object(ray);
            let of_object = DoubleBruteForce { geometry: &placed.object.geometry }.all_hits(&ray);
            hits.extend(of_object.iter().map(|hit| InstanceHit {
                t: hit.t,
                instance: instance as u32,
                prim_id: hit.prim_id,
            }));
        }
        hits.sort_unstable_by(InstanceHit::order);
        hits
    }

    /// The first hit.
    pub fn closest_hit(&self, ray: &DoubleRay) -> Option<InstanceHit> {
        self.all_hits(ray).first().copied()
    }
}
