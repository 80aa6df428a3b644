//! Ray walks, each written once and generic over the query and the counters.

mod caster;
mod counters;
mod query;

pub use caster::RayCaster;
pub use counters::{Counters, Counts, NoCounts};
pub use query::{ClosestHit, Occluded, Query};
