//! Ropewalk's own engines, behind the same trait as the peers.
//!
//! A further engine is a file here that implements [`Engine`](crate::harness::Engine), and
//! [`Builder`](crate::harness::Builder) for its build times, and a line in each of `engines` and
//! `run_builds` of the binary.

mod ta_b;
mod walker;
mod wave;

pub use ta_b::{TaB, TaBBuilder, geometry};
pub use walker::Walker;
pub use wave::{Single, Wave, WaveBuilder};
