//! Each bad input and the exact sentence it is refused with.

use ropewalk_scene::{Fault, NffLimits, NffStats, Scene, SceneError, load_scene, read_nff};
use std::io::{self, BufReader, Read, Write};
use std::path::PathBuf;

const ENTITY: &str = "expected an entity (v, b, l, f, s, c, p, pp or #)";

/// Input and sentence after `a.nff:`.
fn table() -> Vec<(&'static [u8], String)> {
    let cases: &[(&[u8], &str)] = &[
        // Empty files.
        (b"", "1:1: expected at least one object (s, c, p or pp), found the end of the file"),
        (
            b"b 0 0 0\n# only a comment\n",
            "3:1: expected at least one object (s, c, p or pp), found the end of the file",
        ),
        // Truncated files.
        (
            b"s 0 0",
            "1:6: expected a number for z of the sphere's centre, found the end of the file",
        ),
        (b"s 0 0 0\n", "2:1: expected a number for the sphere's radius, found the end of the file"),
        (
            b"p 4\n0 0 0\n1 0 0\n1 1",
            "4:4: expected a number for z of vertex 3 of 4, found the end of the file",
        ),
        (
            b"pp 3\n0 0 0 0 0 1\n1 0 0 0\n",
            "4:1: expected a number for y of normal 2 of 3, found the end of the file",
        ),
        (
            b"v from 0 0 0 at 0 0 1 angle 45 hither 1\n",
            "2:1: expected the view's up or resolution, found the end of the file",
        ),
        (
            b"p",
            "1:2: expected a whole number from 3 for the polygon's vertex count, found the end of the file",
        ),
        // Not numbers.
        (b"s 0 0 0 abc", "1:9: expected a number for the sphere's radius, found \"abc\""),
        (b"s 0 0 0\n s 1 1 1 1", "2:2: expected a number for the sphere's radius, found \"s\""),
        (
            b"b 0 0,5 1",
            "1:5: expected a number for green of the background's colour, found \"0,5\"",
        ),
        (b"s 0x10 0 0 1", "1:3: expected a number for x of the sphere's centre, found \"0x10\""),
        (b"s 1_0 0 0 1", "1:3: expected a number for x of the sphere's centre, found \"1_0\""),
        (b"s - 0 0 1", "1:3: expected a number for x of the sphere's centre, found \"-\""),
        (b"s 0 0 0 \xff", "1:9: expected a number for the sphere's radius, found \"\u{fffd}\""),
        (
            b"f 1 1 1 1 0 many 0 1",
            "1:13: expected a number for the material's shine, found \"many\"",
        ),
        // Not finite.
        (
            b"s 0 nan 0 1",
            "1:5: expected a finite number for y of the sphere's centre, found \"nan\"",
        ),
        (b"s 0 0 0 -INF", "1:9: expected a finite number for the sphere's radius, found \"-INF\""),
        (
            b"s 0 0 0 1e999",
            "1:9: expected a finite number for the sphere's radius, found \"1e999\"",
        ),
        (
            b"s 0 0 0 1e39",
            "1:9: expected a number of at most 3.4e38 for the sphere's radius, found \"1e39\"",
        ),
        (b"s 0 0 0 1.#IND", "1:9: expected a number for the sphere's radius, found \"1.#IND\""),
        (
            b"l 0 0 0 nan 0 0",
            "1:9: expected a finite number for red of the light's colour, found \"nan\"",
        ),
        (b"l 0 0 0 1 0 s", "1:13: expected a number for blue of the light's colour, found \"s\""),
        // Counts.
        (
            b"p -3 0 0 0",
            "1:3: expected a whole number from 3 for the polygon's vertex count, found \"-3\"",
        ),
        (
            b"pp 2 0 0 0",
            "1:4: expected a whole number from 3 for the patch's vertex count, found \"2\"",
        ),
        (
            b"p 3.0 0 0 0",
            "1:3: expected a whole number from 3 for the polygon's vertex count, found \"3.0\"",
        ),
        (
            b"p 1000000000\n0 0 0\n",
            "1:3: expected at most 1000000 vertices in a polygon, found \"1000000000\"",
        ),
        (
            b"p 99999999999999999999999\n0 0 0\n",
            "1:3: expected at most 1000000 vertices in a polygon, found \"99999999999999999999999\"",
        ),
        // The view.
        (
            b"v from 0 0 0 from 0 0 0",
            "1:14: expected the view's at or up or angle or hither or resolution, found \"from\"",
        ),
        (b"v angle 0", "1:9: expected a view angle between 0 and 180 degrees, found \"0\""),
        (b"v angle -45", "1:9: expected a view angle between 0 and 180 degrees, found \"-45\""),
        (b"v angle 180", "1:9: expected a view angle between 0 and 180 degrees, found \"180\""),
        (
            b"v resolution 512 0",
            "1:18: expected a whole number from 1 for the resolution's height, found \"0\"",
        ),
        (
            b"v resolution -512 512",
            "1:14: expected a whole number from 1 for the resolution's width, found \"-512\"",
        ),
        (
            b"v resolution 5000000000 1",
            "1:14: expected at most 4294967295 pixels a side, found \"5000000000\"",
        ),
        // Cones.
        (
            b"c 0 0 0 1 0 0 1 -1",
            "1:17: expected the cone's apex radius to be positive or zero, like its base radius, found \"-1\"",
        ),
        (
            b"c 0 0 0 -1 0 0 1 2",
            "1:18: expected the cone's apex radius to be negative or zero, like its base radius, found \"2\"",
        ),
        // Bytes.
        (b"\x1f\x8b\x08\0\0\0", "1:1: expected text, found the byte 0x1f, as in a binary file"),
        (b"s 0 0\0 0 1", "1:6: expected text, found the byte 0x00, as in a binary file"),
        (b"s 0 0 \x7f", "1:7: expected text, found the byte 0x7f, as in a binary file"),
    ];
    let mut table: Vec<_> = cases.iter().map(|(text, e)| (*text, e.to_string())).collect();
    // Words that begin no entity.
    for (text, rest) in [
        (&b"tess 4"[..], "1:1: @, found \"tess\""),
        (b"S 0 0 0 1", "1:1: @, found \"S\""),
        (b"1 2 3", "1:1: @, found \"1\""),
        (b"s 0 0 0 1 2", "1:11: @ after the 4 numbers of s, found \"2\""),
        (b"f 1 1 1 1 1 1 0 1\tearth.jpg", "1:19: @ after the 8 numbers of f, found \"earth.jpg\""),
        (b"p 3 0 0 0 1 0 0 0 1 0\n1 1 0", "2:1: @ after the announced vertices of p, found \"1\""),
        (b"l 1 2 3 white", "1:9: @ or a colour after the 3 numbers of l, found \"white\""),
        (b"{\"spheres\": []}", "1:1: @, found \"{\\\"spheres\\\":\""),
        (
            b"abcdefghijklmnopqrstuvwxyzabcdefghijklmnopqrstuvwxyz",
            "1:1: @, found \"abcdefghijklmnopqrstuvwxyzabcdef...\"",
        ),
    ] {
        table.push((text, rest.replace('@', ENTITY)));
    }
    table
}

