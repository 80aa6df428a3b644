//! `ropewalk paper` through the command: the shape of its JSON, its report, its exit codes.

use serde_json::Value;
use std::process::{Command, Output};

fn ropewalk(args: &[&str]) -> Output {
    let program = env!("CARGO_BIN_EXE_ropewalk");
    Command::new(program).args(args).output().expect("the command starts")
}

fn number(value: &Value, path: &str) -> f64 {
    let found = value.pointer(path).unwrap_or_else(|| panic!("{path} is missing"));
    found.as_f64().unwrap_or_else(|| panic!("{path} is {found}, no number"))
}

#[test]
fn a_small_run_prints_one_object_and_writes_the_report() {
    let folder = tempfile::tempdir().unwrap();
    let report = folder.path().join("report.html");
    let output = ropewalk(&[
        "paper",
        "--size",
        "small",
        "--scenes",
        "tetra",
        "--rays",
        "2000",
        "--sensitivity",
        "--json",
        "-o",
        report.to_str().unwrap(),
    ]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let json: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    check_scene(&json["scenes"][0]);
    assert_eq!(json["scenes"].as_array().unwrap().len(), 1);
    assert_eq!(json["sensitivity"].as_array().unwrap().len(), 16);
    assert_eq!(json["scaling"].as_array().unwrap().len(), 0);
    assert!(json["verdicts"].as_array().unwrap().len() >= 15);
    for key in ["version", "date", "command"] {
        assert!(json[key].is_string(), "{key}");
    }
    assert!(json["machine"]["cpu"].is_string() && json["headline"]["sentence"].is_string());
    let page = std::fs::read_to_string(&report).unwrap();
    assert!(page.starts_with("<!DOCTYPE html>") && page.ends_with("</html>\n"));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "no temporary file is left");
}

fn check_scene(scene: &Value) {
    assert_eq!(scene["name"], "tetra");
    assert_eq!(number(scene, "/objects"), 1024.0);
    assert_eq!(number(scene, "/rays/primary"), 513.0 * 513.0);
    for key in ["primary_hits", "reflection", "refraction", "shadow", "shadow_hits"] {
        number(scene, &format!("/rays/{key}"));
    }
    let methods = scene["methods"].as_array().unwrap();
    let find = |name: &str| methods.iter().find(|m| m["name"] == name).unwrap();
    for method in methods {
        check_method(method);
    }
    let (naive, reference) = (find("naive"), find("macdonald-booth-1990"));
    assert_eq!(number(naive, "/per_ray/intersection_tests"), 1024.0);
    for figure in ["operations", "time", "size"] {
        assert_eq!(number(reference, &format!("/ratio_to_macdonald_booth/{figure}")), 1.0);
    }
    assert!(number(naive, "/ratio_to_macdonald_booth/operations") > 10.0);
    assert!(number(find("rope-trees"), "/per_ray/rope_crossings") > 0.0);
    assert!(number(find("rope-trees"), "/per_ray/rope_tree_steps") > 0.0);
}

fn check_method(method: &Value) {
    for path in [
        "/tree/inner_nodes",
        "/tree/leaves",
        "/tree/empty_leaves",
        "/tree/references",
        "/tree/depth",
        "/tree/bytes",
        "/tree/build_seconds",
        "/per_ray/intersection_tests",
        "/per_ray/traversal_steps",
        "/per_ray/leaf_visits",
        "/per_ray/empty_leaf_visits",
        "/per_ray/rope_crossings",
        "/per_ray/rope_tree_steps",
        "/seconds/read",
        "/seconds/build",
        "/seconds/trace",
        "/ratio_to_macdonald_booth/operations",
        "/ratio_to_exact/operations",
        "/ratio_to_macdonald_booth/time",
        "/ratio_to_exact/time",
    ] {
        assert!(number(method, path) >= 0.0, "{path} of {}", method["name"]);
    }
    let per_ray = |key: &str| number(method, &format!("/per_ray/{key}"));
    let operations = per_ray("intersection_tests") + per_ray("traversal_steps");
    assert!((operations - number(method, "/operations")).abs() < 1e-9);
}

#[test]
fn wrong_uses_and_wrong_paths_are_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    let unknown = ropewalk(&["paper", "--scenes", "cornell"]);
    assert_eq!(unknown.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&unknown.stderr).contains("'cornell'"));
    let nowhere = folder.path().join("missing").join("report.html");
    let nowhere = ropewalk(&["paper", "--scenes", "tetra", "-o", nowhere.to_str().unwrap()]);
    assert_eq!(nowhere.status.code(), Some(1));
    assert!(nowhere.stdout.is_empty());
    let rays = ropewalk(&["paper", "--rays", "0"]);
    assert_eq!(rays.status.code(), Some(2));
}
