//! Meshes and views of the benchmark, and their list.

mod catalog;
mod mesh;
mod spd;

pub use crate::workload::View;
pub use catalog::{Catalog, SceneEntry};
pub use mesh::{Mesh, MeshError, Scene};
