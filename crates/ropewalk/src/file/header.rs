//! Header and table of sections.

use super::error::{FileError, Part};
use super::{Hash, short};
use crate::aabb::Aabb;
use crate::geometry::Geometry;
use crate::wide::MAX_LINES;

/// The first bytes of a file.
pub const MAGIC: [u8; 8] = *b"ROPEWALK";
/// Version of header and sections.
pub const FORMAT_VERSION: u32 = 1;
/// Version of treelets and blocks.
pub const LAYOUT_VERSION: u32 = 1;

/// The same of a tree that holds other primitives than triangles: blocks have bounds of these.
pub const SHAPES_LAYOUT_VERSION: u32 = 2;

/// The version of a tree's layout.
fn layout_version(has_shapes: bool) -> u32 {
    if has_shapes { SHAPES_LAYOUT_VERSION } else { LAYOUT_VERSION }
}
/// Bytes of the header, without the table of sections that follows it.
pub const HEADER_BYTES: usize = 192;
/// Sections begin at multiples of it, and so does the address of a file's first byte.
pub const SECTION_ALIGNMENT: usize = 64;
/// Most sections.
pub const MAX_SECTIONS: usize = 32;

/// Bytes of an entry of the table.
const ENTRY_BYTES: usize = 64;
/// As a little-endian number.
const BYTE_ORDER: u32 = 0x0102_0304;
/// Where the checksum of header and table stands.
const CHECKSUM: std::ops::Range<usize> = 32..64;
/// Where the entry of a section has its checksum.
const ENTRY_CHECKSUM: usize = 32;
/// Flag: leaves hold other primitives than triangles.
const HAS_SHAPES: u32 = 1;

/// The name of a section, four ASCII letters. A reader may pass over sections that it does not know if
/// their first letter is small; others it must refuse.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct Tag(pub [u8; 4]);

impl Tag {
    /// Treelets and blocks.
    pub const TREE: Tag = Tag(*b"TREE");
    /// Leaves of 15 blocks or more.
    pub const OVERFLOW: Tag = Tag(*b"OVER");
    /// Triangles.
    pub const TRIANGLES: Tag = Tag(*b"TRIS");
    /// Sides on which triangles are hit.
    pub const SIDES: Tag = Tag(*b"SIDE");
    /// Kinds and sides of primitives of all kinds.
    pub const KINDS: Tag = Tag(*b"KIND");
    /// Where the numbers of each primitive end.
    pub const ENDS: Tag = Tag(*b"ENDS");
    /// Numbers of primitives.
    pub const NUMBERS: Tag = Tag(*b"NUMS");
    /// Vertices in `f64`.
    pub const VERTICES: Tag = Tag(*b"VERT");
    /// Numbers of the vertices of triangles.
    pub const FACES: Tag = Tag(*b"FACE");
    /// Box of the vertices in `f64`.
    pub const BOX: Tag = Tag(*b"DBOX");
    /// Triangles in `f64` without area.
    pub const FLAT: Tag = Tag(*b"FLAT");
    /// Figures of the tree.
    pub const FIGURES: Tag = Tag(*b"stat");

    /// The sections whose checksums make the geometry's hash.
    pub const GEOMETRY: [Tag; 7] = [
        Tag::TRIANGLES,
        Tag::SIDES,
        Tag::KINDS,
        Tag::ENDS,
        Tag::NUMBERS,
        Tag::VERTICES,
        Tag::FACES,
    ];

    /// True if readers that do not know the section must refuse the file.
    pub fn is_required(self) -> bool {
        !self.0[0].is_ascii_lowercase()
    }
}

impl std::fmt::Display for Tag {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.0.escape_ascii())
    }
}

impl std::fmt::Debug for Tag {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{self}")
    }
}

/// Where a section lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Section {
    /// Its name.
    pub tag: Tag,
    /// Where it begins.
    pub offset: u64,
    /// Its bytes.
    pub len: u64,
    /// Their hash.
    pub checksum: Hash,
}

impl Section {
    /// Its bytes' places; the section must lie inside of a file in memory.
    pub fn range(&self) -> std::ops::Range<usize> {
        self.offset as usize..(self.offset + self.len) as usize
    }
}

/// The header, as numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Header {
    pub geometry_hash: Hash,
    pub tree_bounds: Aabb,
    pub geometry_bounds: Aabb,
    pub root: u32,
    pub has_shapes: bool,
    pub primitives: u64,
    pub degenerate: u64,
    pub treelets: u64,
    pub blocks: u64,
    pub sections: Vec<Section>,
}

/// The next multiple of the alignment, or `u64::MAX` beyond all of them.
pub fn aligned(offset: u64) -> u64 {
    offset.checked_next_multiple_of(SECTION_ALIGNMENT as u64).unwrap_or(u64::MAX)
}

/// Bytes of header and table.
pub fn prefix_bytes(sections: usize) -> usize {
    HEADER_BYTES + sections * ENTRY_BYTES
}

