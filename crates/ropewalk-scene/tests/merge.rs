//! Vertices that are merged when asked to.

use ropewalk::build::Monitor;
use ropewalk_scene::{MergeError, Mesh};

fn merged(vertices: &[[f64; 3]], distance: f64) -> (Mesh, usize) {
    let count = vertices.len() as u32;
    let faces = (0..count - 2).map(|i| [i, i + 1, i + 2]).collect();
    let mut mesh = Mesh { vertices: vertices.to_vec(), faces };
    let gone = mesh.merge_vertices(distance, &()).unwrap();
    assert_eq!(
        (mesh.vertices.len() + gone, mesh.faces.len()),
        (vertices.len(), vertices.len() - 2)
    );
    (mesh, gone)
}

#[test]
fn the_same_place() {
    let vertices = [
        [1.0, 2.0, 0.0],
        [5.0; 3],
        [1.0, 2.0, -0.0],
        [1.0, 2.0, 1e-300],
        [5.0; 3],
        [1.0, 2.0, 0.0],
    ];
    let (mesh, gone) = merged(&vertices, 0.0);
    assert_eq!((mesh.vertices, gone), (vec![[1.0, 2.0, 0.0], [5.0; 3], [1.0, 2.0, 1e-300]], 3));
    assert_eq!(mesh.faces, [[0, 1, 0], [1, 0, 2], [0, 2, 1], [2, 1, 0]], "those without area too");
}

#[test]
fn the_first_one_that_is_near() {
    // 1 joins 0, 2 is too far from 0 and is kept, 3 is near both and joins the first.
    let line = [0.0, 0.9, 1.8, 0.95, -1.0, 2.8].map(|x| [x, 0.0, 0.0]);
    let (mesh, gone) = merged(&line, 1.0);
    assert_eq!(mesh.vertices, [[0.0; 3], [1.8, 0.0, 0.0]]);
    assert_eq!((gone, &mesh.faces[..]), (4, &[[0, 0, 1], [0, 1, 0], [1, 0, 0], [0, 0, 1]][..]));
    // The distance itself is near; across, by Euclid.
    assert_eq!(merged(&[[0.0; 3], [3.0, 4.0, 0.0], [9.0; 3]], 5.0).1, 1);
    assert_eq!(merged(&[[0.0; 3], [3.0, 4.0, 1e-6], [9.0; 3]], 5.0).1, 0);
}

/// Against the rule, tried for all pairs: in clouds, on grids of the distance, far from the origin and in extreme numbers.
#[test]
fn as_the_rule_says() {
    let mut state = 7u64;
    let mut random = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    for (scale, offset, step, distance) in [
        (1.0, 0.0, 0.0, 0.05),
        (1.0, -0.5, 0.0, 0.3),
        (10.0, 0.0, 1.0, 1.0),
        (10.0, -5.0, 1.0, 2.0),
        (8.0, -4.0, 0.5, 0.25),
        (1e-3, 1e7, 0.0, 1e-4),
        (2e-8, 1e8, 0.0, 1.5e-8),
        (1e38, -5e37, 0.0, 1e37),
        (1e-300, 0.0, 0.0, 2e-301),
        (1.0, 0.0, 0.0, 5e-324),
        (1.0, 0.0, 0.0, 1e300),
    ] {
        let mut number = || {
            let x = offset + scale * random();
            if step > 0.0 { (x / step).round() * step } else { x }
        };
        let vertices: Vec<[f64; 3]> = (0..400).map(|_| [number(), number(), number()]).collect();
        let is_near = |a: &[f64; 3], b: &[f64; 3]| {
            (0..3).map(|i| ((a[i] - b[i]) / distance).powi(2)).sum::<f64>() <= 1.0
        };
        let mut kept: Vec<[f64; 3]> = Vec::new();
        let mut became = Vec::new();
        for vertex in &vertices {
            let first = kept.iter().position(|other| is_near(other, vertex));
            became.push(first.unwrap_or(kept.len()) as u32);
            if first.is_none() {
                kept.push(*vertex);
            }
        }
        let (mesh, _) = merged(&vertices, distance);
        assert_eq!(mesh.vertices, kept, "{scale} {offset} {step} {distance}");
        let faces: Vec<[u32; 3]> = became.windows(3).map(|w| [w[0], w[1], w[2]]).collect();
        assert_eq!(mesh.faces, faces, "{scale} {offset} {step} {distance}");
    }
}

struct Stop;

impl Monitor for Stop {
    fn is_cancelled(&self) -> bool {
        true
    }
}

#[test]
fn refused() {
    let mesh = Mesh { vertices: vec![[0.0; 3]; 3], faces: vec![[0, 1, 2]] };
    for distance in [-1.0, f64::NAN, f64::INFINITY, -f64::MIN_POSITIVE] {
        let mut same = mesh.clone();
        let error = same.merge_vertices(distance, &()).unwrap_err();
        assert!(error.to_string().starts_with("expected a distance that is finite and 0 or more"));
        assert_eq!(same, mesh);
    }
    for distance in [0.0, 1.0] {
        let mut same = mesh.clone();
        assert_eq!(same.merge_vertices(distance, &Stop), Err(MergeError::Cancelled));
        assert_eq!(same, mesh);
    }
}
