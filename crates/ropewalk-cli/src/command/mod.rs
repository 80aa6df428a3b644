//! One file a subcommand.

pub mod bench;
pub mod build;
pub mod convert;
pub mod info;
mod mesh_info;
pub mod paths;
pub mod render;
pub mod scene;
pub mod stats;
pub mod validate;
