//! What can be wrong with a mesh file, and where.

use crate::watched::Cancelled;
use std::fmt;
use std::io;

/// An error in a mesh file. Displays as one sentence: `cow.obj: line 12: expected a number for x, found "abc"`.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {place}{kind}")]
#[non_exhaustive]
pub struct MeshError {
    /// The file as the user named it; `input` if it came from memory.
    pub file: String,
    /// Where.
    pub place: Place,
    /// What.
    pub kind: MeshErrorKind,
}

/// A place in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    Start,
    /// A line of text, from 1.
    Line(u64),
    /// An offset in bytes after decompression.
    Byte(u64),
    /// A part by its name in the format, such as `accessors[3].count`.
    Part(String),
    /// The end.
    End,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::Start => Ok(()),
            Place::Line(line) => write!(f, "line {line}: "),
            Place::Byte(byte) => write!(f, "byte {byte}: "),
            Place::Part(part) => write!(f, "{part}: "),
            Place::End => write!(f, "end of the file: "),
        }
    }
}

/// What is wrong.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshErrorKind {
    /// Something that cannot stand here.
    #[error("expected {expected}, found {found}")]
    Unexpected {
        /// What the format asks for.
        expected: String,
        /// What is there, shortened.
        found: String,
    },
    /// The monitor cancelled it.
    #[error("reading was cancelled")]
    Cancelled,
    /// The system, or a damaged archive.
    #[error("{0}")]
    Io(io::Error),
}

/// What readers return.
pub(super) type Result<T> = std::result::Result<T, MeshError>;

impl MeshError {
    /// The same error, with the name of the file.
    pub fn in_file(mut self, file: impl Into<String>) -> Self {
        self.file = file.into();
        self
    }
}

impl From<io::Error> for MeshError {
    fn from(error: io::Error) -> Self {
        MeshError { file: "input".into(), place: Place::Start, kind: MeshErrorKind::Io(error) }
    }
}

impl From<Cancelled> for MeshError {
    fn from(_: Cancelled) -> Self {
        MeshError { file: "input".into(), place: Place::Start, kind: MeshErrorKind::Cancelled }
    }
}

/// Longest text that a message quotes, in characters.
const QUOTED_CHARS: usize = 60;

/// An error at a place.
pub(super) fn wrong(
    place: Place,
    expected: impl Into<String>,
    found: impl fmt::Display,
) -> MeshError {
    // Names of the file's own stand in what is expected too.
    let expected = printable(&expected.into(), 3 * QUOTED_CHARS);
    let found = printable(&found.to_string(), QUOTED_CHARS);
    MeshError { file: "input".into(), place, kind: MeshErrorKind::Unexpected { expected, found } }
}

/// Shortened, with control characters escaped.
pub(super) fn printable(text: &str, most: usize) -> String {
    let mut out = String::new();
    for c in text.chars().take(most) {
        if c.is_control() {
            out.extend(c.escape_default());
        } else {
            out.push(c);
        }
    }
    if text.chars().nth(most).is_some() {
        out.push_str("...");
    }
    out
}
