//! From a tree and its geometry to bytes.

use super::error::WriteError;
use super::figures::Figures;
use super::header::{
    Header, SECTION_ALIGNMENT, Section, Tag, aligned, geometry_hash as hash_of, prefix_bytes,
};
use super::shapes::write_shapes;
use super::{Extra, Hash};
use crate::build::Monitor;
use crate::double::{DoubleGeometry, DoubleTree};
use crate::geometry::{BACK, FRONT, Geometry, TRIANGLE_BYTES};
use crate::primitive::Sides;
use crate::wide::WideTree;
use std::borrow::Cow;
use std::io::{self, Write};

/// What is saved.
#[derive(Clone, Copy)]
pub struct Contents<'a> {
    /// The tree.
    pub tree: &'a WideTree,
    /// What it was built over.
    pub geometry: Primitives<'a>,
    /// Figures of its build.
    pub figures: Option<&'a Figures>,
    /// Sections of others; their tags should begin with a small letter.
    pub extra: &'a [Extra],
}

impl<'a> Contents<'a> {
    /// A tree and what it was built over.
    pub fn new(tree: &'a WideTree, geometry: &'a Geometry) -> Self {
        Contents { tree, geometry: Primitives::Single(geometry), figures: None, extra: &[] }
    }

    /// The same in `f64`.
    pub fn of_double(tree: &'a DoubleTree, geometry: &'a DoubleGeometry) -> Self {
        let (tree, geometry) = (tree.wide(), Primitives::Double(geometry));
        Contents { tree, geometry, figures: None, extra: &[] }
    }
}

/// What a tree was built over.
#[derive(Clone, Copy)]
pub enum Primitives<'a> {
    /// Primitives in `f32`.
    Single(&'a Geometry),
    /// Triangles in `f64`.
    Double(&'a DoubleGeometry),
}

/// What was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Written {
    /// Bytes.
    pub bytes: u64,
    /// The geometry's hash.
    pub geometry_hash: Hash,
}

/// Triangles that are made into bytes at once.
const CHUNK: usize = 1 << 12;

/// Bytes that are hashed or written before the monitor is asked: some milliseconds.
pub const PIECE: usize = 1 << 22;

/// The bytes of a section.
enum Source<'a> {
    Bytes(Cow<'a, [u8]>),
    Triangles(&'a Geometry),
}

impl Source<'_> {
    fn len(&self) -> u64 {
        match self {
            Source::Bytes(bytes) => bytes.len() as u64,
            Source::Triangles(geometry) => (geometry.len() * TRIANGLE_BYTES) as u64,
        }
    }

    /// Hands the bytes to `put`, piece by piece, until the monitor cancels it.
    fn each(
        &self,
        monitor: &dyn Monitor,
        mut put: impl FnMut(&[u8]) -> io::Result<()>,
    ) -> Result<(), WriteError> {
        let mut put = |bytes: &[u8]| match monitor.is_cancelled() {
            true => Err(WriteError::Cancelled),
            false => Ok(put(bytes)?),
        };
        match self {
            Source::Bytes(bytes) => bytes.chunks(PIECE).try_for_each(put),
            Source::Triangles(geometry) => {
                let mut rows = Vec::with_capacity(CHUNK);
                for prim in 0..geometry.len() as u32 {
                    rows.extend(geometry.triangle(prim).map(|t| t.vertices));
                    if rows.len() == CHUNK {
                        put(bytemuck::cast_slice(&rows))?;
                        rows.clear();
                    }
                }
                put(bytemuck::cast_slice(&rows))
            }
        }
    }

    fn checksum(&self, monitor: &dyn Monitor) -> Result<Hash, WriteError> {
        let mut hasher = blake3::Hasher::new();
        self.each(monitor, |bytes| {
            hasher.update(bytes);
            Ok(())
        })?;
        Ok(*hasher.finalize().as_bytes())
    }
}

