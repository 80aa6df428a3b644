//! Short rays that start at their entries answer bit for bit as brute force does.

use crate::bench::{Bench, coordinates};
use crate::scenes;
use ropewalk::kernel::{BatchCaster, BatchEvents, Level, Start};
use ropewalk::traverse::{BruteForce, NoCounts, RayCaster};
use ropewalk::tree::BspTree;
use ropewalk::wide::WideTree;
use ropewalk::{Aabb, Geometry, Ray};
use ropewalk_testkit::rays::{Draw, generic_ray, grid_ray, invalid_rays};
use ropewalk_testkit::trees::{TreeShape, random_tree};

/// Segments of which most begin where the one before ended, with lengths in exponent space; on a
/// grid some end in planes and run in them.
fn walk(draw: &mut Draw, bounds: &Aabb, values: &[Vec<f32>; 3], count: usize) -> Vec<Ray> {
    let size = bounds.diagonal();
    let mut at = draw.point_in(bounds);
    let mut rays = Vec::new();
    for _ in 0..count {
        let length = size * draw.uniform(-12.0, 0.5).exp2();
        let mut dir = draw.direction();
        if draw.chance(0.2) {
            dir[draw.below(3)] = 0.0;
        }
        // Also ranges that begin elsewhere, and directions that are not normalised.
        let scale = if draw.chance(0.2) { draw.uniform(-8.0, 8.0).exp2() } else { 1.0 };
        let dir = dir.map(|d| (f64::from(d) * scale) as f32);
        let dir = if dir == [0.0; 3] { [scale as f32, 0.0, 0.0] } else { dir };
        let t_max = (length / scale) as f32;
        let t_min = if draw.chance(0.1) { t_max * 0.25 } else { 0.0 };
        let ray = Ray::new(at, dir).with_range(t_min, t_max);
        rays.push(ray);
        // The same segment seen from afar.
        let back = size * draw.uniform(0.0, 5.0).exp2() / scale;
        let origin = ray.at(-back as f32).map(|x| x as f32);
        let range = (back as f32, (back + f64::from(t_max)) as f32);
        rays.push(Ray::new(origin, dir).with_range(range.0, range.1));
        at = ray.at(t_max).map(|x| x as f32);
        for (a, x) in at.iter_mut().enumerate() {
            if draw.chance(0.15) && !values[a].is_empty() {
                *x = values[a][draw.below(values[a].len())];
            }
        }
        let inside = (0..3).all(|a| bounds.min[a] <= at[a] && at[a] <= bounds.max[a]);
        if !inside || draw.chance(0.02) {
            at = draw.point_in(bounds);
        }
    }
    rays
}

/// Ends rays at their hits and one `f32` beside them, except at hits in the very origin: those are
/// decided by the rounding of `f64`, which the intervals of the wave know nothing of.
fn end_at_hits(draw: &mut Draw, geometry: &Geometry, rays: &mut [Ray]) {
    let oracle = BruteForce { geometry };
    for ray in rays {
        if draw.chance(0.5)
            && let Some(hit) = oracle.closest_hit(ray, &mut NoCounts)
            && hit.t.abs() > 1e-6 * ray.t_max
        {
            let ends = [hit.t, hit.t.next_down(), hit.t.next_up()];
            ray.t_max = ends[draw.below(3)].max(ray.t_min);
        }
    }
}

/// Checks all queries at every level from every start; the events of the best level.
fn check(geometry: &Geometry, tree: &BspTree, rays: &[Ray]) -> BatchEvents {
    let wide = WideTree::compile(tree, geometry).unwrap();
    let oracle = BruteForce { geometry };
    let expected: Vec<_> = rays.iter().map(|r| oracle.closest_hit(r, &mut NoCounts)).collect();
    let root = BatchCaster::new(&wide, geometry).with_start(Start::Root);
    let all = root.all_hits(rays);
    for level in Level::ALL {
        let Some(caster) = root.with_level(level) else { continue };
        for start in [Start::Root, Start::Entry, Start::Automatic] {
            let caster = caster.with_start(start);
            let (hits, occluded) = (caster.closest_hit(rays), caster.occluded(rays));
            for (i, ray) in rays.iter().enumerate() {
                let hit = expected[i].map_or((f32::INFINITY, u32::MAX), |h| (h.t, h.prim_id));
                let found = (hits.t[i], hits.prim_id[i]);
                assert_eq!(found, hit, "{} {start:?}, ray {i}: {ray:?}", level.name());
                assert_eq!(occluded[i], expected[i].is_some(), "{} {ray:?}", level.name());
            }
            assert_eq!(caster.all_hits(rays), all);
        }
    }
    root.with_start(Start::Entry).closest_hit_events(rays)
}

fn each(seed: u64, scene: impl Fn(&mut Draw) -> Geometry) -> BatchEvents {
    let mut sum = BatchEvents::default();
    for round in 0..6 {
        let mut draw = Draw::new(seed + round);
        let geometry = scene(&mut draw);
        let shape = TreeShape { max_depth: 6 + draw.below(16), ..TreeShape::default() };
        let tree = random_tree(&mut draw, &geometry, shape).unwrap();
        let bench = Bench::new(geometry.clone().into(), tree.clone().into());
        let values = coordinates(&bench);
        let mut rays = walk(&mut draw, &geometry.bounds(), &values, 900);
        end_at_hits(&mut draw, &geometry, &mut rays);
        for i in 0..200 {
            // Long rays between, so that the path is wrong for what comes next.
            let at = draw.below(rays.len());
            let other = match i % 3 {
                0 => generic_ray(&mut draw, &geometry.bounds()),
                1 => grid_ray(&mut draw, 4).with_range(0.0, 1.0),
                _ => generic_ray(&mut draw, &geometry.bounds()).with_range(-1.0, 1.0),
            };
            rays.insert(at, other);
        }
        rays.extend(invalid_rays());
        let events = check(&geometry, &tree, &rays);
        sum.skipped += events.skipped;
        sum.rays += events.rays;
    }
    sum
}

