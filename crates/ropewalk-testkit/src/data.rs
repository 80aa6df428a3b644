//! Tests on the real scenes that lie beside the repository.
//!
//! Where the data is absent such a test reports *ignored*, never passed: use [`trial`] in a test
//! target with `harness = false` and end its `main` with
//! `libtest_mimic::run(&Arguments::from_args(), trials).exit()`.

use libtest_mimic::{Failed, Trial};
use std::path::{Path, PathBuf};

/// The folder `data` of the shared files: `$ROPEWALK_SHARED/data` if set, else `../shared/data`
/// beside the workspace; `None` where there is none.
pub fn shared_data() -> Option<PathBuf> {
    let root = std::env::var_os("ROPEWALK_SHARED")
        .map(PathBuf::from)
        .unwrap_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared"));
    let data = root.join("data");
    data.is_dir().then_some(data)
}

/// A test on one shared file (`path` below the data folder); ignored, with the reason in its kind,
/// where the file is absent.
pub fn trial(
    name: impl Into<String>,
    path: &str,
    test: impl FnOnce(&Path) -> Result<(), Failed> + Send + 'static,
) -> Trial {
    match shared_data().map(|data| data.join(path)).filter(|file| file.exists()) {
        Some(file) => Trial::test(name, move || test(&file)),
        None => Trial::test(name, || Ok(()))
            .with_kind(format!("ignored: {path} of the shared data is absent"))
            .with_ignored_flag(true),
    }
}
