//! Every walk over the trees of every builder.

use crate::bench::{Bench, coordinates};
use crate::scenes;
use ropewalk::Geometry;
use ropewalk::build::{BuildSettings, Measure, Preset, RaySample, Termination, build};
use ropewalk_testkit::rays::{Draw, aligned_ray, generic_ray, grid_ray};
use std::sync::Arc;

const MEASURES: [Measure; 7] = Measure::ALL;

/// Settings that make deep and shallow trees, with clipping and without.
fn settings(measure: Measure, draw: &mut Draw) -> BuildSettings {
    let terminations = [
        Termination::Fixed { leaf_size: 1, max_depth: Some(14) },
        Termination::Fixed { leaf_size: 4, max_depth: None },
        Termination::Automatic { max_ratio: 0.75 },
        Termination::Cost { max_depth: None },
    ];
    BuildSettings {
        measure,
        termination: terminations[draw.below(4)],
        clipping: draw.chance(0.7),
        late_cutting: draw.chance(0.7),
        threads: 1,
        ..BuildSettings::default()
    }
}

fn check(settings: &BuildSettings, geometry: Geometry, draw: &mut Draw) {
    let (tree, _) = build(&geometry, settings, &()).unwrap();
    let bench = Bench::new(Arc::new(geometry), Arc::new(tree));
    for accelerator in &bench.walks {
        if let Some(ropes) = accelerator.ropes() {
            ropes.validate(bench.tree()).unwrap();
        }
        if let Some(rope_trees) = accelerator.rope_trees() {
            rope_trees.validate(bench.tree()).unwrap();
        }
    }
    let (values, bounds) = (coordinates(&bench), bench.geometry().bounds());
    for _ in 0..100 {
        bench.check_with_ranges(&generic_ray(draw, &bounds), draw);
        bench.check_with_ranges(&aligned_ray(draw, &values), draw);
        bench.check_with_ranges(&grid_ray(draw, 5), draw);
    }
}

#[test]
fn every_measure() {
    for (round, measure) in MEASURES.into_iter().enumerate() {
        for repeat in 0..3 {
            let mut draw = Draw::new(1000 + 10 * round as u64 + repeat);
            let draw = &mut draw;
            for geometry in all_scenes(draw, round % 3) {
                let settings = settings(measure, draw);
                check(&settings, geometry, draw);
            }
        }
    }
}

#[test]
fn binned_planes_and_presets() {
    for round in 0..4 {
        let mut draw = Draw::new(2000 + round);
        let draw = &mut draw;
        for geometry in all_scenes(draw, round as usize % 3) {
            let binned_from = [0, 8, 33][draw.below(3)];
            let settings = BuildSettings { binned_from, ..settings(Measure::MacDonaldBooth, draw) };
            check(&settings, geometry.clone(), draw);
            let preset = Preset::ALL[draw.below(Preset::ALL.len())];
            let settings = BuildSettings { threads: 1, ..BuildSettings::preset(preset) };
            check(&settings, geometry.clone(), draw);
            let bounds = geometry.bounds();
            let rays: Vec<_> = (0..300).map(|_| generic_ray(draw, &bounds)).collect();
            check(&BuildSettings { rays: RaySample::new(&rays), ..settings }, geometry, draw);
        }
    }
}

/// One scene of each kind; the flat one is perpendicular to `axis`.
fn all_scenes(draw: &mut Draw, axis: usize) -> [Geometry; 9] {
    [
        scenes::soup(draw, 200, 1.0),
        scenes::exponent_soup(draw, 100, -8.0, 8.0),
        scenes::mixed(draw, 150, false),
        scenes::mixed(draw, 80, true),
        scenes::grid_soup(draw, 120, 4),
        scenes::grid_quads(draw, 80, 4),
        scenes::flat(draw, 40, axis),
        scenes::offset(&scenes::grid_soup(draw, 100, 4), [1e6, 0.0, -1e6]),
        Geometry::new(),
    ]
}
