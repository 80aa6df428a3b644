//! The reader and the writer on real files: the Standard Procedural Databases as their original
//! generators wrote them, and files of another program's dialect.

use flate2::read::GzDecoder;
use libtest_mimic::{Arguments, Failed, Trial};
use ropewalk_scene::{NffLimits, NffStats, NffWriter, Scene, load_scene, read_nff};
use ropewalk_testkit::data::{shared_data, trial};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

fn main() {
    let mut trials = Vec::new();
    for name in SPD_FILES {
        let path = format!("spd/{name}.nff.gz");
        trials.push(trial(format!("nff::counts::{name}"), &path, counts));
        trials.push(trial(format!("nff::writes_same_tokens::{name}"), &path, same_tokens));
    }
    for (name, sentence) in DIALECTS {
        let path = format!("ugly/assimp/{name}.nff");
        trials.push(trial(format!("nff::dialect::{name}"), &path, |path| refused(path, sentence)));
    }
    trials.push(trial("nff::every_file_is_tested", "spd", every_file_is_tested));
    trials.push(no_permission());
    libtest_mimic::run(&Arguments::from_args(), trials).exit()
}

const SPD_FILES: [&str; 21] = [
    "balls_3",
    "balls_4",
    "balls_5",
    "gears_2",
    "gears_4",
    "lattice_6",
    "lattice_12",
    "mount_4",
    "mount_6",
    "mount_8",
    "rings_3",
    "rings_7",
    "teapot_4",
    "teapot_6",
    "teapot_12",
    "tetra_5",
    "tetra_6",
    "tree_8",
    "tree_11",
    "sample_1",
    "sombrero_1",
];

/// Files that add words to the format: textures behind `f`, `tess`, five numbers behind `s`.
const DIALECTS: [(&str, &str); 3] = [
    (
        "ManyEarthsNotJustOne",
        "13:33: expected an entity (v, b, l, f, s, c, p, pp or #) after the 8 numbers of f, \
         found \"earthSpherical.jpg\"",
    ),
    (
        "cone",
        "3:35: expected an entity (v, b, l, f, s, c, p, pp or #) after the 8 numbers of f, \
         found \"cantfindme.png\"",
    ),
    ("spheres", "11:1: expected a number for the material's index of refraction, found \"s\""),
];

fn text(path: &Path) -> Result<String, Failed> {
    let mut text = String::new();
    GzDecoder::new(File::open(path)?).read_to_string(&mut text)?;
    Ok(text)
}

/// The counts of the data's index, from a table row such as
/// `| spd/balls_4.nff.gz | ... | 7382 (s 7381 p 1) | 74286 |`.
fn indexed_counts(path: &Path) -> Result<(u64, BTreeMap<String, u64>), Failed> {
    let data = shared_data().ok_or("the shared data is absent")?;
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let index = std::fs::read_to_string(data.join("INDEX.md"))?;
    let prefix = format!("| spd/{file} |");
    let row = index.lines().find(|row| row.starts_with(&prefix)).ok_or("not in the index")?;
    let cell = row.split('|').nth(4).ok_or("no such column")?.trim();
    let (total, kinds) = cell.split_once(" (").ok_or("no counts")?;
    let words: Vec<_> = kinds.trim_end_matches(')').split(' ').collect();
    let kinds = words.chunks(2).map(|kind| Ok((kind[0].to_owned(), kind[1].parse()?)));
    Ok((total.parse()?, kinds.collect::<Result<_, std::num::ParseIntError>>()?))
}

fn counts(path: &Path) -> Result<(), Failed> {
    let mut scene = Scene::default();
    let input = BufReader::new(GzDecoder::new(File::open(path)?));
    let stats: NffStats = read_nff(input, &NffLimits::DEFAULT, &mut scene)?;
    let (total, kinds) = indexed_counts(path)?;
    let found =
        [("s", stats.spheres), ("c", stats.cones), ("p", stats.polygons), ("pp", stats.patches)];
    let found: BTreeMap<_, _> =
        found.into_iter().filter(|&(_, n)| n > 0).map(|(kind, n)| (kind.to_owned(), n)).collect();
    assert_eq!((stats.objects(), found), (total, kinds));
    assert_eq!((scene.objects.len() as u64, stats.degenerate), (total, 0));
    assert!(scene.camera.is_some() && !scene.lights.is_empty());
    // By name the same scene comes out.
    let loaded = load_scene(&path.to_string_lossy(), &NffLimits::DEFAULT)?;
    assert_eq!(format!("{}.nff.gz", loaded.name), path.file_name().unwrap().to_string_lossy());
    assert_eq!(Scene { name: String::new(), ..loaded }, scene);
    Ok(())
}

fn same_tokens(path: &Path) -> Result<(), Failed> {
    let text = text(path)?;
    let mut direct = NffWriter::new(Vec::new());
    read_nff(text.as_bytes(), &NffLimits::DEFAULT, &mut direct)?;
    let mut held = NffWriter::new(Vec::new());
    Scene::read_nff(text.as_bytes(), &NffLimits::DEFAULT)?.write_to(&mut held)?;
    for (way, written) in [("entity by entity", direct), ("from a scene", held)] {
        let written = String::from_utf8(written.into_inner())?;
        compare(&text, &written).map_err(|difference| format!("written {way}: {difference}"))?;
    }
    Ok(())
}

/// Compares word by word, comments dropped.
fn compare(original: &str, written: &str) -> Result<(), String> {
    let (mut original, mut written) = (words(original), words(written));
    for i in 0.. {
        match (original.next(), written.next()) {
            (None, None) => break,
            (a, b) if a == b => {}
            (a, b) => return Err(format!("word {i}: {a:?} became {b:?}")),
        }
    }
    Ok(())
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.lines().flat_map(|line| line.split('#').next().unwrap_or("").split_ascii_whitespace())
}

fn refused(path: &Path, sentence: &str) -> Result<(), Failed> {
    let path = path.to_string_lossy();
    let error = load_scene(&path, &NffLimits::DEFAULT).err().ok_or("it was read")?;
    assert_eq!(error.to_string(), format!("{path}:{sentence}"));
    Ok(())
}

fn every_file_is_tested(folder: &Path) -> Result<(), Failed> {
    for entry in std::fs::read_dir(folder)? {
        let name = entry?.file_name().to_string_lossy().into_owned();
        if let Some(stem) = name.strip_suffix(".nff.gz") {
            assert!(SPD_FILES.contains(&stem), "{name} is not in the list of this test");
        }
    }
    Ok(())
}

/// A file that its user may not read; ignored where the user may read everything.
fn no_permission() -> Trial {
    let locked = tempfile::NamedTempFile::with_suffix(".nff").and_then(|file| {
        #[cfg(unix)]
        std::fs::set_permissions(file.path(), std::os::unix::fs::PermissionsExt::from_mode(0o0))?;
        Ok(file)
    });
    let readable = locked.as_ref().map_or(true, |file| File::open(file.path()).is_ok());
    Trial::test("nff::no_permission", move || {
        let file = locked?;
        let path = file.path().to_string_lossy();
        let error = load_scene(&path, &NffLimits::DEFAULT).err().ok_or("it was read")?;
        let sentence = format!("{path}: cannot open the scene file: no permission to read it");
        assert_eq!(error.to_string(), sentence);
        Ok(())
    })
    .with_kind(if readable { "ignored: this user may read every file" } else { "" })
    .with_ignored_flag(readable)
}
