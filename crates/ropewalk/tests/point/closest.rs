//! The nearest triangle.

use crate::meshes::{self, PLACES, check, points, queries, trees};
use ropewalk::point::{LARGEST, PointBruteForce, PointError, PointQueries};
use ropewalk::primitive::{Sphere, Triangle};
use ropewalk::wide::WideTree;
use ropewalk::{Geometry, Sides};
use ropewalk_testkit::rays::Draw;

/// Triangles around points of the unit cube, sizes in exponent space, slivers and copies among them.
fn soup(draw: &mut Draw, count: usize) -> meshes::Triangles {
    let mut triangles = meshes::Triangles::new();
    for _ in 0..count {
        let reach = draw.uniform(-6.0, -0.5).exp2();
        let centre: [f64; 3] = std::array::from_fn(|_| draw.uniform(0.0, 1.0));
        let mut corner = || centre.map(|c| c + draw.uniform(-reach, reach));
        let (a, b, mut c) = (corner(), corner(), corner());
        if draw.chance(0.2) {
            // A sliver: the third vertex on the first edge but for a little.
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
fn soups_at_all_scales() {
    for (round, place) in PLACES.into_iter().enumerate() {
        let mut draw = Draw::new(100 + round as u64);
        let geometry = meshes::geometry(&soup(&mut draw, 250), place);
        let points = points(&mut draw, &geometry, 60);
        check(&mut draw, &geometry, &points);
    }
}

/// Integer coordinates: ties everywhere, triangles without area and copies.
#[test]
fn grids_with_ties() {
    for round in 0..4 {
        let mut draw = Draw::new(200 + round);
        let mut geometry = Geometry::new();
        for _ in 0..200 {
            let mut vertices = std::array::from_fn(|_| draw.grid_point(4));
            if draw.chance(0.1) {
                vertices[2] = vertices[draw.below(2)];
            }
            geometry.push(Triangle { vertices }, Sides::Front).unwrap();
        }
        assert!(!meshes::is_proper(&geometry));
        let mut points: Vec<_> =
            (0..300).map(|_| draw.grid_point(11).map(|x| f64::from(x) / 2.0)).collect();
        points.extend(meshes::points(&mut draw, &geometry, 20));
        check(&mut draw, &geometry, &points);
    }
}

#[test]
fn extreme_triangles() {
    for exponent in [-140.0, -100.0, 60.0, 120.0f64] {
        let mut draw = Draw::new(300);
        let geometry = meshes::geometry(&soup(&mut draw, 80), (exponent.exp2(), 0.0));
        let points = points(&mut draw, &geometry, 30);
        check(&mut draw, &geometry, &points);
    }
}

/// A point of the answer lies on its triangle and at the distance, and no triangle is nearer.
#[test]
fn answers_are_those_of_geometry() {
    let mut draw = Draw::new(400);
    let geometry = meshes::geometry(&soup(&mut draw, 100), (1.0, 0.0));
    let oracle = PointBruteForce { geometry: &geometry };
    for point in points(&mut draw, &geometry, 40) {
        let nearest = oracle.closest_point(point).unwrap();
        let length =
            |p: [f64; 3], q: [f64; 3]| (0..3).map(|i| (p[i] - q[i]).powi(2)).sum::<f64>().sqrt();
        let slack = 1e-13 * (1.0 + nearest.distance);
        assert!((length(point, nearest.point) - nearest.distance).abs() <= slack);
        for id in 0..geometry.len() as u32 {
            let ropewalk::Shape::Triangle(t) = geometry.shape(id) else { unreachable!() };
            let [a, b, c] = t.vertices.map(|v| v.map(f64::from));
            for _ in 0..20 {
                let (u, v) = (draw.uniform(0.0, 1.0), draw.uniform(0.0, 1.0));
                let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                let q = std::array::from_fn(|i| a[i] + u * (b[i] - a[i]) + v * (c[i] - a[i]));
                assert!(length(point, q) >= nearest.distance - slack);
            }
        }
    }
}

#[test]
fn points_that_are_none_and_scenes_of_nothing() {
    let mut draw = Draw::new(500);
    let geometry = meshes::geometry(&meshes::torus(12, 8), (1.0, 0.0));
    let (inf, nan) = (f64::INFINITY, f64::NAN);
    let bad = [[nan, 0.0, 0.0], [0.0, inf, 0.0], [0.0, 0.0, -inf], [0.0, 2.0 * LARGEST, 0.0]];
    let mut points = points(&mut draw, &geometry, 10);
    for (i, point) in bad.into_iter().enumerate() {
        points.insert(7 * i, point);
    }
    points.extend([[LARGEST; 3], [-LARGEST, 0.0, 1e-300], [0.0; 3], [-0.0; 3]]);
    check(&mut draw, &geometry, &points);
    let [tree, _] = trees(&mut draw, &geometry);
    for queries in queries(&tree, &geometry) {
        assert!(queries.distance(&bad).iter().all(|d| d.is_nan()));
        assert!(queries.signed_distance(&bad).iter().all(|d| d.is_nan()));
        assert!(queries.closest_point(&bad).prim_id.iter().all(|&id| id == u32::MAX));
        assert!(!queries.contains(&bad).contains(&true));
        assert!(queries.winding_number(&bad).iter().all(|w| w.is_nan()));
        assert!(queries.closest_point(&[]).prim_id.is_empty());
    }

    let line = [[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
    for triangles in [vec![], vec![line; 20]] {
        let nothing = meshes::geometry(&triangles, (1.0, 0.0));
        check(&mut draw, &nothing, &[[0.0; 3], [1.0, 0.0, 0.0]]);
        let [tree, random] = trees(&mut draw, &nothing);
        for tree in [tree, random] {
            let queries = PointQueries::new(&tree, &nothing).unwrap();
            assert_eq!(queries.distance(&[[0.5, 0.0, 0.0]]), [f64::INFINITY]);
        }
    }
}

#[test]
fn other_primitives_are_refused() {
    let mut draw = Draw::new(600);
    let mut geometry = meshes::geometry(&meshes::torus(4, 4), (1.0, 0.0));
    geometry.push(Sphere { center: [0.0; 3], radius: 1.0 }, Sides::Both).unwrap();
    for tree in trees(&mut draw, &geometry) {
        assert_eq!(PointQueries::new(&tree, &geometry).err(), Some(PointError::NotTriangles));
    }
}

/// Long batches are shared out; the answers are those of one thread.
#[test]
fn batches_longer_than_a_task() {
    let mut draw = Draw::new(700);
    let geometry = meshes::geometry(&meshes::rough(&mut draw), (1.0, 0.0));
    let [tree, _]: [WideTree; 2] = trees(&mut draw, &geometry);
    let points = points(&mut draw, &geometry, 600);
    let queries = PointQueries::new(&tree, &geometry).unwrap();
    let one = queries.with_threads(1);
    let (all, single) = (queries.closest_point(&points), one.closest_point(&points));
    assert_eq!(all, single);
    assert_eq!(queries.sides(&points), one.sides(&points));
    // Bit for bit, whatever came before a point in its batch.
    for (i, point) in points.iter().enumerate() {
        assert_eq!(queries.distance(&[*point])[0].to_bits(), all.distance[i].to_bits());
    }
}