/// The geometry's hash from the checksums of its sections.
pub fn geometry_hash<'a>(sections: impl IntoIterator<Item = &'a Section>) -> Hash {
    let mut hasher = blake3::Hasher::new();
    hasher.update(b"ropewalk geometry 1");
    for section in sections {
        hasher.update(&section.tag.0);
        hasher.update(&section.len.to_le_bytes());
        hasher.update(&section.checksum);
    }
    *hasher.finalize().as_bytes()
}

impl Header {
    /// Where the root's code stands.
    pub const ROOT_AT: u64 = 144;
    /// Where the number of treelets stands.
    pub const TREELETS_AT: u64 = 168;
    /// Where the number of blocks stands.
    pub const BLOCKS_AT: u64 = 176;

    /// Bytes of the whole file.
    pub fn file_bytes(&self) -> u64 {
        let last = self.sections.last().map(|s| s.offset.saturating_add(s.len));
        aligned(last.unwrap_or(prefix_bytes(0) as u64))
    }

    /// Header and table as bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(prefix_bytes(self.sections.len()));
        let mut put = |part: &[u8]| bytes.extend_from_slice(part);
        put(&MAGIC);
        let layout = layout_version(self.has_shapes);
        for number in [BYTE_ORDER, FORMAT_VERSION, layout, self.sections.len() as u32] {
            put(&number.to_le_bytes());
        }
        put(&self.file_bytes().to_le_bytes());
        put(&[0; 32]);
        put(&self.geometry_hash);
        for bounds in [&self.tree_bounds, &self.geometry_bounds] {
            bounds.min.iter().chain(&bounds.max).for_each(|x| put(&x.to_le_bytes()));
        }
        put(&self.root.to_le_bytes());
        put(&u32::from(self.has_shapes).to_le_bytes());
        for number in [self.primitives, self.degenerate, self.treelets, self.blocks, 0] {
            put(&number.to_le_bytes());
        }
        for section in &self.sections {
            put(&section.tag.0);
            put(&[0; 4]);
            put(&section.offset.to_le_bytes());
            put(&section.len.to_le_bytes());
            put(&[0; 8]);
            put(&section.checksum);
        }
        let checksum = blake3::hash(&bytes);
        bytes[CHECKSUM].copy_from_slice(checksum.as_bytes());
        bytes
    }

    /// Reads and checks header, table, the sizes of all sections and what lies between them; not the
    /// sections themselves.
    pub fn parse(bytes: &[u8]) -> Result<Header, FileError> {
        let found = bytes.len() as u64;
        if !bytes.starts_with(&MAGIC) {
            let found = bytes[..bytes.len().min(8)].escape_ascii();
            return Err(FileError::Unknown { found: format!("\"{found}\"") });
        }
        let Some(fixed) = bytes.get(..HEADER_BYTES) else {
            return Err(FileError::Size { expected: HEADER_BYTES as u64, found });
        };
        let word = |at: usize| u32::from_le_bytes(fixed[at..at + 4].try_into().expect("4 bytes"));
        let long = |at: usize| u64::from_le_bytes(fixed[at..at + 8].try_into().expect("8 bytes"));
        if word(8).swap_bytes() == BYTE_ORDER {
            return Err(FileError::ByteOrder);
        }
        check("the mark of the byte order", 8, word(8), BYTE_ORDER)?;
        version("format", 12, word(12), FORMAT_VERSION)?;
        version("tree layout", 16, word(16), layout_version(word(148) & HAS_SHAPES != 0))?;
        let count = word(20) as usize;
        if count > MAX_SECTIONS {
            return Err(value(
                "the number of sections",
                20,
                count,
                format!("at most {MAX_SECTIONS}"),
            ));
        }
        if long(24) != found {
            return Err(FileError::Size { expected: long(24), found });
        }
        let prefix = prefix_bytes(count);
        let Some(prefix) = bytes.get(..prefix) else {
            return Err(FileError::Size { expected: prefix as u64, found });
        };
        let expected: Hash = fixed[CHECKSUM].try_into().expect("32 bytes");
        let mut zeroed = prefix.to_vec();
        zeroed[CHECKSUM].fill(0);
        compare(Part::Header, 0, &expected, blake3::hash(&zeroed).as_bytes())?;

        let point = |at: usize| [0, 4, 8].map(|i| f32::from_bits(word(at + i)));
        let header = Header {
            geometry_hash: fixed[64..96].try_into().expect("32 bytes"),
            tree_bounds: Aabb::new(point(96), point(108)),
            geometry_bounds: Aabb::new(point(120), point(132)),
            root: word(144),
            has_shapes: word(148) & HAS_SHAPES != 0,
            primitives: long(152),
            degenerate: long(160),
            treelets: long(168),
            blocks: long(176),
            sections: prefix[HEADER_BYTES..].chunks_exact(ENTRY_BYTES).map(section).collect(),
        };
        if word(148) & !HAS_SHAPES != 0 {
            return Err(value("the flags", 148, word(148), "0 or 1"));
        }
        if header.primitives > Geometry::MAX_PRIMITIVES as u64 {
            let expected = format!("at most {}", Geometry::MAX_PRIMITIVES);
            return Err(value("the number of primitives", 152, header.primitives, expected));
        }
        if header.degenerate > header.primitives {
            let expected = format!("at most {}", header.primitives);
            return Err(value(
                "the number of primitives without area",
                160,
                header.degenerate,
                expected,
            ));
        }
        for (at, most) in [(168, header.treelets), (176, header.blocks)] {
            if most > MAX_LINES as u64 {
                return Err(value(
                    "the size of the tree",
                    at,
                    most,
                    format!("at most {MAX_LINES}"),
                ));
            }
        }
        for (at, bounds) in [(96, &header.tree_bounds), (120, &header.geometry_bounds)] {
            if !is_box(bounds, header.primitives == 0) {
                let found = format!("{:?} to {:?}", bounds.min, bounds.max);
                return Err(value("a box", at, found, "finite corners in order"));
            }
        }
        header.check_table(bytes)?;
        let of_geometry = |s: &&Section| Tag::GEOMETRY.contains(&s.tag);
        let hash = geometry_hash(header.sections.iter().filter(of_geometry));
        if hash != header.geometry_hash {
            let (found, expected) = (short(&header.geometry_hash), short(&hash));
            return Err(value("the geometry's hash", 64, found, expected));
        }
        // What is left: bytes without meaning, which are 0.
        let again = header.to_bytes();
        match prefix.iter().zip(&again).position(|(found, expected)| found != expected) {
            Some(i) => Err(value("a reserved byte", i as u64, prefix[i], again[i])),
            None => Ok(header),
        }
    }

    /// Sections follow one another without overlap and fill the file.
    fn check_table(&self, bytes: &[u8]) -> Result<(), FileError> {
        let mut end = prefix_bytes(self.sections.len()) as u64;
        for (i, section) in self.sections.iter().enumerate() {
            let at = prefix_bytes(i) as u64;
            let part = Part::Section(section.tag);
            if section.offset != aligned(end) {
                let (found, expected) = (section.offset.to_string(), aligned(end).to_string());
                let what = "its beginning";
                return Err(FileError::Value {
                    section: part,
                    offset: at + 8,
                    what,
                    expected,
                    found,
                });
            }
            let most = (bytes.len() as u64).saturating_sub(section.offset);
            if section.len > most {
                let (found, expected) = (section.len.to_string(), format!("at most {most}"));
                let what = "its length";
                return Err(FileError::Value {
                    section: part,
                    offset: at + 16,
                    what,
                    expected,
                    found,
                });
            }
            check_padding(bytes, end, section.offset)?;
            end = section.offset + section.len;
        }
        if aligned(end) != bytes.len() as u64 {
            return Err(FileError::Size { expected: aligned(end), found: bytes.len() as u64 });
        }
        check_padding(bytes, end, aligned(end))
    }
}

