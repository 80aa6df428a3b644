//! `render`, `scene`, `stats` and `validate` through the command: output, files and exit codes.

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

fn ropewalk(folder: &Path, args: &[&str]) -> Output {
    let program = env!("CARGO_BIN_EXE_ropewalk");
    Command::new(program).current_dir(folder).args(args).output().expect("the command starts")
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn files(folder: &Path) -> Vec<String> {
    let name = |entry: std::io::Result<std::fs::DirEntry>| entry.unwrap().file_name();
    let mut names: Vec<_> =
        std::fs::read_dir(folder).unwrap().map(|e| name(e).into_string().unwrap()).collect();
    names.sort();
    names
}

fn has_numbers(json: &Value, block: &str, keys: &[&str]) {
    for key in keys {
        assert!(json[block][key].is_number(), "{block}.{key} in {json}");
    }
}

const TREE: [&str; 7] =
    ["inner_nodes", "leaves", "empty_leaves", "references", "depth", "bytes", "build_seconds"];

#[test]
fn render_writes_all_pictures_and_prints_one_object() {
    let folder = tempfile::tempdir().unwrap();
    let aov = "depth,normal,steps,tests";
    let args = ["render", "spd:balls:2", "--size", "64x48", "-o", "a.png", "--aov", aov, "--json"];
    let output = ropewalk(folder.path(), &args);
    assert!(output.status.success(), "{}", stderr(&output));
    let json: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    let rays = ["primary", "primary_hits", "reflection", "refraction", "shadow", "shadow_hits"];
    has_numbers(&json, "rays", &rays);
    has_numbers(&json, "tree", &TREE);
    let events = [
        "intersection_tests",
        "traversal_steps",
        "leaf_visits",
        "empty_leaf_visits",
        "rope_crossings",
        "rope_tree_steps",
    ];
    has_numbers(&json, "per_ray", &events);
    has_numbers(&json, "seconds", &["read", "build", "trace"]);
    assert_eq!(json["rays"]["primary"], 64 * 48);
    let expected = ["a.depth.png", "a.normal.png", "a.png", "a.steps.png", "a.tests.png"];
    assert_eq!(files(folder.path()), expected);
}

#[test]
fn every_method_renders_the_same_picture() {
    let folder = tempfile::tempdir().unwrap();
    let render = |method: &str| {
        let args = ["render", "spd:rings:1", "--size", "40x40", "-o", "a.png", "--method", method];
        let output = ropewalk(folder.path(), &args);
        assert!(output.status.success(), "{method}: {}", stderr(&output));
        std::fs::read(folder.path().join("a.png")).unwrap()
    };
    let expected = render("naive");
    for method in ropewalk::method::Method::all() {
        assert!(render(method.name) == expected, "{} differs from naive", method.name);
    }
}

#[test]
fn spd_rules_shoot_corner_rays() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["render", "spd:tetra:3", "--spd-rules", "-o", "a.exr", "--json"];
    let output = ropewalk(folder.path(), &args);
    assert!(output.status.success(), "{}", stderr(&output));
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["rays"]["primary"], 513 * 513);
}

#[test]
fn two_sided_surfaces_are_hit_from_behind() {
    let folder = tempfile::tempdir().unwrap();
    let view = "v from 0 0 -5 at 0 0 0 up 0 1 0 angle 40 hither 0 resolution 8 8\n";
    let polygon = "f 1 1 1 1 0 1 0 1\np 3\n-9 -9 0\n9 -9 0\n0 9 0\n"; // its front faces +z
    std::fs::write(folder.path().join("a.nff"), format!("{view}{polygon}")).unwrap();
    let hits = |extra: &[&str]| {
        let args = [&["render", "a.nff", "-o", "a.png", "--json"], extra].concat();
        let output = ropewalk(folder.path(), &args);
        assert!(output.status.success(), "{}", stderr(&output));
        let json: Value = serde_json::from_slice(&output.stdout).unwrap();
        json["rays"]["primary_hits"].as_u64().unwrap()
    };
    assert_eq!((hits(&[]), hits(&["--two-sided"])), (0, 64));
}

