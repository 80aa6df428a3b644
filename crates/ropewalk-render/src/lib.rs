//! Pictures: Whitted ray tracing of [`ropewalk_scene`] scenes through any [`ropewalk`] ray caster, by the
//! rules of the Standard Procedural Databases, and path tracing of meshes with materials ([`path`]).
//!
//! [`render`] makes a [`Render`]: a picture in linear `f32`, the numbers of rays by kind, the
//! traversal events, and on request the auxiliary pictures of [`AovBuffers`]. [`record_rays`]
//! collects the rays of a render, so that several traversal methods can be given exactly the same
//! ones. [`Render::write`] and [`write_image`] write PNG and EXR
//! files, whole or not at all.

#![forbid(unsafe_code)]

mod aov;
mod error;
mod heat_map;
mod image;
mod image_file;
mod light;
mod observer;
mod offset;
pub mod path;
mod ray_counts;
mod recorder;
mod renderer;
mod sampling;
mod settings;
mod shading;
mod vec3;
mod view;
mod whitted;

pub use aov::{AovBuffers, AovKind};
pub use error::RenderError;
pub use heat_map::{HeatRange, heat_map, inferno};
pub use image::Image;
pub use image_file::{ImageFileError, ImageFormat, check_image_path, write_image};
pub use ray_counts::{RayCounts, RayKind};
pub use recorder::{RaySet, RecordedRay, record_rays};
pub use renderer::{Monitor, Progress, Render, render};
pub use settings::{MAX_PIXELS, RenderSettings};
pub use view::default_camera;
