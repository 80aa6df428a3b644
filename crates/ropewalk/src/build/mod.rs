//! Builders of the binary BSP tree.

mod settings;

pub use settings::{BuildSettings, Measure, Termination, TerminationEstimator};
