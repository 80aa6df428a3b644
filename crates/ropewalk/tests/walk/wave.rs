//! The batch kernels at every level answer bit for bit as brute force does.

use crate::bench::{Bench, coordinates};
use crate::scenes;
use ropewalk::kernel::{AllHits, BatchCaster, HitFilter, Level, Masks, Opacity, Sorting};
use ropewalk::primitive::Triangle;
use ropewalk::ray::PreparedRay;
use ropewalk::traverse::{BruteForce, NoCounts, RayCaster};
use ropewalk::tree::{BspTree, Node};
use ropewalk::wide::WideTree;
use ropewalk::{Geometry, Hit, Ray, Shape};
use ropewalk_testkit::rays::{Draw, aligned_ray, generic_ray, grid_ray, invalid_rays};
use ropewalk_testkit::trees::{TreeShape, random_tree};

/// All hits of a ray, in order, each once.
fn every_hit(geometry: &Geometry, ray: &Ray) -> Vec<(f32, u32)> {
    geometry.all_hits(ray).iter().map(|h| (h.t + 0.0, h.prim_id)).collect()
}

pub fn check(geometry: &Geometry, tree: &BspTree, rays: &[Ray]) {
    let wide = WideTree::compile(tree, geometry).unwrap();
    assert_eq!(wide.validate(tree, geometry), Ok(()));
    let oracle = BruteForce { geometry };
    let closest: Vec<_> = rays.iter().map(|r| oracle.closest_hit(r, &mut NoCounts)).collect();
    let every: Vec<_> = rays.iter().map(|r| every_hit(geometry, r)).collect();
    for level in Level::ALL {
        let Some(caster) = BatchCaster::new(&wide, geometry).with_level(level) else { continue };
        let level = level.name();
        let (hits, occluded) = (caster.closest_hit(rays), caster.occluded(rays));
        let (all, first) = (caster.all_hits(rays), caster.first_hits(rays, 3));
        let counts = caster.count_hits(rays);
        for (i, ray) in rays.iter().enumerate() {
            let expected = closest[i].map_or((f32::INFINITY, u32::MAX), |h| (h.t, h.prim_id));
            assert_eq!((hits.t[i], hits.prim_id[i]), expected, "{level} closest, {ray:?}");
            assert_eq!(caster.closest_hit_one(ray), closest[i], "{level} closest, one, {ray:?}");
            assert_eq!(caster.occluded_one(ray), closest[i].is_some(), "{level} one, {ray:?}");
            assert_eq!(occluded[i], closest[i].is_some(), "{level} occluded, {ray:?}");
            let row = |of: &AllHits| {
                let range = of.offsets[i]..of.offsets[i + 1];
                let ids = of.prim_id[range.clone()].iter().copied();
                of.t[range].iter().copied().zip(ids).collect::<Vec<_>>()
            };
            assert_eq!(row(&all), every[i], "{level} all hits, {ray:?}");
            assert_eq!(counts[i] as usize, every[i].len(), "{level} count, {ray:?}");
            let three = &every[i][..every[i].len().min(3)];
            assert_eq!(row(&first), three, "{level} first hits, {ray:?}");
        }
    }
}

fn rays_for(geometry: &Geometry, draw: &mut Draw, grid: Option<i32>) -> Vec<Ray> {
    let tree = random_tree(draw, geometry, TreeShape::default()).unwrap();
    let bench = Bench::new(geometry.clone().into(), tree.into());
    let (values, bounds) = (coordinates(&bench), geometry.bounds());
    let mut rays = invalid_rays();
    for _ in 0..400 {
        rays.push(generic_ray(draw, &bounds));
        rays.push(aligned_ray(draw, &values));
        if let Some(n) = grid {
            rays.push(grid_ray(draw, n));
            rays.push(grid_ray(draw, n).with_range(0.25, 2.0));
        }
    }
    rays
}

fn each(seed: u64, grid: Option<i32>, scene: impl Fn(&mut Draw) -> Geometry) {
    for round in 0..4 {
        let mut draw = Draw::new(seed + round);
        let geometry = scene(&mut draw);
        let shape = TreeShape { max_depth: 6 + draw.below(16), ..TreeShape::default() };
        let tree = random_tree(&mut draw, &geometry, shape).unwrap();
        let rays = rays_for(&geometry, &mut draw, grid);
        check(&geometry, &tree, &rays);
    }
}