#[test]
fn bench_measures_every_workload() {
    let folder = tempfile::tempdir().unwrap();
    let names =
        ["primary", "diffuse", "shadow", "ao", "all-hits", "first-8", "walk-1%", "walk-0.2%"];
    let list = names.join(",");
    for scene in ["spd:tetra:3", "spd:balls:1"] {
        let args =
            ["bench", scene, "--side", "16", "--rounds", "2", "--workloads", &list, "--json"];
        let output = ropewalk(folder.path(), &[&args[..], &["--preset", "compact"]].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        let json: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
        has_numbers(&json, "seconds", &["read", "build"]);
        assert_eq!((&json["preset"], &json["rounds"]), (&"compact".into(), &2.into()));
        assert!(json["bytes_per_primitive"].as_f64().unwrap() > 40.0);
        let workloads = json["workloads"].as_array().unwrap();
        for (workload, name) in workloads.iter().zip(names) {
            assert_eq!(workload["name"], name);
            assert!(workload["rays"].as_u64().unwrap() > 0 && workload["median_mrays"].is_number());
            assert_eq!(workload["per_ray"]["steps"].is_number(), name != "first-8", "{workload}");
        }
        assert_eq!((workloads.len(), &workloads[0]["rays"]), (names.len(), &256.into()));
    }
    let args = ["bench", "spd:tetra:2", "--side", "8", "--threads", "1", "--level", "scalar"];
    let output = ropewalk(folder.path(), &args);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success() && text.contains("scalar, 1 thread(s)"), "{text}");
    assert!(files(folder.path()).is_empty());
}

