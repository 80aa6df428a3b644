//! Any bytes as an OBJ file, up to the first zero, with a library of materials and an image beside it behind that: the readers refuse them
//! or read a sound mesh and its looks. They never panic and never allocate by an announced count.
#![no_main]

#[path = "../properties/mesh.rs"]
mod property;

use std::path::PathBuf;
use std::sync::OnceLock;

/// A folder of this process.
static FOLDER: OnceLock<PathBuf> = OnceLock::new();

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let folder = FOLDER.get_or_init(|| {
        let folder = std::env::temp_dir().join(format!("ropewalk-fuzz-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder for temporary files");
        folder
    });
    property::reads_or_refuses_with_library(bytes, folder);
});
