//! Scenes: a neutral scene model, the NFF reader and writer, and generators of the Standard
//! Procedural Databases.
//!
//! Readers and generators speak to a [`SceneSink`], so that a scene can be held ([`Scene`]),
//! written to a file as it is made, or merely counted.

mod model;

pub use model::{Camera, Cone, FacetPolicy, Light, Material, Object, Scene, SceneSink, Surface};