/// The sections of a geometry.
fn geometry_sections(geometry: &Geometry) -> Result<Vec<(Tag, Source<'_>)>, WriteError> {
    let count = geometry.len() as u32;
    if (0..count).all(|prim| geometry.triangle(prim).is_some()) {
        let mut sections = vec![(Tag::TRIANGLES, Source::Triangles(geometry))];
        if (0..count).any(|prim| geometry.sides(prim) != Sides::Both) {
            let side = |prim| match geometry.sides(prim) {
                Sides::Front => FRONT,
                Sides::Back => BACK,
                Sides::Both => 0,
            };
            let sides: Vec<u8> = (0..count).map(side).collect();
            sections.push((Tag::SIDES, Source::Bytes(sides.into())));
        }
        return Ok(sections);
    }
    let (kinds, ends, numbers) = write_shapes(geometry)?;
    let bytes = |row: &[u8]| Source::Bytes(row.to_vec().into());
    Ok(vec![
        (Tag::KINDS, Source::Bytes(kinds.into())),
        (Tag::ENDS, bytes(bytemuck::cast_slice(&ends))),
        (Tag::NUMBERS, bytes(bytemuck::cast_slice(&numbers))),
    ])
}

/// The sections of a geometry in `f64` that make its hash.
fn double_sections(geometry: &DoubleGeometry) -> Vec<(Tag, Source<'_>)> {
    mesh_sections(geometry.vertices(), geometry.faces())
}

fn mesh_sections<'a>(vertices: &'a [[f64; 3]], faces: &'a [[u32; 3]]) -> Vec<(Tag, Source<'a>)> {
    let bytes = |row: &'a [u8]| Source::Bytes(row.into());
    vec![
        (Tag::VERTICES, bytes(bytemuck::cast_slice(vertices))),
        (Tag::FACES, bytes(bytemuck::cast_slice(faces))),
    ]
}

/// What else is kept of a geometry in `f64`.
fn more_double_sections(geometry: &DoubleGeometry) -> Vec<(Tag, Source<'_>)> {
    let mut sections = Vec::new();
    if let Some((min, max)) = geometry.bounds() {
        let numbers = min.into_iter().chain(max).flat_map(f64::to_le_bytes);
        sections.push((Tag::BOX, Source::Bytes(numbers.collect::<Vec<u8>>().into())));
    }
    if geometry.degenerate_count() > 0 {
        let flat: &[u8] = bytemuck::cast_slice(geometry.degenerate());
        sections.push((Tag::FLAT, Source::Bytes(flat.into())));
    }
    sections
}

