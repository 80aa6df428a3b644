//! Bytes of a file, piece by piece, unpacked if they are gzipped.

use super::error::{Place, Result, wrong};
use super::{Cancelled, Watched};
use flate2::bufread::MultiGzDecoder;
use std::fs::File;
use std::io::{BufReader, Read, Seek};

/// The first bytes of every gzip file.
pub const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];

/// Bytes that are read at once: enough that calls into the system do not show, and few beside any mesh.
const PIECE: usize = 1 << 20;

/// A file that is read from its beginning to its end.
pub struct Input<'a> {
    source: Box<dyn Read + 'a>,
    buffer: Vec<u8>,
    /// Of the buffer, what is read and not yet used.
    start: usize,
    end: usize,
    /// Bytes before that.
    at: u64,
    /// Bytes of all, after unpacking, if they are known.
    size: Option<u64>,
    limits: &'a Watched<'a>,
}

impl<'a> Input<'a> {
    /// Bytes in memory.
    pub fn of_bytes(bytes: &'a [u8], limits: &'a Watched<'a>) -> Result<Self> {
        if bytes.starts_with(&GZIP_MAGIC) {
            return Ok(Input::new(Box::new(MultiGzDecoder::new(bytes)), None, limits));
        }
        Input::of_plain(bytes, limits)
    }

    /// Bytes in memory that are not gzipped, whatever they begin with.
    pub fn of_plain(bytes: &'a [u8], limits: &'a Watched<'a>) -> Result<Self> {
        Input::sized(Box::new(bytes), bytes.len() as u64, limits)
    }

    /// A file.
    pub fn of_file(mut file: File, limits: &'a Watched<'a>) -> Result<Self> {
        let mut magic = Vec::new();
        (&mut file).take(2).read_to_end(&mut magic)?;
        let data = file.metadata()?;
        if !data.is_file() {
            // A pipe, which cannot be wound back.
            let source = std::io::Cursor::new(magic).chain(file);
            return Ok(Input::new(Box::new(source), None, limits));
        }
        file.rewind()?;
        if magic == GZIP_MAGIC {
            let source = MultiGzDecoder::new(BufReader::with_capacity(1 << 16, file));
            return Ok(Input::new(Box::new(source), None, limits));
        }
        Input::sized(Box::new(file), data.len(), limits)
    }

    fn sized(source: Box<dyn Read + 'a>, size: u64, limits: &'a Watched<'a>) -> Result<Self> {
        if size > limits.bytes {
            return Err(too_large(limits, size));
        }
        Ok(Input::new(source, Some(size), limits))
    }

    fn new(source: Box<dyn Read + 'a>, size: Option<u64>, limits: &'a Watched<'a>) -> Self {
        Input { source, buffer: Vec::new(), start: 0, end: 0, at: 0, size, limits }
    }

    /// Bytes of all, after unpacking, if they are known beforehand.
    pub fn size(&self) -> Option<u64> {
        self.size
    }

    /// Where the next byte stands.
    pub fn at(&self) -> u64 {
        self.at
    }

    /// Bytes that are left, or more than can be where that is not known.
    pub fn left(&self) -> u64 {
        self.size.map_or(u64::MAX, |size| size.saturating_sub(self.at))
    }

    /// The next bytes: `count` of them or more, fewer only at the end of the file.
    #[inline]
    pub fn ahead(&mut self, count: usize) -> Result<&[u8]> {
        if self.end - self.start < count {
            self.fill(count)?;
        }
        Ok(&self.buffer[self.start..self.end])
    }

    /// Goes on behind so many of the bytes ahead.
    #[inline]
    pub fn skip(&mut self, count: usize) {
        debug_assert!(count <= self.end - self.start);
        self.start += count;
        self.at += count as u64;
    }

    /// The next `count` bytes, which are ahead, and goes on behind them.
    #[inline]
    pub fn take(&mut self, count: usize) -> &[u8] {
        let start = self.start;
        self.skip(count);
        &self.buffer[start..][..count]
    }

    /// Whole lines ahead, and at the end what is left. Nothing means that there is no more. A line goes on behind a
    /// backslash at its end.
    pub fn lines(&mut self) -> Result<&[u8]> {
        let mut wanted = 1;
        let length = loop {
            let ahead = self.ahead(wanted)?;
            let whole = whole_lines(ahead);
            if whole > 0 {
                break whole;
            }
            if ahead.len() < wanted {
                break ahead.len();
            }
            wanted = 2 * ahead.len();
        };
        Ok(&self.buffer[self.start..][..length])
    }

    #[cold]
    fn fill(&mut self, count: usize) -> Result<()> {
        self.buffer.copy_within(self.start..self.end, 0);
        (self.start, self.end) = (0, self.end - self.start);
        let wanted =
            count.max(PIECE).min(usize::try_from(self.left()).unwrap_or(usize::MAX).max(1));
        if self.buffer.len() < wanted {
            let more = wanted - self.buffer.len();
            self.buffer.try_reserve_exact(more).map_err(std::io::Error::from)?;
            self.buffer.resize(wanted, 0);
        }
        while self.end < self.buffer.len() {
            if self.limits.monitor.is_cancelled() {
                return Err(Cancelled.into());
            }
            match self.source.read(&mut self.buffer[self.end..]) {
                Ok(0) => break,
                Ok(found) => self.end += found,
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error.into()),
            }
            if self.at + self.end as u64 > self.limits.bytes {
                return Err(too_large(self.limits, self.at + self.end as u64));
            }
        }
        Ok(())
    }

    /// All that is left.
    pub fn rest(self) -> Result<Vec<u8>> {
        // What a file grows by meanwhile is not read.
        let (left, most) = (self.left(), self.limits.bytes.saturating_sub(self.at));
        let mut bytes = Vec::new();
        let announced = usize::try_from(left.min(most)).unwrap_or(0);
        if self.size.is_some() {
            bytes.try_reserve_exact(announced).map_err(std::io::Error::from)?;
        }
        bytes.extend_from_slice(&self.buffer[self.start..self.end]);
        let most = left.min(most.saturating_add(1)).saturating_sub(bytes.len() as u64);
        crate::watched::read_to_end(self.source.take(most), &mut bytes, self.limits.monitor)??;
        if self.at + bytes.len() as u64 > self.limits.bytes {
            return Err(too_large(self.limits, self.at + bytes.len() as u64));
        }
        Ok(bytes)
    }
}

/// Length of the lines in some bytes that surely end there.
fn whole_lines(bytes: &[u8]) -> usize {
    let mut end = bytes.len();
    while let Some(last) = bytes[..end].iter().rposition(|&b| b == b'\n') {
        if !goes_on(&bytes[..=last]) {
            return last + 1;
        }
        end = last;
    }
    0
}

/// True of a line that the next one continues.
pub fn goes_on(line: &[u8]) -> bool {
    line.ends_with(b"\\\n") || line.ends_with(b"\\\r\n")
}

fn too_large(limits: &Watched<'_>, found: u64) -> super::MeshError {
    wrong(Place::Start, format!("at most {} bytes", limits.bytes), format!("{found} or more"))
}
