//! The batch kernels over the wide tree.
//!
//! A batch keeps many rays in flight on each core: while one ray waits for a cache line, others
//! step. The loop is written once (wave.rs) and is generic over the SIMD [`Level`] and the query.
//!
//! A ray by itself goes through the same steps and tests without lists (single.rs).
//!
//! Points are answered by walks of their own (point/), one after the other.
//!
//! Rays in turn that start or end in one point, or are parallel, and lie close together are taken out of
//! the batch first and answered in beams (beam/), at a fraction of the cost; which way the rays went is
//! reported, and answers do not depend on it.

mod avx2;
mod avx512;
mod batch;
mod beam;
mod double;
mod engine;
mod entry;
mod entry_packet;
mod entry_x86;
mod events;
mod exact;
mod extreme;
mod known;
mod lanes;
mod launch;
mod leaf;
mod level;
mod list;
mod look;
mod memory;
mod near;
mod order;
mod particles;
pub(crate) mod point;
mod query;
#[cfg(test)]
mod random;
mod room;
mod scalar;
mod scanlines;
mod single;
mod slot;
mod sorted;
mod source;
mod vicinity;
mod wave;
mod width;
mod x86;

pub use batch::{AllHits, BatchCaster, BatchHit, Start};
pub use beam::BatchReport;
pub use double::{DoubleAllHits, DoubleBatchHit, DoubleCaster, DoubleFilter};
pub(crate) use entry_packet::PACKET;
pub use events::BatchEvents;
pub(crate) use events::NoEvents;
pub(crate) use known::{Known, Supply};
pub use lanes::WalkReport;
pub(crate) use lanes::{Before, Crowd, Lanes};
pub use level::Level;
pub(crate) use memory::Memory;
pub use memory::SharedBytes;
pub use particles::{Arrival, Particle, prefetch};
pub(crate) use query::Crossings;
pub use query::{HitFilter, Masks, NoFilter, Opacity};
pub use sorted::Sorting;
pub(crate) use wave::WAVE;
pub(crate) use width::wave_width;

/// Asks for the cache line of any address at all, where there is such an instruction.
#[inline(always)]
pub(crate) fn prefetch_line(address: *const u8) {
    #[cfg(target_arch = "x86_64")]
    x86::prefetch(address);
    #[cfg(not(target_arch = "x86_64"))]
    let _ = address;
}
