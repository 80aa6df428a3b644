//! From bytes to a tree and a geometry that read them where they lie.

use super::Hash;
use super::error::{FileError, Part};
use super::figures::Figures;
use super::header::{Header, SECTION_ALIGNMENT, Section, Tag, compare};
use super::links::Links;
use super::shapes::read_shapes;
use super::write::PIECE;
use crate::build::Monitor;
use crate::double::{DoubleGeometry, DoubleTree, Rows};
use crate::geometry::{Geometry, StoredTriangles};
use crate::kernel::{Memory, SharedBytes};
use crate::wide::{LINE, Lines, MAX_LINES, WideTree};

/// How much of a file is checked when it is opened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Check {
    /// Header, sizes and links: all that it takes for no query to leave the bytes or to go on forever.
    #[default]
    Structure,
    /// The same, and the checksums of all sections: that the bytes are those that were written.
    Everything,
}

/// A section that belongs to somebody else.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Extra {
    /// Its name, with a small first letter.
    pub tag: Tag,
    /// Its bytes.
    pub bytes: Vec<u8>,
}

/// A scene that has been opened.
pub struct Opened<T = WideTree, G = Geometry> {
    /// The tree; it reads the bytes where they lie.
    pub tree: T,
    /// What it was built over. Triangles stay where they lie; where there are other primitives, all have
    /// been copied.
    pub geometry: G,
    /// Figures of the build, if they were saved.
    pub figures: Option<Figures>,
    /// Sections that this module does not know, copied.
    pub extra: Vec<Extra>,
    /// The geometry's hash; see [`geometry_hash`](super::geometry_hash()).
    pub geometry_hash: Hash,
    /// Where everything lies.
    pub sections: Vec<Section>,
    /// Bytes of the file.
    pub bytes: u64,
}

/// The same in `f64`.
pub type OpenedDouble = Opened<DoubleTree, DoubleGeometry>;

/// A scene of either precision that has been opened.
pub enum AnyOpened {
    /// Primitives in `f32`.
    Single(Box<Opened>),
    /// Triangles in `f64`.
    Double(Box<OpenedDouble>),
}

/// Opens a scene in `f32`; see [`open_any`].
///
/// # Errors
/// As there, and [`FileError::Double`] for one in `f64`.
pub fn open(bytes: &SharedBytes, check: Check) -> Result<Opened, FileError> {
    match open_any(bytes, check)? {
        AnyOpened::Single(scene) => Ok(*scene),
        AnyOpened::Double(_) => Err(FileError::Double),
    }
}

/// Opens what [`write`](super::write()) wrote, wherever it lies; the owner is kept as long as the tree or the
/// geometry lives. Its first byte must lie at a multiple of [`SECTION_ALIGNMENT`], as that of a map does.
///
/// Bytes that pass are safe to use, whatever they say; that they are those that were written is known
/// only after [`Check::Everything`]. They must not change while they are in use.
///
/// # Errors
/// [`FileError`] with the part of the file, the offset, and what was expected there.
pub fn open_any(bytes: &SharedBytes, check: Check) -> Result<AnyOpened, FileError> {
    open_monitored(bytes, check, &())
}

