//! Reading files can be cancelled anywhere.

use flate2::{Compression, write::GzEncoder};
use ropewalk::build::Monitor;
use ropewalk_scene::mesh::MeshErrorKind;
use ropewalk_scene::{NffLimits, SceneError, load_monitored};
use std::io::Write;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Cancels when it has been asked so many times.
struct After(AtomicUsize);

impl Monitor for After {
    fn is_cancelled(&self) -> bool {
        self.0.fetch_sub(1, Ordering::Relaxed) == 0
    }
}

#[test]
fn files_of_all_kinds() {
    let folder = tempfile::tempdir().unwrap();
    let count = 100_000;
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\n".repeat(count);
    let nff = "p 3\n0 0 0\n1 0 0\n0 1 0\n".repeat(count);
    let mut off = format!("OFF\n3 {count} 0\n0 0 0\n1 0 0\n0 1 0\n");
    off.push_str(&"3 0 1 2\n".repeat(count));
    let mut gzip = GzEncoder::new(Vec::new(), Compression::fast());
    gzip.write_all(obj.as_bytes()).unwrap();
    let files = [
        ("a.obj", obj.into_bytes(), 20),
        ("a.obj.gz", gzip.finish().unwrap(), 20),
        ("a.off", off.into_bytes(), 10),
        ("a.nff", nff.into_bytes(), 20),
    ];
    for (name, bytes, least) in files {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let path = path.to_str().unwrap();
        let mut asks = 0;
        loop {
            let monitor = After(AtomicUsize::new(asks));
            match load_monitored(path, &NffLimits::default(), &monitor) {
                Ok(loaded) => {
                    assert_eq!(loaded.into_scene().objects.len(), count, "{name}");
                    break;
                }
                Err(SceneError::Mesh(error)) => {
                    assert!(matches!(error.kind, MeshErrorKind::Cancelled), "{error}");
                    assert!(error.to_string().contains(name), "{error}");
                }
                Err(error) => assert!(error.to_string().contains("cancelled"), "{error}"),
            }
            asks += 1 + asks / 4;
        }
        assert!(asks > least, "{name} asked {asks} times");
    }
}
