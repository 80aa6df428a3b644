//! Triangle meshes from files: OBJ, PLY, STL, OFF and glTF 2.0, plain or gzipped.
//!
//! [`Mesh`] reads positions and faces, [`PlacedMeshes`] keeps the meshes of nodes apart, [`Stage`] reads what a file says of looks
//! too. Whatever a file announces is
//! checked against its size before memory is taken for it, and every error says where it is and what was expected there.
//! All but glTF is read piece by piece. [`Mesh::write`] writes positions and faces, [`Mesh::defects`] says what may be wrong,
//! [`Mesh::merge_vertices`] makes one of vertices at one place, when asked to.

mod beside;
mod defects;
mod error;
mod format;
mod gltf;
mod input;
mod merge;
mod mtl;
mod obj;
mod off;
mod picture;
mod placed;
mod ply;
mod polygon;
mod skipped;
mod soup;
mod stl;
mod text;
mod write;

pub use defects::Defects;
pub use error::{MeshError, MeshErrorKind, Place};
pub(crate) use format::{HEAD, recognise};
pub use format::{MeshFormat, Recognised};
pub(crate) use input::GZIP_MAGIC;
pub use merge::MergeError;
pub use placed::{FlattenError, PlacedMeshes, Placement};
pub use write::MeshOutput;

use crate::stage::{Material, Stage};
use crate::watched::Cancelled;
use beside::Beside;
use error::Result;
use input::Input;
use ropewalk::build::Monitor;
use soup::Soup;
use std::fs::File;
use std::ops::Deref;
use std::path::Path;

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
    /// Bytes of the file after decompression; as many again of the files that it names, together.
    pub bytes: u64,
    /// Vertices.
    pub vertices: usize,
    /// Triangles, after polygons are cut.
    pub faces: usize,
    /// Corners of one polygon.
    pub corners: usize,
    /// Placements of meshes by nodes.
    pub placements: usize,
    /// Images of textures.
    pub images: usize,
    /// Pixels of all images together.
    pub pixels: u64,
}

impl MeshLimits {
    /// 8 GiB, 500 million vertices and as many triangles, a million corners, 10 million placements, 1,024 images of
    /// 2^28 pixels (1 GiB).
    pub const DEFAULT: MeshLimits = MeshLimits {
        bytes: 8 << 30,
        vertices: 500_000_000,
        faces: 500_000_000,
        corners: 1_000_000,
        placements: 10_000_000,
        images: 1024,
        pixels: 1 << 28,
    };
}

impl Default for MeshLimits {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl Mesh {
    /// Reads a mesh file; gzip is recognised by its magic, the format by the content, then by the name.
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
        Ok(read_file(path, false, limits, monitor)?.mesh)
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
        Ok(read_bytes(format, bytes, folder, false, limits, monitor)?.mesh)
    }
}

/// Reads a file, with looks or without.
pub(crate) fn read_file(
    path: &Path,
    with_looks: bool,
    limits: &MeshLimits,
    monitor: &dyn Monitor,
) -> Result<Stage> {
    let watched = Watched { limits, monitor };
    open(path, &watched, |format, input| {
        read_input(format, input, path.parent(), with_looks, &watched)
    })
}

/// Opens a file and tells its format; errors get its name.
fn open<'a, T>(
    path: &Path,
    limits: &'a Watched<'a>,
    read: impl FnOnce(MeshFormat, Input<'a>) -> Result<T>,
) -> Result<T> {
    let opened = || {
        let mut input = Input::of_file(File::open(path)?, limits)?;
        let size = input.size();
        let format = match recognise(path, input.ahead(HEAD)?, size) {
            Recognised::Mesh(format) => format,
            Recognised::Nff => return Err(format::not_a_mesh("a scene in NFF")),
            Recognised::Neither(what) => return Err(format::not_a_mesh(what)),
        };
        read(format, input)
    };
    opened().map_err(|error: MeshError| error.in_file(path.display().to_string()))
}

/// Reads bytes, with looks or without.
pub(crate) fn read_bytes(
    format: MeshFormat,
    bytes: &[u8],
    folder: Option<&Path>,
    with_looks: bool,
    limits: &MeshLimits,
    monitor: &dyn Monitor,
) -> Result<Stage> {
    let watched = Watched { limits, monitor };
    read_input(format, Input::of_bytes(bytes, &watched)?, folder, with_looks, &watched)
}

fn read_input(
    format: MeshFormat,
    input: Input<'_>,
    folder: Option<&Path>,
    with_looks: bool,
    limits: &Watched<'_>,
) -> Result<Stage> {
    let soup = Soup::new(with_looks);
    let beside = Beside::new(folder, limits.bytes);
    let finished = |soup: Soup| match with_looks {
        true => soup.stage(limits),
        false => Ok(Stage { mesh: soup.mesh(limits)?, ..Stage::default() }),
    };
    let mut stage = match format {
        MeshFormat::Obj => {
            let (soup, named) = obj::parse(input, soup, limits)?;
            let mut stage = finished(soup)?;
            if with_looks {
                mtl::dress(&mut stage, &named, &beside, limits)?;
            }
            stage
        }
        MeshFormat::Ply => {
            let (soup, texture) = ply::parse(input, soup, limits)?;
            let mut stage = finished(soup)?;
            if let Some(name) = texture.filter(|_| !stage.uvs.is_empty()) {
                ply::dress(&mut stage, &name, &beside, limits)?;
            }
            stage
        }
        MeshFormat::Stl => finished(stl::parse(input, soup, limits)?)?,
        MeshFormat::Off => finished(off::parse(input, soup, limits)?)?,
        MeshFormat::Gltf => gltf::parse(input.rest()?, soup, &beside, limits)?,
    };
    if stage.materials.is_empty() {
        stage.materials.push(Material::default());
    }
    if format != MeshFormat::Gltf {
        (stage.meshes, stage.placements) = (1, 1);
    }
    Ok(stage)
}

/// Meshes and their placements.
fn placed_input(
    format: MeshFormat,
    input: Input<'_>,
    folder: Option<&Path>,
    limits: &Watched<'_>,
) -> Result<PlacedMeshes> {
    if format == MeshFormat::Gltf {
        let beside = Beside::new(folder, limits.bytes);
        return gltf::parse_placed(&input.rest()?, &beside, limits);
    }
    Ok(PlacedMeshes::of_mesh(read_input(format, input, folder, false, limits)?.mesh))
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
