//! Why bytes are refused.

use super::header::Tag;

/// Why bytes are not a saved scene. Offsets count from the beginning of the file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FileError {
    /// Something else altogether.
    #[error("no saved scene: at offset 0, expected the bytes \"ROPEWALK\", found {found}")]
    Unknown {
        /// The first bytes.
        found: String,
    },
    /// Written, or carried over, with the other byte order.
    #[error("the numbers are big-endian: at offset 8, expected 0x01020304, found 0x04030201")]
    ByteOrder,
    /// Another version of the format or of the tree's layout.
    #[error("{what} version {found} at offset {offset}; this program reads version {expected}{advice}", advice = advice(*.found, *.expected))]
    Version {
        /// Of what.
        what: &'static str,
        /// Where it stands.
        offset: u64,
        /// The version that can be read.
        expected: u32,
        /// The version found.
        found: u32,
    },
    /// Cut off, or too long.
    #[error("{}: expected {expected} bytes, found {found}", if .found < .expected { "the file is cut off" } else { "the file is too long" })]
    Size {
        /// Bytes that there should be.
        expected: u64,
        /// Bytes that there are.
        found: u64,
    },
    /// A value that cannot be.
    #[error("{section}, offset {offset}: {what} is {found}; expected {expected}")]
    Value {
        /// The part of the file.
        section: Part,
        /// Where the value stands.
        offset: u64,
        /// What it means.
        what: &'static str,
        /// What it should be.
        expected: String,
        /// What it is.
        found: String,
    },
    /// A part of the file is not what was written.
    #[error(
        "{section}, offset {offset}: the bytes were altered; expected checksum {expected}, found {found}"
    )]
    Altered {
        /// The part.
        section: Part,
        /// Where it begins.
        offset: u64,
        /// Its checksum as written.
        expected: String,
        /// Its checksum.
        found: String,
    },
    /// A section that must be there is not.
    #[error("there is no section {section}")]
    Missing {
        /// Its tag.
        section: Tag,
    },
    /// A scene in `f64` where one in `f32` was asked for.
    #[error("the scene is of double precision; one of single precision is needed here")]
    Double,
    /// The owner's bytes do not begin at a multiple of the alignment of sections.
    #[error(
        "the bytes begin at an address that is no multiple of {alignment}; map the file, or copy them"
    )]
    Unaligned {
        /// The alignment.
        alignment: usize,
    },
    /// This processor is big-endian.
    #[error("saved scenes are used as they lie, which needs a little-endian processor")]
    BigEndian,
    /// The monitor cancelled it.
    #[error("opening was cancelled")]
    Cancelled,
}

fn advice(found: u32, expected: u32) -> &'static str {
    if found < expected { "; save the scene again" } else { "; it was saved by a newer program" }
}

/// A part of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Header and table of sections.
    Header,
    /// A section.
    Section(Tag),
}

impl std::fmt::Display for Part {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Part::Header => write!(f, "header"),
            Part::Section(tag) => write!(f, "section {tag}"),
        }
    }
}

/// Why a scene cannot be saved.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// A primitive of a user's own kind.
    #[error("primitive {index} is of a kind that cannot be saved")]
    Custom {
        /// Its number.
        index: u32,
    },
    /// This processor is big-endian.
    #[error("scenes are saved as they lie, which needs a little-endian processor")]
    BigEndian,
    /// The monitor cancelled it.
    #[error("saving was cancelled")]
    Cancelled,
    /// Bytes could not be written.
    #[error(transparent)]
    Io(#[from] std::io::Error),
}
