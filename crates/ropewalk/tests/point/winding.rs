//! Winding numbers.

use crate::meshes::{self, PLACES, points, queries, trees};
use ropewalk::point::PointBruteForce;
use ropewalk_testkit::rays::Draw;

#[test]
fn closed_surfaces_have_whole_numbers() {
    for place in PLACES {
        let mut draw = Draw::new(5000);
        let geometry = meshes::geometry(&meshes::nested(), place);
        let oracle = PointBruteForce { geometry: &geometry };
        let at = |r: f64| oracle.winding_number([r, 0.1, 0.05].map(|x| x * place.0 + place.1));
        for (r, expected) in [(0.1, 1.0), (0.55, 0.0), (0.85, 1.0), (1.5, 0.0)] {
            assert!((at(r) - expected).abs() < 1e-9, "{} at {r}", at(r));
        }
        let [tree, _] = trees(&mut draw, &geometry);
        let points = points(&mut draw, &geometry, 5);
        for queries in queries(&tree, &geometry) {
            let expected: Vec<f64> = points.iter().map(|&p| oracle.winding_number(p)).collect();
            assert_eq!(queries.winding_number(&points), expected);
        }
    }
}

#[test]
fn an_open_surface_and_the_middle_of_a_face() {
    // Half of a ball: seen from the centre it fills half of the sky.
    let mut half = meshes::ball(3, |_| 1.0);
    half.retain(|t| t.iter().all(|p| p[2] >= 0.0));
    let geometry = meshes::geometry(&half, (1.0, 0.0));
    let oracle = PointBruteForce { geometry: &geometry };
    assert!((oracle.winding_number([0.0; 3]) - 0.5).abs() < 1e-12);
    assert!((oracle.winding_number([0.0, 0.0, 0.9]) - 0.9).abs() < 0.1);
    let cube = meshes::geometry(&meshes::ball(0, |_| 1.0), (1.0, 0.0));
    let on_a_face = PointBruteForce { geometry: &cube }.winding_number([0.25, 0.25, 0.5]);
    assert!((on_a_face - 0.5).abs() < 1e-12);
}