#[test]
fn a_scene_without_a_view_is_seen_from_outside() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.nff"), "s 0 0 0 1\n").unwrap();
    let output = ropewalk(folder.path(), &["bench", "a.nff", "--side", "16", "--json"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let json: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert!(json["workloads"][2]["rays"].as_u64().unwrap() > 0, "{json}");
}

#[test]
fn scene_writes_what_stats_and_validate_read() {
    let folder = tempfile::tempdir().unwrap();
    let output = ropewalk(folder.path(), &["scene", "mount", "--size", "3", "-o", "m.nff"]);
    assert!(output.status.success(), "{}", stderr(&output));
    for (scene, name) in [("m.nff", "m"), ("spd:mount:3", "spd:mount:3")] {
        let output = ropewalk(folder.path(), &["stats", scene, "--json"]);
        let json: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
        assert_eq!(json["scene"], name);
        assert_eq!(json["primitives"], 132);
        has_numbers(&json, "tree", &TREE);
    }
    let output = ropewalk(folder.path(), &["validate", "m.nff"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(text.contains("rope-trees") && text.contains("ok"), "{text}");
}

#[test]
fn the_inputs_fault_is_exit_code_1_and_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("cut.nff", "s 0 0");
    write("nan.nff", "s 0 0 nan 1");
    write("many.nff", "p 1000000000\n0 0 0");
    write("negative.nff", "p -4");
    write("unknown.nff", "cube 1 2 3");
    write("empty.nff", "");
    std::fs::create_dir(folder.path().join("folder.nff")).unwrap();
    let cases = [
        ("cut.nff", "cut.nff:1:6: expected a number"),
        ("nan.nff", "nan.nff:1:7: expected a finite number"),
        ("many.nff", "many.nff:1:3: "),
        ("negative.nff", "negative.nff:1:3: expected a whole number"),
        ("unknown.nff", "unknown.nff:1:1: expected an entity"),
        ("empty.nff", "empty.nff:1:1: expected at least one object"),
        ("folder.nff", "folder.nff: expected a scene file, found a directory"),
        ("absent.nff", "absent.nff: cannot open the scene file"),
        ("spd:cubes", "spd:cubes: expected a built-in scene (balls, "),
        ("stage:hall", "stage:hall: expected a built-in stage (room), found"),
        ("stage:room:17", "stage:room:17: expected a size from 1 to 16 for room, found"),
    ];
    let before = files(folder.path());
    for (scene, sentence) in cases {
        for command in ["render", "stats", "validate", "bench"] {
            let output = ropewalk(folder.path(), &[command, scene]);
            let text = stderr(&output);
            assert_eq!(output.status.code(), Some(1), "{command} {scene}: {text}");
            assert!(text.starts_with(&format!("ropewalk: {sentence}")), "{text}");
            assert_eq!(text.lines().count(), 1, "{text}");
        }
    }
    assert_eq!(files(folder.path()), before, "a failed command writes nothing");
}

#[test]
fn a_wrong_use_is_exit_code_2() {
    let folder = tempfile::tempdir().unwrap();
    let cases: [&[&str]; 22] = [
        &["render"],
        &["render", "spd:tetra:2", "--exposure", "1"],
        &["render", "spd:tetra:2", "--path", "--spd-rules"],
        &["render", "spd:tetra:2", "--path", "--up", "x"],
        &["render", "spd:tetra:2", "--path", "--tone", "film"],
        &["render", "spd:tetra:2", "--path", "--from", "1,2,3"],
        &["render", "spd:tetra:2", "--path", "--from", "1,2", "--at", "0,0,0"],
        &["render", "spd:tetra:2", "--method", "magic"],
        &["render", "spd:tetra:2", "--size", "0x10"],
        &["render", "spd:tetra:2", "--aov", "heat"],
        &["scene", "cubes"],
        &["scene", "tetra", "--size", "99"],
        &["bench"],
        &["bench", "spd:tetra:2", "--workloads", "primary,build"],
        &["bench", "spd:tetra:2", "--preset", "worst"],
        &["bench", "spd:tetra:2", "--cost-model", "sah"],
        &["bench", "spd:tetra:2", "--rays", "photons"],
        &["bench", "spd:tetra:2", "--rays", "ao", "--cost-model", "termination"],
        &["bench", "spd:tetra:2", "--level", "avx1024"],
        &["bench", "spd:tetra:2", "--side", "100"],
        &["bench", "spd:tetra:2", "--rounds", "0"],
        &["paint"],
    ];
    for args in cases {
        let output = ropewalk(folder.path(), args);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {}", stderr(&output));
    }
    assert!(files(folder.path()).is_empty());
}

#[test]
fn a_picture_that_cannot_be_written_is_known_before_tracing() {
    let folder = tempfile::tempdir().unwrap();
    for path in ["no/such/folder/a.png", "a.tiff"] {
        let output = ropewalk(folder.path(), &["render", "spd:tetra:2", "-o", path]);
        assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    }
    assert!(files(folder.path()).is_empty());
}

/// Options that would do nothing are refused, cameras are named as they were given, causes are said once.
#[test]
fn options_of_paths_say_what_is_wrong() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("four.obj"), FOUR).unwrap();
    let say = |code: i32, options: &str| {
        let args = format!("render four.obj --size 8x8 --samples 1 {options}");
        let output = ropewalk(folder.path(), &args.split(' ').collect::<Vec<_>>());
        assert_eq!(output.status.code(), Some(code), "{options}: {}", stderr(&output));
        stderr(&output)
    };
    assert!(say(2, "-o a.png --focus 3").contains("--aperture"));
    assert!(say(2, "-o a.exr --tone clip").contains("--tone is for PNG"));
    assert!(say(2, "-o a.exr --exposure 1").contains("--exposure is for PNG"));
    let same = say(1, "-o a.png --from 7,8,9 --at 7,8,9");
    assert!(same.contains("from [7.0, 8.0, 9.0] and at [7.0, 8.0, 9.0]"), "{same}");
    let far = say(1, "-o a.png --from 1e300,0,0 --at 0,0,0");
    assert!(far.contains("from [1e300, 0.0, 0.0] lies more than"), "{far}");
    assert_eq!(files(folder.path()), ["four.obj"]);
    let dark = say(0, "-o a.png --no-sky");
    assert!(dark.contains("nothing shines"), "{dark}");
    assert_eq!(say(0, "-o a.png"), "");
    #[cfg(target_os = "linux")]
    {
        let refused = say(1, "-o /proc/a.png");
        assert_eq!(refused.matches("os error").count(), 1, "{refused}");
    }
}

#[cfg(unix)]
#[test]
fn an_interrupt_leaves_the_last_picture_or_none() {
    let folder = tempfile::tempdir().unwrap();
    let program = env!("CARGO_BIN_EXE_ropewalk");
    let mut child = Command::new(program)
        .current_dir(folder.path())
        .args(["render", "spd:balls:3", "--size", "6000x6000", "-o", "a.png"])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_millis(1500));
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(kill.success());
    let status = child.wait().unwrap();
    assert_eq!(status.code(), Some(1));
    assert!(files(folder.path()).is_empty(), "{:?}", files(folder.path()));
}

