//! Nanoseconds and counted events per ray of the batch kernels, without peers.
//!
//! `kernel_profile SCENES WORKLOADS [ROUNDS] [LEVEL] [START] [PRESETS] [SIDE]`, names separated by commas;
//! START is `automatic`, `root` or `entry`, `wave` for the root and no beams, `cells` for rays that start from the cells of their origins,
//! `single` for one call a ray, or `walker` for walks with only the next segment known. Rounds of the presets are
//! interleaved. Views have SIDE x SIDE rays (512); beams want 1024, as the record has. Where rays went in beams, a second
//! line says what those cost.
//!
//! With the environment variable `PLAIN_CLOCK` time is taken from the wall clock, as Valgrind needs it.

use anyhow::Context;
use ropewalk::build::{BuildSettings, Preset};
use ropewalk::kernel::{AllHits, BatchCaster, BatchReport, Level, Start};
use ropewalk_bench::answer::BenchHit;
use ropewalk_bench::harness::{Clock, Engine, Spread};
use ropewalk_bench::own::{Walker, Wave};
use ropewalk_bench::scene::Catalog;
use ropewalk_bench::workload::{Generator, Kind, Question, Sizes, Workload};
use std::path::PathBuf;
use std::time::Instant;

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
        "wave" | "single" | "walker" => Start::Root,
        "cells" => Start::Entry,
        name => anyhow::bail!("no start {name}"),
    };
    let asked = |start: &str| arguments.get(4).is_some_and(|name| name == start);
    let (single, walker, from_cells) = (asked("single"), asked("walker"), asked("cells"));
    let wave = asked("wave");
    let presets = match list(5) {
        names if names.is_empty() => vec![Preset::Balanced],
        names => names.iter().map(|name| preset(name)).collect::<anyhow::Result<_>>()?,
    };
    let side: usize = arguments.get(6).map_or(Ok(512), |n| n.parse())?;
    let catalog =
        Catalog { data: PathBuf::from("../shared/data"), generated: "target/bench-scenes".into() };
    println!(
        "{:12} {:9} {:8} {:>7} {:>7} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6}",
        "scene",
        "workload",
        "preset",
        "Mrays/s",
        "ns/ray",
        "beam",
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
        let sizes = Sizes { side, chords: 16_384, walk: 1 << 18 };
        let generator = Generator::new(&scene.mesh, &scene.view, sizes, &trace);
        for name in list(1) {
            let kind = Kind::named(&name).with_context(|| format!("no workload {name}"))?;
            let Workload { rays, chains, .. } = generator.workload(kind);
            let origin = |ray: &ropewalk::Ray| ray.origin.map(f64::from);
            let origins: Vec<[f64; 3]> = rays.iter().map(origin).collect();
            let cells = engines[0].points()?.locate(&origins);
            if from_cells {
                let up = engines[0].tree().link_up();
                println!(
                    "table of treelets above: {} bytes beside {}",
                    up.bytes(),
                    engines[0].bytes()
                );
            }
            let caster = |engine| {
                let caster = Wave::caster(engine).with_level(level).context("level not available");
                let caster = caster.map(|c| c.with_start(start).with_beams(!wave));
                if from_cells { caster.map(|c| c.with_cells(&cells)) } else { caster }
            };
            let casters: Vec<_> = engines.iter().map(caster).collect::<anyhow::Result<_>>()?;
            let mut times = time(&casters, kind.question(), &rays, rounds, single);
            if walker {
                times = engines.iter().map(|e| walk(e, &rays, &chains, rounds)).collect();
            }
            for ((caster, ns), preset) in casters.iter().zip(times).zip(&presets) {
                let events = match kind.question() {
                    Question::Occluded => caster.occluded_events(&rays),
                    Question::AllHits => caster.all_hits_events(&rays),
                    _ => caster.closest_hit_events(&rays),
                };
                let n = rays.len() as f64;
                let per = |count: u64| count as f64 / n;
                let beams = in_beams(caster, kind.question(), &rays);
                println!(
                    "{:12} {name:9} {:8} {:7.2} {ns:7.1} {:6.3} {:6.3} {:6.2} {:6.2} {:6.2} {:6.2} {:6.2} {:6.3} {:6.3}",
                    entry.name,
                    preset.name(),
                    1e3 / ns,
                    per(beams.beam_rays),
                    per(events.skipped),
                    per(events.looked),
                    per(events.boxed),
                    per(events.steps),
                    per(events.leaves),
                    per(events.blocks),
                    per(events.clear),
                    per(events.open)
                );
                if beams.beams > 0 {
                    let each = |count: u64| count as f64 / beams.beams as f64;
                    println!(
                        "  {} beams, {} given up; a beam: rays {:.1}, steps {:.1}, blocks {:.1}, tests {:.1}, exact {:.2}",
                        beams.beams,
                        beams.given_up,
                        each(beams.beam_rays),
                        each(beams.steps),
                        each(beams.blocks),
                        each(beams.tests),
                        each(beams.exact)
                    );
                }
            }
        }
    }
    Ok(())
}

