//! Words of a text with the lines on which they stand.

use super::error::{MeshError, Place, Result, wrong};
use super::input::Input;

/// Words of a text in memory, one after the other.
pub struct Words<'a> {
    bytes: &'a [u8],
    at: usize,
    line: u64,
    /// Begins a comment that runs to the end of its line.
    comment: Option<u8>,
}

impl<'a> Words<'a> {
    /// Words of `bytes`, the first of which stands on `line`.
    pub fn new(bytes: &'a [u8], line: u64, comment: Option<u8>) -> Self {
        Words { bytes, at: 0, line, comment }
    }

    /// The place of the last word.
    pub fn place(&self) -> Place {
        Place::Line(self.line)
    }

    /// The line of the last word, from 1.
    pub fn line(&self) -> u64 {
        self.line
    }

    /// What is left of this line, comments included.
    pub fn rest_of_line(&mut self) -> &'a [u8] {
        let start = self.at;
        while self.at < self.bytes.len() && self.bytes[self.at] != b'\n' {
            self.at += 1;
        }
        &self.bytes[start..self.at]
    }

    /// Bytes that are left.
    pub fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// The next word, on whatever line.
    pub fn next(&mut self) -> Option<&'a [u8]> {
        loop {
            if let Some(word) = self.next_on_line() {
                return Some(word);
            }
            if self.at >= self.bytes.len() {
                return None;
            }
            self.skip_line();
        }
    }

    /// The next word if there is one on this line.
    pub fn next_on_line(&mut self) -> Option<&'a [u8]> {
        while self.at < self.bytes.len() {
            match self.bytes[self.at] {
                b'\n' => return None,
                b if Some(b) == self.comment => {
                    while self.at < self.bytes.len() && self.bytes[self.at] != b'\n' {
                        self.at += 1;
                    }
                    return None;
                }
                b if b.is_ascii_whitespace() => self.at += 1,
                _ => break,
            }
        }
        let start = self.at;
        while self.at < self.bytes.len() && !self.bytes[self.at].is_ascii_whitespace() {
            self.at += 1;
        }
        (start < self.at).then(|| &self.bytes[start..self.at])
    }

    /// Goes on behind the next line end.
    pub fn skip_line(&mut self) {
        while self.at < self.bytes.len() && self.bytes[self.at] != b'\n' {
            self.at += 1;
        }
        if self.at < self.bytes.len() {
            self.at += 1;
            self.line += 1;
        }
    }
}

/// Words of a file that is read piece by piece. What keeps it from being read looks like its end, and is told by
/// [`Stream::checked`].
pub struct Stream<'a> {
    input: Input<'a>,
    line: u64,
    /// Begins a comment that runs to the end of its line.
    comment: Option<u8>,
    failure: Option<MeshError>,
    line_end: u8,
}

/// Bytes that are looked at together at first; more where a word or line is longer.
const NEAR: usize = 256;

impl<'a> Stream<'a> {
    /// Words of what is left of `input`, the first of which stands on `line`.
    pub fn new(input: Input<'a>, line: u64, comment: Option<u8>) -> Self {
        Stream { input, line, comment, failure: None, line_end: b'\n' }
    }

    /// The same with another byte at the ends of lines.
    pub fn with_line_end(self, line_end: u8) -> Self {
        Stream { line_end, ..self }
    }

    /// The place of the last word.
    pub fn place(&self) -> Place {
        Place::Line(self.line)
    }

    /// Bytes that are left, or more than can be where that is not known.
    pub fn left(&self) -> u64 {
        self.input.left()
    }

    /// What came out of all words, unless the file could not be read to there.
    pub fn checked<T>(self, result: Result<T>) -> Result<T> {
        self.failure.map_or(result, Err)
    }

    /// So many of the next bytes or more, fewer at the end.
    #[inline]
    fn ahead(&mut self, count: usize) -> &[u8] {
        match self.input.ahead(count) {
            Ok(bytes) if self.failure.is_none() => bytes,
            Ok(_) => &[],
            Err(error) => {
                self.failure.get_or_insert(error);
                &[]
            }
        }
    }

    /// Passes over bytes as long as `goes_on`.
    #[inline]
    fn pass(&mut self, goes_on: impl Fn(u8) -> bool) {
        loop {
            let bytes = self.ahead(1);
            let (all, end) = (bytes.len(), bytes.iter().position(|&b| !goes_on(b)));
            self.input.skip(end.unwrap_or(all));
            if end.is_some() || all == 0 {
                return;
            }
        }
    }

    /// The length of the next word on this line, to which it goes on.
    #[inline]
    fn find(&mut self) -> Option<usize> {
        let end = self.line_end;
        self.pass(|b| b != end && b.is_ascii_whitespace());
        if self.comment.is_some() && self.ahead(1).first().copied() == self.comment {
            self.pass(|b| b != end);
        }
        let mut wanted = NEAR;
        loop {
            let bytes = self.ahead(wanted);
            let end = bytes.iter().position(|b| b.is_ascii_whitespace());
            match end {
                Some(end) => return (end > 0).then_some(end),
                None if bytes.len() < wanted => return (!bytes.is_empty()).then_some(bytes.len()),
                None => wanted = 2 * bytes.len(),
            }
        }
    }

    /// The next word if there is one on this line, without going on behind it.
    pub fn peek_on_line(&mut self) -> Option<&[u8]> {
        let length = self.find()?;
        Some(&self.ahead(length)[..length])
    }

    /// The next word if there is one on this line.
    #[inline]
    pub fn next_on_line(&mut self) -> Option<&[u8]> {
        let length = self.find()?;
        Some(self.input.take(length))
    }

    /// The next word, on whatever line.
    #[inline]
    pub fn next(&mut self) -> Option<&[u8]> {
        let length = loop {
            if let Some(length) = self.find() {
                break length;
            }
            if self.ahead(1).is_empty() {
                return None;
            }
            self.skip_line();
        };
        Some(self.input.take(length))
    }

    /// Goes on behind the next line end.
    #[inline]
    pub fn skip_line(&mut self) {
        let end = self.line_end;
        self.pass(|b| b != end);
        if !self.ahead(1).is_empty() {
            self.input.skip(1);
            self.line += 1;
        }
    }

    /// The next word as a number.
    #[inline]
    pub fn number(&mut self, what: &str) -> Result<f64> {
        self.parse(what)
    }

    /// The next word as a count or an index.
    #[inline]
    pub fn count(&mut self, what: &str) -> Result<u64> {
        self.parse(what)
    }

    #[inline]
    fn parse<T: std::str::FromStr>(&mut self, what: &str) -> Result<T> {
        let found = match self.next() {
            None => "the end of the text".to_owned(),
            Some(word) => match std::str::from_utf8(word).map(str::parse) {
                Ok(Ok(number)) => return Ok(number),
                _ => quote(word),
            },
        };
        Err(wrong(self.place(), what, found))
    }
}

/// A number of type `T`; `None` is the end of the text or line.
pub fn parse<T: std::str::FromStr>(word: Option<&[u8]>, what: &str, place: &Place) -> Result<T> {
    let Some(word) = word else {
        return Err(wrong(place.clone(), what, "the end of the text or line"));
    };
    let text = std::str::from_utf8(word).ok();
    text.and_then(|text| text.parse().ok()).ok_or_else(|| wrong(place.clone(), what, quote(word)))
}

/// A word for a message.
pub fn quote(word: &[u8]) -> String {
    format!("\"{}\"", String::from_utf8_lossy(word))
}
