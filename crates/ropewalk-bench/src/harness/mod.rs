//! Verifies, times and records engines on workloads.

mod chart;
mod clock;
mod curves;
mod engine;
mod measure;
mod memory;
mod oracle;
mod provenance;
mod record;
mod statistics;
mod summary;
mod tables;
mod verify;

pub use chart::chart;
pub use clock::{Clock, cpu_name};
pub use curves::{Curve, curves};
pub use engine::{Answer, Answers, Builder, Built, Engine, Family};
pub use measure::{Budget, Rate, build_rates, calibrate, rates};
pub use memory::{peak_resident, reset_peak, resident};
pub use oracle::{Candidate, Oracle};
pub use provenance::{commit, today};
pub use record::{Record, Row};
pub use statistics::{Spread, geometric_mean};
pub use summary::summary;
pub use tables::tables;
pub use verify::{Testimony, Verdict, max_wrong_per_million, verify};
