//! Trees built with a sample of rays, and by cost models of a name.

use ropewalk::build::{BuildError, BuildSettings, CostChoice, Preset, RaySample, build};
use ropewalk::double::{DoubleBruteForce, DoubleCaster, DoubleGeometry, DoubleRay};
use ropewalk::kernel::BatchCaster;
use ropewalk::primitive::Triangle;
use ropewalk::traverse::{BruteForce, NoCounts, RayCaster};
use ropewalk::tree::BspTree;
use ropewalk::wide::WideTree;
use ropewalk::{Geometry, Ray, Sides};
use ropewalk_testkit::rays::{Draw, invalid_rays};

/// Triangles of many sizes in the unit cube.
fn soup(draw: &mut Draw, count: usize) -> Geometry {
    let mut geometry = Geometry::new();
    for _ in 0..count {
        let reach = draw.uniform(-8.0, -4.0).exp2();
        let center: [f64; 3] = std::array::from_fn(|_| draw.uniform(0.0, 1.0));
        let mut corner = || center.map(|c| (c + draw.uniform(-reach, reach)) as f32);
        let vertices = [corner(), corner(), corner()];
        geometry.push(Triangle { vertices }, Sides::Both).expect("finite triangle");
    }
    geometry
}

/// Rays from above down through a corner of the cube, a little slanted.
fn down(draw: &mut Draw, count: usize) -> Vec<Ray> {
    let ray = |draw: &mut Draw| {
        let mut at = |low, high| draw.uniform(low, high) as f32;
        Ray::new([at(0.0, 0.3), at(0.0, 0.3), 2.0], [at(-0.05, 0.05), at(-0.05, 0.05), -1.0])
    };
    (0..count).map(|_| ray(draw)).collect()
}

fn with_rays(preset: Preset, rays: &[Ray], threads: usize) -> BuildSettings {
    BuildSettings { rays: RaySample::new(rays), threads, ..BuildSettings::preset(preset) }
}

/// The tree of a preset and a sample, checked.
fn tree(geometry: &Geometry, preset: Preset, rays: &[Ray], threads: usize) -> BspTree {
    let settings = with_rays(preset, rays, threads);
    let (tree, report) = build(geometry, &settings, &()).expect("settings in range");
    tree.validate(geometry).unwrap_or_else(|fault| panic!("{preset:?}: {fault}"));
    let limit = settings.max_duplication * geometry.len() as f64;
    assert!(report.tree.references as f64 <= limit, "{preset:?}: {report:?}");
    tree
}

#[test]
fn rays_like_those_of_the_sample_meet_fewer_blocks() {
    let mut draw = Draw::new(1);
    let geometry = soup(&mut draw, 20_000);
    let (sample, asked) = (down(&mut draw, 5000), down(&mut draw, 5000));
    let blocks = |settings: &BuildSettings| {
        let (wide, _) = WideTree::build(&geometry, settings, &()).unwrap();
        BatchCaster::new(&wide, &geometry).all_hits_events(&asked).blocks as f64
    };
    let plain = blocks(&with_rays(Preset::Balanced, &[], 0));
    for preset in [Preset::Fast, Preset::Balanced, Preset::Best] {
        let steered = blocks(&with_rays(preset, &sample, 0));
        assert!(steered < 0.95 * plain, "{preset:?}: {steered} of {plain}");
    }
}

#[test]
fn answers_are_those_of_brute_force() {
    let mut draw = Draw::new(2);
    let geometry = soup(&mut draw, 2000);
    let (sample, asked) = (down(&mut draw, 500), down(&mut draw, 300));
    let oracle = BruteForce { geometry: &geometry };
    for preset in Preset::ALL {
        let (wide, report) =
            WideTree::build(&geometry, &with_rays(preset, &sample, 2), &()).unwrap();
        assert_eq!(report.settings.rays.len(), sample.len());
        let hits = BatchCaster::new(&wide, &geometry).closest_hit(&asked);
        for (i, ray) in asked.iter().enumerate() {
            let hit = oracle.closest_hit(ray, &mut NoCounts);
            let expected = hit.map_or((f32::INFINITY, u32::MAX), |h| (h.t, h.prim_id));
            assert_eq!((hits.t[i], hits.prim_id[i]), expected, "{preset:?}, {ray:?}");
        }
    }
}

