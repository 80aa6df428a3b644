//! Trees built with a sample of rays beside trees built without:
//! `rays_profile SCENES SAMPLES WORKLOADS [ROUNDS] [PRESET]`, names separated by commas.
//!
//! For each scene and kind of sample there is a tree without rays, one with rays of that kind, and one with the
//! same rays ending at their hits; all are asked the same workloads in turn. Samples are drawn with another seed and from
//! another picture than the rays that are measured.

use anyhow::Context;
use ropewalk::Ray;
use ropewalk::build::{BuildSettings, Preset, RaySample};
use ropewalk::kernel::{AllHits, BatchCaster, Start};
use ropewalk_bench::answer::BenchHit;
use ropewalk_bench::harness::{Clock, Engine, Spread};
use ropewalk_bench::own::Wave;
use ropewalk_bench::scene::Catalog;
use ropewalk_bench::workload::{Generator, Kind, Question, Sizes};
use std::path::PathBuf;

/// A tree with what its build took.
struct Tree {
    name: &'static str,
    wave: Wave,
    seconds: f64,
}

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let list = |i: usize| {
        let text: &str = arguments.get(i).map_or("", String::as_str);
        text.split(',').filter(|s| !s.is_empty()).map(str::to_owned).collect::<Vec<String>>()
    };
    let rounds: usize = arguments.get(3).map_or(Ok(7), |n| n.parse())?;
    let preset = arguments.get(4).map_or("balanced", String::as_str);
    let preset = Preset::ALL.into_iter().find(|p| p.name() == preset).context("no such preset")?;
    let kinds = |names: Vec<String>| {
        let kind = |name: &String| Kind::named(name).with_context(|| format!("no {name}"));
        names.iter().map(kind).collect::<anyhow::Result<Vec<Kind>>>()
    };
    let (samples, workloads) = (kinds(list(1))?, kinds(list(2))?);
    let catalog =
        Catalog { data: PathBuf::from("../shared/data"), generated: "target/bench-scenes".into() };
    println!(
        "scene,sample,workload,tree,ns,ns_ratio,steps,leaves,blocks,build_s,bytes_per_triangle"
    );
    for entry in Catalog::select(&list(0))? {
        let scene = catalog.load(&entry)?;
        let build = |name, rays: RaySample| -> anyhow::Result<Tree> {
            let settings = BuildSettings { threads: 1, rays, ..BuildSettings::preset(preset) };
            let clock = Clock::start();
            let wave = Wave::with_settings(&scene.mesh, &settings)?;
            Ok(Tree { name, wave, seconds: clock.elapsed().0 })
        };
        let plain = build("plain", RaySample::default())?.wave;
        let trace = |rays: &[Ray], out: &mut [BenchHit]| plain.closest(rays, out);
        let generator =
            |side: usize| Generator::new(&scene.mesh, &scene.view, Sizes::of_side(side), &trace);
        let (measured, sampled) = (generator(512), generator(256).with_seed(1));
        for &sample in &samples {
            let rays = sampled.workload(sample).rays;
            let ended = ended(&rays, &trace);
            let trees = [
                build("plain", RaySample::default())?,
                build("rays", RaySample::new(&rays))?,
                build("rays to hits", RaySample::new(&ended))?,
            ];
            for &kind in &workloads {
                let rays = measured.workload(kind).rays;
                let casters: Vec<BatchCaster<'_>> =
                    trees.iter().map(|t| t.wave.caster().with_start(Start::Automatic)).collect();
                let times = time(&casters, kind.question(), &rays, rounds);
                for ((tree, caster), ns) in trees.iter().zip(&casters).zip(&times) {
                    let events = match kind.question() {
                        Question::Occluded => caster.occluded_events(&rays),
                        Question::AllHits | Question::FirstHits(_) => caster.all_hits_events(&rays),
                        _ => caster.closest_hit_events(&rays),
                    };
                    let per = |count: u64| count as f64 / rays.len().max(1) as f64;
                    println!(
                        "{},{},{},{},{ns:.1},{:.3},{:.2},{:.2},{:.2},{:.3},{:.1}",
                        entry.name,
                        sample.name(),
                        kind.name(),
                        tree.name,
                        ns / times[0],
                        per(events.steps),
                        per(events.leaves),
                        per(events.blocks),
                        tree.seconds,
                        tree.wave.bytes() as f64 / scene.mesh.faces.len() as f64,
                    );
                }
            }
        }
    }
    Ok(())
}

/// The same rays up to their hits.
fn ended(rays: &[Ray], trace: &dyn Fn(&[Ray], &mut [BenchHit])) -> Vec<Ray> {
    let mut hits = vec![BenchHit::MISS; rays.len()];
    trace(rays, &mut hits);
    let end = |(ray, hit): (&Ray, &BenchHit)| Ray { t_max: ray.t_max.min(hit.t), ..*ray };
    rays.iter().zip(&hits).map(end).collect()
}

/// Median nanoseconds of thread CPU time a ray, for each caster in turn.
fn time(casters: &[BatchCaster<'_>], question: Question, rays: &[Ray], rounds: usize) -> Vec<f64> {
    let (mut t, mut prim) = (vec![0.0; rays.len()], vec![0; rays.len()]);
    let (mut hit, mut all_hits) = (vec![false; rays.len()], AllHits::default());
    let mut samples = vec![Vec::new(); casters.len()];
    for round in 0..rounds {
        for i in 0..casters.len() {
            let at = (i + round) % casters.len();
            let (caster, clock) = (&casters[at], Clock::start());
            match question {
                Question::Occluded => drop(caster.occluded_into(rays, &mut hit)),
                Question::AllHits => caster.all_hits_into(rays, &mut all_hits),
                Question::FirstHits(k) => caster.first_hits_into(rays, k, &mut all_hits),
                _ => drop(caster.closest_hit_into(rays, &mut t, &mut prim)),
            }
            samples[at].push(clock.elapsed().0 * 1e9 / rays.len().max(1) as f64);
        }
    }
    samples.iter().map(|s| Spread::of(s).map_or(f64::NAN, |s| s.median)).collect()
}
