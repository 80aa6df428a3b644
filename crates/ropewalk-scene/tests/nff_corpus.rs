//! Replays the fuzzer's seed corpus, and every input that once failed, without a fuzzer.

use std::path::Path;

#[path = "../../../fuzz/properties/nff.rs"]
mod property;

#[test]
fn the_fuzz_corpus_holds() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus-seed/nff");
    let mut scenes = Vec::new();
    let mut refused = Vec::new();
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let bytes = std::fs::read(&path).unwrap();
        // Every prefix too: files are cut off at any byte.
        for end in 0..bytes.len() {
            property::reads_or_refuses(&bytes[..end]);
        }
        let list = if property::reads_or_refuses(&bytes) { &mut scenes } else { &mut refused };
        list.push(name);
    }
    for name in ["whole.nff", "free_form.nff", "line_ends.nff", "concave.nff"] {
        assert!(scenes.iter().any(|n| n == name), "{name} must be read; read: {scenes:?}");
    }
    for name in ["empty.nff", "announced.nff", "c_nan.nff", "gzip.nff"] {
        assert!(refused.iter().any(|n| n == name), "{name} must be refused; refused: {refused:?}");
    }
}
