//! The batch kernels over the wide tree.
//!
//! A batch keeps many rays in flight on each core: while one ray waits for a cache line, others
//! step. The loop is written once (wave.rs) and is generic over the SIMD [`Level`] and the query.

mod avx2;
mod avx512;
mod batch;
mod events;
mod exact;
mod extreme;
mod level;
mod list;
mod query;
mod scalar;
mod slot;
mod wave;
mod x86;

pub use batch::{AllHits, BatchCaster, BatchHit};
pub use events::BatchEvents;
pub use level::Level;
pub use query::{HitFilter, Masks, NoFilter, Opacity};