#[test]
fn every_level_equals_brute_force() {
    each(1, None, |d| scenes::soup(d, 300, 1.0));
    each(2, None, |d| scenes::exponent_soup(d, 120, -6.0, 6.0));
    each(3, None, |d| scenes::mixed(d, 150, false));
    each(4, Some(6), |d| scenes::grid_soup(d, 150, 4));
    each(5, Some(6), |d| scenes::grid_quads(d, 60, 4));
    each(6, None, |d| scenes::flat(d, 50, 1));
}

/// Coordinates and directions whose products leave the range of `f32`.
#[test]
fn extreme_numbers_change_nothing() {
    each(20, None, |d| scenes::exponent_soup(d, 60, -19.0, 19.0));
    for exponent in [-110, -75, -50, 50, 66, 70, 75, 110] {
        each(21, None, |d| {
            let (soup, scale) = (scenes::soup(d, 100, 1.0), 2f32.powi(exponent));
            let mut scaled = Geometry::new();
            for id in 0..soup.len() as u32 {
                let Shape::Triangle(triangle) = soup.shape(id) else { unreachable!() };
                let vertices = triangle.vertices.map(|p| p.map(|x| x * scale));
                scaled.push(Triangle { vertices }, soup.sides(id)).unwrap();
            }
            scaled
        });
    }
    let mut draw = Draw::new(30);
    let geometry = scenes::soup(&mut draw, 100, 1.0);
    let tree = random_tree(&mut draw, &geometry, TreeShape::default()).unwrap();
    let rays: Vec<_> = (0..2000)
        .map(|_| {
            let mut ray = generic_ray(&mut draw, &geometry.bounds());
            let scale = draw.uniform(-37.0, 37.0);
            let axis = draw.below(3);
            ray.dir = ray.dir.map(|d| (f64::from(d) * 10f64.powf(scale)) as f32);
            ray.dir[axis] *= if draw.chance(0.3) { 1e-38 } else { 1.0 };
            ray
        })
        .collect();
    check(&geometry, &tree, &rays);
}

#[test]
fn ranges_may_be_negative() {
    let mut draw = Draw::new(31);
    let geometry = scenes::soup(&mut draw, 200, 1.0);
    let tree = random_tree(&mut draw, &geometry, TreeShape::default()).unwrap();
    let oracle = BruteForce { geometry: &geometry };
    let mut rays = Vec::new();
    for _ in 0..1500 {
        let ray = generic_ray(&mut draw, &geometry.bounds()).with_range(f32::NEG_INFINITY, 0.0);
        // Ranges that begin or end exactly at a hit.
        let hit = oracle.closest_hit(&ray, &mut NoCounts);
        rays.extend(hit.map(|h| ray.with_range(h.t, 0.0)));
        rays.extend(hit.map(|h| ray.with_range(f32::NEG_INFINITY, h.t)));
        rays.extend([ray, ray.with_range(-2.0, -1.0), ray.with_range(-1.0, 1.0)]);
    }
    check(&geometry, &tree, &rays);
}

/// Rays that start in the planes of primitives, of cuts and of the scene's box: their hits lie within
/// `f64` rounding of 0, on either side, and ranges end at them.
#[test]
fn hits_about_zero_are_found() {
    for round in 0..6 {
        let mut draw = Draw::new(40 + round);
        let geometry = scenes::grid_quads(&mut draw, 60, 4);
        let tree = random_tree(&mut draw, &geometry, TreeShape::default()).unwrap();
        let mut rays = Vec::new();
        for _ in 0..1500 {
            let mut ray = generic_ray(&mut draw, &geometry.bounds());
            ray.origin = draw.point_in(&geometry.bounds());
            ray.origin[draw.below(3)] = draw.below(9) as f32 - 4.0;
            let line = ray.with_range(f32::NEG_INFINITY, f32::INFINITY);
            for (t, _) in every_hit(&geometry, &line) {
                if t.abs() < 1e-6 {
                    rays.extend([ray.with_range(-8.0, t), ray.with_range(t, 8.0), line]);
                }
            }
        }
        assert!(rays.len() > 300, "{}", rays.len());
        check(&geometry, &tree, &rays);
    }
}

