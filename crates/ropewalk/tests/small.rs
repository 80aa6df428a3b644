//! A dozen triangles and a handful of rays through builder, compiler and kernels at every level: little enough for Miri
//! (`scripts/sanitize --miri`), which looks for undefined behaviour where tests see right answers only.

use ropewalk::build::BuildSettings;
use ropewalk::kernel::{BatchCaster, Level, Start};
use ropewalk::point::PointQueries;
use ropewalk::primitive::Sphere;
use ropewalk::traverse::{BruteForce, NoCounts, RayCaster};
use ropewalk::wide::WideTree;
use ropewalk::{Geometry, Ray, Sides};
use ropewalk_testkit::rays::Draw;

/// A cube from 0 to 1, turned outwards.
fn cube() -> Geometry {
    let vertices: Vec<[f32; 3]> =
        (0..8).map(|i| [i & 1, i >> 1 & 1, i >> 2].map(|x| x as f32)).collect();
    let faces = [
        [0, 2, 1],
        [1, 2, 3],
        [4, 5, 6],
        [5, 7, 6],
        [0, 1, 4],
        [1, 5, 4],
        [2, 6, 3],
        [3, 6, 7],
        [0, 4, 2],
        [2, 4, 6],
        [1, 3, 5],
        [3, 7, 5],
    ];
    Geometry::from_triangles(&vertices, &faces).unwrap()
}

fn rays(count: usize) -> Vec<Ray> {
    let mut draw = Draw::new(5);
    let ray = |i: usize| {
        let origin = std::array::from_fn(|_| draw.uniform(-0.5, 1.5) as f32);
        let ray = Ray::new(origin, draw.direction());
        // Some are short, so that the entry search has what to answer; one is nothing.
        match i % 4 {
            0 => ray.with_range(0.0, 0.05),
            1 if i == 5 => ray.with_range(1.0, 0.0),
            _ => ray,
        }
    };
    (0..count).map(ray).collect()
}

fn check(geometry: &Geometry) {
    let settings = BuildSettings { threads: 1, ..BuildSettings::default() };
    let (wide, _) = WideTree::build(geometry, &settings, &()).unwrap();
    wide.link_up();
    let (rays, oracle) = (rays(30), BruteForce { geometry });
    for level in Level::ALL {
        let caster = BatchCaster::new(&wide, geometry).with_threads(1);
        let Some(caster) = caster.with_level(level) else { continue };
        let cells = caster.cells_at(&rays, &vec![0.0; rays.len()]);
        for start in [Start::Root, Start::Entry] {
            let caster = caster.with_start(start);
            let (hits, occluded) = (caster.closest_hit(&rays), caster.occluded(&rays));
            let from_cells = caster.with_cells(&cells).closest_hit(&rays);
            let (all, two, counts) =
                (caster.all_hits(&rays), caster.first_hits(&rays, 2), caster.count_hits(&rays));
            for (i, ray) in rays.iter().enumerate() {
                let hit = oracle.closest_hit(ray, &mut NoCounts);
                let expected = hit.map_or((f32::INFINITY, u32::MAX), |hit| (hit.t, hit.prim_id));
                assert_eq!((hits.t[i], hits.prim_id[i]), expected, "{ray:?}");
                assert_eq!((from_cells.t[i], from_cells.prim_id[i]), expected, "{ray:?}");
                assert_eq!(occluded[i], hit.is_some());
                assert_eq!(caster.closest_hit_one(ray), hit);
                let list: Vec<u32> = geometry.all_hits(ray).iter().map(|hit| hit.prim_id).collect();
                assert_eq!(all.prim_id[all.offsets[i]..all.offsets[i + 1]], list);
                assert_eq!(
                    two.prim_id[two.offsets[i]..two.offsets[i + 1]],
                    list[..list.len().min(2)]
                );
                assert_eq!(counts[i] as usize, list.len());
            }
        }
    }
}

#[test]
fn triangles() {
    check(&cube());
}

#[test]
fn triangles_and_a_sphere() {
    let mut geometry = cube();
    geometry.push(Sphere { center: [0.5; 3], radius: 0.25 }, Sides::Both).unwrap();
    check(&geometry);
}

/// From an eye, to the plane behind: beams.
#[test]
fn a_picture() {
    let geometry = cube();
    let settings = BuildSettings { threads: 1, ..BuildSettings::default() };
    let (wide, _) = WideTree::build(&geometry, &settings, &()).unwrap();
    let side = 16;
    let to = |i: usize| (i as f32 + 0.5) / side as f32 * 0.2 + 0.9;
    let rays: Vec<Ray> = (0..side * side)
        .map(|i| Ray::new([0.4, 0.6, -2.0], [to(i % side) - 0.4, to(i / side) - 0.6, 2.0]))
        .collect();
    let oracle = BruteForce { geometry: &geometry };
    for level in Level::ALL {
        let caster = BatchCaster::new(&wide, &geometry).with_threads(1);
        let Some(caster) = caster.with_level(level) else { continue };
        let (mut t, mut prim_id) = (vec![0.0; rays.len()], vec![0; rays.len()]);
        let report = caster.closest_hit_into(&rays, &mut t, &mut prim_id);
        assert!(report.beam_rays > 0, "{report:?}");
        for (i, ray) in rays.iter().enumerate() {
            let hit = oracle.closest_hit(ray, &mut NoCounts);
            let expected = hit.map_or((f32::INFINITY, u32::MAX), |hit| (hit.t, hit.prim_id));
            assert_eq!((t[i], prim_id[i]), expected, "{ray:?}");
        }
    }
}

#[test]
fn points() {
    let geometry = cube();
    let settings = BuildSettings { threads: 1, ..BuildSettings::default() };
    let (wide, _) = WideTree::build(&geometry, &settings, &()).unwrap();
    for level in Level::ALL {
        let queries = PointQueries::new(&wide, &geometry).unwrap().with_threads(1);
        let Some(queries) = queries.with_level(level) else { continue };
        let points = [[0.5, 0.5, 0.25], [0.5, 0.5, -1.0], [2.0, 0.5, 0.5], [0.0, 0.5, 0.5]];
        assert_eq!(queries.distance(&points), [0.25, 1.0, 1.0, 0.0]);
        assert_eq!(queries.contains(&points), [true, false, false, true]);
    }
}
