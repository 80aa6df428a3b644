//! Rays that start from cells, right or wrong ones, answer bit for bit as those from the root do.

use crate::scenes;
use ropewalk::kernel::{BatchCaster, Level, Start};
use ropewalk::point::{Cell, PointQueries};
use ropewalk::traverse::{BruteForce, NoCounts, RayCaster};
use ropewalk::wide::{LEAF, WideTree, code_line};
use ropewalk::{Geometry, Ray};
use ropewalk_testkit::rays::{Draw, generic_ray, invalid_rays};
use ropewalk_testkit::trees::{TreeShape, random_tree};

/// Short and long rays.
fn rays(draw: &mut Draw, geometry: &Geometry) -> Vec<Ray> {
    let bounds = geometry.bounds();
    let mut rays = invalid_rays();
    for _ in 0..800 {
        let length = bounds.diagonal() * draw.uniform(-12.0, 1.0).exp2();
        let ray = Ray::new(draw.point_in(&bounds), draw.direction());
        rays.push(ray.with_range(0.0, length as f32));
    }
    rays.extend((0..100).map(|_| generic_ray(draw, &bounds)));
    rays
}

fn each(seed: u64, scene: impl Fn(&mut Draw) -> Geometry) {
    for round in 0..4 {
        let mut draw = Draw::new(seed + round);
        let geometry = scene(&mut draw);
        let shape = TreeShape { max_depth: 6 + draw.below(16), ..TreeShape::default() };
        let tree = random_tree(&mut draw, &geometry, shape).unwrap();
        let wide = WideTree::compile(&tree, &geometry).unwrap();
        assert!(wide.up().is_none() && wide.link_up().bytes() > 0);
        let rays = rays(&mut draw, &geometry);
        let oracle = BruteForce { geometry: &geometry };
        let expected: Vec<_> = rays.iter().map(|r| oracle.closest_hit(r, &mut NoCounts)).collect();
        let root = BatchCaster::new(&wide, &geometry).with_start(Start::Root);
        let all = root.all_hits(&rays);
        let lines = wide.lines().len() as u32;
        // Where the rays start, where other rays do, treelets and blocks at random, and no lines at all.
        let right = root.cells_at(&rays, &vec![0.0; rays.len()]);
        let mut stale = right.clone();
        stale.rotate_left(7);
        let mut cell = |bits: u32| Some(Cell::from_bits(draw.bits() as u32 % bits));
        let random: Vec<_> = rays.iter().map(|_| cell(8 * lines)).collect();
        let wild: Vec<_> = rays.iter().map(|_| cell(u32::MAX)).collect();
        let few = right[..rays.len() / 2].to_vec();
        for cells in [right, stale, random, wild, few, vec![None; rays.len()], Vec::new()] {
            for level in Level::ALL {
                let Some(caster) = root.with_level(level) else { continue };
                for start in [Start::Entry, Start::Automatic] {
                    let caster = caster.with_start(start).with_cells(&cells);
                    let (hits, hit) = (caster.closest_hit(&rays), caster.occluded(&rays));
                    for (i, ray) in rays.iter().enumerate() {
                        let best =
                            expected[i].map_or((f32::INFINITY, u32::MAX), |h| (h.t, h.prim_id));
                        assert_eq!((hits.t[i], hits.prim_id[i]), best, "{} {ray:?}", level.name());
                        assert_eq!(hit[i], expected[i].is_some(), "{} {ray:?}", level.name());
                    }
                    assert_eq!(caster.all_hits(&rays), all);
                }
            }
        }
    }
}

#[test]
fn cells_change_no_answer() {
    each(1, |d| scenes::soup(d, 300, 1.0));
    each(2, |d| scenes::exponent_soup(d, 120, -6.0, 6.0));
    each(3, |d| scenes::mixed(d, 100, true));
    each(4, |d| scenes::grid_quads(d, 40, 4));
    each(5, |d| scenes::offset(&scenes::soup(d, 200, 1.0), [1e6, 0.0, -1e6]));
    each(6, |d| scenes::exponent_soup(d, 60, -19.0, 19.0));
    each(7, |d| scenes::soup(d, 2, 1.0));
}

/// Short rays start from their cells; what is reported adds up.
#[test]
fn it_is_reported_how_rays_started() {
    let mut draw = Draw::new(20);
    let geometry = scenes::soup(&mut draw, 300, 1.0);
    let (wide, _) = WideTree::build(&geometry, &Default::default(), &()).unwrap();
    let short: Vec<Ray> = (0..2000)
        .map(|_| {
            Ray::new(draw.point_in(&geometry.bounds()), draw.direction()).with_range(0.0, 1e-4)
        })
        .collect();
    let caster = BatchCaster::new(&wide, &geometry).with_threads(1).with_start(Start::Entry);
    let cells = caster.cells_at(&short, &vec![0.0; short.len()]);
    let mut hit = vec![false; short.len()];
    // Without the table there is nothing to climb by.
    let report = caster.with_cells(&cells).occluded_into(&short, &mut hit);
    assert_eq!((report.cell_rays, report.entry_rays), (0, 2000));
    wide.link_up();
    let report = caster.with_cells(&cells).occluded_into(&short, &mut hit);
    assert!(report.cell_rays > 1500, "{report:?}");
    assert_eq!(report.cell_rays + report.climbed_rays, 2000);
    let wild = vec![Some(Cell::from_bits(u32::MAX)); short.len()];
    let report = caster.with_cells(&wild).occluded_into(&short, &mut hit);
    assert_eq!((report.cell_rays, report.climbed_rays), (0, 2000));
}

/// The table holds the treelets of the tree with their cells.
#[test]
fn the_table_leads_up() {
    let mut draw = Draw::new(30);
    let geometry = scenes::soup(&mut draw, 300, 1.0);
    let (wide, _) = WideTree::build(&geometry, &Default::default(), &()).unwrap();
    let (up, points) = (wide.link_up(), PointQueries::new(&wide, &geometry).unwrap());
    let mut seen = 0;
    for line in 0..wide.lines().len() as u32 + 70 {
        let Some(number) = up.number(line) else { continue };
        assert_eq!((number, up.above(number).line()), (seen, line));
        seen += 1;
        let (above, treelet) = (up.above(number), wide.lines().treelet(line as usize));
        for child in 0..8 {
            let code = treelet.child[child];
            if code != 0 && code & LEAF == 0 {
                let below = up.number(code_line(code) as u32).unwrap();
                assert_eq!(up.above(below).parent(), number);
                let holds = |i: usize| up.above(below).0[i] >= above.0[i];
                assert!([0, 1, 2, 4, 5, 6].into_iter().all(holds));
            } else if let Some(bounds) = points.cell_box(Cell::from_bits(line * 8 + child as u32)) {
                assert!(
                    (0..3).all(|a| bounds.min[a] >= above.0[a] && bounds.max[a] <= -above.0[a + 4])
                );
            }
        }
    }
    assert_eq!(seen, wide.treelets());
}