/// Rays answered in beams, and what that took.
fn in_beams(caster: &BatchCaster<'_>, question: Question, rays: &[ropewalk::Ray]) -> BatchReport {
    let (mut t, mut prim) = (vec![0.0; rays.len()], vec![0; rays.len()]);
    match question {
        Question::Occluded => caster.occluded_into(rays, &mut vec![false; rays.len()]),
        Question::AllHits | Question::FirstHits(_) => BatchReport::default(),
        _ => caster.closest_hit_into(rays, &mut t, &mut prim),
    }
}

fn preset(name: &str) -> anyhow::Result<Preset> {
    let found = Preset::ALL.into_iter().find(|p| p.name() == name);
    found.with_context(|| format!("no preset {name}"))
}

/// Thread CPU time, or wall time where the other cannot be had.
enum Stopwatch {
    Thread(Clock),
    Wall(Instant),
}

impl Stopwatch {
    fn start() -> Self {
        if std::env::var_os("PLAIN_CLOCK").is_some() {
            Stopwatch::Wall(Instant::now())
        } else {
            Stopwatch::Thread(Clock::start())
        }
    }

    fn seconds(&self) -> f64 {
        match self {
            Stopwatch::Thread(clock) => clock.elapsed().0,
            Stopwatch::Wall(start) => start.elapsed().as_secs_f64(),
        }
    }
}

/// The same for walks of which only the next segment is known.
fn walk(engine: &Wave, rays: &[ropewalk::Ray], chains: &[u32], rounds: usize) -> f64 {
    let (walker, mut out) = (Walker(engine.clone()), vec![BenchHit::MISS; rays.len()]);
    let mut samples = Vec::new();
    for _ in 0..rounds {
        let clock = Stopwatch::start();
        let report = walker.follow(rays, chains, &mut out);
        samples.push(clock.seconds() * 1e9 / rays.len() as f64);
        std::hint::black_box(report);
    }
    Spread::of(&samples).map_or(f64::NAN, |s| s.median)
}

/// Median nanoseconds of thread CPU time a ray, for each caster.
fn time(
    casters: &[BatchCaster<'_>],
    question: Question,
    rays: &[ropewalk::Ray],
    rounds: usize,
    single: bool,
) -> Vec<f64> {
    let (mut t, mut prim) = (vec![0.0; rays.len()], vec![0; rays.len()]);
    let mut hit = vec![false; rays.len()];
    let mut all_hits = AllHits::default();
    let mut samples = vec![Vec::new(); casters.len()];
    for round in 0..rounds {
        for i in 0..casters.len() {
            let at = (i + round) % casters.len();
            let (caster, clock) = (&casters[at], Stopwatch::start());
            match question {
                Question::Occluded if single => {
                    for (ray, hit) in rays.iter().zip(&mut hit) {
                        *hit = caster.occluded_one(ray);
                    }
                }
                Question::Closest | Question::Walk if single => {
                    for (ray, t) in rays.iter().zip(&mut t) {
                        *t = caster.closest_hit_one(ray).map_or(f32::INFINITY, |hit| hit.t);
                    }
                }
                Question::Occluded => {
                    caster.occluded_into(rays, &mut hit);
                }
                Question::AllHits => caster.all_hits_into(rays, &mut all_hits),
                Question::FirstHits(k) => caster.first_hits_into(rays, k, &mut all_hits),
                _ => {
                    caster.closest_hit_into(rays, &mut t, &mut prim);
                }
            }
            samples[at].push(clock.seconds() * 1e9 / rays.len() as f64);
        }
    }
    samples.iter().filter_map(|s| Spread::of(s)).map(|s| s.median).collect()
}
