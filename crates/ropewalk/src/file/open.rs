//! From bytes to a tree and a geometry that read them where they lie.

use super::Hash;
use super::error::{FileError, Part};
use super::figures::Figures;
use super::header::{Header, SECTION_ALIGNMENT, Section, Tag, compare};
use super::links::Links;
use super::shapes::read_shapes;
use super::write::PIECE;
use crate::build::Monitor;
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
pub struct Opened {
    /// The tree; it reads the bytes where they lie.
    pub tree: WideTree,
    /// What it was built over. Triangles stay where they lie; where there are other primitives, all have
    /// been copied.
    pub geometry: Geometry,
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

/// Opens what [`write`](super::write()) wrote, wherever it lies; the owner is kept as long as the tree or the
/// geometry lives. Its first byte must lie at a multiple of [`SECTION_ALIGNMENT`], as that of a map does.
///
/// Bytes that pass are safe to use, whatever they say; that they are those that were written is known
/// only after [`Check::Everything`]. They must not change while they are in use.
///
/// # Errors
/// [`FileError`] with the part of the file, the offset, and what was expected there.
pub fn open(bytes: &SharedBytes, check: Check) -> Result<Opened, FileError> {
    open_monitored(bytes, check, &())
}

/// The same, until the monitor cancels it: checksums take as long as the bytes take to read.
///
/// # Errors
/// As [`open`], and [`FileError::Cancelled`].
pub fn open_monitored(
    bytes: &SharedBytes,
    check: Check,
    monitor: &dyn Monitor,
) -> Result<Opened, FileError> {
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
    let geometry = file.geometry()?;
    let figures = file.figures()?;
    let is_extra = |s: &&Section| !s.tag.is_required() && s.tag != Tag::FIGURES;
    let extra = header.sections.iter().filter(is_extra);
    let extra = extra.map(|s| Extra { tag: s.tag, bytes: all[s.range()].to_vec() }).collect();
    let Header { geometry_hash, sections, .. } = header;
    Ok(Opened { tree, geometry, figures, extra, geometry_hash, sections, bytes: all.len() as u64 })
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
        const ALONE: [Tag; 3] = [Tag::TREE, Tag::OVERFLOW, Tag::FIGURES];
        for (i, section) in self.header.sections.iter().enumerate() {
            let tag = section.tag;
            let known = ALONE.contains(&tag) || Tag::GEOMETRY.contains(&tag);
            let mixed = tag == Tag::SIDES || tag == Tag::KINDS;
            let expected = if !known && tag.is_required() {
                "a section that this version knows"
            } else if self.header.sections[..i].iter().any(|other| other.tag == tag) {
                "one section of this name"
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
