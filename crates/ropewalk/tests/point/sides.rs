//! Inside, outside and on the surface.

use crate::meshes::{self, PLACES, check, points, queries, trees};
use ropewalk::point::{PointBruteForce, Side};
use ropewalk::{Geometry, Shape};
use ropewalk_testkit::rays::Draw;

/// The sides of a closed surface by another rule, the winding number, for points that are not within
/// `1e-7` of its size.
fn check_by_winding(geometry: &Geometry, points: &[[f64; 3]]) {
    let (oracle, size) = (PointBruteForce { geometry }, geometry.bounds().diagonal());
    for &point in points {
        if oracle.closest_point(point).unwrap().distance > 1e-7 * size {
            let inside = oracle.winding_number(point).round() as i64 % 2 != 0;
            let expected = if inside { Side::Inside } else { Side::Outside };
            assert_eq!(oracle.side(point), expected, "{point:?}");
        }
    }
}

/// Vertices and the middles of edges lie on the surface, and points beside faces on their sides.
fn check_near_faces(geometry: &Geometry) {
    let oracle = PointBruteForce { geometry };
    let size = geometry.bounds().diagonal();
    for id in (0..geometry.len() as u32).step_by(3) {
        let Shape::Triangle(t) = geometry.shape(id) else { unreachable!() };
        let [a, b, c] = t.vertices.map(|v| v.map(f64::from));
        let normal = t.scaled_normal();
        let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
        assert_eq!(oracle.side(a), Side::On);
        let sum: [f64; 3] = std::array::from_fn(|i| b[i] + c[i]);
        if (0..3).all(|i| sum[i] - b[i] == c[i] && sum[i] - c[i] == b[i]) {
            assert_eq!(oracle.side(sum.map(|x| 0.5 * x)), Side::On);
        }
        // A little more than 1e-9 of the coordinates, so that the point can be written down.
        let largest = a.iter().fold(size, |m, x| m.max(x.abs()));
        for (side, by) in [(Side::Outside, 1e-9 * largest), (Side::Inside, -1e-9 * largest)] {
            let point =
                std::array::from_fn(|i| (a[i] + b[i] + c[i]) / 3.0 + by * normal[i] / length);
            assert_eq!(oracle.side(point), side, "{point:?} beside {:?}", t.vertices);
        }
    }
}

#[test]
fn closed_surfaces_at_all_scales() {
    for (round, place) in PLACES.into_iter().enumerate() {
        let mut draw = Draw::new(1000 + round as u64);
        for triangles in [meshes::torus(16, 9), meshes::nested(), meshes::rough(&mut draw)] {
            let geometry = meshes::geometry(&triangles, place);
            let points = points(&mut draw, &geometry, 25);
            check(&mut draw, &geometry, &points);
            check_by_winding(&geometry, &points);
            check_near_faces(&geometry);
        }
    }
}

/// Cubes of a grid, filled or not: the surface between them has edges and vertices where many faces
/// meet, and all of them are parallel to axes.
#[test]
fn cubes_filled_at_random() {
    const N: i32 = 5;
    for round in 0..6 {
        let mut draw = Draw::new(2000 + round);
        let filled: Vec<bool> = (0..N * N * N).map(|_| draw.chance(0.5)).collect();
        let is_filled = |cube: [i32; 3]| {
            let inside = cube.iter().all(|x| (0..N).contains(x));
            inside && filled[((cube[0] * N + cube[1]) * N + cube[2]) as usize]
        };
        let mut triangles = meshes::Triangles::new();
        for i in 0..(N + 1) * (N + 1) * (N + 1) {
            let cube = [i / (N + 1) / (N + 1), i / (N + 1) % (N + 1), i % (N + 1)];
            for axis in 0..3 {
                let mut before = cube;
                before[axis] -= 1;
                if is_filled(cube) == is_filled(before) {
                    continue;
                }
                let corner = |u: i32, v: i32| {
                    let mut p = cube;
                    p[(axis + 1) % 3] += u;
                    p[(axis + 2) % 3] += v;
                    p.map(f64::from)
                };
                let [p, q, r, s] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                triangles.extend([[p, q, r], [p, r, s]]);
            }
        }
        let geometry = meshes::geometry(&triangles, (1.0, 0.0));
        let point = |_| -> [f64; 3] {
            std::array::from_fn(|_| draw.below(4 * N as usize + 9) as f64 / 4.0 - 1.0)
        };
        let points: Vec<[f64; 3]> = (0..2000).map(point).collect();
        let expected = points.iter().map(|p| {
            // The cubes that a point touches.
            let near = |i: usize, a: usize| (p[a].floor() - f64::from((i >> a & 1) as u8)) as i32;
            let touched =
                (0..8).filter(|i| (0..3).all(|a| i >> a & 1 == 0 || p[a] == p[a].floor()));
            let states: Vec<bool> =
                touched.map(|i| is_filled(std::array::from_fn(|a| near(i, a)))).collect();
            match (states.contains(&true), states.contains(&false)) {
                (true, true) => Side::On,
                (true, false) => Side::Inside,
                _ => Side::Outside,
            }
        });
        let expected: Vec<Side> = expected.collect();
        for tree in trees(&mut draw, &geometry) {
            for queries in queries(&tree, &geometry) {
                assert_eq!(queries.sides(&points), expected);
            }
        }
    }
}

/// Flat and odd scenes: answers are those of brute force all the same.
#[test]
fn open_surfaces_and_soups() {
    for round in 0..4 {
        let mut draw = Draw::new(3000 + round);
        let mut soup = meshes::Triangles::new();
        for _ in 0..150 {
            let flat = draw.below(6);
            let corner = |d: &mut Draw| {
                let mut p = d.grid_point(4).map(f64::from);
                if flat < 3 {
                    p[flat] = 1.0;
                }
                p
            };
            soup.push(std::array::from_fn(|_| corner(&mut draw)));
        }
        let geometry = meshes::geometry(&soup, (1.0, 0.0));
        let mut points: Vec<_> =
            (0..400).map(|_| draw.grid_point(11).map(|x| f64::from(x) / 2.0)).collect();
        points.extend(meshes::points(&mut draw, &geometry, 20));
        check(&mut draw, &geometry, &points);
    }
}

/// Signs are right for points closer to a face than any rounding of `f64` products.
#[test]
fn one_step_of_f64_beside_a_face() {
    let mut draw = Draw::new(4000);
    let geometry = meshes::geometry(&meshes::ball(2, |_| 1.0), (1.0, 0.0));
    let oracle = PointBruteForce { geometry: &geometry };
    for id in 0..geometry.len() as u32 {
        let Shape::Triangle(t) = geometry.shape(id) else { unreachable!() };
        let [a, b, c] = t.vertices.map(|v| v.map(f64::from));
        let (u, v) = (draw.uniform(0.1, 0.5), draw.uniform(0.1, 0.4));
        let on: [f64; 3] = std::array::from_fn(|i| a[i] + u * (b[i] - a[i]) + v * (c[i] - a[i]));
        // Along the ray the sides change once, from one number to the next.
        let mut z = on[2];
        (0..40).for_each(|_| z = z.next_down());
        let mut sides = Vec::new();
        for _ in 0..80 {
            sides.push(oracle.side([on[0], on[1], z]));
            z = z.next_up();
        }
        sides.dedup();
        let steps = sides.iter().filter(|&&side| side != Side::On).count();
        assert!(steps <= 2 && sides.len() <= 3, "{sides:?}");
    }
}