#[test]
fn each_bad_text_is_refused_with_its_sentence() {
    for (text, sentence) in table() {
        let shown = String::from_utf8_lossy(text);
        let error = match Scene::read_nff(text, &NffLimits::DEFAULT) {
            Ok(scene) => panic!("{shown:?} was read as {scene:?}"),
            Err(error) => error.in_file("a.nff").to_string(),
        };
        assert_eq!(error, format!("a.nff:{sentence}"), "for {shown:?}");
    }
}

#[test]
fn lines_end_with_either_or_both_control_characters() {
    for (text, place) in [
        ("s 0 0 0 1\n#\nx", "3:1"),
        ("s 0 0 0 1\r\n#\r\n x", "3:2"),
        ("s 0 0 0 1\r#\rx", "3:1"),
        ("s 0 0 0 1\n\rx", "3:1"),
        ("s 0 0 0 1\r\r\n\n x", "4:2"),
        ("s 0 0 0 1\r1", "2:1"),
    ] {
        let error = Scene::read_nff(text.as_bytes(), &NffLimits::DEFAULT).unwrap_err();
        assert_eq!(format!("{}:{}", error.line, error.column), place, "{text:?}");
        // Line ends that straddle two reads.
        let trickle = BufReader::with_capacity(1, text.as_bytes());
        let error = Scene::read_nff(trickle, &NffLimits::DEFAULT).unwrap_err();
        assert_eq!(format!("{}:{}", error.line, error.column), place, "{text:?} byte by byte");
    }
}

