//! Saving and opening files, whatever they are called and whatever happens to them.

use ropewalk::build::{BuildSettings, Monitor, Preset};
use ropewalk::file::{Check, Contents, FileError, WriteError};
use ropewalk::kernel::{BatchCaster, BatchHit};
use ropewalk::primitive::Triangle;
use ropewalk::wide::WideTree;
use ropewalk::{Geometry, Ray, Sides};
use ropewalk_file::{
    OpenError, is_saved_scene, open, open_monitored, read, read_monitored, save, save_monitored,
};
use ropewalk_testkit::rays::{Draw, generic_ray};
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

fn soup(triangles: usize, seed: u64) -> (WideTree, Geometry) {
    let (mut draw, mut geometry) = (Draw::new(seed), Geometry::new());
    for _ in 0..triangles {
        let mut corner = || std::array::from_fn(|_| draw.uniform(0.0, 1.0) as f32);
        let vertices = [corner(), corner(), corner()];
        geometry.push(Triangle { vertices }, Sides::Both).unwrap();
    }
    let settings = BuildSettings { threads: 1, ..BuildSettings::preset(Preset::Fast) };
    let (tree, _) = WideTree::build(&geometry, &settings, &()).unwrap();
    (tree, geometry)
}

fn rays(geometry: &Geometry) -> Vec<Ray> {
    let mut draw = Draw::new(1);
    (0..500).map(|_| generic_ray(&mut draw, &geometry.bounds())).collect()
}

fn hits(tree: &WideTree, geometry: &Geometry) -> BatchHit {
    BatchCaster::new(tree, geometry).closest_hit(&rays(geometry))
}

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
}

#[test]
fn any_name_will_do() {
    let folder = tempfile::tempdir().unwrap();
    let (tree, geometry) = soup(300, 1);
    for name in ["a b.rope", "Bälle und 球 🎾", "no extension", ".hidden", "-x.rope"] {
        let path = folder.path().join(name);
        let written = save(&path, &Contents::new(&tree, &geometry)).unwrap();
        assert_eq!(names(folder.path()), [name]);
        assert_eq!(written.bytes, std::fs::metadata(&path).unwrap().len());
        assert!(is_saved_scene(&path).unwrap());
        for scene in
            [open(&path, Check::Everything).unwrap(), read(&path, Check::Everything).unwrap()]
        {
            assert_eq!(hits(&scene.tree, &scene.geometry), hits(&tree, &geometry), "{name}");
            assert_eq!(scene.geometry_hash, written.geometry_hash);
        }
        std::fs::remove_file(path).unwrap();
    }
}

/// Cancels when it has been asked so many times.
struct After(AtomicUsize);

impl Monitor for After {
    fn is_cancelled(&self) -> bool {
        self.0.fetch_sub(1, Ordering::Relaxed) == 0
    }
}

/// Cancels some work ever later, until it comes to its end; how often it was cancelled.
fn cancelled(mut work: impl FnMut(&After) -> bool) -> usize {
    (0..).take_while(|&asks| work(&After(AtomicUsize::new(asks)))).count()
}

#[test]
fn what_is_cancelled_leaves_no_file_and_the_old_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.rope");
    // Some sections are several pieces long.
    let ((tree, geometry), (other, old)) = (soup(150_000, 4), soup(100, 5));
    save(&path, &Contents::new(&other, &old)).unwrap();
    let times = cancelled(|monitor| {
        let saved = save_monitored(&path, &Contents::new(&tree, &geometry), monitor);
        assert_eq!(names(folder.path()), ["scene.rope"]);
        let Err(error) = saved else { return false };
        assert!(matches!(error.source, WriteError::Cancelled), "{error}");
        assert_eq!(open(&path, Check::Everything).unwrap().geometry.len(), 100);
        true
    });
    assert!(times > 6, "{times} times");
    let is_cancelled = |error: OpenError| match error {
        OpenError::Content { source, .. } => assert_eq!(source, FileError::Cancelled),
        error => panic!("{error}"),
    };
    let times = cancelled(|monitor| {
        open_monitored(&path, Check::Everything, monitor).map_err(is_cancelled).is_err()
    });
    assert!(times > 3, "{times} times");
    let times = cancelled(|monitor| {
        read_monitored(&path, Check::Structure, monitor).map_err(is_cancelled).is_err()
    });
    assert!(times > 0, "{times} times");
    assert_eq!(open(&path, Check::Everything).unwrap().geometry.len(), 150_000);
}

#[test]
fn files_that_may_only_be_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.rope");
    let (tree, geometry) = soup(100, 2);
    save(&path, &Contents::new(&tree, &geometry)).unwrap();
    let mut permissions = std::fs::metadata(&path).unwrap().permissions();
    permissions.set_readonly(true);
    std::fs::set_permissions(&path, permissions).unwrap();
    let scene = open(&path, Check::Everything).unwrap();
    assert_eq!(hits(&scene.tree, &scene.geometry), hits(&tree, &geometry));
}

