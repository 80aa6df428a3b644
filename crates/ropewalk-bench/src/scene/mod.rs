//! Meshes and views: a loader that is good enough for the files of the benchmark, and their list.

mod catalog;
mod glb;
mod mesh;
mod ply;
mod spd;

pub use crate::workload::View;
pub use catalog::{Catalog, SceneEntry};
pub use mesh::{Mesh, MeshError, Scene};