#[test]
fn each_limit_is_exact() {
    let text = "l 0 0 0 f 1 1 1 1 1 1 0 1 p 4 0 0 0 1 0 0 1 1 0 0 1 0 s 0 0 0 12345";
    let exact = NffLimits {
        bytes: text.len() as u64,
        objects: 2,
        vertices_per_polygon: 4,
        materials: 1,
        lights: 1,
        token_bytes: 5,
    };
    assert!(Scene::read_nff(text.as_bytes(), &exact).is_ok());
    for (limits, sentence) in [
        (NffLimits { bytes: 66, ..exact }, "1:67: expected at most 66 bytes of text, found more"),
        (NffLimits { objects: 1, ..exact }, "1:63: expected at most 1 objects, found 2"),
        (
            NffLimits { vertices_per_polygon: 3, ..exact },
            "1:29: expected at most 3 vertices in a polygon, found \"4\"",
        ),
        (NffLimits { materials: 0, ..exact }, "1:9: expected at most 0 materials (f), found 1"),
        (NffLimits { lights: 0, ..exact }, "1:1: expected at most 0 lights (l), found 1"),
        (
            NffLimits { token_bytes: 4, ..exact },
            "1:63: expected at most 4 bytes in a word, found \"12345\"",
        ),
    ] {
        let error = Scene::read_nff(text.as_bytes(), &limits).unwrap_err();
        assert_eq!(error.in_file("a").to_string(), format!("a:{sentence}"));
    }
}

#[test]
fn a_word_or_a_comment_without_end_takes_no_memory() {
    // 2 GiB each, were they ever held.
    let endless = BufReader::new(io::repeat(b'a').take(2 << 30));
    let error = Scene::read_nff(endless, &NffLimits::DEFAULT).unwrap_err();
    assert!(error.to_string().contains("expected at most 1024 bytes in a word"), "{error}");
    let limits = NffLimits { bytes: 1 << 20, ..NffLimits::DEFAULT };
    let endless = BufReader::new(io::repeat(b'#').take(2 << 30));
    let error = Scene::read_nff(endless, &limits).unwrap_err();
    assert!(error.to_string().contains("expected at most 1048576 bytes of text"), "{error}");
}

#[test]
fn degenerate_objects_are_read_and_counted() {
    let text = "s 0 0 0 0 s 1 1 1 -0 c 0 0 0 1 0 0 0 2 c 0 0 0 0 1 1 1 0 \
                s 0 0 0 -1 c 0 0 0 0 0 0 1 -2 # the last two are whole";
    let mut scene = Scene::default();
    let stats: NffStats = read_nff(text.as_bytes(), &NffLimits::DEFAULT, &mut scene).unwrap();
    assert_eq!((stats.spheres, stats.cones, stats.degenerate), (3, 3, 4));
    assert_eq!((stats.objects(), stats.comments, stats.bytes), (6, 1, text.len() as u64));
    assert_eq!(scene.objects.len(), 6);
}