/// [`open_any`] until the monitor cancels it: checksums take as long as the bytes take to read.
///
/// # Errors
/// As there, and [`FileError::Cancelled`].
pub fn open_monitored(
    bytes: &SharedBytes,
    check: Check,
    monitor: &dyn Monitor,
) -> Result<AnyOpened, FileError> {
    if cfg!(target_endian = "big") {
        return Err(FileError::BigEndian);
    }
    let all = (**bytes).as_ref();
    if !all.as_ptr().addr().is_multiple_of(SECTION_ALIGNMENT) {
        return Err(FileError::Unaligned { alignment: SECTION_ALIGNMENT });
    }
    let header = Header::parse(all)?;
    if check == Check::Everything {
        for section in &header.sections {
            let mut hasher = blake3::Hasher::new();
            for piece in all[section.range()].chunks(PIECE) {
                if monitor.is_cancelled() {
                    return Err(FileError::Cancelled);
                }
                hasher.update(piece);
            }
            let (found, part) = (hasher.finalize(), Part::Section(section.tag));
            compare(part, section.offset, &section.checksum, found.as_bytes())?;
        }
    }
    let file = File { bytes, all, header: &header };
    file.known()?;
    let tree = file.tree()?;
    let geometry = file.any_geometry()?;
    let figures = file.figures()?;
    let is_extra = |s: &&Section| !s.tag.is_required() && s.tag != Tag::FIGURES;
    let extra = header.sections.iter().filter(is_extra);
    let extra = extra.map(|s| Extra { tag: s.tag, bytes: all[s.range()].to_vec() }).collect();
    let bytes = all.len() as u64;
    let Header { geometry_hash, sections, .. } = header;
    Ok(match geometry {
        AnyGeometry::Single(geometry) => AnyOpened::Single(Box::new(Opened {
            tree,
            geometry,
            figures,
            extra,
            geometry_hash,
            sections,
            bytes,
        })),
        AnyGeometry::Double(geometry) => AnyOpened::Double(Box::new(Opened {
            tree: DoubleTree::of_file(tree),
            geometry,
            figures,
            extra,
            geometry_hash,
            sections,
            bytes,
        })),
    })
}

/// What a tree was built over.
enum AnyGeometry {
    Single(Geometry),
    Double(DoubleGeometry),
}

/// A file whose header is right.
struct File<'a> {
    bytes: &'a SharedBytes,
    all: &'a [u8],
    header: &'a Header,
}

