//! Ray walks, each written once and generic over the query and the counters.

mod brute_force;
mod caster;
mod closed_ray;
mod counters;
mod locate;
mod query;
mod ropes;
mod stack;
mod sung_shirley;
mod ta_b;

pub use brute_force::{BruteForce, brute_force};
pub use caster::RayCaster;
pub use closed_ray::SLACK;
pub use counters::{Counters, Counts, NoCounts};
pub use locate::{LeafId, locate};
pub use query::{ClosestHit, Occluded, Query};
pub use ropes::{rope_trees, ropes};
pub use sung_shirley::sung_shirley;
pub use ta_b::ta_b;
