//! Words of a text with the lines on which they stand.

use super::error::{Place, Result, wrong};

/// Reads words one after the other.
#[derive(Clone)]
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

    /// The next word as a number.
    pub fn number(&mut self, what: &str) -> Result<f64> {
        let word = self.next();
        parse(word, what, &self.place())
    }

    /// The next word as a count or an index.
    pub fn count(&mut self, what: &str) -> Result<u64> {
        let word = self.next();
        parse(word, what, &self.place())
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