#[test]
fn a_saved_scene_is_explained_and_measured() {
    let folder = tempfile::tempdir().unwrap();
    let run = |args: &[&str]| {
        let output = ropewalk(folder.path(), args);
        assert!(output.status.success(), "{args:?}: {}", stderr(&output));
        output.stdout
    };
    let json = |args: &[&str]| -> Value { serde_json::from_slice(&run(args)).expect("one object") };
    let file = "balls and more.rope";
    let built = json(&["build", "spd:balls:2", "--save", file, "--preset", "fast", "--json"]);
    assert_eq!(files(folder.path()), [file]);
    has_numbers(&built, "seconds", &["read", "build", "save"]);
    let info = json(&["info", file, "--verify", "--json"]);
    assert_eq!(info["primitives"], built["primitives"]);
    assert_eq!(info["bytes"], built["file_bytes"]);
    assert_eq!(info["preset"], "fast");
    has_numbers(&info, "build", &["inner_nodes", "leaves", "references", "depth"]);
    let names: Vec<_> = info["sections"].as_array().unwrap().iter().map(|s| &s["name"]).collect();
    assert_eq!(names, ["TREE", "KIND", "ENDS", "NUMS", "stat", "view"]);
    let text = String::from_utf8(run(&["info", file])).unwrap();
    assert!(text.contains("a saved scene, ") && text.contains("treelets and blocks"), "{text}");

    // The same rays cost the same as over the scene itself.
    let bench = |scene: &str, preset: &[&str]| {
        let args = ["bench", scene, "--side", "32", "--rounds", "1", "--threads", "1", "--json"];
        json(&[&args, preset].concat())
    };
    let (saved, built) = (bench(file, &[]), bench("spd:balls:2", &["--preset", "fast"]));
    assert_eq!(saved["preset"], "fast");
    for (saved, built) in [(&saved, &built)].iter().flat_map(|(a, b)| {
        let of = |json: &Value| json["workloads"].as_array().unwrap().clone();
        of(a).into_iter().zip(of(b))
    }) {
        assert_eq!(saved["rays"], built["rays"]);
        assert_eq!(saved["per_ray"], built["per_ray"]);
    }
    // Saved again with other threads: not a byte differs.
    let before = std::fs::read(folder.path().join(file)).unwrap();
    run(&["build", "spd:balls:2", "--save", file, "--preset", "fast", "--threads", "2"]);
    assert_eq!(std::fs::read(folder.path().join(file)).unwrap(), before);
}

#[test]
fn a_file_that_is_no_saved_scene_is_refused_in_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |args: &[&str], code: i32| {
        let output = ropewalk(folder.path(), args);
        assert_eq!(output.status.code(), Some(code), "{args:?}: {}", stderr(&output));
        let sentence = stderr(&output);
        assert_eq!(sentence.lines().count(), 1, "{sentence}");
        sentence
    };
    assert!(refused(&["info", "no.rope"], 1).contains("cannot open no.rope: "));
    std::fs::write(folder.path().join("a.nff"), "v\n").unwrap();
    let sentence = refused(&["info", "a.nff"], 1);
    assert!(sentence.contains("a.nff:2:1: expected the view's from"), "{sentence}");
    assert!(refused(&["info", "a.nff", "--verify"], 2).contains("--verify is for saved scenes"));
    assert!(
        ropewalk(folder.path(), &["build", "spd:tetra:2", "--save", "a.rope"]).status.success()
    );
    let path = folder.path().join("a.rope");
    let mut bytes = std::fs::read(&path).unwrap();
    let last = bytes.len() - 64;
    std::fs::write(&path, &bytes[..last]).unwrap();
    for command in ["info", "bench"] {
        assert!(refused(&[command, "a.rope"], 1).contains("the file is cut off: expected "));
    }
    let tree = 192 + 64 * 5;
    bytes[tree + 64] ^= 1;
    std::fs::write(&path, &bytes).unwrap();
    let sentence = refused(&["info", "a.rope", "--verify"], 1);
    assert!(
        sentence.contains("section TREE, offset ") && sentence.contains("altered"),
        "{sentence}"
    );
    assert!(refused(&["bench", "a.rope", "--preset", "fast"], 2).contains("--preset"));
    assert!(
        refused(&["build", "spd:tetra:2", "--save", "b", "--preset", "x"], 2).contains("balanced")
    );
    assert!(refused(&["build", "spd:tetra:2", "--save", "no/b"], 1).contains("cannot save no/b: "));
    assert_eq!(files(folder.path()), ["a.nff", "a.rope"]);
}

