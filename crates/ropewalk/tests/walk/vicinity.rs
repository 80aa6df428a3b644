//! Short occlusion rays that start from cells found once for many answer as brute force does.

use crate::scenes;
use ropewalk::build::build_default;
use ropewalk::kernel::{BatchCaster, Level, Start};
use ropewalk::traverse::{BruteForce, NoCounts, RayCaster};
use ropewalk::wide::WideTree;
use ropewalk::{Geometry, Ray};
use ropewalk_testkit::rays::{Draw, generic_ray, invalid_rays};
use ropewalk_testkit::trees::{TreeShape, random_tree};

/// Rays of one length from places close together, group after group, as ambient occlusion has them; some in coordinate planes,
/// some on a grid, some that end at a hit or one `f32` beside it, and others between.
fn rays(draw: &mut Draw, geometry: &Geometry, count: usize) -> Vec<Ray> {
    let (bounds, oracle) = (geometry.bounds(), BruteForce { geometry });
    let size = bounds.diagonal();
    let mut rays = Vec::new();
    while rays.len() < count {
        let length = size * draw.uniform(-5.0, -1.0).exp2();
        let scale = if draw.chance(0.3) { draw.uniform(-8.0, 8.0).exp2() } else { 1.0 };
        // Also places far outside of the scene.
        let away = if draw.chance(0.1) { size * draw.uniform(0.0, 20.0).exp2() } else { 0.0 };
        let push = draw.direction().map(|d| f64::from(d) * away);
        let mut at: [f64; 3] =
            std::array::from_fn(|a| f64::from(draw.point_in(&bounds)[a]) + push[a]);
        let is_on_grid = draw.chance(0.2);
        for _ in 0..100 {
            let step = draw.direction().map(|d| f64::from(d) * 0.05 * length);
            at = std::array::from_fn(|a| at[a] + step[a]);
            let mut dir = draw.direction().map(|d| (f64::from(d) * scale) as f32);
            if draw.chance(0.2) {
                dir[draw.below(3)] = 0.0;
            }
            if dir == [0.0; 3] {
                dir[0] = scale as f32;
            }
            let mut origin = at.map(|x| x as f32);
            if is_on_grid {
                origin = origin.map(f32::round);
            }
            let longer = if draw.chance(0.01) { size } else { length };
            let t_min = if draw.chance(0.1) { -0.5 * length } else { 0.0 };
            let range = ((t_min / scale) as f32, (longer / scale) as f32);
            let mut ray = Ray::new(origin, dir).with_range(range.0, range.1);
            if draw.chance(0.3)
                && let Some(hit) = oracle.closest_hit(&ray, &mut NoCounts)
                && hit.t.abs() > 1e-6 * ray.t_max
            {
                let ends = [hit.t, hit.t.next_down(), hit.t.next_up()];
                ray.t_max = ends[draw.below(3)].max(ray.t_min);
            }
            rays.push(ray);
        }
        rays.push(generic_ray(draw, &bounds));
    }
    rays.extend(invalid_rays());
    rays
}

/// Checks every level; rays that started from cells near them.
fn check(seed: u64, scene: impl Fn(&mut Draw) -> Geometry) -> u64 {
    let mut near = 0;
    for round in 0..6 {
        let mut draw = Draw::new(seed * 100 + round);
        let geometry = scene(&mut draw);
        let shape = TreeShape { max_depth: 8 + draw.below(16), ..TreeShape::default() };
        let tree = if round % 2 == 0 {
            random_tree(&mut draw, &geometry, shape).unwrap()
        } else {
            build_default(&geometry).unwrap().0
        };
        let wide = WideTree::compile(&tree, &geometry).unwrap();
        let rays = rays(&mut draw, &geometry, 4000);
        let oracle = BruteForce { geometry: &geometry };
        let expected: Vec<_> = rays.iter().map(|r| oracle.occluded(r, &mut NoCounts)).collect();
        let caster = BatchCaster::new(&wide, &geometry).with_threads(1);
        for level in Level::ALL {
            let Some(caster) = caster.with_level(level) else { continue };
            let mut hit = vec![false; rays.len()];
            let report = caster.occluded_into(&rays, &mut hit);
            for (i, ray) in rays.iter().enumerate() {
                assert_eq!(
                    hit[i],
                    expected[i],
                    "{}, round {round}, ray {i}: {ray:?}",
                    level.name()
                );
            }
            near += report.near_rays;
            let report = caster.with_start(Start::Root).occluded_into(&rays, &mut hit);
            assert_eq!((report.near_rays, &hit), (0, &expected));
        }
    }
    near
}

#[test]
fn cells_near_rays_change_no_answer() {
    let near =
        [check(1, |d| scenes::soup(d, 1500, 0.03)), check(2, |d| scenes::grid_soup(d, 300, 8))];
    assert!(near.iter().all(|&near| near > 5_000), "{near:?}");
    check(3, |d| scenes::exponent_soup(d, 200, -6.0, 6.0));
    check(4, |d| scenes::mixed(d, 200, false));
    check(5, |d| scenes::grid_quads(d, 100, 6));
    check(6, |d| scenes::offset(&scenes::soup(d, 400, 0.3), [1e6, 0.0, -1e6]));
    check(7, |d| scenes::mixed(d, 100, true));
    check(8, |d| scenes::exponent_soup(d, 60, -19.0, 19.0));
}

/// Rays that have nothing to do with each other are soon left to the root.
#[test]
fn scattered_rays_are_left_to_the_root() {
    let mut draw = Draw::new(77);
    let geometry = scenes::soup(&mut draw, 2000, 0.05);
    let tree = random_tree(&mut draw, &geometry, TreeShape::default()).unwrap();
    let wide = WideTree::compile(&tree, &geometry).unwrap();
    let caster = BatchCaster::new(&wide, &geometry).with_threads(1);
    let bounds = geometry.bounds();
    let length = (0.05 * bounds.diagonal()) as f32;
    let rays: Vec<_> = (0..20_000)
        .map(|_| Ray::new(draw.point_in(&bounds), draw.direction()).with_range(0.0, length))
        .collect();
    let mut hit = vec![false; rays.len()];
    let report = caster.occluded_into(&rays, &mut hit);
    assert!(report.near_rays < 200, "{report:?}");
}
