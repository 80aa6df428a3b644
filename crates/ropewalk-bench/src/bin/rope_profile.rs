//! What segments of transport walks meet from leaf to leaf: `rope_profile SCENES WORKLOADS [ROUNDS] [PRESET]`, names
//! separated by commas.
//!
//! Each segment starts in the leaf that holds its origin, which is known beforehand and not counted. A line says, by
//! segment: leaves visited, those of them that are empty, ropes followed, rope-tree steps, tests, walks that were
//! finished from the root, the time of that reference walk (scalar, in `f64`), and the bytes a triangle of the
//! records of leaves with their ropes; beside them the steps and blocks of the batch call over the same segments, and its time.

use anyhow::Context;
use ropewalk::build::{self, BuildSettings, Preset};
use ropewalk::kernel::Start;
use ropewalk::traverse::{ClosestHit, Counts, NoCounts, locate, rope_trees};
use ropewalk::{Ray, rope::RopeTrees};
use ropewalk_bench::answer::BenchHit;
use ropewalk_bench::harness::{Clock, Engine, Spread};
use ropewalk_bench::own::{Wave, geometry};
use ropewalk_bench::scene::Catalog;
use ropewalk_bench::workload::{Generator, Kind, Sizes};
use std::path::PathBuf;

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let list = |i: usize| {
        let text: &str = arguments.get(i).map_or("", String::as_str);
        text.split(',').filter(|s| !s.is_empty()).map(str::to_owned).collect::<Vec<String>>()
    };
    let rounds: usize = arguments.get(2).map_or(Ok(5), |n| n.parse())?;
    let preset = arguments.get(3).map_or("balanced", String::as_str);
    let preset = Preset::ALL.into_iter().find(|p| p.name() == preset).context("no such preset")?;
    let settings = BuildSettings { threads: 1, ..BuildSettings::preset(preset) };
    let catalog =
        Catalog { data: PathBuf::from("../shared/data"), generated: "target/bench-scenes".into() };
    println!(
        "scene,workload,leaves,empty,ropes,rope_tree_steps,tests,restarts,rope_ns,rope_bytes,steps,blocks,batch_ns"
    );
    for entry in Catalog::select(&list(0))? {
        let scene = catalog.load(&entry)?;
        let geometry = geometry(&scene.mesh)?;
        let (tree, _) = build::build(&geometry, &settings, &())?;
        let ropes = RopeTrees::build(&tree)?;
        let wave = Wave::with_settings(&scene.mesh, &settings)?;
        let trace = |rays: &[Ray], out: &mut [BenchHit]| wave.closest(rays, out);
        let sizes = Sizes { side: 64, chords: 1024, walk: 1 << 17 };
        let generator = Generator::new(&scene.mesh, &scene.view, sizes, &trace);
        for name in list(1) {
            let kind = Kind::named(&name).with_context(|| format!("no workload {name}"))?;
            let rays = generator.workload(kind).rays;
            let starts: Vec<_> = rays.iter().map(|ray| locate(&tree, ray.origin)).collect();
            let mut counts = Counts::default();
            for (ray, &start) in rays.iter().zip(&starts) {
                rope_trees::<ClosestHit, _>(&geometry, &tree, &ropes, ray, start, &mut counts);
            }
            let caster = wave.caster().with_start(Start::Automatic);
            let events = caster.closest_hit_events(&rays);
            let (mut t, mut prim) = (vec![0.0; rays.len()], vec![0; rays.len()]);
            let (mut roped, mut batch) = (Vec::new(), Vec::new());
            for _ in 0..rounds {
                let clock = Clock::start();
                for (ray, &start) in rays.iter().zip(&starts) {
                    let (hit, _) = rope_trees::<ClosestHit, _>(
                        &geometry,
                        &tree,
                        &ropes,
                        ray,
                        start,
                        &mut NoCounts,
                    );
                    std::hint::black_box(hit);
                }
                roped.push(clock.elapsed().0 * 1e9 / rays.len() as f64);
                let clock = Clock::start();
                caster.closest_hit_into(&rays, &mut t, &mut prim);
                batch.push(clock.elapsed().0 * 1e9 / rays.len() as f64);
            }
            let median = |times: &[f64]| Spread::of(times).map_or(f64::NAN, |s| s.median);
            let each = |count: u64| count as f64 / rays.len() as f64;
            println!(
                "{},{name},{:.3},{:.3},{:.3},{:.3},{:.3},{:.4},{:.1},{:.0},{:.3},{:.3},{:.1}",
                entry.name,
                each(counts.leaf_visits),
                each(counts.empty_leaf_visits),
                each(counts.rope_crossings),
                each(counts.rope_tree_steps),
                each(counts.intersection_tests),
                each(counts.restarts),
                median(&roped),
                ropes.bytes() as f64 / scene.mesh.faces.len() as f64,
                each(events.steps),
                each(events.blocks),
                median(&batch),
            );
        }
    }
    Ok(())
}
