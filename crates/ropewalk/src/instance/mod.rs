//! Objects placed many times: one level of instances under affine transforms.
//!
//! An [`Object`] is triangles in `f64` with their tree; an [`InstancedScene`] places objects without copying
//! them. A ray is transformed into an object's space in `f64`, with a direction that keeps its length there, so that
//! parameters mean the same in both; what it hits there is decided as [`double`](crate::double) decides.
//! [`InstanceBruteForce`] defines the answers.
//!
//! The top-level tree is one over the boxes of the instances, twelve triangles each. A batch visits
//! instances in passes: each ray goes to the nearest one that it has not visited, those of an instance are
//! transformed together and asked as a batch, and a ray ends where the next box begins behind its best hit. Moving
//! instances rebuilds the top-level tree alone; a new object leaves the trees of the others as they are.

mod brute_force;
mod caster;
mod scene;
mod transform;

pub use brute_force::InstanceBruteForce;
pub use caster::{InstanceAllHits, InstanceBatchHit, InstanceCaster, InstanceFilter};
pub use scene::{Instance, InstanceError, InstanceHit, InstancedScene, Object};
pub use transform::{Transform, TransformError};