/// Origins so far away that neighbouring cells are a few roundings of `t` apart.
#[test]
fn far_origins_change_nothing() {
    for round in 0..8 {
        let mut draw = Draw::new(60 + round);
        let geometry = match round % 2 {
            0 => scenes::grid_quads(&mut draw, 60, 4),
            _ => scenes::soup(&mut draw, 150, 4.0),
        };
        let tree = random_tree(&mut draw, &geometry, TreeShape::default()).unwrap();
        let mut rays = Vec::new();
        for _ in 0..1500 {
            let mut ray = generic_ray(&mut draw, &geometry.bounds());
            let (inside, away) = (draw.point_in(&geometry.bounds()), draw.uniform(2.0, 6.0));
            let length = ray.dir.iter().fold(0.0f32, |m, d| m.max(d.abs()));
            let away = 10f64.powf(away) as f32 / length;
            ray.origin = std::array::from_fn(|a| inside[a] - away * ray.dir[a]);
            if let Some(&(t, _)) = every_hit(&geometry, &ray).first() {
                rays.push(ray.with_range(t * 0.9999, t * 1.0001));
                rays.push(ray.with_range(t, t));
            }
            rays.push(ray);
        }
        check(&geometry, &tree, &rays);
    }
}

#[test]
fn leaves_of_more_blocks_than_a_code_can_count() {
    let mut draw = Draw::new(8);
    for count in [1, 7, 112, 113, 120, 121, 400] {
        let geometry = scenes::soup(&mut draw, count, 1.0);
        let refs: Vec<u32> = (0..count as u32).collect();
        let nodes = vec![Node::leaf(0, count as u32)];
        let tree = BspTree::from_nodes(geometry.bounds(), nodes, refs).unwrap();
        let bounds = geometry.bounds();
        let rays: Vec<_> = (0..100).map(|_| generic_ray(&mut draw, &bounds)).collect();
        check(&geometry, &tree, &rays);
    }
}

/// Filters by a closure, by masks and by opacity: every query answers as if the refused hits were not
/// there, on one thread and on all.
#[test]
fn filters_see_every_hit_that_matters() {
    let mut draw = Draw::new(12);
    let geometry = scenes::mixed(&mut draw, 200, false);
    let tree = random_tree(&mut draw, &geometry, TreeShape::default()).unwrap();
    let wide = WideTree::compile(&tree, &geometry).unwrap();
    let rays: Vec<_> = (0..6000).map(|_| generic_ray(&mut draw, &geometry.bounds())).collect();
    let word = |d: &mut Draw| 1u32 << d.below(3);
    let primitive: Vec<u32> = (0..geometry.len()).map(|_| word(&mut draw)).collect();
    let ray: Vec<u32> = rays.iter().map(|_| word(&mut draw) | word(&mut draw)).collect();
    let opacity: Vec<f32> = (0..geometry.len()).map(|_| draw.uniform(0.0, 1.0) as f32).collect();

    fn check(
        (wide, geometry): (&WideTree, &Geometry),
        rays: &[Ray],
        filter: impl HitFilter + Copy,
    ) -> usize {
        let mut refused = 0;
        for level in Level::ALL {
            let caster = BatchCaster::new(wide, geometry).with_filter(filter);
            let Some(caster) = caster.with_level(level) else { continue };
            let serial = caster.with_threads(1);
            let (hits, all) = (caster.closest_hit(rays), caster.all_hits(rays));
            assert_eq!(hits, serial.closest_hit(rays));
            assert_eq!(all, serial.all_hits(rays));
            let (occluded, counts) = (caster.occluded(rays), caster.count_hits(rays));
            for (i, ray) in rays.iter().enumerate() {
                let Some(prepared) = PreparedRay::new(ray) else { continue };
                let prims = 0..geometry.len() as u32;
                let mut every: Vec<_> =
                    prims.filter_map(|id| geometry.intersect(id, &prepared)).collect();
                every.sort_by(|a, b| a.t.total_cmp(&b.t).then(a.prim_id.cmp(&b.prim_id)));
                let whole = every.clone();
                every.retain(|hit| filter.accepts(i, hit));
                refused += whole.len() - every.len();
                geometry.leave_out(ray, &mut every);
                let first = every.first().map_or((f32::INFINITY, u32::MAX), |h| (h.t, h.prim_id));
                assert_eq!((hits.t[i], hits.prim_id[i]), first);
                // By itself a ray is ray 0.
                let as_first = |hit: &&Hit| filter.accepts(0, hit);
                let one = caster.closest_hit_one(ray).map(|hit| (hit.t, hit.prim_id));
                let mut alone = whole.iter().filter(as_first);
                assert_eq!(one, alone.next().map(|hit| (hit.t, hit.prim_id)));
                assert_eq!(caster.occluded_one(ray), one.is_some());
                assert_eq!(occluded[i], !every.is_empty());
                assert_eq!(counts[i] as usize, every.len());
                let ids: Vec<_> = every.iter().map(|h| h.prim_id).collect();
                assert_eq!(all.prim_id[all.offsets[i]..all.offsets[i + 1]], ids);
            }
        }
        refused
    }
    let scene = (&wide, &geometry);
    let refused = [
        check(scene, &rays, |ray: usize, hit: &Hit| {
            !(ray + hit.prim_id as usize).is_multiple_of(3)
        }),
        check(scene, &rays, |_: usize, hit: &Hit| hit.u < 0.5),
        check(scene, &rays, Masks { primitive: &primitive, ray: &ray }),
        check(scene, &rays, Opacity { primitive: &opacity, seed: 7 }),
    ];
    assert!(refused.iter().all(|&n| n > 300), "{refused:?}");
}

