//! Saved scenes: a tree with its geometry in a file, written whole or not at all, and mapped into memory.
//!
//! ```
//! use ropewalk::build::{BuildSettings, Preset};
//! use ropewalk::file::{Check, Contents};
//! use ropewalk::kernel::BatchCaster;
//! use ropewalk::{Geometry, Ray, wide::WideTree};
//!
//! let vertices = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
//! let geometry = Geometry::from_triangles(&vertices, &[[0, 1, 2]])?;
//! let (tree, _) = WideTree::build(&geometry, &BuildSettings::preset(Preset::Balanced), &())?;
//! let folder = tempfile::tempdir()?;
//! let path = folder.path().join("triangle.rope");
//! ropewalk_file::save(&path, &Contents::new(&tree, &geometry))?;
//!
//! let scene = ropewalk_file::open(&path, Check::Structure)?;
//! let caster = BatchCaster::new(&scene.tree, &scene.geometry);
//! assert_eq!(caster.closest_hit(&[Ray::new([0.2, 0.2, 1.0], [0.0, 0.0, -1.0])]).t, [1.0]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//! docs/file-format.md draws the file and says what its checks are worth.

mod map;

pub use map::is_saved_scene;

use ropewalk::build::Monitor;
use ropewalk::file::{AnyOpened, Check, Contents, FileError, Opened, WriteError, Written};
use ropewalk_scene::write_atomically;
use std::io;
use std::path::{Path, PathBuf};

/// The extension of files that hold a saved scene; any other works as well.
pub const EXTENSION: &str = "rope";

/// Why a scene could not be saved. Nothing is left behind, and a file that was there is untouched.
#[derive(Debug, thiserror::Error)]
#[error("cannot save {}: {source}", .path.display())]
pub struct SaveError {
    /// The path as given.
    pub path: PathBuf,
    /// What went wrong.
    pub source: WriteError,
}

/// Why a file could not be opened.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OpenError {
    /// The system does not open it.
    #[error("cannot open {}: {source}", .path.display())]
    Open {
        /// The path as given.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The system does not read it or map it.
    #[error("cannot read {}: {source}", .path.display())]
    Read {
        /// The path as given.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// It holds something else than a sound scene.
    #[error("{}: {source}", .path.display())]
    Content {
        /// The path as given.
        path: PathBuf,
        /// What is wrong with it.
        source: FileError,
    },
}

/// Saves a scene: into a temporary file in the same folder, which takes the name once all is on disk.
///
/// # Errors
/// [`SaveError`]; see [`write_atomically`].
pub fn save(path: impl AsRef<Path>, contents: &Contents<'_>) -> Result<Written, SaveError> {
    save_monitored(path, contents, &())
}

/// The same, until the monitor cancels it: then nothing is left behind.
///
/// # Errors
/// As [`save`]; the source is [`WriteError::Cancelled`].
pub fn save_monitored(
    path: impl AsRef<Path>,
    contents: &Contents<'_>,
    monitor: &dyn Monitor,
) -> Result<Written, SaveError> {
    let path = path.as_ref();
    let saved =
        write_atomically(path, |out| ropewalk::file::write_monitored(contents, out, monitor));
    saved.map_err(|source| SaveError { path: path.to_owned(), source })
}

/// Opens a saved scene by mapping it: nothing is copied, and processes that open the same file share its
/// pages. Saving over the file while it is open is safe, since that makes a new one; see
/// [`read`] if others may write into it.
///
/// # Safety of the map
/// The file must not be written into or cut off as long as the scene lives. If it is, answers may be
/// anything, and queries may read what is not theirs or end the process (docs/file-format.md).
///
/// # Errors
/// [`OpenError`].
pub fn open(path: impl AsRef<Path>, check: Check) -> Result<Opened, OpenError> {
    single(path.as_ref(), open_any(&path, check)?)
}

/// [`open`] for a scene of either precision.
///
/// # Errors
/// [`OpenError`].
pub fn open_any(path: impl AsRef<Path>, check: Check) -> Result<AnyOpened, OpenError> {
    open_monitored(path, check, &())
}

/// [`open_any`] until the monitor cancels it.
///
/// # Errors
/// As there; the source is [`FileError::Cancelled`].
pub fn open_monitored(
    path: impl AsRef<Path>,
    check: Check,
    monitor: &dyn Monitor,
) -> Result<AnyOpened, OpenError> {
    let path = path.as_ref();
    map::map(path).and_then(|bytes| opened(path, &bytes, check, monitor))
}

/// Opens a saved scene by reading it into memory of its own, on huge pages where the system has them: what
/// becomes of the file does not matter afterwards.
///
/// # Errors
/// [`OpenError`].
pub fn read(path: impl AsRef<Path>, check: Check) -> Result<Opened, OpenError> {
    single(path.as_ref(), read_any(&path, check)?)
}

/// [`read`] for a scene of either precision.
///
/// # Errors
/// [`OpenError`].
pub fn read_any(path: impl AsRef<Path>, check: Check) -> Result<AnyOpened, OpenError> {
    read_monitored(path, check, &())
}

/// [`read_any`] until the monitor cancels it.
///
/// # Errors
/// As there; the source is [`FileError::Cancelled`].
pub fn read_monitored(
    path: impl AsRef<Path>,
    check: Check,
    monitor: &dyn Monitor,
) -> Result<AnyOpened, OpenError> {
    let path = path.as_ref();
    map::read(path, monitor).and_then(|bytes| opened(path, &bytes, check, monitor))
}

fn single(path: &Path, scene: AnyOpened) -> Result<Opened, OpenError> {
    match scene {
        AnyOpened::Single(scene) => Ok(*scene),
        AnyOpened::Double(_) => {
            Err(OpenError::Content { path: path.to_owned(), source: FileError::Double })
        }
    }
}

fn opened(
    path: &Path,
    bytes: &ropewalk::kernel::SharedBytes,
    check: Check,
    monitor: &dyn Monitor,
) -> Result<AnyOpened, OpenError> {
    let opened = ropewalk::file::open_monitored(bytes, check, monitor);
    opened.map_err(|source| OpenError::Content { path: path.to_owned(), source })
}