#[test]
fn scenes_of_double_precision_are_shown() {
    let seeds = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus-seed/file");
    let output = ropewalk(&seeds, &["info", "double.rope", "--verify", "--json"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let info: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&info["precision"], &info["degenerate"]), (&"double".into(), &1.into()));
    assert!(info["bounds"][0][0].as_f64().unwrap() >= 1e7);
    let names: Vec<_> = info["sections"].as_array().unwrap().iter().map(|s| &s["name"]).collect();
    assert_eq!(names, ["TREE", "VERT", "FACE", "DBOX", "FLAT", "stat"]);
    let text = String::from_utf8(ropewalk(&seeds, &["info", "double.rope"]).stdout).unwrap();
    assert!(text.contains("double precision") && text.contains("vertices in f64"), "{text}");
    let output = ropewalk(&seeds, &["bench", "double.rope"]);
    assert!(!output.status.success());
    assert!(stderr(&output).contains("one of single precision is needed here"));
}

const FOUR: &str = "v 0 0 0\nv 4 0 0\nv 0 4 0\nv 0 0 4\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

/// Frames that are whole are kept, others are made anew, and are what they would have been.
#[test]
fn a_turntable_goes_on_where_it_was_interrupted() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    std::fs::write(place("four.obj"), FOUR).unwrap();
    let turn = || {
        let args = "render four.obj --size 24x16 --samples 2 --turntable 3 -o a.png --json";
        let output = ropewalk(folder.path(), &args.split(' ').collect::<Vec<_>>());
        assert!(output.status.success(), "{}", stderr(&output));
        let json: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
        (json["kept"].as_u64().unwrap(), json["pictures"].as_array().unwrap().len())
    };
    assert_eq!(turn(), (0, 3));
    let names = ["a.0000.png", "a.0001.png", "a.0002.png"];
    assert_eq!(files(folder.path()), [&names[..], &["four.obj"]].concat());
    let whole = names.map(|name| std::fs::read(place(name)).unwrap());
    assert!(whole[0] != whole[1] && whole[1] != whole[2]);
    std::fs::remove_file(place(names[0])).unwrap();
    std::fs::write(place(names[2]), &whole[2][..whole[2].len() / 2]).unwrap();
    assert_eq!(turn(), (1, 2));
    assert_eq!(names.map(|name| std::fs::read(place(name)).unwrap()), whole);
    assert_eq!(turn(), (3, 0));
}

#[cfg(unix)]
#[test]
fn an_interrupt_of_paths_leaves_whole_pictures() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("four.obj"), FOUR).unwrap();
    let interrupted = |signal: &str, extra: &[&str]| {
        let args = ["render", "four.obj", "--size", "300x200", "--samples", "1000000"];
        let child = Command::new(env!("CARGO_BIN_EXE_ropewalk"))
            .current_dir(folder.path())
            .args([&args, extra].concat())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(2500));
        let kill = Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
        assert!(kill.success());
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
        assert!(stderr(&output).contains("interrupted"), "{}", stderr(&output));
        stderr(&output)
    };
    interrupted("-INT", &["--turntable", "2", "-o", "frame.png"]);
    assert_eq!(files(folder.path()), ["four.obj"]);
    // A later frame that is there counts too.
    let later = ropewalk(
        folder.path(),
        &["render", "four.obj", "--size", "300x200", "--samples", "1", "-o", "frame.0001.png"],
    );
    assert!(later.status.success(), "{}", stderr(&later));
    let said = interrupted("-TERM", &["--turntable", "2", "-o", "frame.png"]);
    assert!(said.contains("1 of 2 frames are there"), "{said}");
    std::fs::remove_file(folder.path().join("frame.0001.png")).unwrap();
    interrupted("-TERM", &["-o", "a.png"]);
    let left = files(folder.path());
    let path = folder.path().join("a.png");
    assert!(left == ["four.obj"] || ropewalk_render::path::is_whole_picture(&path, [300, 200]));
    assert!(left.len() <= 2, "{left:?}");
}

