//! Every walk over any valid tree answers exactly as brute force does, ties included.

use crate::bench::{Bench, coordinates};
use crate::scenes;
use ropewalk::Geometry;
use ropewalk_testkit::rays::{Draw, aligned_ray, generic_ray, grid_ray, invalid_rays};
use ropewalk_testkit::trees::TreeShape;

/// Trees per scene and rays per tree.
const TREES: usize = 3;
const RAYS: usize = 400;

fn each_bench(seed: u64, scene: impl Fn(&mut Draw) -> Geometry, check: impl Fn(&Bench, &mut Draw)) {
    for round in 0..TREES as u64 {
        let mut draw = Draw::new(seed + round);
        let geometry = scene(&mut draw);
        let shape = TreeShape { max_depth: 6 + draw.below(16), ..TreeShape::default() };
        check(&Bench::random(&mut draw, geometry, shape), &mut draw);
    }
}

/// Generic rays and rays through the scene's own coordinates, whole and with sub-ranges.
fn usual_rays(bench: &Bench, draw: &mut Draw) {
    let values = coordinates(bench);
    let bounds = bench.geometry().bounds();
    for _ in 0..RAYS {
        bench.check_with_ranges(&generic_ray(draw, &bounds), draw);
        bench.check_with_ranges(&aligned_ray(draw, &values), draw);
    }
    for ray in invalid_rays() {
        bench.check(&ray);
    }
}

#[test]
fn soups_in_exponent_space() {
    each_bench(1, |d| scenes::soup(d, 200, 1.0), usual_rays);
    each_bench(2, |d| scenes::exponent_soup(d, 120, -12.0, 12.0), usual_rays);
}

#[test]
fn all_kinds_of_primitives() {
    each_bench(3, |d| scenes::mixed(d, 150, false), usual_rays);
    each_bench(50, |d| scenes::mixed(d, 100, true), usual_rays);
}

#[test]
fn integer_grid_with_exact_ties() {
    let check = |bench: &Bench, draw: &mut Draw| {
        for _ in 0..3 * RAYS {
            bench.check_with_ranges(&grid_ray(draw, 6), draw);
        }
        usual_rays(bench, draw);
    };
    each_bench(4, |d| scenes::grid_soup(d, 150, 4), check);
    each_bench(5, |d| scenes::grid_quads(d, 60, 4), check);
}

#[test]
fn flat_scenes() {
    for axis in 0..3 {
        let check = |bench: &Bench, draw: &mut Draw| {
            for _ in 0..RAYS {
                bench.check_with_ranges(&grid_ray(draw, 5), draw);
            }
            usual_rays(bench, draw);
        };
        each_bench(6 + axis as u64, |d| scenes::flat(d, 60, axis), check);
    }
}

#[test]
fn far_from_the_origin() {
    each_bench(20, |d| scenes::offset(&scenes::soup(d, 100, 64.0), [1e6, -1e6, 1e6]), usual_rays);
    each_bench(21, |d| scenes::offset(&scenes::grid_soup(d, 100, 4), [0.0, 1e6, -1e6]), usual_rays);
}

#[test]
fn nothing_and_one() {
    each_bench(
        30,
        |_| Geometry::new(),
        |bench, draw| {
            for _ in 0..10 {
                bench.check(&grid_ray(draw, 3));
            }
        },
    );
    each_bench(31, |d| scenes::soup(d, 1, 1.0), usual_rays);
}
