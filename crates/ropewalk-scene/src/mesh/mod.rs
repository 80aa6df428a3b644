//! Triangle meshes from files: OBJ, PLY, STL, OFF and glTF 2.0, plain or gzipped.
//!
//! Positions and faces are read, nothing else. Whatever a file announces is checked against its size
//! before memory is taken for it, and every error says where it is and what was expected there.

mod error;
mod gltf;
mod obj;
mod off;
mod ply;
mod polygon;
mod stl;
mod text;

pub use error::{MeshError, MeshErrorKind, Place};

use crate::watched::{self, Cancelled};
use error::{Result, wrong};
use flate2::bufread::MultiGzDecoder;
use ropewalk::build::Monitor;
use std::fs::File;
use std::ops::Deref;
use std::path::Path;

/// The first bytes of every gzip file.
const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];

/// An indexed triangle mesh. Every face names existing vertices and every vertex is finite, also once rounded to
/// `f32`; faces without area are kept.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Positions as the file states them.
    pub vertices: Vec<[f64; 3]>,
    /// Three vertices a triangle.
    pub faces: Vec<[u32; 3]>,
}

/// What a reader accepts before it gives up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshLimits {
    /// Bytes of the file after decompression, its external buffers included.
    pub bytes: u64,
    /// Vertices.
    pub vertices: usize,
    /// Triangles, after polygons are cut.
    pub faces: usize,
    /// Corners of one polygon.
    pub corners: usize,
}

impl MeshLimits {
    /// 8 GiB, 500 million vertices and as many triangles, a million corners.
    pub const DEFAULT: MeshLimits = MeshLimits {
        bytes: 8 << 30,
        vertices: 500_000_000,
        faces: 500_000_000,
        corners: 1_000_000,
    };
}

impl Default for MeshLimits {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// A file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshFormat {
    /// Wavefront OBJ.
    Obj,
    /// PLY, ascii or binary of either byte order.
    Ply,
    /// STL, ascii or binary.
    Stl,
    /// Object File Format, ascii.
    Off,
    /// glTF 2.0, as text or binary (GLB).
    Gltf,
}

impl MeshFormat {
    /// All formats.
    pub const ALL: [MeshFormat; 5] =
        [MeshFormat::Obj, MeshFormat::Ply, MeshFormat::Stl, MeshFormat::Off, MeshFormat::Gltf];

    /// The format that a file's name stands for, `.gz` aside.
    pub fn of_name(path: &Path) -> Option<MeshFormat> {
        let extension = |path: &Path| Some(path.extension()?.to_str()?.to_ascii_lowercase());
        let mut found = extension(path)?;
        if found == "gz" {
            found = extension(Path::new(path.file_stem()?))?;
        }
        Some(match found.as_str() {
            "obj" => MeshFormat::Obj,
            "ply" => MeshFormat::Ply,
            "stl" => MeshFormat::Stl,
            "off" => MeshFormat::Off,
            "gltf" | "glb" => MeshFormat::Gltf,
            _ => return None,
        })
    }
}

impl Mesh {
    /// Reads a mesh file; gzip is recognised by its magic, the format by the name.
    ///
    /// Polygons with more than three corners become triangles in the order of their corners: convex ones and
    /// quadrilaterals by diagonals from one corner, others by cutting off ears. Meshes, groups and nodes of a file
    /// are one mesh in their order, nodes of glTF moved by their transforms.
    ///
    /// # Errors
    /// [`MeshError`] with the file's name: what was expected where, and what was found.
    pub fn read(path: &Path, limits: &MeshLimits) -> Result<Mesh> {
        Mesh::read_monitored(path, limits, &())
    }

    /// The same, until the monitor cancels it.
    ///
    /// # Errors
    /// As [`Mesh::read`], and [`MeshErrorKind::Cancelled`].
    pub fn read_monitored(path: &Path, limits: &MeshLimits, monitor: &dyn Monitor) -> Result<Mesh> {
        let name = path.display().to_string();
        let read = || {
            let format = MeshFormat::of_name(path).ok_or_else(|| {
                wrong(
                    Place::Start,
                    "a name that ends in .obj, .ply, .stl, .off, .gltf or .glb",
                    "none",
                )
            })?;
            let bytes = watched::read_file(File::open(path)?, monitor)??;
            Mesh::parse_monitored(format, &bytes, path.parent(), limits, monitor)
        };
        read().map_err(|error| error.in_file(name))
    }

    /// The same from memory. `folder` is where buffers of glTF files lie; without it there are none.
    ///
    /// # Errors
    /// See [`Mesh::read`]; the file is called `input`.
    pub fn parse(
        format: MeshFormat,
        bytes: &[u8],
        folder: Option<&Path>,
        limits: &MeshLimits,
    ) -> Result<Mesh> {
        Mesh::parse_monitored(format, bytes, folder, limits, &())
    }