impl File<'_> {
    /// The section of a name.
    fn section(&self, tag: Tag) -> Option<&Section> {
        self.header.sections.iter().find(|section| section.tag == tag)
    }

    /// The bytes of a section, with their owner.
    fn memory(&self, section: &Section) -> Result<Memory, FileError> {
        let size = |found| FileError::Size { expected: self.all.len() as u64, found };
        let memory = Memory::of_shared(self.bytes, section.range());
        memory.ok_or_else(|| size((**self.bytes).as_ref().len() as u64))
    }

    /// Each name once, none that must be known and is not, and one of the two ways of keeping primitives.
    fn known(&self) -> Result<(), FileError> {
        const ALONE: [Tag; 5] = [Tag::TREE, Tag::OVERFLOW, Tag::BOX, Tag::FLAT, Tag::FIGURES];
        const DOUBLE: [Tag; 4] = [Tag::VERTICES, Tag::FACES, Tag::BOX, Tag::FLAT];
        let is_double = self.section(Tag::VERTICES).is_some();
        for (i, section) in self.header.sections.iter().enumerate() {
            let tag = section.tag;
            let known = ALONE.contains(&tag) || Tag::GEOMETRY.contains(&tag);
            let mixed = tag == Tag::SIDES || tag == Tag::KINDS;
            let expected = if !known && tag.is_required() {
                "a section that this version knows"
            } else if self.header.sections[..i].iter().any(|other| other.tag == tag) {
                "one section of this name"
            } else if DOUBLE.contains(&tag) != is_double
                && (DOUBLE.contains(&tag) || Tag::GEOMETRY.contains(&tag))
            {
                "primitives in f32, or triangles in f64"
            } else if mixed && self.section(Tag::TRIANGLES).is_some() != (tag == Tag::SIDES) {
                "triangles with their sides, or primitives of all kinds"
            } else {
                continue;
            };
            return Err(self.value(section, "its name", tag, expected));
        }
        Ok(())
    }

    fn tree(&self) -> Result<WideTree, FileError> {
        let header = self.header;
        let section = self.section(Tag::TREE).ok_or(FileError::Missing { section: Tag::TREE })?;
        let lines = section.len / LINE as u64;
        if section.len % LINE as u64 != 0 || lines == 0 || lines > MAX_LINES as u64 {
            let expected = format!("1 to {MAX_LINES} lines of {LINE} bytes");
            return Err(self.value(section, "its length", section.len, expected));
        }
        let lines = Lines::shared(self.memory(section)?);
        let lines = lines.ok_or(FileError::Unaligned { alignment: SECTION_ALIGNMENT })?;
        let (overflow, overflow_offset) = self.overflow()?;
        let links =
            Links { lines: &lines, overflow: &overflow, offset: section.offset, overflow_offset };
        let counted = links.check(header.root, Header::ROOT_AT)?;
        for (what, found, expected, offset) in [
            ("the number of treelets", header.treelets, counted.treelets, Header::TREELETS_AT),
            ("the number of blocks", header.blocks, counted.blocks, Header::BLOCKS_AT),
        ] {
            if found != expected {
                let (expected, found) = (expected.to_string(), found.to_string());
                let section = Part::Header;
                return Err(FileError::Value { section, offset, what, expected, found });
            }
        }
        Ok(WideTree::of_file(header, lines, overflow))
    }

    /// Leaves of many blocks, and where their list begins.
    fn overflow(&self) -> Result<(Vec<(u32, u32)>, u64), FileError> {
        let Some(section) = self.section(Tag::OVERFLOW) else { return Ok((Vec::new(), 0)) };
        let (pairs, rest) = self.all[section.range()].as_chunks::<8>();
        if !rest.is_empty() {
            return Err(self.value(section, "its length", section.len, "a multiple of 8"));
        }
        let half = |pair: &[u8; 8], at: usize| {
            u32::from_le_bytes([pair[at], pair[at + 1], pair[at + 2], pair[at + 3]])
        };
        Ok((pairs.iter().map(|pair| (half(pair, 0), half(pair, 4))).collect(), section.offset))
    }

    fn any_geometry(&self) -> Result<AnyGeometry, FileError> {
        match self.section(Tag::VERTICES) {
            Some(vertices) => self.double(vertices).map(AnyGeometry::Double),
            None => self.geometry().map(AnyGeometry::Single),
        }
    }

    /// Triangles in `f64`, where they lie.
    fn double(&self, vertices: &Section) -> Result<DoubleGeometry, FileError> {
        let header = self.header;
        let get = |tag| self.section(tag).ok_or(FileError::Missing { section: tag });
        let (faces, corners) = (get(Tag::FACES)?, get(Tag::BOX)?);
        let flat = self.section(Tag::FLAT);
        if !vertices.len.is_multiple_of(24) {
            return Err(self.value(vertices, "its length", vertices.len, "a multiple of 24"));
        }
        if header.primitives == 0 || faces.len != 12 * header.primitives {
            let expected = 12 * header.primitives.max(1);
            return Err(self.value(faces, "its length", faces.len, expected));
        }
        let flat_bytes = flat.map_or(0, |flat| flat.len);
        if flat_bytes != 4 * header.degenerate {
            let Some(flat) = flat else { return Err(FileError::Missing { section: Tag::FLAT }) };
            return Err(self.value(flat, "its length", flat_bytes, 4 * header.degenerate));
        }
        let (numbers, rest) = self.all[corners.range()].as_chunks::<8>();
        let &[a, b, c, d, e, f] = numbers else {
            return Err(self.value(corners, "its length", corners.len, 48));
        };
        let [min, max] = [[a, b, c], [d, e, f]].map(|p| p.map(f64::from_le_bytes));
        let fits = |i: usize| {
            min[i] <= max[i] && min[i].abs().max(max[i].abs()) <= DoubleGeometry::MAX_COORDINATE
        };
        if !rest.is_empty() || !(0..3).all(fits) {
            let found = format!("{min:?} to {max:?}");
            return Err(self.value(corners, "a box", found, "corners in order, at most 1e100"));
        }
        if header.has_shapes {
            return Err(FileError::Missing { section: Tag::KINDS });
        }
        let unaligned = FileError::Unaligned { alignment: SECTION_ALIGNMENT };
        let rows = (Rows::stored(self.memory(vertices)?), Rows::stored(self.memory(faces)?));
        let flat = match flat {
            Some(flat) => Rows::stored(self.memory(flat)?),
            None => Some(Rows::Own(Vec::new())),
        };
        let ((Some(vertices), Some(faces)), Some(flat)) = (rows, flat) else {
            return Err(unaligned);
        };
        Ok(DoubleGeometry::of_file((vertices, faces), flat, (min, max)))
    }

    fn geometry(&self) -> Result<Geometry, FileError> {
        let header = self.header;
        let count = header.primitives;
        let geometry = if let Some(triangles) = self.section(Tag::TRIANGLES) {
            let sides = self.section(Tag::SIDES);
            let bytes = count * crate::geometry::TRIANGLE_BYTES as u64;
            if triangles.len != bytes {
                return Err(self.value(triangles, "its length", triangles.len, bytes));
            }
            if let Some(sides) = sides.filter(|sides| sides.len != count) {
                return Err(self.value(sides, "its length", sides.len, count));
            }
            let sides = sides.map(|sides| self.memory(sides)).transpose()?;
            let stored = StoredTriangles::new(self.memory(triangles)?, sides);
            let stored = stored.ok_or(FileError::Unaligned { alignment: SECTION_ALIGNMENT })?;
            Geometry::of_stored(stored, header.geometry_bounds, header.degenerate as usize)
        } else {
            self.shapes()?
        };
        if header.has_shapes && self.section(Tag::KINDS).is_none() {
            return Err(FileError::Missing { section: Tag::KINDS });
        }
        Ok(geometry)
    }

    /// Primitives of all kinds, copied.
    fn shapes(&self) -> Result<Geometry, FileError> {
        let get = |tag| self.section(tag).ok_or(FileError::Missing { section: tag });
        let missing = FileError::Missing { section: Tag::TRIANGLES };
        let kinds = get(Tag::KINDS).map_err(|_| missing)?;
        let (ends, numbers) = (get(Tag::ENDS)?, get(Tag::NUMBERS)?);
        if kinds.len != self.header.primitives {
            return Err(self.value(kinds, "its length", kinds.len, self.header.primitives));
        }
        let bytes = |section: &Section| &self.all[section.range()];
        let uneven = |section| self.value(section, "its length", section.len, "whole numbers");
        let wide = bytemuck::try_cast_slice(bytes(ends)).map_err(|_| uneven(ends))?;
        let rows = bytemuck::try_cast_slice(bytes(numbers)).map_err(|_| uneven(numbers))?;
        let geometry = read_shapes(bytes(kinds), wide, rows).map_err(|i| {
            let expected = "the numbers of a primitive of a known kind";
            self.value(kinds, "a primitive", format!("number {i}, which is none"), expected)
        })?;
        let same_box = geometry.bounds() == self.header.geometry_bounds;
        if !same_box || geometry.degenerate_count() as u64 != self.header.degenerate {
            return Err(self.value(
                kinds,
                "the box of its primitives",
                "another",
                "that of the header",
            ));
        }
        Ok(geometry)
    }

    fn figures(&self) -> Result<Option<Figures>, FileError> {
        let Some(section) = self.section(Tag::FIGURES) else { return Ok(None) };
        let figures = Figures::parse(&self.all[section.range()]);
        figures.map(Some).ok_or_else(|| {
            self.value(section, "its content", "something else", "the figures of a tree")
        })
    }

    fn value(
        &self,
        section: &Section,
        what: &'static str,
        found: impl ToString,
        expected: impl ToString,
    ) -> FileError {
        let (offset, section) = (section.offset, Part::Section(section.tag));
        let (expected, found) = (expected.to_string(), found.to_string());
        FileError::Value { section, offset, what, expected, found }
    }
}
