//! Generators and checks shared by the tests of ropewalk.

#![forbid(unsafe_code)]

pub mod data;
pub mod primitives;
pub mod rays;
pub mod trees;
