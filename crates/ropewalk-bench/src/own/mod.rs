//! Ropewalk's own engines, behind the same trait as the peers.

mod ta_b;

pub use ta_b::{TaB, TaBBuilder};