#[test]
fn opacity_is_a_probability() {
    let opacity = [0.0, 0.25, 1.0];
    let filter = Opacity { primitive: &opacity, seed: 1 };
    let share = |prim_id| {
        let hit = Hit { t: 1.0, prim_id, u: 0.0, v: 0.0 };
        (0..10_000).filter(|&ray| filter.accepts(ray, &hit)).count()
    };
    assert_eq!((share(0), share(2), share(3)), (0, 10_000, 10_000));
    // Five standard deviations of a binomial draw.
    assert!(share(1).abs_diff(2500) < 217, "{}", share(1));
}

#[test]
fn threads_do_not_change_answers() {
    let mut draw = Draw::new(9);
    let geometry = scenes::soup(&mut draw, 300, 1.0);
    let tree = random_tree(&mut draw, &geometry, TreeShape::default()).unwrap();
    let wide = WideTree::compile(&tree, &geometry).unwrap();
    let rays: Vec<_> = (0..20_000).map(|_| generic_ray(&mut draw, &geometry.bounds())).collect();
    let all = BatchCaster::new(&wide, &geometry);
    let one = all.with_threads(1);
    assert_eq!(all.closest_hit(&rays), one.closest_hit(&rays));
    assert_eq!(all.occluded(&rays), one.occluded(&rays));
    assert_eq!(all.all_hits(&rays), one.all_hits(&rays));
    let mut kept = AllHits::default();
    for (rays, k) in [(&rays[..], 8), (&rays[..5000], 1), (&rays[..100], usize::MAX), (&[], 2)] {
        for caster in [all, one] {
            caster.first_hits_into(rays, k, &mut kept);
            assert_eq!(kept, one.first_hits(rays, k));
        }
    }
    one.first_hits_into(&rays[..3], 0, &mut kept);
    assert_eq!((kept.offsets, kept.t), (vec![0; 4], vec![]));
}

/// Pictures in rows go in tiles, wherever the batch begins and ends, and are answered where they stand.
#[test]
fn rows_of_a_picture_are_answered_where_they_stand() {
    let mut draw = Draw::new(31);
    let geometry = scenes::soup(&mut draw, 300, 1.0);
    let tree = random_tree(&mut draw, &geometry, TreeShape::default()).unwrap();
    let wide = WideTree::compile(&tree, &geometry).unwrap();
    let (bounds, size) = (geometry.bounds(), geometry.bounds().diagonal() as f32);
    let oracle = BruteForce { geometry: &geometry };
    for (width, height, parallel) in [(100, 61, false), (64, 40, true), (333, 17, false)] {
        let at = |i: usize| {
            let x = (i % width) as f32 / width as f32 - 0.5;
            let y = ((i / width) as f32 - 0.5 * height as f32) / width as f32;
            let mut from: [f32; 3] = std::array::from_fn(|a| 0.5 * (bounds.min[a] + bounds.max[a]));
            from[2] += size;
            match parallel {
                true => Ray::new(
                    [from[0] + 0.5 * size * x, from[1] + 0.5 * size * y, from[2]],
                    [0.01, 0.02, -1.0],
                ),
                false => Ray::new(from, [0.5 * x, 0.5 * y, -1.0]),
            }
        };
        let rays: Vec<Ray> = (0..width * height).map(at).collect();
        for rays in [&rays[..], &rays[37..], &rays[..rays.len() - 5]] {
            let expected: Vec<_> =
                rays.iter().map(|r| oracle.closest_hit(r, &mut NoCounts)).collect();
            assert!(expected.iter().flatten().count() > rays.len() / 20);
            for level in Level::ALL {
                let Some(caster) = BatchCaster::new(&wide, &geometry).with_level(level) else {
                    continue;
                };
                let (mut t, mut prim) = (vec![0.0; rays.len()], vec![0; rays.len()]);
                let one = caster.with_threads(1);
                let report = one.closest_hit_into(rays, &mut t, &mut prim);
                assert_eq!(report.tiled_rays, rays.len() as u64, "{width}");
                assert_eq!(report.beam_rays + report.wave_rays, rays.len() as u64);
                assert_eq!(caster.closest_hit(rays), one.closest_hit(rays));
                let occluded = one.occluded(rays);
                for (i, hit) in expected.iter().enumerate() {
                    let hit = hit.map_or((f32::INFINITY, u32::MAX), |h| (h.t, h.prim_id));
                    assert_eq!((t[i], prim[i]), hit, "{width}, ray {i}, {}", level.name());
                    assert_eq!(occluded[i], hit.1 != u32::MAX, "{width}, ray {i}");
                }
            }
        }
    }
}

