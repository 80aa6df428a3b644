//! The peers, each wrapped in one file.

mod bvh;
mod embree;
mod obvhs;
mod parry;

pub use self::bvh::{BvhBuilder, BvhPeer};
pub use self::obvhs::{ObvhsBuilder, ObvhsPeer};
pub use embree::{Call, Embree, EmbreeBuilder, EmbreeEngine, EmbreeScene, Quality};
pub use parry::{ParryBuilder, ParryPeer};
