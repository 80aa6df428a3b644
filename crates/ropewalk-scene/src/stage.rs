//! What a picture needs beyond triangles: materials, textures, lights and a view, as files of meshes state them.
//!
//! Quantities are those of glTF 2.0 (metallic-roughness materials, punctual lights); other formats are translated.
//! Colours are linear Rec. 709 unless they lie in an [`Image`]. Placements are worked into the vertices.

use crate::mesh::{self, Mesh, MeshError, MeshFormat, MeshLimits};
use crate::model::Camera;
use crate::source::stem;
use ropewalk::build::Monitor;
use std::path::Path;

/// A triangle mesh with its looks. Every list that is not empty has one entry a face, except those of materials,
/// images and lights, and every index names an entry.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stage {
    /// Name for messages: the file name without extensions.
    pub name: String,
    /// Positions and faces.
    pub mesh: Mesh,
    /// Normals at the corners of each face, of unit length, or zeros where a corner has none; empty if none has.
    pub normals: Vec<[[f32; 3]; 3]>,
    /// Texture coordinates at the corners of each face, `(0, 0)` being the upper left corner of an image.
    pub uvs: Vec<[[f32; 2]; 3]>,
    /// Colours at the corners of each face, which are multiplied with those of the material.
    pub colors: Vec<[[f32; 3]; 3]>,
    /// The material of each face; empty if all have material 0.
    pub material: Vec<u32>,
    /// Materials; at least one.
    pub materials: Vec<Material>,
    /// Images that materials name.
    pub images: Vec<Image>,
    /// Lights besides faces that emit.
    pub lights: Vec<Light>,
    /// The first view of the file.
    pub camera: Option<Camera>,
    /// True if a sky belongs to it beside the lights of its own, as to a room with windows.
    pub daylight: bool,
    /// Meshes with triangles that the file's nodes place, and how often in all; 1 each where a format has no nodes, 0 if the
    /// stage is not from a file.
    pub meshes: usize,
    /// See `meshes`.
    pub placements: usize,
    /// What the reader left out, one sentence a kind.
    pub skipped: Vec<String>,
}

impl Stage {
    /// A mesh of which nothing else is known: matte, light grey.
    pub fn of_mesh(name: String, mesh: Mesh) -> Stage {
        Stage { name, mesh, materials: vec![Material::default()], ..Stage::default() }
    }

    /// Reads a mesh file with what it says about looks, until the monitor cancels it. Materials and images that lie beside the
    /// file are read from its folder or below and nowhere else; those that cannot be had are left out, with a sentence
    /// in [`Stage::skipped`]. The mesh is that of [`Mesh::read_monitored`].
    ///
    /// # Errors
    /// Those of [`Mesh::read_monitored`], and of materials that are no materials of glTF.
    pub fn read_monitored(
        path: &Path,
        limits: &MeshLimits,
        monitor: &dyn Monitor,
    ) -> Result<Stage, MeshError> {
        Ok(Stage { name: stem(path), ..mesh::read_file(path, true, limits, monitor)? })
    }

    /// The same from memory. `folder` is where the files lie that it names; without it there are none.
    ///
    /// # Errors
    /// Those of [`Mesh::parse`]; the file is called `input`.
    pub fn parse(
        format: MeshFormat,
        bytes: &[u8],
        folder: Option<&Path>,
        limits: &MeshLimits,
    ) -> Result<Stage, MeshError> {
        mesh::read_bytes(format, bytes, folder, true, limits, &())
    }
}

/// A surface: metal or dielectric with a GGX lobe, or glass (glTF 2.0, section 3.9).
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name in the file.
    pub name: String,
    /// Albedo of dielectrics, reflectance of metals at normal incidence; 0 to 1.
    pub base_color: [f32; 3],
    /// Coverage, 0 to 1; see [`Alpha`].
    pub opacity: f32,
    /// How coverage is meant.
    pub alpha: Alpha,
    /// 0 for dielectrics to 1 for metals.
    pub metallic: f32,
    /// Perceptual roughness, 0 (mirror) to 1; GGX alpha is its square.
    pub roughness: f32,
    /// Radiance that is emitted from the front, or from both sides of a two-sided surface; not negative.
    pub emission: [f32; 3],
    /// Share of the light entering a dielectric that passes through, 0 to 1 (KHR_materials_transmission).
    pub transmission: f32,
    /// Index of refraction of dielectrics (KHR_materials_ior), 1 or more.
    pub ior: f32,
    /// True if the back is seen as the front is.
    pub two_sided: bool,
    /// Multiplies `base_color` and `opacity`; sRGB.
    pub base_color_texture: Option<Texture>,
    /// Green multiplies `roughness`, blue `metallic`; linear.
    pub metallic_roughness_texture: Option<Texture>,
    /// Multiplies `emission`; sRGB.
    pub emission_texture: Option<Texture>,
    /// Normals in tangent space; linear.
    pub normal_texture: Option<Texture>,
}

impl Default for Material {
    /// Matte, light grey, opaque, seen from both sides.
    fn default() -> Self {
        Material {
            name: String::new(),
            base_color: [0.8; 3],
            opacity: 1.0,
            alpha: Alpha::Opaque,
            metallic: 0.0,
            roughness: 1.0,
            emission: [0.0; 3],
            transmission: 0.0,
            ior: 1.5,
            two_sided: true,
            base_color_texture: None,
            metallic_roughness_texture: None,
            emission_texture: None,
            normal_texture: None,
        }
    }
}

/// What a material's opacity does.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Alpha {
    /// Nothing.
    #[default]
    Opaque,
    /// A point below this opacity is not there.
    Mask(f32),
    /// Light passes with the probability that is left.
    Blend,
}

/// An image on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Texture {
    /// Index into [`Stage::images`].
    pub image: u32,
    /// What happens beyond 0 to 1, across and down.
    pub wrap: [Wrap; 2],
}

/// What an image shows beyond its edges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// Itself again.
    #[default]
    Repeat,
    /// Itself, every other one mirrored.
    Mirror,
    /// Its edge.
    Clamp,
}

/// Pixels row by row from the upper left corner, eight bits a channel, alpha not multiplied in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// Pixels across; at least 1.
    pub width: u32,
    /// Pixels down; at least 1.
    pub height: u32,
    /// Red, green, blue and alpha; `width * height` of them.
    pub pixels: Vec<[u8; 4]>,
}

/// A light that is no surface (KHR_lights_punctual).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// Light from a point.
    Point {
        /// Where.
        position: [f64; 3],
        /// Radiant intensity.
        intensity: [f32; 3],
    },
    /// A point that lights a cone.
    Spot {
        /// Where.
        position: [f64; 3],
        /// Unit vector away from the light.
        direction: [f64; 3],
        /// Radiant intensity inside of the inner cone.
        intensity: [f32; 3],
        /// Half angles of the inner and the outer cone, in radians.
        cone: [f32; 2],
    },
    /// Parallel light.
    Directional {
        /// Unit vector away from the light.
        direction: [f64; 3],
        /// Irradiance of a surface that faces it.
        irradiance: [f32; 3],
    },
}
