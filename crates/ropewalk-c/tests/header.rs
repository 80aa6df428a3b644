//! The header is what cbindgen makes of the sources.

use std::path::Path;

/// `UPDATE=1 cargo test -p ropewalk-c` writes it.
#[test]
fn header_is_up_to_date() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(root.join("cbindgen.toml")).unwrap();
    let bindings = cbindgen::Builder::new()
        .with_config(config)
        .with_src(root.join("src/status.rs"))
        .with_src(root.join("src/scene.rs"))
        .with_src(root.join("src/rays.rs"))
        .with_src(root.join("src/hits.rs"))
        .generate()
        .unwrap();
    let mut made = Vec::new();
    bindings.write(&mut made);
    let (made, path) = (String::from_utf8(made).unwrap(), root.join("include/ropewalk.h"));
    if std::env::var_os("UPDATE").is_some() {
        std::fs::write(&path, &made).unwrap();
    }
    let found = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(found == made, "include/ropewalk.h is out of date: UPDATE=1 cargo test -p ropewalk-c");
}