/// Bytes between sections are 0.
fn check_padding(bytes: &[u8], from: u64, to: u64) -> Result<(), FileError> {
    let between = &bytes[from as usize..to as usize];
    match between.iter().position(|&byte| byte != 0) {
        None => Ok(()),
        Some(i) => Err(value("a byte between sections", from + i as u64, between[i], "0")),
    }
}

fn section(entry: &[u8]) -> Section {
    let long = |at: usize| u64::from_le_bytes(entry[at..at + 8].try_into().expect("8 bytes"));
    Section {
        tag: Tag(entry[..4].try_into().expect("4 bytes")),
        offset: long(8),
        len: long(16),
        checksum: entry[ENTRY_CHECKSUM..].try_into().expect("32 bytes"),
    }
}

/// True for finite corners in order, or the empty box if `may_be_empty`.
fn is_box(bounds: &Aabb, may_be_empty: bool) -> bool {
    let finite = bounds.min.iter().chain(&bounds.max).all(|x| x.is_finite());
    (finite && !bounds.is_empty()) || (may_be_empty && *bounds == Aabb::EMPTY)
}

fn version(what: &'static str, offset: u64, found: u32, expected: u32) -> Result<(), FileError> {
    if found == expected {
        return Ok(());
    }
    Err(FileError::Version { what, offset, expected, found })
}

fn check(what: &'static str, offset: u64, found: u32, expected: u32) -> Result<(), FileError> {
    if found == expected {
        return Ok(());
    }
    Err(value(what, offset, format!("{found:#010x}"), format!("{expected:#010x}")))
}

fn value(
    what: &'static str,
    offset: u64,
    found: impl ToString,
    expected: impl ToString,
) -> FileError {
    let (expected, found) = (expected.to_string(), found.to_string());
    FileError::Value { section: Part::Header, offset, what, expected, found }
}

/// Compares checksums.
pub fn compare(section: Part, offset: u64, expected: &Hash, found: &Hash) -> Result<(), FileError> {
    if expected == found {
        return Ok(());
    }
    let (expected, found) = (short(expected), short(found));
    Err(FileError::Altered { section, offset, expected, found })
}