#[test]
fn the_tree_does_not_depend_on_the_number_of_threads() {
    let mut draw = Draw::new(3);
    let geometry = soup(&mut draw, 30_000);
    let sample = down(&mut draw, 20_000);
    for preset in Preset::ALL {
        let one = tree(&geometry, preset, &sample, 1);
        assert!(one != tree(&geometry, preset, &[], 1), "{preset:?}: rays do nothing");
        for threads in [2, 5] {
            assert!(one == tree(&geometry, preset, &sample, threads), "{preset:?}");
        }
    }
}

#[test]
fn samples_of_nothing_change_nothing() {
    let mut draw = Draw::new(4);
    let geometry = soup(&mut draw, 3000);
    let invalid = invalid_rays();
    assert_eq!(RaySample::new(&invalid).left_out(), invalid.len());
    let aside = vec![Ray::new([5.0, 5.0, 5.0], [1.0, 0.5, 0.25]); 1000];
    let short = vec![Ray::new([0.5, 0.5, 2.0], [0.0, 0.0, -1.0]).with_range(0.0, 0.5); 1000];
    for preset in Preset::ALL {
        // With a sample even the best preset looks at bins.
        let from = if preset == Preset::Best { 33 } else { usize::MAX };
        let mut settings = with_rays(preset, &[], 1);
        settings.binned_from = settings.binned_from.min(from);
        let (plain, _) = build(&geometry, &settings, &()).unwrap();
        for sample in [&aside[..], &short] {
            assert!(plain == tree(&geometry, preset, sample, 1), "{preset:?}");
        }
        let plain = tree(&geometry, preset, &[], 1);
        assert!(plain == tree(&geometry, preset, &invalid, 1), "{preset:?}");
    }
}

#[test]
fn hostile_samples() {
    let mut draw = Draw::new(5);
    let geometry = soup(&mut draw, 3000);
    let line = Ray::new([0.5, 0.5, -1.0], [0.001, 0.002, 1.0]);
    let on_axis = Ray::new([0.5, 0.5, -1.0], [0.0, 0.0, 1.0]);
    let point = Ray::new([0.5; 3], [1.0; 3]).with_range(0.0, 0.0);
    let whole =
        Ray::new([0.5; 3], [1.0, -1e-30, 3e38]).with_range(f32::NEG_INFINITY, f32::INFINITY);
    let tiny = Ray::new([0.5; 3], [1e-45, 0.0, 0.0]);
    for ray in [line, on_axis, point, whole, tiny] {
        for preset in Preset::ALL {
            tree(&geometry, preset, &vec![ray; 100_000], 2);
        }
    }
    let empty = Geometry::new();
    tree(&empty, Preset::Balanced, &[line; 100], 1);
    let mut flat = Geometry::new();
    for i in 0..100 {
        let x = i as f32;
        let vertices = [[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0], [x, 1.0, 0.0]];
        flat.push(Triangle { vertices }, Sides::Both).unwrap();
    }
    for preset in Preset::ALL {
        tree(&flat, preset, &down(&mut draw, 1000), 1);
    }
}

#[test]
fn of_a_million_rays_some_are_kept_from_all_over() {
    let rays: Vec<Ray> =
        (0..1_000_000).map(|i| Ray::new([i as f32, 0.0, 0.0], [0.0, 0.0, 1.0])).collect();
    let sample = RaySample::new(&rays);
    assert_eq!((sample.len(), sample.left_out()), (RaySample::MAX, 0));
    assert_eq!(sample, RaySample::new(&rays));
    let mut draw = Draw::new(6);
    let geometry = soup(&mut draw, 5000);
    let many = down(&mut draw, 1_000_000);
    tree(&geometry, Preset::Balanced, &many, 2);
}