#[test]
fn a_time_limit_ends_a_picture_with_what_it_has() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("four.obj"), FOUR).unwrap();
    let args = "render four.obj --size 64x64 --seconds 0.2 --environment no.hdr -o a.png --json";
    let args: Vec<_> = args.split(' ').collect();
    let output = ropewalk(folder.path(), &args);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("no.hdr: cannot read it"), "{}", stderr(&output));
    let without: Vec<_> = [&args[..6], &args[8..]].concat();
    let output = ropewalk(folder.path(), &without);
    assert!(output.status.success(), "{}", stderr(&output));
    let json: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert!(json["samples"].as_u64().unwrap() >= 1, "{json}");
}

/// Mesh files are read wherever scenes are, and hit from both sides.
#[test]
fn mesh_files_are_rendered_and_timed() {
    let folder = tempfile::tempdir().unwrap();
    let text = "v 0 0 0\nv 4 0 0\nv 0 4 0\nv 0 0 4\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n";
    std::fs::write(folder.path().join("four.obj"), text).unwrap();
    let args = ["render", "four.obj", "--size", "40x30", "-o", "a.png", "--json"];
    let output = ropewalk(folder.path(), &args);
    assert!(output.status.success(), "{}", stderr(&output));
    let json: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert!(json["rays"]["primary_hits"].as_u64().unwrap() > 100, "{json}");
    assert_eq!((&json["method"], &json["samples"]), (&"paths".into(), &64.into()));
    let share = json["traversal_share"].as_f64().unwrap();
    assert!(share > 0.0 && share < 1.0 && json["mrays"].as_f64().unwrap() > 0.0, "{json}");
    // The content tells, where the name does not.
    std::fs::write(folder.path().join("four"), text).unwrap();
    let args = ["render", "four", "--size", "40x30", "-o", "four.png", "--json"];
    let output = ropewalk(folder.path(), &args);
    let json: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert_eq!(json["method"], "paths");
    let picture = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert!(picture("a.png") == picture("four.png"));
    let args = ["render", "four.obj", "--size", "40x30", "-o", "b.png", "--whitted", "--json"];
    let output = ropewalk(folder.path(), &args);
    let json: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert!(json["rays"]["refraction"].is_number(), "{json}");
    let args = ["bench", "four.obj", "--side", "16", "--rounds", "1", "--json"];
    let output = ropewalk(folder.path(), &args);
    assert!(output.status.success(), "{}", stderr(&output));
    std::fs::write(folder.path().join("cut.obj"), "v 0 0 0\nf 1 2").unwrap();
    let output = ropewalk(folder.path(), &["stats", "cut.obj"]);
    assert!(!output.status.success());
    let message = stderr(&output);
    assert!(
        message.contains("cut.obj: line 2: expected a face of at least 3 corners"),
        "{message}"
    );
}

/// A cube without one side, of two materials, and a vertex of its own.
const BOX: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 0.1\nv 9 9 9\n\
    vn 0 0 1\nusemtl paint\nf 1//1 3 4 2\nf 1 2 6 5\nf 3 7 8 4\nusemtl other\nf 1 5 7 3\nf 2 4 8 6\n";

/// A triangle in glTF that three nodes place.
const PLACED: &str = r#"{"asset":{"version":"2.0"},"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
    "nodes":[{"mesh":0},{"mesh":0,"translation":[2,0,0],"children":[2]},{"mesh":0,"translation":[2,0,0]}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],
    "bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,
    "uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;

