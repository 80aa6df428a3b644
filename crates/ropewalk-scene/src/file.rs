//! Files that are written whole or not at all.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

/// Attempts to find a free temporary name before giving up.
const NAME_ATTEMPTS: u32 = 100;

/// Writes the file `path` by `write`, so that it appears complete or not at all: the bytes go to a
/// temporary file in the same folder, which is renamed to `path` once all is on disk, and removed
/// if `write` fails or panics. A file that was there before stays as it was until then. A symbolic
/// link is followed. What is there and no regular file (a device, a pipe) is written to directly.
///
/// # Errors
/// Those of `write`, and [`io::Error`] if the file cannot be made, written or renamed; the message
/// does not name `path`.
pub fn write_atomically<T, E: From<io::Error>>(
    path: impl AsRef<Path>,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<T, E>,
) -> Result<T, E> {
    let path = match fs::canonicalize(path.as_ref()) {
        Ok(target) => target,
        Err(error) if error.kind() == io::ErrorKind::NotFound => path.as_ref().to_owned(),
        Err(error) => return Err(error.into()),
    };
    if path.is_dir() {
        return Err(io::Error::from(io::ErrorKind::IsADirectory).into());
    }
    if path.exists() && !path.is_file() {
        let mut output = BufWriter::new(OpenOptions::new().write(true).open(&path)?);
        let value = write(&mut output)?;
        output.flush()?;
        return Ok(value);
    }
    let (mut temporary, file) = Temporary::create_beside(&path)?;
    let mut output = BufWriter::new(file);
    let value = write(&mut output)?;
    let file = output.into_inner().map_err(io::IntoInnerError::into_error)?;
    file.sync_all()?;
    // Closed first: Windows does not rename open files.
    drop(file);
    temporary.rename(&path)?;
    Ok(value)
}

/// A temporary file's name; the file is removed on drop unless it was renamed.
struct Temporary {
    path: PathBuf,
    renamed: bool,
}

impl Temporary {
    fn create_beside(path: &Path) -> io::Result<(Temporary, File)> {
        static COUNTER: AtomicU32 = AtomicU32::new(0);
        let name = path.file_name().ok_or(io::ErrorKind::InvalidFilename)?;
        for attempt in 1.. {
            let mut hidden = std::ffi::OsString::from(".");
            hidden.push(name);
            let number = COUNTER.fetch_add(1, Ordering::Relaxed);
            hidden.push(format!(".{}-{number}.tmp", std::process::id()));
            let path = path.with_file_name(hidden);
            match OpenOptions::new().write(true).create_new(true).open(&path) {
                Ok(file) => return Ok((Temporary { path, renamed: false }, file)),
                Err(error)
                    if error.kind() == io::ErrorKind::AlreadyExists && attempt < NAME_ATTEMPTS => {}
                Err(error) => return Err(error),
            }
        }
        Err(io::ErrorKind::AlreadyExists.into())
    }

    fn rename(&mut self, target: &Path) -> io::Result<()> {
        fs::rename(&self.path, target)?;
        self.renamed = true;
        Ok(())
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if !self.renamed {
            // Nothing more can be done about a file that cannot be removed.
            let _ = fs::remove_file(&self.path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
    }

    #[test]
    fn a_success_replaces_the_file_and_leaves_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.png");
        fs::write(&path, "old").unwrap();
        let seen = write_atomically(&path, |out| {
            out.write_all(b"new")?;
            out.flush()?;
            fs::read_to_string(&path)
        });
        assert_eq!(seen.unwrap(), "old", "the old file stays until the new one is complete");
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        assert_eq!(names(folder.path()), ["picture.png"]);
    }

    #[test]
    fn an_error_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.png");
        for old in [None, Some("old")] {
            if let Some(old) = old {
                fs::write(&path, old).unwrap();
            }
            let result: io::Result<()> = write_atomically(&path, |out| {
                out.write_all(b"half")?;
                Err(io::ErrorKind::StorageFull.into())
            });
            assert_eq!(result.unwrap_err().kind(), io::ErrorKind::StorageFull);
            assert_eq!(fs::read_to_string(&path).ok().as_deref(), old);
            assert_eq!(names(folder.path()).len(), usize::from(old.is_some()));
        }
    }

    #[test]
    fn a_panic_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.png");
        let result = std::panic::catch_unwind(|| {
            write_atomically(&path, |_| -> io::Result<()> { panic!("by the test") })
        });
        assert!(result.is_err());
        assert_eq!(names(folder.path()).len(), 0);
    }

    #[test]
    fn folders_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let into_folder = write_atomically(folder.path(), |_| io::Result::Ok(()));
        assert_eq!(into_folder.unwrap_err().kind(), io::ErrorKind::IsADirectory);
        let no_folder =
            write_atomically(folder.path().join("no/picture.png"), |_| io::Result::Ok(()));
        assert_eq!(no_folder.unwrap_err().kind(), io::ErrorKind::NotFound);
    }

    #[cfg(unix)]
    #[test]
    fn devices_are_written_to_and_links_followed() {
        let folder = tempfile::tempdir().unwrap();
        let (target, link) = (folder.path().join("target"), folder.path().join("link"));
        fs::write(&target, "old").unwrap();
        std::os::unix::fs::symlink(&target, &link).unwrap();
        write_atomically(&link, |out| out.write_all(b"new")).unwrap();
        assert_eq!(fs::read_to_string(&target).unwrap(), "new");
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        let null = folder.path().join("null");
        std::os::unix::fs::symlink("/dev/null", &null).unwrap();
        write_atomically(&null, |out| out.write_all(b"nothing")).unwrap();
        assert!(!Path::new("/dev/null").is_file());
    }
}
