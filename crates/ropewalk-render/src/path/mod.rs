//! Path tracing of triangle meshes with materials, in waves through the batch engine.
//!
//! A [`Stage`](ropewalk_scene::Stage) and its [`Surroundings`] become a [`World`]; [`trace_paths`] follows paths
//! through it and brings back a [`Film`], which [`developed`] makes fit for a display and [`write_film`] writes.
//! docs/rendering.md says what is computed, and after whom.

mod albedo;
mod alias;
mod bsdf;
mod camera;
mod distribution;
mod environment;
mod file;
mod film;
mod fresnel;
mod ggx;
mod integrator;
mod light;
mod light_tree;
mod render;
mod sampler;
mod settings;
mod sight;
mod tessellate;
mod texture;
mod tone;
mod world;

pub use camera::{Lens, Up, fitted_camera, orbited, swept};
pub use environment::Environment;
pub use file::{Development, is_whole_picture, write_film};
pub use film::{Film, NO_FACE, WalkCost};
pub use integrator::PathCounts;
pub use render::{PathRender, trace_paths};
pub use settings::{LightChoice, PathSettings, Strategy};
pub use tessellate::tessellated;
pub use tone::{Tone, automatic_exposure, developed};
pub use world::{Backdrop, Surroundings, World};