#[test]
fn rays_need_the_surface_area() {
    let mut draw = Draw::new(7);
    let geometry = soup(&mut draw, 100);
    let sample = with_rays(Preset::Balanced, &down(&mut draw, 100), 1);
    for choice in CostChoice::ALL {
        let built = WideTree::build(&geometry, &choice.applied(sample.clone()), &());
        match (choice, built) {
            (CostChoice::SurfaceArea, built) => assert!(built.is_ok()),
            (_, Err(BuildError::Setting { field: "rays", .. })) => {}
            (choice, built) => panic!("{choice:?}: {built:?}"),
        }
    }
}

#[test]
fn memory_limits_count_the_rays() {
    let mut draw = Draw::new(8);
    let geometry = soup(&mut draw, 1000);
    let limit = Some(ropewalk::build::estimated_bytes(1000, 2.0));
    let plain = BuildSettings { memory_limit: limit, ..with_rays(Preset::Balanced, &[], 1) };
    assert!(WideTree::build(&geometry, &plain, &()).is_ok());
    let settings = BuildSettings {
        memory_limit: limit,
        ..with_rays(Preset::Balanced, &down(&mut draw, 60_000), 1)
    };
    let refused = WideTree::build(&geometry, &settings, &());
    assert!(matches!(refused, Err(BuildError::Memory { .. })), "{refused:?}");
}

#[test]
fn every_cost_model_builds_wide_trees_that_answer_right() {
    let mut draw = Draw::new(9);
    let geometry = soup(&mut draw, 1500);
    let asked = down(&mut draw, 200);
    let oracle = BruteForce { geometry: &geometry };
    let mut sizes = Vec::new();
    for choice in CostChoice::ALL {
        for preset in Preset::ALL {
            let settings = choice.applied(BuildSettings::preset(preset));
            let (wide, report) = WideTree::build(&geometry, &settings, &()).unwrap();
            assert_eq!(CostChoice::of(&report.settings), Some(choice));
            let caster = BatchCaster::new(&wide, &geometry);
            for ray in &asked {
                let hit = oracle.closest_hit(ray, &mut NoCounts);
                assert_eq!(caster.closest_hit_one(ray), hit, "{choice:?}, {preset:?}");
            }
            if preset == Preset::Best {
                sizes.push((report.tree.inner_nodes, report.tree.references));
            }
        }
    }
    let first = sizes[0];
    assert!(sizes[1..].iter().all(|&size| size != first), "models make the same tree: {sizes:?}");
}

#[test]
fn double_precision_takes_both() {
    let mut draw = Draw::new(10);
    let corner = |d: &mut Draw| -> [f64; 3] { std::array::from_fn(|_| 1e7 + d.uniform(0.0, 1.0)) };
    let vertices: Vec<[f64; 3]> = (0..3000).map(|_| corner(&mut draw)).collect();
    let faces = (0..1000).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let geometry = DoubleGeometry::from_triangles(vertices, faces).unwrap();
    let rays: Vec<DoubleRay> = (0..500)
        .map(|_| {
            let (from, to) = (corner(&mut draw), corner(&mut draw));
            DoubleRay::new(from, std::array::from_fn(|a| to[a] - from[a]))
        })
        .collect();
    let sample = geometry.ray_sample(&rays);
    assert_eq!((sample.len(), sample.left_out()), (500, 0));
    let nan = DoubleRay::new([f64::NAN; 3], [1.0; 3]);
    assert_eq!(geometry.ray_sample(&[nan, rays[0]]).left_out(), 1);
    let preset = BuildSettings::preset(Preset::Balanced);
    let steered = BuildSettings { rays: sample, ..preset.clone() };
    let oracle = DoubleBruteForce { geometry: &geometry };
    for settings in [steered, CostChoice::Termination.applied(preset)] {
        let (tree, _) = geometry.build(&settings, &()).unwrap();
        let hits = DoubleCaster::new(&tree, &geometry).closest_hit(&rays[..50]);
        for (i, ray) in rays[..50].iter().enumerate() {
            let hit = oracle.closest_hit(ray);
            let expected = hit.map_or((f64::INFINITY, u32::MAX), |h| (h.t, h.prim_id));
            assert_eq!((hits.t[i], hits.prim_id[i]), expected, "{ray:?}");
        }
    }
}
