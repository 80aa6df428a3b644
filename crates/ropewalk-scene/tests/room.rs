//! The generated interior: sizes, sound lists, and that nothing but its windows lets light in.

use ropewalk::build::{BuildSettings, Preset};
use ropewalk::kernel::BatchCaster;
use ropewalk::wide::WideTree;
use ropewalk::{Geometry, Ray};
use ropewalk_scene::room::{SIZES, STANDARD_SIZE, room};
use ropewalk_scene::{Builtin, Loaded, NffLimits, Stage, load, parse_builtin};
use std::sync::LazyLock;

static SMALL: LazyLock<Stage> = LazyLock::new(|| room(2).expect("a size"));

/// Corners of the windows in the wall at `x = 0`: heights, then places along `z`.
const HEIGHTS: [f64; 2] = [0.42, 2.5];
const WINDOWS: [[f64; 2]; 2] = [[0.95, 2.45], [3.35, 4.85]];

#[test]
fn sizes_reach_from_ten_thousand_to_a_million_and_more() {
    let faces = |size| room(size).expect("a size").mesh.faces.len();
    let counts = [1, STANDARD_SIZE, *SIZES.end()].map(faces);
    assert_eq!(counts, COUNTS);
    assert!(room(0).is_none() && room(SIZES.end() + 1).is_none());
}

#[test]
fn lists_hold_together_and_are_the_same_each_time() {
    let made = &*SMALL;
    let faces = made.mesh.faces.len();
    assert_eq!(
        [made.normals.len(), made.uvs.len(), made.colors.len(), made.material.len()],
        [faces; 4]
    );
    assert!(made.mesh.vertices.iter().flatten().all(|x| x.is_finite() && x.abs() < 10.0));
    for (face, normals) in made.normals.iter().enumerate() {
        let lengths = normals.map(|n| n.iter().map(|x| x * x).sum::<f32>().sqrt());
        assert!(lengths.iter().all(|l| (l - 1.0).abs() < 1e-3), "face {face}: {lengths:?}");
    }
    let textures =
        made.materials.iter().filter_map(|m| m.base_color_texture.or(m.emission_texture));
    assert!(textures.into_iter().all(|t| (t.image as usize) < made.images.len()));
    assert!(made.material.iter().all(|&m| (m as usize) < made.materials.len()));
    assert!(*made == room(2).expect("a size"));
}

/// Smooth normals point to where faces do. At rims a coarse face turns by more than a right angle.
#[test]
fn normals_agree_with_faces() {
    let made = &*SMALL;
    let mut against = 0;
    for (face, normals) in made.mesh.faces.iter().zip(&made.normals) {
        let [a, b, c] = face.map(|i| made.mesh.vertices[i as usize]);
        let [e, f] = [b, c].map(|p| [0, 1, 2].map(|k| p[k] - a[k]));
        let n = [e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]];
        let dot = |m: &[f32; 3]| (0..3).map(|k| n[k] * f64::from(m[k])).sum::<f64>();
        against += usize::from(normals.iter().map(dot).sum::<f64>() < 0.0);
    }
    assert!(against < made.mesh.faces.len() / 300, "{against} of {}", made.mesh.faces.len());
}

/// Rays from all over the room that meet nothing leave by a window.
#[test]
fn light_gets_in_by_the_windows_alone() {
    let mesh = &SMALL.mesh;
    let vertices: Vec<[f32; 3]> = mesh.vertices.iter().map(|v| v.map(|x| x as f32)).collect();
    let geometry = Geometry::from_triangles(&vertices, &mesh.faces).expect("triangles");
    let settings = BuildSettings::preset(Preset::Balanced);
    let (tree, _) = WideTree::build(&geometry, &settings, &()).expect("built");
    let mut state = 1u64;
    let mut next = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1 << 24) as f32
    };
    let rays: Vec<Ray> = (0..200_000)
        .map(|_| {
            let origin = [0.3 + 4.8 * next(), 0.3 + 2.2 * next(), 0.3 + 6.0 * next()];
            Ray::new(origin, [next() - 0.5, next() - 0.5, next() - 0.5])
        })
        .collect();
    let blocked = BatchCaster::new(&tree, &geometry).occluded(&rays);
    let mut free = 0;
    for (ray, _) in rays.iter().zip(blocked).filter(|(_, blocked)| !blocked) {
        let at = ray.at(-ray.origin[0] / ray.dir[0]);
        let within = |x: f64, [low, high]: [f64; 2]| (low - 1e-4..=high + 1e-4).contains(&x);
        let is_window = within(at[1], HEIGHTS) && WINDOWS.iter().any(|&w| within(at[2], w));
        assert!(ray.dir[0] < 0.0 && is_window, "{ray:?}");
        free += 1;
    }
    assert!(free > 1000, "{free}");
}

#[test]
fn names_are_those_of_the_command() {
    assert_eq!(parse_builtin("stage:room").unwrap(), Some(Builtin::Room(STANDARD_SIZE)));
    assert_eq!(parse_builtin("stage:room:7").unwrap(), Some(Builtin::Room(7)));
    assert_eq!(parse_builtin("room").unwrap(), None);
    let refused = |spec: &str| parse_builtin(spec).unwrap_err().to_string();
    assert_eq!(
        refused("stage:hall"),
        "stage:hall: expected a built-in stage (room), found \"hall\""
    );
    for size in ["0", "17", "-1", "x", ""] {
        let spec = format!("stage:room:{size}");
        let expected = format!("{spec}: expected a size from 1 to 16 for room, found \"{size}\"");
        assert_eq!(refused(&spec), expected);
    }
    let loaded = load("stage:room:1", &NffLimits::default()).unwrap();
    assert!(
        matches!(loaded, Loaded::Mesh(name, mesh) if name == "stage:room:1" && mesh.faces.len() == COUNTS[0])
    );
}

/// Triangles at sizes 1, 8 and 16.
const COUNTS: [usize; 3] = [21_274, 416_822, 1_475_310];