#[test]
fn whoever_has_a_file_open_keeps_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.rope");
    let (first, second) = (soup(400, 3), soup(50, 4));
    save(&path, &Contents::new(&first.0, &first.1)).unwrap();
    let old = open(&path, Check::Structure).unwrap();
    save(&path, &Contents::new(&second.0, &second.1)).unwrap();
    assert_eq!(hits(&old.tree, &old.geometry), hits(&first.0, &first.1));
    let new = open(&path, Check::Structure).unwrap();
    assert_eq!(hits(&new.tree, &new.geometry), hits(&second.0, &second.1));
    // Over itself, and after it is gone.
    save(&path, &Contents::new(&new.tree, &new.geometry)).unwrap();
    std::fs::remove_file(&path).unwrap();
    assert_eq!(hits(&new.tree, &new.geometry), hits(&second.0, &second.1));
    assert_eq!(names(folder.path()), [""; 0]);
}

#[test]
fn many_open_while_one_saves() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.rope");
    let scenes = [soup(600, 5), soup(200, 6)];
    let expected = [0, 1].map(|i| hits(&scenes[i].0, &scenes[i].1));
    save(&path, &Contents::new(&scenes[0].0, &scenes[0].1)).unwrap();
    let done = AtomicBool::new(false);
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                while !done.load(Ordering::Relaxed) {
                    let scene = open(&path, Check::Everything).unwrap();
                    let which = usize::from(scene.geometry.len() == 200);
                    assert_eq!(hits(&scene.tree, &scene.geometry), expected[which]);
                }
            });
        }
        for i in 0..30 {
            let (tree, geometry) = &scenes[i % 2];
            save(&path, &Contents::new(tree, geometry)).unwrap();
        }
        done.store(true, Ordering::Relaxed);
    });
    assert_eq!(names(folder.path()), ["scene.rope"]);
}

#[test]
fn what_cannot_be_saved_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (tree, geometry) = soup(100, 7);
    let contents = Contents::new(&tree, &geometry);
    let file = folder.path().join("file");
    std::fs::write(&file, "something").unwrap();
    for path in
        [folder.path().join("no/such/scene.rope"), file.join("scene.rope"), folder.path().into()]
    {
        let error = save(&path, &contents).unwrap_err();
        let sentence = error.to_string();
        assert!(sentence.starts_with(&format!("cannot save {}: ", path.display())), "{sentence}");
    }
    assert_eq!(names(folder.path()), ["file"]);
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "something");
}

/// A device that is always full stands for a full disk.
#[cfg(target_os = "linux")]
#[test]
fn full_disks_are_heard_of() {
    let (tree, geometry) = soup(100, 8);
    let error = save("/dev/full", &Contents::new(&tree, &geometry)).unwrap_err();
    let ropewalk::file::WriteError::Io(source) = &error.source else { panic!("{error}") };
    assert_eq!(source.kind(), std::io::ErrorKind::StorageFull, "{error}");
}

#[test]
fn what_is_no_scene_is_refused_with_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.rope");
    let refusal = |path: &Path| {
        let error = open(path, Check::Structure).err().expect("it must be refused");
        let copied = read(path, Check::Structure).err().expect("it must be refused");
        assert_eq!(error.to_string(), copied.to_string());
        error
    };
    assert!(matches!(refusal(&path), OpenError::Open { .. }));
    assert!(matches!(refusal(folder.path()), OpenError::Read { .. } | OpenError::Open { .. }));
    std::fs::write(&path, "").unwrap();
    let sentence = refusal(&path).to_string();
    let expected = "the file is cut off: expected 192 bytes, found 0";
    assert_eq!(sentence, format!("{}: {expected}", path.display()));
    assert!(!is_saved_scene(&path).unwrap());
    std::fs::write(&path, "v\nfrom 0 0 0\n").unwrap();
    assert!(matches!(refusal(&path), OpenError::Content { .. }));
    assert!(!is_saved_scene(&path).unwrap());
    let (tree, geometry) = soup(200, 9);
    save(&path, &Contents::new(&tree, &geometry)).unwrap();
    let whole = std::fs::metadata(&path).unwrap().len();
    std::fs::OpenOptions::new().write(true).open(&path).unwrap().set_len(whole - 64).unwrap();
    let expected = format!("the file is cut off: expected {whole} bytes, found {}", whole - 64);
    assert_eq!(refusal(&path).to_string(), format!("{}: {expected}", path.display()));
}

#[cfg(unix)]
#[test]
fn devices_are_refused() {
    let error = open("/dev/zero", Check::Structure).err().unwrap();
    assert_eq!(error.to_string(), "cannot read /dev/zero: it is no regular file");
}