/// A temporary file `name` with `bytes`, and the folder that removes it.
fn file(name: &str, bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    (folder, path)
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

#[test]
fn files_are_loaded_compressed_or_not_and_named_after_their_stem() {
    let text = b"s 0 0 0 1\n";
    for (name, bytes) in [
        ("two.balls.nff", text.to_vec()),
        ("two.balls.nff.gz", gzip(text)),
        ("two.balls.nff", gzip(text)),
        ("two.balls", text.to_vec()),
        ("two.balls.nff.gz", [gzip(text), gzip(text)].concat()),
    ] {
        let (_folder, path) = file(name, &bytes);
        let scene = load_scene(path.to_str().unwrap(), &NffLimits::DEFAULT).unwrap();
        assert_eq!(scene.name, "two.balls");
        assert!(!scene.objects.is_empty());
    }
}

/// The sentence, without the folder, and whose fault it is.
fn refusal(name: &str, bytes: &[u8]) -> (String, Fault) {
    let (folder, path) = file(name, bytes);
    let error = load_scene(path.to_str().unwrap(), &NffLimits::DEFAULT).unwrap_err();
    let folder = format!("{}{}", folder.path().display(), std::path::MAIN_SEPARATOR);
    (error.to_string().replace(&folder, ""), error.fault())
}

#[test]
fn bad_files_are_refused_with_their_name() {
    let whole = gzip("s 0 0 0 1\n".repeat(1000).as_bytes());
    let (sentence, fault) = refusal("a.nff", b"s 0 0 0 1\nx");
    assert_eq!(sentence, format!("a.nff:2:1: {ENTITY} after the 4 numbers of s, found \"x\""));
    assert_eq!(fault, Fault::Input);
    let (sentence, fault) = refusal("a.nff.gz", b"s 0 0 0 1\n");
    assert_eq!(sentence, "a.nff.gz: expected gzip data, as the name says, found something else");
    assert_eq!(fault, Fault::Input);
    // The same place as in the text itself.
    let (sentence, _) = refusal("a.nff.gz", &gzip(b"s 0 0 0 1\nx"));
    assert!(sentence.starts_with("a.nff.gz:2:1: expected an entity"), "{sentence}");
    // A cut archive, and one with a flipped byte in its checksum.
    let (sentence, fault) = refusal("a.nff.gz", &whole[..whole.len() - 12]);
    assert!(sentence.contains(": expected to read on, found an error: "), "{sentence}");
    assert_eq!(fault, Fault::Input);
    let mut flipped = whole.clone();
    flipped[whole.len() - 6] ^= 1;
    let (sentence, fault) = refusal("a.nff.gz", &flipped);
    assert!(sentence.contains(": expected to read on, found an error: "), "{sentence}");
    assert_eq!(fault, Fault::Input);
}

#[test]
fn what_is_no_file_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().to_str().unwrap();
    let error = load_scene(path, &NffLimits::DEFAULT).unwrap_err();
    assert_eq!(error.to_string(), format!("{path}: expected a scene file, found a directory"));
    let missing = format!("{path}/missing.nff");
    let error = load_scene(&missing, &NffLimits::DEFAULT).unwrap_err();
    let sentence = format!("{missing}: cannot open the scene file: there is no such file");
    assert_eq!((error.to_string(), error.fault()), (sentence, Fault::Request));
    // A super-user may read every file, so the system's refusal is made here.
    let source = io::ErrorKind::PermissionDenied.into();
    let error = SceneError::Open { path: "a.nff".to_owned(), source };
    let sentence = "a.nff: cannot open the scene file: no permission to read it";
    assert_eq!((error.to_string().as_str(), error.fault()), (sentence, Fault::System));
}

#[test]
fn built_in_scenes_are_loaded_by_name() {
    for (spec, name, objects) in [
        ("spd:tetra", "spd:tetra:6", 4096),
        ("spd:balls:2", "spd:balls:2", 92),
        ("spd:teapot:4", "spd:teapot:4", 1008),
    ] {
        let scene = load_scene(spec, &NffLimits::DEFAULT).unwrap();
        assert_eq!((scene.name.as_str(), scene.objects.len()), (name, objects));
    }
}

#[test]
fn bad_names_of_built_in_scenes_are_refused() {
    let names = "balls, gears, mount, rings, teapot, tetra, tree, lattice, jacks, shells, \
                 sombrero, sample";
    for (spec, sentence) in [
        ("spd:cubes:4", format!("expected a built-in scene ({names}), found \"cubes\"")),
        ("spd:", format!("expected a built-in scene ({names}), found \"\"")),
        ("spd:balls:0", "expected a size from 1 to 10 for balls, found \"0\"".to_owned()),
        ("spd:balls:11", "expected a size from 1 to 10 for balls, found \"11\"".to_owned()),
        ("spd:balls:-4", "expected a size from 1 to 10 for balls, found \"-4\"".to_owned()),
        ("spd:balls:4:5", "expected a size from 1 to 10 for balls, found \"4:5\"".to_owned()),
        ("spd:balls:", "expected a size from 1 to 10 for balls, found \"\"".to_owned()),
        // Refused by its closed-form count, before anything is made.
        (
            "spd:tetra:15",
            "expected at most 20000000 objects, found a scene of 1073741824".to_owned(),
        ),
    ] {
        let error = load_scene(spec, &NffLimits::DEFAULT).unwrap_err();
        assert_eq!(error.to_string(), format!("{spec}: {sentence}"));
        assert_eq!(error.fault(), Fault::Request);
    }
}

#[test]
fn a_failing_disk_is_the_systems_fault() {
    struct Failing;
    impl Read for Failing {
        fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
            Err(io::Error::other("the disk is gone"))
        }
    }
    let input = BufReader::new("s 0 0 0 1\ns 0 ".as_bytes().chain(Failing));
    let error = Scene::read_nff(input, &NffLimits::DEFAULT).unwrap_err().in_file("a.nff");
    assert_eq!(
        error.to_string(),
        "a.nff:2:5: expected to read on, found an error: the disk is gone"
    );
    assert_eq!(SceneError::Nff(error).fault(), Fault::System);
}
