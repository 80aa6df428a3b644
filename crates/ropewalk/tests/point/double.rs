//! Points about triangles in `f64`: brute force, bit for bit, at any scale and distance from the origin.

use crate::meshes::{
    self, Triangles, check_trees, double_geometry, double_trees, points_around, queries,
    triangles_of,
};
use ropewalk::double::DoubleGeometry;
use ropewalk::point::{LARGEST, PointBruteForce, Side, Triangles as _};
use ropewalk_testkit::rays::Draw;

/// Scales and offsets: the usual ones, detail of a thousandth at ten million, and the ends of the numbers.
const PLACES: [(f64, f64); 8] = [
    (1.0, 0.0),
    (1e-6, 0.0),
    (1e6, 3e5),
    (10.0, 1e7),
    (1e-3, 1e7),
    (1e-3, -3e7),
    (1e90, 0.0),
    (1e-60, 0.0),
];

fn check(geometry: &DoubleGeometry, points: &[[f64; 3]]) {
    check_trees(&double_trees(geometry), geometry, points);
}

/// Triangles of all sizes down to far below the resolution of `f32`, slivers and copies among them.
fn soup(draw: &mut Draw, count: usize) -> Triangles {
    let mut triangles = Triangles::new();
    for _ in 0..count {
        let reach = 10f64.powf(draw.uniform(-10.0, -0.2));
        let centre: [f64; 3] = std::array::from_fn(|_| draw.uniform(-1.0, 1.0));
        let mut corner = || centre.map(|c| c + draw.uniform(-reach, reach));
        let (a, b, mut c) = (corner(), corner(), corner());
        if draw.chance(0.2) {
            let (t, width) = (draw.uniform(-0.2, 1.2), reach * draw.uniform(-30.0, -5.0).exp2());
            c = std::array::from_fn(|i| a[i] + t * (b[i] - a[i]) + draw.uniform(-width, width));
        }
        triangles.push([a, b, c]);
        if draw.chance(0.1) {
            triangles.push([b, c, a]);
        }
    }
    triangles
}

#[test]
fn soups_everywhere() {
    for (round, place) in PLACES.into_iter().enumerate() {
        let mut draw = Draw::new(9000 + round as u64);
        let geometry = double_geometry(&soup(&mut draw, 250), place);
        let points = points_around(&mut draw, &triangles_of(&geometry), 50);
        check(&geometry, &points);
    }
}

/// Ties everywhere, triangles without area and copies; odd steps, so that coordinates are rounded in `f32`.
#[test]
fn grids_with_ties() {
    for (round, (scale, offset)) in PLACES.into_iter().enumerate() {
        let mut draw = Draw::new(9100 + round as u64);
        let mut soup = Triangles::new();
        for _ in 0..150 {
            let mut corners: [[f64; 3]; 3] =
                std::array::from_fn(|_| draw.grid_point(4).map(f64::from));
            if draw.chance(0.1) {
                corners[2] = corners[draw.below(2)];
            }
            soup.push(corners);
        }
        let place = |x: f64| x / 3.0 * scale + offset;
        let moved = soup.iter().map(|t| t.map(|p| p.map(place))).collect();
        let geometry = double_geometry(&moved, (1.0, 0.0));
        assert!(geometry.degenerate_count() > 0);
        let grid = (0..300).map(|_| draw.grid_point(11).map(|x| place(f64::from(x) / 2.0)));
        let mut points: Vec<_> = grid.collect();
        points.extend(points_around(&mut draw, &moved, 20));
        check(&geometry, &points);
    }
}

/// A point beside the middle of a face, along its normal.
fn beside([a, b, c]: [[f64; 3]; 3], by: f64) -> [f64; 3] {
    let [e, f]: [[f64; 3]; 2] =
        [std::array::from_fn(|i| b[i] - a[i]), std::array::from_fn(|i| c[i] - a[i])];
    let cross = |i: usize, j: usize| e[i] * f[j] - e[j] * f[i];
    let normal = [cross(1, 2), cross(2, 0), cross(0, 1)];
    let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
    // Less is rounded than by the mean of the corners.
    std::array::from_fn(|i| a[i] + ((e[i] + f[i]) / 3.0 + by * normal[i] / length))
}

