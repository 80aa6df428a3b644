//! Reading that a monitor can cancel.

use ropewalk::build::Monitor;
use std::io::{self, BufRead, Read};

/// The monitor cancelled it.
#[derive(Clone, Copy, Debug)]
pub struct Cancelled;

/// Bytes that are read before the monitor is asked: some milliseconds, also if they are unpacked.
const PIECE: u64 = 1 << 22;

/// Reads all that is left, until the monitor cancels it.
pub fn read_to_end(
    mut input: impl Read,
    bytes: &mut Vec<u8>,
    monitor: &dyn Monitor,
) -> io::Result<Result<(), Cancelled>> {
    while !monitor.is_cancelled() {
        if input.by_ref().take(PIECE).read_to_end(bytes)? == 0 {
            return Ok(Ok(()));
        }
    }
    Ok(Err(Cancelled))
}

/// Text that ends with an error once the monitor cancels it.
pub struct Text<'a, R> {
    /// The text.
    pub input: R,
    /// Asked whenever a buffer is filled.
    pub monitor: &'a dyn Monitor,
}

impl<R: BufRead> Read for Text<'_, R> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let here = self.fill_buf()?;
        let count = here.len().min(out.len());
        out[..count].copy_from_slice(&here[..count]);
        self.consume(count);
        Ok(count)
    }
}

impl<R: BufRead> BufRead for Text<'_, R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.monitor.is_cancelled() {
            return Err(io::Error::other("reading was cancelled"));
        }
        self.input.fill_buf()
    }

    fn consume(&mut self, count: usize) {
        self.input.consume(count);
    }
}
