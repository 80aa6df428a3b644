//! The header is what cbindgen makes of the sources.

use std::collections::BTreeSet;
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

/// docs/c.md has a row for each function of the header, and no others.
#[test]
fn every_function_is_documented() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let read = |path: &str| std::fs::read_to_string(root.join(path)).unwrap();
    let (header, page) = (read("include/ropewalk.h"), read("../../docs/c.md"));
    let declared: BTreeSet<&str> = header
        .lines()
        .filter(|line| !line.starts_with("//") && !line.starts_with([' ', '/', '*']))
        .filter_map(|line| line.split_once('('))
        .filter_map(|(before, _)| before.rsplit([' ', '*']).next())
        .filter(|name| name.starts_with("ropewalk_"))
        .collect();
    let rows = page.lines().filter_map(|line| line.strip_prefix("| `")?.split_once('`'));
    let listed: BTreeSet<&str> =
        rows.map(|(name, _)| name).filter(|name| name.starts_with("ropewalk_")).collect();
    assert!(declared.len() > 10, "the header is not read as it is written: {declared:?}");
    assert_eq!(declared, listed, "functions of include/ropewalk.h, and rows of docs/c.md");
}