/// Cavities count, vertices are on the surface, and what lies beside faces does: by a billionth of the size, or a
/// few steps of `f64` where there is an offset.
#[test]
fn sides_of_closed_surfaces() {
    for (round, (scale, offset)) in PLACES[..6].iter().copied().enumerate() {
        let mut draw = Draw::new(9200 + round as u64);
        for triangles in [meshes::torus(16, 9), meshes::nested(), meshes::rough(&mut draw)] {
            let geometry = double_geometry(&triangles, (scale, offset));
            let triangles = triangles_of(&geometry);
            let mut points = points_around(&mut draw, &triangles, 20);
            check(&geometry, &points);
            let oracle = PointBruteForce { geometry: &geometry };
            let near = 1e-7 * scale;
            points.retain(|&p| oracle.closest_point(p).unwrap().distance > near);
            for &point in &points {
                let inside = oracle.winding_number(point).round() as i64 % 2 != 0;
                let expected = if inside { Side::Inside } else { Side::Outside };
                assert_eq!(oracle.side(point), expected, "{point:?}");
            }
            let by = (1e-9 * scale).max(4.0 * f64::EPSILON * offset.abs());
            let (mut beside_faces, mut expected) = (Vec::new(), Vec::new());
            for &[a, b, c] in triangles.iter().step_by(3) {
                beside_faces.extend([a, beside([a, b, c], by), beside([a, b, c], -by)]);
                expected.extend([Side::On, Side::Outside, Side::Inside]);
            }
            let [tree, _] = double_trees(&geometry);
            for queries in queries(&tree, &geometry) {
                assert_eq!(queries.sides(&beside_faces), expected, "{scale} {offset}");
            }
        }
    }
}

/// Two shells a thousandth apart at ten million: between them, and nowhere else, is inside.
#[test]
fn a_thin_shell_far_from_the_origin() {
    let place = (1e3, 1e7);
    let outer = meshes::ball(2, |_| 1.0);
    let cavity = meshes::ball(2, |_| 1.0 - 1e-6);
    let turned: Triangles = cavity.into_iter().map(|[a, b, c]| [a, c, b]).collect();
    let shell: Triangles = outer.into_iter().chain(turned).collect();
    let geometry = double_geometry(&shell, place);
    let points: Vec<[f64; 3]> =
        triangles_of(&geometry)[..128].iter().map(|&t| beside(t, -5e-4)).collect();
    let within: Vec<[f64; 3]> =
        triangles_of(&geometry)[..128].iter().map(|&t| beside(t, -2e-3)).collect();
    let [tree, _] = double_trees(&geometry);
    for queries in queries(&tree, &geometry) {
        assert!(queries.contains(&points).iter().all(|&inside| inside));
        assert!(!queries.contains(&within).contains(&true));
        for (point, distance) in points.iter().zip(queries.signed_distance(&points)) {
            assert!((-6e-4..=-4e-4).contains(&distance), "{distance} of {point:?}");
        }
    }
}

/// The nearest point lies on its triangle, and no triangle is nearer.
#[test]
fn answers_are_those_of_geometry() {
    for (scale, offset) in PLACES[..6].iter().copied() {
        let mut draw = Draw::new(9300);
        let geometry = double_geometry(&soup(&mut draw, 80), (scale, offset));
        let triangles = triangles_of(&geometry);
        let oracle = PointBruteForce { geometry: &geometry };
        for point in points_around(&mut draw, &triangles, 20) {
            let nearest = oracle.closest_point(point).unwrap();
            let length =
                |q: [f64; 3]| (0..3).map(|i| (point[i] - q[i]).powi(2)).sum::<f64>().sqrt();
            let slack = 1e-13 * (scale + nearest.distance) + 4.0 * f64::EPSILON * offset.abs();
            assert!((length(nearest.point) - nearest.distance).abs() <= slack);
            for (id, [a, b, c]) in triangles.iter().enumerate() {
                if !geometry.has_area(id as u32) {
                    continue;
                }
                let (u, v) = (draw.uniform(0.0, 1.0), draw.uniform(0.0, 1.0));
                let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                let q = std::array::from_fn(|i| a[i] + u * (b[i] - a[i]) + v * (c[i] - a[i]));
                assert!(length(q) >= nearest.distance - slack);
            }
        }
    }
}

