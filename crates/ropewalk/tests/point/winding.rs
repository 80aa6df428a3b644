//! Winding numbers.

use crate::meshes::{self, PLACES, points, queries, trees};
use ropewalk::kernel::Level;
use ropewalk::point::{PointBruteForce, PointError, PointQueries};
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

/// Closed, open, nested, and no surface at all.
fn surfaces(draw: &mut Draw) -> Vec<meshes::Triangles> {
    let mut half = meshes::rough(draw);
    half.retain(|t| t.iter().all(|p| p[2] >= -0.2));
    let corner = |d: &mut Draw| [0; 3].map(|_| d.uniform(-1.0, 1.0));
    let soup = (0..900).map(|_| [0; 3].map(|_| corner(draw))).collect();
    vec![meshes::torus(24, 11), meshes::nested(), half, soup]
}

#[test]
fn moments_are_as_accurate_as_they_are_asked_to_be() {
    for (round, place) in PLACES.into_iter().enumerate() {
        let mut draw = Draw::new(5100 + round as u64);
        for triangles in surfaces(&mut draw) {
            let geometry = meshes::geometry(&triangles, place);
            let oracle = PointBruteForce { geometry: &geometry };
            let points = points(&mut draw, &geometry, 12);
            let exact: Vec<f64> = points.iter().map(|&p| oracle.winding_number(p)).collect();
            for tree in trees(&mut draw, &geometry) {
                let moments = PointQueries::new(&tree, &geometry).unwrap().winding_moments();
                for accuracy in [1.0, 0.1, 1e-3, 1e-5, f64::NAN] {
                    let mut first: Option<Vec<f64>> = None;
                    for queries in queries(&tree, &geometry) {
                        let found =
                            queries.winding_number_within(&moments, &points, accuracy).unwrap();
                        for ((w, e), point) in found.iter().zip(&exact).zip(&points) {
                            let off = (w - e).abs();
                            assert!(off <= accuracy.max(1e-10), "{off} > {accuracy} at {point:?}");
                        }
                        // The same bits at every level and with any number of threads.
                        assert_eq!(first.get_or_insert_with(|| found.clone()), &found);
                    }
                }
                for queries in queries(&tree, &geometry) {
                    let found = queries.contains_by_winding(&moments, &points).unwrap();
                    let expected: Vec<bool> = exact.iter().map(|&w| w > 0.5).collect();
                    assert_eq!(found, expected);
                }
            }
        }
    }
}

/// Where the number is .5 up to rounding, the sum decides: on faces, edges and vertices, over the
/// middle of a hole and beside all of them.
#[test]
fn numbers_near_one_half_are_decided_by_the_sum() {
    let mut draw = Draw::new(5200);
    let mut half = meshes::ball(4, |_| 1.0);
    half.retain(|t| t.iter().all(|p| p[2] >= 0.0));
    for triangles in [half, meshes::ball(4, |_| 1.0), meshes::torus(24, 11)] {
        let geometry = meshes::geometry(&triangles, (1.0, 0.0));
        let oracle = PointBruteForce { geometry: &geometry };
        let mut points = Vec::new();
        for k in 0..300 {
            let [a, b, c] = triangles[draw.below(triangles.len())];
            let (u, v) = (draw.uniform(0.0, 1.0), draw.uniform(0.0, 1.0));
            let on = |i: usize| match k % 3 {
                0 => a[i] + 0.5 * u * (b[i] - a[i]) + 0.5 * v * (c[i] - a[i]),
                1 => a[i] + u * (b[i] - a[i]),
                _ => f64::from(a[i] as f32),
            };
            points.push(std::array::from_fn(on));
            // Of half a ball the plane of the rim is the surface of .5 or close to it.
            let step = draw.uniform(-40.0, -8.0).exp2();
            points.push([draw.uniform(-0.7, 0.7), draw.uniform(-0.7, 0.7), step]);
            points.push([0.0, 0.0, draw.uniform(-1.0, 1.0) * step]);
        }
        let [tree, _] = trees(&mut draw, &geometry);
        let queries = PointQueries::new(&tree, &geometry).unwrap();
        let moments = queries.winding_moments();
        let found = queries.contains_by_winding(&moments, &points).unwrap();
        for (inside, &point) in found.iter().zip(&points) {
            assert_eq!(*inside, oracle.winding_number(point) > 0.5, "{point:?}");
        }
    }
}

#[test]
fn points_and_trees_without_an_answer() {
    let mut draw = Draw::new(5300);
    let geometry = meshes::geometry(&meshes::ball(3, |_| 1.0), (1.0, 0.0));
    let other = meshes::geometry(&meshes::torus(9, 9), (1.0, 0.0));
    let ([tree, _], [foreign, _]) = (trees(&mut draw, &geometry), trees(&mut draw, &other));
    let queries = PointQueries::new(&tree, &geometry).unwrap();
    let moments = queries.winding_moments();
    assert!(moments.fits(&tree) && moments.bytes() > 0);
    let nan = [[f64::NAN, 0.0, 0.0], [f64::INFINITY; 3], [1e101, 0.0, 0.0]];
    assert!(queries.winding_number_within(&moments, &nan, 0.1).unwrap().iter().all(|w| w.is_nan()));
    assert_eq!(queries.contains_by_winding(&moments, &nan), Ok(vec![false; 3]));
    let moments = PointQueries::new(&foreign, &other).unwrap().winding_moments();
    let refused = queries.winding_number_within(&moments, &nan, 0.1);
    assert_eq!(refused, Err(PointError::OtherTree));
    let empty = ropewalk::Geometry::new();
    let [tree, _] = trees(&mut draw, &empty);
    let queries = PointQueries::new(&tree, &empty).unwrap();
    let moments = queries.winding_moments();
    for level in Level::ALL.into_iter().filter_map(|level| queries.with_level(level)) {
        assert_eq!(level.winding_number_within(&moments, &[[0.0; 3]], 0.1), Ok(vec![0.0]));
    }
}
