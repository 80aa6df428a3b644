//! Benchmarks of ropewalk against its peers: one process, the same rays, interleaved rounds,
//! answers verified before anything is timed.
//!
//! [`scene`] loads meshes and their views, [`workload`] makes the rays, [`peer`] and [`own`] wrap
//! the engines, [`harness`] verifies, times and records them. docs/performance.md states the
//! method. [`scenes`] makes triangle sets of any size; [`campaign`] compares answers without timing.

pub mod answer;
pub mod campaign;
pub mod harness;
pub mod own;
pub mod peer;
pub mod scene;
pub mod scenes;

pub use ropewalk_workload as workload;
