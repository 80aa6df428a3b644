//! Benchmarks of ropewalk against its peers: one process, the same rays, interleaved rounds,
//! answers verified before anything is timed.
//!
//! [`scene`] loads meshes and their views, [`workload`] makes the rays, [`peer`] and [`own`] wrap
//! the engines, [`harness`] verifies, times and records them. docs/performance.md states the
//! method. [`scenes`] makes triangle sets of any size for timing the builder alone.

pub mod answer;
pub mod harness;
pub mod own;
pub mod peer;
pub mod scene;
pub mod scenes;
pub mod workload;
