//! Scenes: a neutral scene model, the NFF reader and writer, readers of triangle meshes, generators of
//! the Standard Procedural Databases, and a furnished [`room`].
//!
//! Readers and generators speak to a [`SceneSink`], so that a scene can be held ([`Scene`]),
//! written to a file as it is made, or merely counted.

#![forbid(unsafe_code)]

mod file;
mod geometry;
pub mod mesh;
mod model;
pub mod nff;
pub mod room;
mod sink;
mod source;
pub mod spd;
pub mod stage;
mod watched;

pub use file::write_atomically;
pub use mesh::{
    Defects, FlattenError, MergeError, Mesh, MeshError, MeshFormat, MeshLimits, MeshOutput,
    PlacedMeshes, Placement, Recognised,
};
pub use model::{Camera, Cone, FacetPolicy, Light, Material, Object, Scene, SceneSink, Surface};
pub use nff::{NffError, NffErrorKind, NffLimits, NffReadError, NffStats, NffWriter, NumberFormat};
pub use nff::{format_g, read_nff};
pub use source::{
    Builtin, Fault, Loaded, SceneError, load, load_monitored, load_scene, parse_builtin, recognise,
};
pub use stage::Stage;