#[test]
fn winding_numbers() {
    for (round, place) in PLACES.into_iter().enumerate() {
        let mut draw = Draw::new(9400 + round as u64);
        let mut half = meshes::rough(&mut draw);
        half.retain(|t| t.iter().all(|p| p[2] >= -0.2));
        for triangles in [meshes::nested(), half, soup(&mut draw, 400)] {
            let geometry = double_geometry(&triangles, place);
            let points = points_around(&mut draw, &triangles_of(&geometry), 8);
            let oracle = PointBruteForce { geometry: &geometry };
            let exact: Vec<f64> = points.iter().map(|&p| oracle.winding_number(p)).collect();
            let [tree, _] = double_trees(&geometry);
            for queries in queries(&tree, &geometry) {
                assert_eq!(queries.winding_number(&points), exact);
                let moments = queries.winding_moments();
                for accuracy in [0.3, 0.01, 1e-5] {
                    let found = queries.winding_number_within(&moments, &points, accuracy).unwrap();
                    for ((found, exact), point) in found.iter().zip(&exact).zip(&points) {
                        assert!((found - exact).abs() <= accuracy, "{found} {exact} {point:?}");
                    }
                }
                let inside = queries.contains_by_winding(&moments, &points).unwrap();
                assert!(inside.iter().zip(&exact).all(|(&inside, &w)| inside == (w > 0.5)));
            }
        }
    }
}

#[test]
fn points_that_are_none_and_scenes_of_nothing() {
    let mut draw = Draw::new(9500);
    let (inf, nan) = (f64::INFINITY, f64::NAN);
    let bad = [[nan, 0.0, 0.0], [0.0, inf, 0.0], [0.0, 0.0, -inf], [0.0, 2.0 * LARGEST, 0.0]];
    for place in [(1.0, 0.0), (1e-60, 0.0), (1e90, 0.0)] {
        let geometry = double_geometry(&meshes::torus(12, 8), place);
        let mut points = points_around(&mut draw, &triangles_of(&geometry), 10);
        points.extend(bad);
        points.extend([[LARGEST; 3], [-LARGEST, 0.0, 1e-300], [0.0; 3], [-0.0; 3]]);
        check(&geometry, &points);
        let [tree, _] = double_trees(&geometry);
        for queries in queries(&tree, &geometry) {
            assert!(!bad.iter().any(|p| queries.is_near(p)) && queries.is_near(&[0.0; 3]));
            assert_eq!(queries.is_near(&[LARGEST; 3]), place.0 >= 1.0);
            assert!(queries.signed_distance(&bad).iter().all(|d| d.is_nan()));
            assert!(queries.closest_point(&bad).prim_id.iter().all(|&id| id == u32::MAX));
            assert!(!queries.contains(&bad).contains(&true));
            assert!(queries.winding_number(&bad).iter().all(|w| w.is_nan()));
        }
    }
    let line = [[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
    let nothing = double_geometry(&vec![line; 20], (1.0, 0.0));
    check(&nothing, &[[0.0; 3], [1.0, 0.0, 0.0]]);
    let [tree, _] = double_trees(&nothing);
    for queries in queries(&tree, &nothing) {
        assert_eq!(queries.distance(&[[0.5, 0.0, 0.0]]), [inf]);
    }
}

/// A cell holds what is found in it, but for the rounding of its corners.
#[test]
fn cells() {
    for (scale, offset) in PLACES {
        let mut draw = Draw::new(9600);
        let geometry = double_geometry(&meshes::torus(16, 9), (scale, offset));
        let points = points_around(&mut draw, &triangles_of(&geometry), 40);
        let [tree, _] = double_trees(&geometry);
        for queries in queries(&tree, &geometry) {
            let slack = 4.0 * f64::EPSILON * (scale + offset.abs());
            let (low, high) = geometry.bounds().unwrap();
            for (point, cell) in points.iter().zip(queries.locate(&points)) {
                let within = |[low, high]: [[f64; 3]; 2], slack: f64| {
                    (0..3).all(|a| low[a] - slack <= point[a] && point[a] <= high[a] + slack)
                };
                assert_eq!(cell.is_some(), within([low, high], 0.0), "{point:?}");
                let Some(cell) = cell else { continue };
                assert!(within(queries.cell_corners(cell).unwrap(), slack), "{point:?}");
            }
        }
    }
}

/// Long batches are shared out; the answers are those of one thread, whatever came before a point.
#[test]
fn batches_longer_than_a_task() {
    let mut draw = Draw::new(9700);
    let geometry = double_geometry(&meshes::rough(&mut draw), (10.0, 1e7));
    let points = points_around(&mut draw, &triangles_of(&geometry), 400);
    let [tree, _] = double_trees(&geometry);
    let all = queries(&tree, &geometry)[0];
    let one = all.with_threads(1);
    assert_eq!(all.closest_point(&points), one.closest_point(&points));
    assert_eq!(all.sides(&points), one.sides(&points));
    for (point, distance) in points.iter().zip(one.distance(&points)) {
        assert_eq!(one.distance(&[*point])[0].to_bits(), distance.to_bits());
    }
}
