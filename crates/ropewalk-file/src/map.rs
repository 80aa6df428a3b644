//! Files as bytes: mapped, or read into memory. The only unsafe code of this crate.

#![allow(unsafe_code)]

use crate::OpenError;
use memmap2::{Mmap, MmapMut};
use ropewalk::build::Monitor;
use ropewalk::file::{FileError, HEADER_BYTES, MAGIC};
use ropewalk::kernel::SharedBytes;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;
use std::sync::Arc;

/// From here on huge pages are asked for.
#[cfg(target_os = "linux")]
const HUGE_FROM: usize = 1 << 21;

/// The pages of a file, which processes share.
pub fn map(path: &Path) -> Result<SharedBytes, OpenError> {
    let (file, _) = open(path)?;
    // SAFETY: bytes that change under a map are undefined behaviour, and nothing in a process can keep
    // others from writing into a file. `ropewalk_file::open` says so: who opens a file by a map vouches
    // for it, as with a shared library. Saving never writes into a file but replaces it.
    let map = unsafe { Mmap::map(&file) }.map_err(|error| read_error(path, error))?;
    Ok(Arc::new(map))
}

/// Bytes that are read before the monitor is asked: some milliseconds.
const PIECE: usize = 1 << 24;

/// The bytes of a file, copied.
pub fn read(path: &Path, monitor: &dyn Monitor) -> Result<SharedBytes, OpenError> {
    let (mut file, len) = open(path)?;
    let refuse = |error| read_error(path, error);
    let mut bytes = MmapMut::map_anon(len).map_err(refuse)?;
    #[cfg(target_os = "linux")]
    if len >= HUGE_FROM {
        // Without huge pages queries are slower, not wrong.
        let _ = bytes.advise(memmap2::Advice::HugePage);
    }
    for piece in bytes.chunks_mut(PIECE) {
        if monitor.is_cancelled() {
            let path = path.to_owned();
            return Err(OpenError::Content { path, source: FileError::Cancelled });
        }
        file.read_exact(piece).map_err(refuse)?;
    }
    Ok(Arc::new(bytes))
}

/// True if a file begins as saved scenes do.
///
/// # Errors
/// What the system says.
pub fn is_saved_scene(path: impl AsRef<Path>) -> io::Result<bool> {
    let mut first = Vec::with_capacity(MAGIC.len());
    let file = File::open(path)?;
    // A pipe would lose what is read here.
    if file.metadata()?.is_file() {
        file.take(MAGIC.len() as u64).read_to_end(&mut first)?;
    }
    Ok(first == MAGIC)
}

/// A file of at least a header's length, and its length.
fn open(path: &Path) -> Result<(File, usize), OpenError> {
    let file =
        File::open(path).map_err(|source| OpenError::Open { path: path.to_owned(), source })?;
    let refuse = |error| read_error(path, error);
    let metadata = file.metadata().map_err(refuse)?;
    if !metadata.is_file() {
        return Err(refuse(io::Error::new(io::ErrorKind::InvalidInput, "it is no regular file")));
    }
    let found = metadata.len();
    match usize::try_from(found) {
        // An empty map is an error of its own.
        Ok(0) => {
            let source = FileError::Size { expected: HEADER_BYTES as u64, found };
            Err(OpenError::Content { path: path.to_owned(), source })
        }
        Ok(len) => Ok((file, len)),
        Err(_) => Err(refuse(io::ErrorKind::FileTooLarge.into())),
    }
}

fn read_error(path: &Path, source: io::Error) -> OpenError {
    OpenError::Read { path: path.to_owned(), source }
}
