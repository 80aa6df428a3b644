//! Nanoseconds and counted events per ray of the batch kernels, without peers.
//!
//! `kernel_profile SCENES WORKLOADS [ROUNDS] [LEVEL] [START] [PRESETS]`, names separated by commas;
//! START is `automatic`, `root` or `entry`. Rounds of the presets are interleaved.

use anyhow::Context;
use ropewalk::build::{BuildSettings, Preset};
use ropewalk::kernel::{BatchCaster, Level, Start};
use ropewalk_bench::answer::BenchHit;
use ropewalk_bench::harness::{Clock, Engine, Spread};
use ropewalk_bench::own::Wave;
use ropewalk_bench::scene::Catalog;
use ropewalk_bench::workload::{Generator, Kind, Question, Sizes};
use std::path::PathBuf;

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let list = |i: usize| {
        let text: &str = arguments.get(i).map_or("", String::as_str);
        text.split(',').filter(|s| !s.is_empty()).map(str::to_owned).collect::<Vec<String>>()
    };
    let rounds: usize = arguments.get(2).map_or(Ok(9), |n| n.parse())?;
    let level = match arguments.get(3) {
        Some(name) => Level::ALL.into_iter().find(|l| l.name() == name).context("no such level")?,
        None => Level::best(),
    };
    let start = match arguments.get(4).map_or("automatic", String::as_str) {
        "automatic" => Start::Automatic,
        "root" => Start::Root,
        "entry" => Start::Entry,
        name => anyhow::bail!("no start {name}"),
    };
    let presets = match list(5) {
        names if names.is_empty() => vec![Preset::Balanced],
        names => names.iter().map(|name| preset(name)).collect::<anyhow::Result<_>>()?,
    };
    let catalog =
        Catalog { data: PathBuf::from("../shared/data"), generated: "target/bench-scenes".into() };
    println!(
        "{:12} {:9} {:8} {:>7} {:>7} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6}",
        "scene",
        "workload",
        "preset",
        "Mrays/s",
        "ns/ray",
        "skip",
        "looks",
        "boxed",
        "steps",
        "leaves",
        "blocks",
        "clear",
        "open"
    );
    for entry in Catalog::select(&list(0))? {
        let scene = catalog.load(&entry)?;
        let build = |&preset: &Preset| {
            let settings = BuildSettings { threads: 1, ..BuildSettings::preset(preset) };
            Wave::with_settings(&scene.mesh, &settings)
        };
        let engines: Vec<Wave> = presets.iter().map(build).collect::<anyhow::Result<_>>()?;
        let trace = |rays: &[ropewalk::Ray], out: &mut [BenchHit]| engines[0].closest(rays, out);
        let sizes = Sizes { side: 512, chords: 16_384, walk: 1 << 18 };
        let generator = Generator::new(&scene.mesh, &scene.view, sizes, &trace);
        for name in list(1) {
            let kind = Kind::named(&name).with_context(|| format!("no workload {name}"))?;
            let rays = generator.workload(kind).rays;
            let caster = |engine| {
                let caster = Wave::caster(engine).with_level(level).context("level not available");
                caster.map(|c| c.with_start(start))
            };
            let casters: Vec<_> = engines.iter().map(caster).collect::<anyhow::Result<_>>()?;
            let times = time(&casters, kind.question(), &rays, rounds);
            for ((caster, ns), preset) in casters.iter().zip(times).zip(&presets) {
                let events = match kind.question() {
                    Question::Occluded => caster.occluded_events(&rays),
                    Question::AllHits => caster.all_hits_events(&rays),
                    _ => caster.closest_hit_events(&rays),
                };
                let n = rays.len() as f64;
                let per = |count: u64| count as f64 / n;
                println!(
                    "{:12} {name:9} {:8} {:7.2} {ns:7.1} {:6.3} {:6.2} {:6.2} {:6.2} {:6.2} {:6.2} {:6.3} {:6.3}",
                    entry.name,
                    preset.name(),
                    1e3 / ns,
                    per(events.skipped),
                    per(events.looked),
                    per(events.boxed),
                    per(events.steps),
                    per(events.leaves),
                    per(events.blocks),
                    per(events.clear),
                    per(events.open)
                );
            }
        }
    }
    Ok(())
}

fn preset(name: &str) -> anyhow::Result<Preset> {
    let found = Preset::ALL.into_iter().find(|p| p.name() == name);
    found.with_context(|| format!("no preset {name}"))
}

/// Median nanoseconds of thread CPU time a ray, for each caster.
fn time(
    casters: &[BatchCaster<'_>],
    question: Question,
    rays: &[ropewalk::Ray],
    rounds: usize,
) -> Vec<f64> {
    let (mut t, mut prim) = (vec![0.0; rays.len()], vec![0; rays.len()]);
    let mut hit = vec![false; rays.len()];
    let mut samples = vec![Vec::new(); casters.len()];
    for round in 0..rounds {
        for i in 0..casters.len() {
            let at = (i + round) % casters.len();
            let (caster, clock) = (&casters[at], Clock::start());
            match question {
                Question::Occluded => {
                    caster.occluded_into(rays, &mut hit);
                }
                Question::AllHits => drop(caster.all_hits(rays)),
                Question::FirstHits(k) => drop(caster.first_hits(rays, k)),
                _ => {
                    caster.closest_hit_into(rays, &mut t, &mut prim);
                }
            }
            samples[at].push(clock.elapsed().0 * 1e9 / rays.len() as f64);
        }
    }
    samples.iter().filter_map(|s| Spread::of(s)).map(|s| s.median).collect()
}