/// Also where only some rays are left to the wave, and with fewer rays than it holds.
#[test]
fn sorting_does_not_change_answers() {
    let mut draw = Draw::new(29);
    let geometry = scenes::soup(&mut draw, 300, 1.0);
    let tree = random_tree(&mut draw, &geometry, TreeShape::default()).unwrap();
    let wide = WideTree::compile(&tree, &geometry).unwrap();
    let bounds = geometry.bounds();
    let mut rays: Vec<_> = (0..20_000).map(|_| generic_ray(&mut draw, &bounds)).collect();
    let eye = rays[0];
    for i in (5000..9000).chain(9500..9516) {
        let end = rays[i].origin;
        rays[i] = Ray::new(eye.origin, std::array::from_fn(|a| end[a] - eye.origin[a]));
    }
    (rays[3].origin[1], rays[7].dir) = (f32::NAN, [0.0; 3]);
    let never = BatchCaster::new(&wide, &geometry).with_sorting(Sorting::Never).with_threads(1);
    let always = never.with_sorting(Sorting::Always);
    for rays in [&rays[..], &rays[4000..9800], &rays[..17], &rays[..1], &[]] {
        assert_eq!(always.closest_hit(rays), never.closest_hit(rays));
        assert_eq!(always.occluded(rays), never.occluded(rays));
        assert_eq!(always.with_threads(0).closest_hit(rays), never.closest_hit(rays));
        let (mut t, mut prim) = (vec![0.0; rays.len()], vec![0; rays.len()]);
        let report = always.closest_hit_into(rays, &mut t, &mut prim);
        assert_eq!(report.sorted_rays + report.beam_rays, rays.len() as u64);
        assert_eq!(report.sorted_rays, report.wave_rays);
    }
}

/// A filter may ask about other rays, and the calls do not disturb each other.
#[test]
fn a_filter_may_cast_single_rays() {
    let mut draw = Draw::new(13);
    let geometry = scenes::soup(&mut draw, 300, 1.0);
    let tree = random_tree(&mut draw, &geometry, TreeShape::default()).unwrap();
    let wide = WideTree::compile(&tree, &geometry).unwrap();
    let inner = BatchCaster::new(&wide, &geometry);
    let mut refused = 0;
    for _ in 0..500 {
        let ray = generic_ray(&mut draw, &geometry.bounds());
        let first = inner.closest_hit_one(&ray);
        let not_first = |_: usize, hit: &Hit| inner.closest_hit_one(&ray) != Some(*hit);
        let second = inner.with_filter(not_first).closest_hit_one(&ray);
        let expected = every_hit(&geometry, &ray);
        assert_eq!(first.map(|hit| (hit.t + 0.0, hit.prim_id)), expected.first().copied());
        assert_eq!(second.map(|hit| (hit.t + 0.0, hit.prim_id)), expected.get(1).copied());
        refused += usize::from(second.is_some());
    }
    assert!(refused > 50, "{refused}");
}

#[test]
fn an_empty_tree_is_missed() {
    let geometry = Geometry::new();
    let (tree, _) = ropewalk::build::build_default(&geometry).unwrap();
    let wide = WideTree::compile(&tree, &geometry).unwrap();
    let caster = BatchCaster::new(&wide, &geometry);
    let rays = [Ray::new([0.0; 3], [1.0, 0.0, 0.0])];
    assert_eq!(caster.occluded(&rays), [false]);
    assert_eq!(caster.closest_hit_one(&rays[0]), None);
    assert!(!caster.occluded_one(&rays[0]));
    assert_eq!(caster.all_hits(&rays).offsets, [0, 0]);
    assert!(caster.closest_hit(&[]).t.is_empty());
}
