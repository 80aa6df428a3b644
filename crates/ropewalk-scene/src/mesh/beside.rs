//! Files that a file names: in its folder or below, and nowhere else.

use std::cell::Cell;
use std::fs::{self, File};
use std::io::Read;
use std::path::{Component, Path, PathBuf};

/// What is said of a file that is not there.
const ABSENT: &str = "there is no such file";

/// Reads files of one folder.
pub struct Beside<'a> {
    /// `None` for files that came from memory: those have nothing beside them.
    folder: Option<&'a Path>,
    /// Bytes that may still be read.
    left: Cell<u64>,
}

/// Why a file was not read: what was expected, and what was found.
#[derive(Debug)]
pub struct Refused {
    pub expected: String,
    pub found: String,
}

impl Refused {
    /// A part of a sentence that names the file elsewhere.
    pub fn sentence(&self, name: &str) -> String {
        if self.found == ABSENT {
            return ABSENT.to_owned();
        }
        let found =
            self.found.strip_prefix(name).unwrap_or(&self.found).trim_start_matches([',', ' ']);
        let found = if found.is_empty() { "something else" } else { found };
        format!("expected {}, found {found}", self.expected)
    }

    fn new(expected: impl Into<String>, found: impl Into<String>) -> Refused {
        Refused { expected: expected.into(), found: found.into() }
    }
}

impl<'a> Beside<'a> {
    /// Files of this folder, of so many bytes together.
    pub fn new(folder: Option<&'a Path>, bytes: u64) -> Self {
        // The parent of a bare name is empty.
        let here =
            |folder: &'a Path| if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        Beside { folder: folder.map(here), left: Cell::new(bytes) }
    }

    /// The bytes of the file `name`, at least `least` of them: a relative path of plain parts, `./` among them. Symbolic links are followed as far
    /// as they stay in the folder.
    pub fn read(&self, name: &str, least: u64) -> Result<Vec<u8>, Refused> {
        let relative = PathBuf::from(name);
        // Many programs write `./` first.
        let is_plain =
            relative.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
        let first = name.split('/').next().unwrap_or_default();
        let is_other = first.contains(':') || name.contains('\\') || name.contains('\0');
        let inside = "a file in this folder or below, without \"..\"";
        if !is_plain || is_other || name.is_empty() {
            return Err(Refused::new(inside, name));
        }
        let Some(folder) = self.folder else {
            let what = "data in the file itself, since it has no folder";
            return Err(Refused::new(what, name));
        };
        let cannot = |e: std::io::Error| {
            let why = match e.kind() {
                std::io::ErrorKind::NotFound => ABSENT.to_owned(),
                _ => e.to_string(),
            };
            Refused::new(format!("to read {name}"), why)
        };
        let path = fs::canonicalize(folder.join(relative)).map_err(cannot)?;
        if !path.starts_with(fs::canonicalize(folder).map_err(cannot)?) {
            return Err(Refused::new(inside, format!("{name}, a link to elsewhere")));
        }
        let size = fs::metadata(&path).map_err(cannot)?;
        if !size.is_file() {
            return Err(Refused::new("a regular file", name));
        }
        let (size, left) = (size.len(), self.left.get());
        if size < least || size > left {
            let what = format!("a file of {least} to {left} bytes");
            return Err(Refused::new(what, format!("{name}, {size} bytes")));
        }
        let mut bytes = Vec::new();
        let file = File::open(&path).map_err(cannot)?;
        // A file that grows meanwhile is cut off.
        file.take(size).read_to_end(&mut bytes).map_err(cannot)?;
        self.left.set(left - bytes.len() as u64);
        Ok(bytes)
    }
}