#[test]
fn meshes_are_explained() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.obj"), BOX).unwrap();
    std::fs::write(folder.path().join("a.mtl"), "newmtl paint\nKd 1 0 0\nmap_Kd ../a.png\n")
        .unwrap();
    let run = |args: &[&str]| {
        let output = ropewalk(folder.path(), args);
        assert!(output.status.success(), "{args:?}: {}", stderr(&output));
        String::from_utf8(output.stdout).unwrap()
    };
    let json: Value = serde_json::from_str(&run(&["info", "a.obj", "--json"])).unwrap();
    assert_eq!((&json["kind"], &json["format"]), (&"mesh".into(), &"OBJ".into()));
    assert_eq!((&json["vertices"], &json["triangles"]), (&9.into(), &10.into()));
    assert_eq!(json["bounds"][1], serde_json::json!([9.0, 9.0, 9.0]));
    assert_eq!(json["materials"][1], serde_json::json!({"name": "other", "triangles": 4}));
    assert_eq!((&json["closed"], &json["normals"]), (&false.into(), &true.into()));
    let defects = &json["defects"];
    assert_eq!((&defects["boundary_edges"], &defects["boundary_loops"]), (&4.into(), &1.into()));
    assert_eq!((&defects["isolated_vertices"], &defects["turned_edges"]), (&1.into(), &0.into()));
    let skipped = json["skipped"].to_string();
    assert!(
        skipped.contains("textures, expected a file in this folder")
            && skipped.contains(": ../a.png"),
        "{skipped}"
    );
    assert!(skipped.contains("materials that no library of the file has: other"), "{skipped}");
    let text = run(&["info", "a.obj"]);
    for part in [
        "a mesh in OBJ",
        "not closed",
        "  not read              textures, expected a file",
        "paint ",
    ] {
        assert!(text.contains(part), "{text}");
    }
    assert!(!text.contains("placed"), "one mesh where it is: {text}");
    std::fs::write(folder.path().join("b.gltf"), PLACED).unwrap();
    let json: Value = serde_json::from_str(&run(&["info", "b.gltf", "--json"])).unwrap();
    assert_eq!((&json["meshes"], &json["placements"]), (&1.into(), &3.into()));
    assert_eq!((&json["vertices"], &json["triangles"]), (&9.into(), &3.into()));
    let text = run(&["info", "b.gltf"]);
    let line = |what: &str| text.lines().find(|line| line.trim_start().starts_with(what)).unwrap();
    assert!(line("meshes").ends_with(" 1") && line("placed").ends_with(" 3"), "{text}");
    let scene: Value = serde_json::from_str(&run(&["info", "spd:balls:1", "--json"])).unwrap();
    assert_eq!((&scene["kind"], &scene["spheres"]), (&"scene".into(), &10.into()));
    std::fs::write(folder.path().join("x"), "Dear reader").unwrap();
    let output = ropewalk(folder.path(), &["info", "x"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        stderr(&output).contains("x: expected a scene in NFF or a mesh"),
        "{}",
        stderr(&output)
    );
    assert!(stderr(&output).contains("found text of an unknown kind"), "{}", stderr(&output));
}

