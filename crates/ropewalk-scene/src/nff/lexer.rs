//! Words and comments, straight from a buffered reader: no line and no file is ever held.

use super::error::{NffError, NffErrorKind, quote};
use super::limits::NffLimits;
use std::io::{self, BufRead};

/// Longest part of a comment that is kept, in bytes; the rest of it is skipped.
const COMMENT_BYTES: usize = 4096;

/// What [`Lexer::next`] found; its bytes are in [`Lexer::text`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Lexeme {
    Word,
    Comment,
    End,
}

/// Splits bytes into words and comments and knows where it is.
pub(super) struct Lexer<R> {
    input: R,
    token_bytes: usize,
    place: Place,
    /// Line and column of the last lexeme.
    start: (u64, u64),
    /// Bytes of the last lexeme.
    text: Vec<u8>,
}

/// How far the text has been read.
struct Place {
    /// Bytes consumed.
    offset: u64,
    /// Most bytes that may be consumed.
    limit: u64,
    /// Current line, from 1.
    line: u64,
    /// Offset of the line's first byte.
    line_start: u64,
    /// The last byte was a carriage return: a line feed now belongs to the same line end.
    after_cr: bool,
}

impl Place {
    /// Line and column of the next byte.
    fn here(&self) -> (u64, u64) {
        (self.line, self.offset - self.line_start + 1)
    }

    /// An error at the next byte.
    fn error(&self, kind: NffErrorKind) -> NffError {
        let (line, column) = self.here();
        NffError::new(line, column, kind)
    }

    /// Passes a byte of white space; `\n`, `\r` and `\r\n` each end a line.
    fn pass_white_space(&mut self, byte: u8) {
        self.offset += 1;
        if byte == b'\r' || byte == b'\n' {
            self.line += u64::from(byte == b'\r' || !self.after_cr);
            self.line_start = self.offset;
        }
        self.after_cr = byte == b'\r';
    }
}

impl<R: BufRead> Lexer<R> {
    pub(super) fn new(input: R, limits: &NffLimits) -> Self {
        let place =
            Place { offset: 0, limit: limits.bytes, line: 1, line_start: 0, after_cr: false };
        let token_bytes = limits.token_bytes;
        Lexer { input, token_bytes, place, start: (1, 1), text: Vec::new() }
    }

    /// Bytes of the last lexeme: the word, or the comment without its `#`.
    pub(super) fn text(&self) -> &[u8] {
        &self.text
    }

    /// Bytes consumed so far.
    pub(super) fn offset(&self) -> u64 {
        self.place.offset
    }

    /// An error at the last lexeme.
    pub(super) fn error(&self, kind: NffErrorKind) -> NffError {
        NffError::new(self.start.0, self.start.1, kind)
    }

    /// Moves to the next lexeme.
    pub(super) fn next(&mut self) -> Result<Lexeme, NffError> {
        self.text.clear();
        let first = self.skip_white_space()?;
        self.start = self.place.here();
        match first {
            None => Ok(Lexeme::End),
            Some(b'#') => self.comment().map(|()| Lexeme::Comment),
            Some(_) => self.word().map(|()| Lexeme::Word),
        }
    }

    /// The first byte that is not white space, not yet consumed.
    fn skip_white_space(&mut self) -> Result<Option<u8>, NffError> {
        loop {
            let window = window(&mut self.input, &self.place)?;
            if window.is_empty() {
                return Ok(None);
            }
            let count = window.iter().take_while(|&&byte| is_white_space(byte)).count();
            window[..count].iter().for_each(|&byte| self.place.pass_white_space(byte));
            let next = window.get(count).copied();
            self.input.consume(count);
            if next.is_some() {
                self.place.after_cr = false;
                return Ok(next);
            }
        }
    }

    /// A word: up to white space or a comment.
    fn word(&mut self) -> Result<(), NffError> {
        loop {
            let window = window(&mut self.input, &self.place)?;
            let mut before = self.text.last().copied();
            let end = window.iter().position(|&byte| {
                // A `#` right behind a decimal point is part of the word: `1.#IND` is how one C
                // library prints NaN, and must not be read as 1 with a comment.
                let ends = byte <= b' ' || byte == 0x7f || (byte == b'#' && before != Some(b'.'));
                before = Some(byte);
                ends
            });
            let part = &window[..end.unwrap_or(window.len())];
            let (count, stop, at_end) = (part.len(), end.map(|end| window[end]), window.is_empty());
            self.text.extend_from_slice(&part[..count.min(self.token_bytes + 1)]);
            self.input.consume(count);
            self.place.offset += count as u64;
            if self.text.len() > self.token_bytes {
                return Err(self.error(NffErrorKind::Limit {
                    what: "bytes in a word",
                    limit: self.token_bytes as u64,
                    found: quote(&self.text),
                }));
            }
            match stop {
                Some(byte) if byte != b'#' && !is_white_space(byte) => {
                    return Err(self.place.error(NffErrorKind::NotText { byte }));
                }
                None if !at_end => {}
                _ => return Ok(()),
            }
        }
    }

    /// A comment, from its `#` to the end of the line.
    fn comment(&mut self) -> Result<(), NffError> {
        self.input.consume(1);
        self.place.offset += 1;
        loop {
            let window = window(&mut self.input, &self.place)?;
            let end = window.iter().position(|&byte| byte == b'\n' || byte == b'\r');
            let part = &window[..end.unwrap_or(window.len())];
            let room = COMMENT_BYTES - self.text.len();
            self.text.extend_from_slice(&part[..part.len().min(room)]);
            let (count, done) = (part.len(), end.is_some() || window.is_empty());
            self.input.consume(count);
            self.place.offset += count as u64;
            if done {
                return Ok(());
            }
        }
    }
}

/// The bytes at hand, within the limit; empty only at the end of the input.
fn window<'a, R: BufRead>(input: &'a mut R, place: &Place) -> Result<&'a [u8], NffError> {
    // An error must not keep `input` borrowed, hence the second call: it finds the buffer filled.
    while let Err(error) = input.fill_buf() {
        if error.kind() != io::ErrorKind::Interrupted {
            return Err(place.error(NffErrorKind::Io(error)));
        }
    }
    let window = input.fill_buf().map_err(|error| place.error(NffErrorKind::Io(error)))?;
    let room = usize::try_from(place.limit - place.offset).unwrap_or(usize::MAX);
    if room == 0 && !window.is_empty() {
        let (what, limit) = ("bytes of text", place.limit);
        return Err(place.error(NffErrorKind::Limit { what, limit, found: "more".to_owned() }));
    }
    Ok(&window[..window.len().min(room)])
}

/// White space as C's `isspace` has it.
fn is_white_space(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t'..=b'\r')
}
