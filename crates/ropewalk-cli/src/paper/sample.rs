//! Made-up results, so that tables, verdicts and the report can be tested without running anything.

use super::machine::Machine;
use super::model::*;
use super::published;
use super::scenes::{Size, choose};
use super::verdict::{Headline, judge};
use crate::output::{PerRay, Rays, Tree};
use ropewalk::method::{Method, Role};

/// The first `count` scenes at standard size with figures that vary from method to method.
pub fn scenes(count: usize) -> Vec<SceneResult> {
    let chosen = choose(&[], Size::Standard).expect("all scenes are known");
    let scenes = chosen.into_iter().take(count).enumerate();
    scenes.map(|(i, choice)| scene(i, choice.name, choice.spec())).collect()
}

fn scene(index: usize, name: &str, spec: String) -> SceneResult {
    let mut methods: Vec<_> = Method::all()
        .iter()
        .enumerate()
        .map(|(m, method)| method_result(index, m, method))
        .collect();
    fill_ratios(&mut methods);
    SceneResult {
        name: name.to_owned(),
        spec,
        objects: 8192,
        rays: Rays { primary: 263_169, primary_hits: 200_000, shadow: 900_000, ..Rays::default() },
        counted_rays: 1_163_169,
        stride: 1,
        timed_rays: 100_000,
        published: published::efficiency(name).map(|e| Outside { octree: e.octree, grid: e.grid }),
        methods,
    }
}

/// A number in 0..1 that looks random and is always the same.
fn noise(a: usize, b: usize) -> f64 {
    let x = (a as f64 * 12.9898 + b as f64 * 78.233).sin() * 43_758.547;
    x - x.floor()
}

fn method_result(scene: usize, index: usize, method: &Method) -> MethodResult {
    let share = match method.role {
        Role::Baseline => 1.8,
        Role::Reference => 1.0,
        Role::Exact => 0.9,
        Role::Ingredient => 0.87,
        Role::Combined => 0.66,
    } * (0.85 + 0.3 * noise(scene, index));
    let naive = method.build.is_none();
    let roped = method.name.contains("rope");
    let per_ray = PerRay {
        intersection_tests: if naive { 8192.0 } else { share * (9.0 + scene as f64) },
        traversal_steps: if naive { 0.0 } else { share * 25.0 },
        leaf_visits: if naive { 0.0 } else { share * 7.0 },
        empty_leaf_visits: if naive { 0.0 } else { share * 3.0 },
        rope_crossings: if roped { 6.0 } else { 0.0 },
        rope_tree_steps: if roped { 9.0 } else { 0.0 },
        ..PerRay::default()
    };
    let tree = if naive {
        Tree::default()
    } else {
        Tree {
            inner_nodes: (share * 20_000.0) as u64,
            leaves: (share * 20_000.0) as u64 + 1,
            empty_leaves: 4000,
            references: (share * 30_000.0) as u64,
            depth: 18,
            bytes: if roped { 5_000_000 } else { 500_000 },
            build_seconds: 0.05,
        }
    };
    let operations = per_ray.operations();
    MethodResult {
        name: method.name,
        title: method.title,
        role: role_name(method.role),
        roped,
        size: tree.size(),
        bytes_per_leaf: (!naive).then(|| tree.bytes as f64 / tree.leaves as f64),
        tree,
        operations,
        all_steps: all_steps(&per_ray),
        per_ray,
        from_root: roped.then_some(per_ray),
        counted_rays: 1_163_169,
        timed_rays: 100_000,
        seconds: MethodSeconds { read: 0.01, build: 0.05, trace: 0.1 * share },
        microseconds_per_ray: share,
        trace_spread: 0.02,
        timed_builds: 5,
        predicted: (!naive).then_some(Predicted {
            traversal_steps: share * 33.0,
            leaf_visits: share * 8.5,
            empty_leaf_visits: share * 3.2,
            intersection_tests: share * 11.0,
        }),
        estimator: method.name.starts_with("termination").then_some(EstimatorError {
            beta: Some(0.7),
            mean_truth: 0.31,
            bias: -0.02,
            mean_absolute: 0.08,
            samples: 4000,
        }),
        ratio_to_macdonald_booth: Ratios::default(),
        ratio_to_exact: Ratios::default(),
    }
}

/// A whole experiment of `count` scenes with every section filled.
pub fn experiment(count: usize) -> Experiment {
    let scenes = scenes(count);
    let mut sensitivity = Vec::new();
    for (i, scene) in scenes.iter().enumerate() {
        for (j, leaf_size) in [1, 2, 4, 8].into_iter().enumerate() {
            for (k, depth) in ["auto", "16", "20", "30"].into_iter().enumerate() {
                sensitivity.push(SensitivityCell {
                    scene: scene.name.clone(),
                    leaf_size,
                    max_depth: depth.to_owned(),
                    reference: 40.0 + noise(j, k),
                    exact: 36.0 + 3.0 * noise(i, k),
                    combined: 26.0 + 9.0 * noise(i + j, k),
                });
            }
        }
    }
    let point = |scene, objects: u64| {
        let n = objects as f64;
        let seconds = 130e-9 * n * n.log2();
        ScalingPoint {
            scene,
            objects,
            build_seconds: seconds,
            nanoseconds_per_n_log_n: 130.0,
            operations: 10.0 + n.log2(),
            size: 5 * objects,
        }
    };
    let mut scaling: Vec<_> =
        [16_384, 65_536, 262_144, 1_048_576].map(|n| point("tetra", n)).to_vec();
    scaling.extend([7_382, 66_431, 597_872].map(|n| point("balls", n)));
    Experiment {
        version: "0.0.0",
        date: "2000-02-29".to_owned(),
        command: "ropewalk paper -o \"a & b\".html".to_owned(),
        machine: Machine { cpu: "A <fast> processor".to_owned(), cores: 2, os: "linux" },
        size: "standard",
        protocol: Protocol {
            timed_rays: 100_000,
            rounds: 5,
            slow_build_seconds: 2.0,
            counting_threads: 2,
        },
        headline: Headline::new(&scenes),
        verdicts: judge(&scenes),
        sensitivity,
        scaling,
        scenes,
    }
}