#[test]
fn meshes_are_converted_whole_or_not_at_all() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("a.obj"), BOX).unwrap();
    let run = |args: &[&str]| ropewalk(folder.path(), args);
    for name in ["b.ply", "b.stl", "b.off", "b.glb", "b.obj"] {
        let output = run(&["convert", "a.obj", name, "--json"]);
        assert!(output.status.success(), "{name}: {}", stderr(&output));
        let json: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(json["triangles"], 10);
        let lost = json["lost"].to_string();
        assert!(lost.contains("materials (2)") && lost.contains("normals"), "{lost}");
        assert_eq!(lost.contains("beyond single precision"), name == "b.stl" || name == "b.glb");
        assert_eq!(lost.contains("share vertices"), name == "b.stl");
        let info = run(&["info", name, "--json"]);
        let info: Value = serde_json::from_slice(&info.stdout).unwrap();
        assert_eq!(
            (&info["triangles"], &info["defects"]["boundary_edges"]),
            (&10.into(), &4.into())
        );
    }
    // What is generated like what is read.
    let output = run(&["convert", "stage:room:1", "room.ply", "--json"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    for (file, format) in [("stage:room:1", "generated"), ("room.ply", "PLY")] {
        let info = run(&["info", file, "--json"]);
        assert!(info.status.success(), "{}", stderr(&info));
        let info: Value = serde_json::from_slice(&info.stdout).unwrap();
        assert_eq!(info["triangles"], json["triangles"]);
        assert_eq!((&info["format"], &info["kind"]), (&format.into(), &"mesh".into()));
    }
    let text = stderr(&run(&["convert", "a.obj", "b.stl"]));
    assert!(
        text.contains("b.stl: 10 triangles, 584 bytes") && text.contains("lost: normals"),
        "{text}"
    );
    // Triangles with vertices of their own, merged only if asked.
    let merged = |args: &[&str]| -> Value {
        let output = run(&[&["convert", "b.stl", "m.off", "--json"], args].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        serde_json::from_slice(&output.stdout).unwrap()
    };
    let json = merged(&[]);
    assert_eq!((&json["vertices"], &json["merged"]), (&30.into(), &Value::Null));
    let json = merged(&["--merge"]);
    assert_eq!((&json["vertices"], &json["merged"]), (&8.into(), &22.into()));
    assert_eq!(json["triangles"], 10);
    let json = merged(&["--merge=0.15"]);
    assert_eq!((&json["vertices"], &json["merged"]), (&7.into(), &23.into()));
    let text = stderr(&run(&["convert", "--merge", "b.stl", "m.off"]));
    assert!(text.contains("merged: 22 vertices, 8 are left"), "{text}");
    let before = files(folder.path());
    let refused = |args: &[&str], code: i32, part: &str| {
        let output = run(args);
        assert_eq!(output.status.code(), Some(code), "{args:?}");
        assert!(stderr(&output).contains(part), "{}", stderr(&output));
    };
    std::fs::write(path("bad.obj"), "v 0 0 0\nf 1 2 3\n").unwrap();
    std::fs::write(path("s.nff"), "s 0 0 0 1\n").unwrap();
    for distance in ["--merge=-1", "--merge=nan", "--merge=inf"] {
        refused(&["convert", "a.obj", "c.off", distance], 2, "expected a distance that is finite");
    }
    refused(&["convert", "a.obj", "c.off", "--merge=x"], 2, "invalid");
    refused(&["convert", "a.obj", "./a.obj"], 2, "the input itself is not overwritten");
    refused(&["convert", "a.obj", "c.fbx"], 2, "expected a name that ends in .obj");
    refused(&["convert", "a.obj", "c.obj.gz"], 2, "expected a name that ends in .obj");
    refused(&["convert", "bad.obj", "c.ply"], 1, "bad.obj: line 2: expected a vertex from 1 to 1");
    refused(&["convert", "s.nff", "c.ply"], 1, "found a scene in NFF");
    refused(&["convert", "spd:balls:1", "c.ply"], 1, "found a scene in NFF");
    refused(&["convert", "stage:hall", "c.ply"], 1, "expected a built-in stage (room), found");
    refused(&["info", "stage:hall"], 1, "expected a built-in stage (room), found");
    refused(&["convert", "no.obj", "c.ply"], 1, "there is no such file");
    refused(&["convert", "a.obj", "no/c.ply"], 1, "cannot write no/c.ply");
    let after: Vec<String> =
        files(folder.path()).into_iter().filter(|n| n != "bad.obj" && n != "s.nff").collect();
    assert_eq!(after, before);
    assert_eq!(std::fs::read_to_string(path("a.obj")).unwrap(), BOX);
}

/// `ropewalk ... | head -1`: who closes the pipe has seen enough.
#[test]
fn a_closed_pipe_is_no_error() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("four.obj"), FOUR).unwrap();
    let small = "--size 8x8 --samples 1 -o a.png";
    let commands = [
        "stats spd:tetra:2".to_owned(),
        "validate spd:tetra:2".to_owned(),
        "render spd:tetra:2 --size 8x8 -o a.png".to_owned(),
        format!("render four.obj {small}"),
        "build spd:tetra:2 --save a.rope".to_owned(),
        "info a.rope".to_owned(),
        "info four.obj".to_owned(),
        "info four.obj --json".to_owned(),
        format!("render four.obj {small} --json"),
        "scene tetra --size 2".to_owned(),
    ];
    for command in &commands {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output = Command::new(env!("CARGO_BIN_EXE_ropewalk"))
            .current_dir(folder.path())
            .args(command.split(' '))
            .stdout(writer)
            .output()
            .unwrap();
        assert!(output.status.success(), "{command}: {}", stderr(&output));
    }
}