#[test]
fn entries_change_no_answer() {
    let events = each(1, |d| scenes::soup(d, 200, 1.0));
    assert!(events.skipped > 1000 && events.rays > 1000, "{events:?}");
    each(2, |d| scenes::exponent_soup(d, 100, -6.0, 6.0));
    each(3, |d| scenes::mixed(d, 100, false));
    each(4, |d| scenes::grid_soup(d, 100, 4));
    each(5, |d| scenes::grid_quads(d, 40, 4));
    each(6, |d| scenes::flat(d, 50, 1));
    each(7, |d| scenes::offset(&scenes::soup(d, 200, 1.0), [1e6, 0.0, -1e6]));
    each(8, |d| scenes::mixed(d, 100, true));
    each(9, |d| scenes::exponent_soup(d, 60, -19.0, 19.0));
}

/// Short segments of one particle in turn go in packets, at every level.
#[test]
fn packets_change_no_answer() {
    let mut sum = BatchEvents::default();
    for seed in 0..8 {
        let mut draw = Draw::new(60 + seed);
        let geometry = match seed % 4 {
            0 => scenes::soup(&mut draw, 300, 0.2),
            1 => scenes::grid_quads(&mut draw, 60, 8),
            2 => scenes::mixed(&mut draw, 100, seed > 3),
            _ => scenes::offset(&scenes::soup(&mut draw, 200, 0.2), [1e4, 0.0, -1e4]),
        };
        let shape = TreeShape { max_depth: 20, ..TreeShape::default() };
        let tree = random_tree(&mut draw, &geometry, shape).unwrap();
        let (bounds, mut rays) = (geometry.bounds(), Vec::new());
        let mut at = draw.point_in(&bounds);
        for _ in 0..1500 {
            let length = bounds.diagonal() * draw.uniform(0.0, 0.01);
            let ray = Ray::new(at, draw.direction()).with_range(0.0, length as f32);
            rays.push(ray);
            at = ray.at(ray.t_max).map(|x| x as f32);
            let inside = (0..3).all(|a| bounds.min[a] <= at[a] && at[a] <= bounds.max[a]);
            if !inside || draw.chance(0.005) {
                at = draw.point_in(&bounds);
            }
        }
        end_at_hits(&mut draw, &geometry, &mut rays);
        sum.rays += rays.len() as u64;
        let events = check(&geometry, &tree, &rays);
        sum.skipped += events.skipped;
    }
    assert!(sum.skipped > sum.rays / 3 && sum.skipped < sum.rays, "{sum:?}");
}

/// A segment in an empty cell needs no step and no test, in whatever order segments come.
#[test]
fn segments_in_empty_cells_end_there() {
    let mut draw = Draw::new(40);
    let geometry = scenes::soup(&mut draw, 200, 1.0);
    let (tree, _) = ropewalk::build::build_default(&geometry).unwrap();
    let wide = WideTree::compile(&tree, &geometry).unwrap();
    let (bounds, mut rays) = (geometry.bounds(), Vec::new());
    tree.for_each_node(|_, kind, cell, _| {
        let ropewalk::tree::NodeKind::Leaf { count: 0, .. } = kind else { return };
        let middle = std::array::from_fn(|a| 0.5 * (cell.min[a] + cell.max[a]));
        let size = (0..3).map(|a| cell.max[a] - cell.min[a]).fold(f32::INFINITY, f32::min);
        if f64::from(size) > 1e-4 * bounds.diagonal() {
            rays.push(Ray::new(middle, draw.direction()).with_range(0.0, 0.4 * size));
        }
    });
    assert!(rays.len() > 20, "{}", rays.len());
    for level in Level::ALL {
        let caster = BatchCaster::new(&wide, &geometry).with_start(Start::Entry);
        let Some(caster) = caster.with_level(level) else { continue };
        let events = caster.occluded_events(&rays);
        assert_eq!((events.skipped, events.steps), (rays.len() as u64, 0), "{}", level.name());
    }
}

/// Long rays are not searched for, short ones are; threads change nothing.
#[test]
fn the_start_is_chosen_by_length() {
    let mut draw = Draw::new(41);
    let geometry = scenes::soup(&mut draw, 300, 1.0);
    let tree = random_tree(&mut draw, &geometry, TreeShape::default()).unwrap();
    let wide = WideTree::compile(&tree, &geometry).unwrap();
    let caster = BatchCaster::new(&wide, &geometry);
    let bounds = geometry.bounds();
    let long: Vec<_> = (0..20_000).map(|_| generic_ray(&mut draw, &bounds)).collect();
    assert_eq!(caster.closest_hit_events(&long).looked, 0);
    let short: Vec<_> = (0..20_000)
        .map(|_| {
            let (at, dir) = (draw.point_in(&bounds), draw.direction());
            Ray::new(at, dir).with_range(0.0, 1e-4)
        })
        .collect();
    let events = caster.closest_hit_events(&short);
    assert!(events.skipped > 10_000, "{events:?}");
    assert_eq!(events.skipped + events.rays, 20_000);
    let (one, mut hit) = (caster.with_threads(1), vec![false; 20_000]);
    assert_eq!(one.occluded_into(&short, &mut hit).entry_rays, 20_000);
    assert_eq!(one.occluded_into(&long, &mut hit).entry_rays, 0);
    assert_eq!(caster.closest_hit(&short), one.closest_hit(&short));
    assert_eq!(caster.occluded(&short), one.with_start(Start::Root).occluded(&short));
}
