//! Ray casting on axis-aligned BSP trees (kd-trees) built with the surface-area heuristic and
//! threaded with ropes and rope trees.
//!
//! The data flow is one way: [`Geometry`] holds the primitives, [`build`](mod@build) makes a
//! [`BspTree`](tree::BspTree) from their boxes and clips, [`rope`] threads its leaves, and
//! [`traverse`] shoots rays through any of them. The crate does no I/O and prints nothing.

pub mod aabb;
pub mod accelerator;
pub mod build;
pub mod cost;
pub mod double;
pub mod file;
pub mod geometry;
pub mod instance;
pub mod kernel;
pub mod method;
pub mod point;
pub mod primitive;
pub mod ray;
pub mod rope;
mod touch;
pub mod traverse;
pub mod tree;
pub mod walker;
pub mod wide;

pub use aabb::Aabb;
pub use accelerator::{Accelerator, AcceleratorError, Walk};
pub use geometry::{Geometry, GeometryError};
pub use primitive::{Shape, Sides};
pub use ray::{Hit, Ray};

/// The README's code runs as a test.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
pub struct Readme;
