//! Hostile sets under every preset: references and nodes stay in proportion to the primitives.

use ropewalk::build::{BuildReport, BuildSettings, Preset, build};
use ropewalk::primitive::Triangle;
use ropewalk::{Geometry, Sides};

type Corners = [[f32; 3]; 3];

fn geometry(triangles: impl IntoIterator<Item = Corners>) -> Geometry {
    let mut geometry = Geometry::new();
    for vertices in triangles {
        geometry.push(Triangle { vertices }, Sides::Both).expect("finite triangle");
    }
    geometry
}

/// Uniform numbers in `0 ..= 1`.
fn uniform(state: &mut u32) -> f32 {
    *state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
    (*state >> 8) as f32 / (1u32 << 24) as f32
}

/// A fine wavy mesh over the unit square, `side * side` squares of two triangles.
fn mesh(side: usize) -> impl Iterator<Item = Corners> {
    let point = move |i: usize, j: usize| {
        let (x, y) = (i as f32 / side as f32, j as f32 / side as f32);
        [x, y, 0.05 * (12.0 * x).sin() * (9.0 * y).cos()]
    };
    (0..side * side).flat_map(move |k| {
        let (i, j) = (k % side, k / side);
        let [a, b, c, d] = [point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)];
        [[a, b, c], [a, c, d]]
    })
}

/// Builds with a preset and checks that no more than `duplication` references a primitive and
/// `nodes` inner nodes a primitive come out.
fn bounded(geometry: &Geometry, preset: Preset, duplication: f64, nodes: f64) -> BuildReport {
    let settings = BuildSettings { threads: 2, ..BuildSettings::preset(preset) };
    let (tree, report) = build(geometry, &settings, &()).expect("settings in range");
    tree.validate(geometry).unwrap_or_else(|fault| panic!("{preset:?}: {fault}"));
    let inner = report.tree.inner_nodes as f64 / geometry.len() as f64;
    assert!(report.duplication <= duplication, "{preset:?}: {report:?}");
    assert!(inner <= nodes, "{preset:?}: {report:?}");
    report
}

#[test]
fn everything_straddles_everything() {
    let mut state = 1;
    let mut point = || std::array::from_fn(|_| uniform(&mut state));
    let geometry = geometry((0..5000).map(|_| [point(), point(), point()]));
    for preset in Preset::ALL {
        bounded(&geometry, preset, 1.0, 0.0);
    }
}

#[test]
fn everything_coincides() {
    let slanted = [[0.0, 0.0, 0.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]];
    let flat = [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]];
    let point = [[1.0; 3]; 3];
    for same in [slanted, flat, point] {
        let geometry = geometry(std::iter::repeat_n(same, 50_000));
        for preset in Preset::ALL {
            bounded(&geometry, preset, 1.0, 0.0);
        }
    }
}

#[test]
fn one_gigantic_triangle_under_many_tiny_ones() {
    let gigantic = [[-1e6, -1e6, -1.0], [1e6, -1e6, 1.0], [0.0, 2e6, 0.0]];
    let geometry = geometry(std::iter::once(gigantic).chain(mesh(150)));
    for preset in Preset::ALL {
        bounded(&geometry, preset, 1.3, 0.5);
    }
}

#[test]
fn needles_through_a_fine_mesh() {
    let mut state = 7;
    let needles: Vec<Corners> = (0..500)
        .map(|_| {
            let mut end = |z: f32| [uniform(&mut state), uniform(&mut state), z];
            let (a, b) = (end(-0.05), end(0.05));
            [a, b, b.map(|x| x + 1e-4)]
        })
        .collect();
    let geometry = geometry(needles.into_iter().chain(mesh(120)));
    for preset in Preset::ALL {
        bounded(&geometry, preset, 4.0, 0.5);
    }
}

#[test]
fn a_fan_around_one_corner() {
    // All needles meet in one point: no plane parts them there.
    let spoke = |i: usize| {
        let angle = |k: usize| std::f32::consts::TAU * k as f32 / 20_000.0;
        let rim = |k: usize| [angle(k).cos(), angle(k).sin(), 0.1 * (7.0 * angle(k)).sin()];
        [[0.0; 3], rim(i), rim(i + 1)]
    };
    let geometry = geometry((0..20_000).map(spoke));
    for preset in Preset::ALL {
        bounded(&geometry, preset, 14.0, 0.5);
    }
}

#[test]
fn sizes_over_many_magnitudes() {
    // Ever smaller copies of one triangle towards a corner, and far larger ones around.
    let copies = (0..4000).map(|i| {
        let s = 1e6 * 0.99f32.powi(i);
        [[s, 0.0, 0.1 * s], [0.0, s, 0.2 * s], [0.5 * s, 0.5 * s, s]]
    });
    let geometry = geometry(copies);
    for preset in Preset::ALL {
        bounded(&geometry, preset, 4.0, 0.1);
    }
}