    /// The same, until the monitor cancels it.
    ///
    /// # Errors
    /// As [`Mesh::parse`], and [`MeshErrorKind::Cancelled`].
    pub fn parse_monitored(
        format: MeshFormat,
        bytes: &[u8],
        folder: Option<&Path>,
        limits: &MeshLimits,
        monitor: &dyn Monitor,
    ) -> Result<Mesh> {
        let limits = &Watched { limits, monitor };
        let mut plain = Vec::new();
        let bytes = if bytes.starts_with(&GZIP_MAGIC) {
            let limit = limits.bytes.saturating_add(1);
            let decoder = std::io::Read::take(MultiGzDecoder::new(bytes), limit);
            watched::read_to_end(decoder, &mut plain, monitor)??;
            &plain[..]
        } else {
            bytes
        };
        if bytes.len() as u64 > limits.bytes {
            let found = format!("{} or more", bytes.len());
            return Err(wrong(Place::Start, format!("at most {} bytes", limits.bytes), found));
        }
        let soup = match format {
            MeshFormat::Obj => obj::parse(bytes, limits),
            MeshFormat::Ply => ply::parse(bytes, limits),
            MeshFormat::Stl => stl::parse(bytes, limits),
            MeshFormat::Off => off::parse(bytes, limits),
            MeshFormat::Gltf => gltf::parse(bytes, folder, limits),
        }?;
        soup.mesh(limits)
    }
}

/// Limits, and who may cancel the reading.
struct Watched<'a> {
    limits: &'a MeshLimits,
    monitor: &'a dyn Monitor,
}

impl Deref for Watched<'_> {
    type Target = MeshLimits;

    fn deref(&self) -> &MeshLimits {
        self.limits
    }
}

/// Vertices or polygons that are read before the monitor is asked.
const ASKED_EVERY: usize = 1 << 14;

impl Watched<'_> {
    /// Asks the monitor at every so many numbers.
    #[inline(always)]
    fn at(&self, number: usize) -> std::result::Result<(), Cancelled> {
        let asks = number.is_multiple_of(ASKED_EVERY);
        if asks && self.monitor.is_cancelled() { Err(Cancelled) } else { Ok(()) }
    }
}

/// Vertices and polygons as a file states them.
#[derive(Default)]
struct Soup {
    vertices: Vec<[f64; 3]>,
    /// Corners of all polygons, one after the other.
    corners: Vec<u32>,
    /// Where each polygon ends in them.
    ends: Vec<usize>,
}

impl Soup {
    /// Adds a vertex, which must be finite.
    fn vertex(&mut self, place: Place, point: [f64; 3], limits: &Watched<'_>) -> Result<()> {
        limits.at(self.vertices.len())?;
        if let Some(x) = point.iter().find(|&&x| !(x as f32).is_finite()) {
            let count = self.vertices.len();
            let what = format!("a finite coordinate within f32 for vertex {count}");
            return Err(wrong(place, what, x));
        }
        if self.vertices.len() >= limits.vertices {
            return Err(wrong(place, format!("at most {} vertices", limits.vertices), "more"));
        }
        self.vertices.push(point);
        Ok(())
    }

    /// Ends the polygon whose corners were pushed since the last one.
    fn end_polygon(&mut self, place: Place, limits: &Watched<'_>) -> Result<()> {
        limits.at(self.ends.len())?;
        let count = self.corners.len() - self.ends.last().copied().unwrap_or(0);
        if count < 3 {
            return Err(wrong(place, "a face of at least 3 corners", count));
        }
        if count > limits.corners {
            return Err(wrong(
                place,
                format!("a face of at most {} corners", limits.corners),
                count,
            ));
        }
        self.ends.push(self.corners.len());
        if self.corners.len() - 2 * self.ends.len() > limits.faces {
            return Err(wrong(place, format!("at most {} triangles", limits.faces), "more"));
        }
        Ok(())
    }

    /// Cuts polygons into triangles. Corners must name vertices.
    fn mesh(self, limits: &Watched<'_>) -> Result<Mesh> {
        let Soup { vertices, corners, ends } = self;
        if ends.is_empty() {
            return Err(wrong(Place::End, "at least one face", "none"));
        }
        let triangles = corners.len() - 2 * ends.len();
        debug_assert!(triangles <= limits.faces);
        let (mut faces, mut start) = (Vec::with_capacity(triangles), 0);
        for (index, end) in ends.into_iter().enumerate() {
            limits.at(index)?;
            match &corners[start..end] {
                &[a, b, c] => faces.push([a, b, c]),
                polygon => polygon::cut(&vertices, polygon, &mut faces).map_err(|most| {
                    let what = format!("a polygon that is convex or has at most {most} corners");
                    wrong(Place::Part(format!("face {index}")), what, polygon.len())
                })?,
            }
            start = end;
        }
        Ok(Mesh { vertices, faces })
    }
}
