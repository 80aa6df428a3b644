//! What can be wrong with a file, and where.

use std::io;

/// An error in the input, at a place in it. Displays as one sentence:
/// `balls.nff:12:7: expected a number for the sphere's radius, found "abc"`.
#[derive(Debug, thiserror::Error)]
#[error("{file}:{line}:{column}: {kind}")]
#[non_exhaustive]
pub struct NffError {
    /// The file as the user named it; `input` until [`NffError::in_file`] sets it.
    pub file: String,
    /// Line, from 1.
    pub line: u64,
    /// Column, from 1, in bytes.
    pub column: u64,
    /// What is wrong.
    pub kind: NffErrorKind,
}

impl NffError {
    pub(super) fn new(line: u64, column: u64, kind: NffErrorKind) -> Self {
        NffError { file: "input".to_owned(), line, column, kind }
    }

    /// The same error, with the name of the file.
    pub fn in_file(mut self, file: impl Into<String>) -> Self {
        self.file = file.into();
        self
    }
}

/// What is wrong with an NFF text.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum NffErrorKind {
    /// A word that cannot stand here.
    #[error("expected {expected}, found {found}")]
    Unexpected {
        /// What the grammar asks for.
        expected: String,
        /// The word found, quoted and shortened.
        found: String,
    },
    /// The text ends within an entity.
    #[error("expected {expected}, found the end of the file")]
    Truncated {
        /// What the grammar asks for.
        expected: String,
    },
    /// No entity of the format begins so.
    #[error("expected an entity (v, b, l, f, s, c, p, pp or #){after}, found {found}")]
    UnknownEntity {
        /// Empty, or what precedes, such as ` after the 4 numbers of s`.
        after: &'static str,
        /// The word found, quoted and shortened.
        found: String,
    },
    /// The text ends without any object: nothing to render.
    #[error("expected at least one object (s, c, p or pp), found the end of the file")]
    NoObjects,
    /// More than [`NffLimits`](crate::NffLimits) allows.
    #[error("expected at most {limit} {what}, found {found}")]
    Limit {
        /// What is counted.
        what: &'static str,
        /// The limit.
        limit: u64,
        /// The count, or the word, that exceeds it.
        found: String,
    },
    /// A control character outside a comment: this is no text file.
    #[error("expected text, found the byte 0x{byte:02x}, as in a binary file")]
    NotText {
        /// The byte.
        byte: u8,
    },
    /// The input failed while it was read: a damaged archive or a disk error, say.
    #[error("expected to read on, found an error: {0}")]
    Io(io::Error),
}

/// Why [`read_nff`](crate::read_nff) stopped: through the input's fault or the sink's.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum NffReadError<E> {
    /// The input is at fault.
    #[error(transparent)]
    Input(#[from] NffError),
    /// The sink refused a piece.
    #[error("{0}")]
    Sink(E),
}

/// Longest part of a word that a message quotes, in characters.
const QUOTED_CHARS: usize = 32;

/// A word for a message: quoted, with control characters escaped, shortened.
pub(super) fn quote(word: &[u8]) -> String {
    let text = String::from_utf8_lossy(word);
    match text.char_indices().nth(QUOTED_CHARS) {
        None => format!("{text:?}"),
        Some((end, _)) => format!("{:?}", format!("{}...", &text[..end])),
    }
}
