//! What the benchmarks of ropewalk share.

pub mod scenes;