/// Places sections one behind the other; the table.
fn place(sources: &[(Tag, Source<'_>)], monitor: &dyn Monitor) -> Result<Vec<Section>, WriteError> {
    let mut end = prefix_bytes(sources.len()) as u64;
    let place = |(tag, source): &(Tag, Source<'_>)| {
        let section = Section {
            tag: *tag,
            offset: aligned(end),
            len: source.len(),
            checksum: source.checksum(monitor)?,
        };
        end = section.offset + section.len;
        Ok(section)
    };
    sources.iter().map(place).collect()
}

/// Writes a scene. The same tree and geometry give the same bytes. `out` gets large pieces.
///
/// The tree must have been built over the geometry. What is given in `extra` comes last, in this order.
///
/// # Errors
/// [`WriteError::Custom`] for primitives of users' own kinds, [`WriteError::Io`] for what `out` says.
pub fn write(contents: &Contents<'_>, out: &mut impl Write) -> Result<Written, WriteError> {
    write_monitored(contents, out, &())
}

/// The same, until the monitor cancels it; it is asked every few milliseconds.
///
/// # Errors
/// As [`write()`], and [`WriteError::Cancelled`].
pub fn write_monitored(
    contents: &Contents<'_>,
    out: &mut impl Write,
    monitor: &dyn Monitor,
) -> Result<Written, WriteError> {
    little_endian()?;
    let Contents { tree, geometry, figures, extra } = contents;
    let mut sources = vec![(Tag::TREE, Source::Bytes(tree.lines().bytes().into()))];
    if !tree.overflow().is_empty() {
        let numbers: Vec<u32> = tree.overflow().iter().flat_map(|&(a, b)| [a, b]).collect();
        let bytes: &[u8] = bytemuck::cast_slice(&numbers);
        sources.push((Tag::OVERFLOW, Source::Bytes(bytes.to_vec().into())));
    }
    let first = sources.len();
    sources.extend(match geometry {
        Primitives::Single(geometry) => geometry_sections(geometry)?,
        Primitives::Double(geometry) => double_sections(geometry),
    });
    let of_geometry = first..sources.len();
    let (geometry_bounds, primitives, degenerate) = match geometry {
        Primitives::Single(geometry) => {
            (geometry.bounds(), geometry.len(), geometry.degenerate_count())
        }
        Primitives::Double(geometry) => {
            sources.extend(more_double_sections(geometry));
            (*tree.bounds(), geometry.len(), geometry.degenerate_count())
        }
    };
    sources.extend(figures.map(|f| (Tag::FIGURES, Source::Bytes(f.to_bytes().into()))));
    sources.extend(extra.iter().map(|e| (e.tag, Source::Bytes(e.bytes[..].into()))));
    let sections = place(&sources, monitor)?;
    let header = Header {
        geometry_hash: hash_of(&sections[of_geometry]),
        tree_bounds: *tree.bounds(),
        geometry_bounds,
        root: tree.root(),
        has_shapes: tree.has_shapes(),
        primitives: primitives as u64,
        degenerate: degenerate as u64,
        treelets: tree.treelets() as u64,
        blocks: tree.blocks() as u64,
        sections,
    };
    let prefix = header.to_bytes();
    out.write_all(&prefix)?;
    let mut end = prefix.len() as u64;
    for ((_, source), section) in sources.iter().zip(&header.sections) {
        pad(out, end)?;
        source.each(monitor, |bytes| out.write_all(bytes))?;
        end = section.offset + section.len;
    }
    pad(out, end)?;
    Ok(Written { bytes: aligned(end), geometry_hash: header.geometry_hash })
}

/// Writes zeros up to the next multiple of the alignment.
fn pad(out: &mut impl Write, end: u64) -> io::Result<()> {
    out.write_all(&[0; SECTION_ALIGNMENT][..(aligned(end) - end) as usize])
}

fn little_endian() -> Result<(), WriteError> {
    if cfg!(target_endian = "big") { Err(WriteError::BigEndian) } else { Ok(()) }
}

pub fn geometry_hash(geometry: &Geometry) -> Result<Hash, WriteError> {
    little_endian()?;
    Ok(hash_of(&place(&geometry_sections(geometry)?, &())?))
}

pub fn mesh_hash(
    vertices: &[[f64; 3]],
    faces: &[[u32; 3]],
    monitor: &dyn Monitor,
) -> Result<Hash, WriteError> {
    Ok(hash_of(&place(&mesh_sections(vertices, faces), monitor)?))
}

pub fn triangles_hash(triangles: impl IntoIterator<Item = [[f32; 3]; 3]>) -> Hash {
    let (mut hasher, mut len) = (blake3::Hasher::new(), 0);
    let mut rows: Vec<[[f32; 3]; 3]> = Vec::with_capacity(CHUNK);
    let mut triangles = triangles.into_iter();
    loop {
        rows.clear();
        rows.extend(triangles.by_ref().take(CHUNK));
        let bytes: &[u8] = bytemuck::cast_slice(&rows);
        if bytes.is_empty() {
            break;
        }
        hasher.update(bytes);
        len += bytes.len() as u64;
    }
    let checksum = *hasher.finalize().as_bytes();
    hash_of(&[Section { tag: Tag::TRIANGLES, offset: 0, len, checksum }])
}
