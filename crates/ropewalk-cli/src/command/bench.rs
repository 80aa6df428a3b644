//! `ropewalk bench SCENE`

use crate::controls::{Controls, named, workloads};
use crate::output::{print_json, thousands, usage};
use crate::paper::statistics::median;
use crate::{engine, interrupt, saved};
use ropewalk::build::CostChoice;
use ropewalk::kernel::{BatchCaster, BatchEvents, BatchReport, Level};
use ropewalk::wide::WideTree;
use ropewalk::{Geometry, Ray};
use ropewalk_workload::{BenchHit, FIRST_HITS, Generator, Question, Sizes, View, Workload};
use serde::Serialize;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;

/// Arguments of `bench`.
#[derive(clap::Args)]
pub struct Args {
    /// A .nff, .obj, .ply, .stl, .off, .gltf or .glb file, also gzipped, a built-in scene such as spd:balls:4, or a saved scene
    scene: String,
    /// Workloads, comma-separated; an unknown name lists them all
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "primary,diffuse,shadow,ao,all-hits,walk-1%"
    )]
    workloads: Vec<String>,
    #[command(flatten)]
    controls: Controls,
    /// Pixels along a side of the picture, a power of two; the other workloads follow its size
    #[arg(long, default_value_t = 512, value_parser = side)]
    side: usize,
    /// Times that each workload is cast; the median counts
    #[arg(long, default_value_t = 7, value_parser = clap::value_parser!(u32).range(1..=1000))]
    rounds: u32,
    /// SIMD level: scalar, avx2 or avx512; the best of this machine if not given
    #[arg(long)]
    level: Option<String>,
    /// Threads; 0 is one per core
    #[arg(long, default_value_t = 0)]
    threads: usize,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

/// Largest picture: 16 million rays.
const MAX_SIDE: usize = 4096;

fn side(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(n) if usize::is_power_of_two(n) && n <= MAX_SIDE => Ok(n),
        _ => Err(format!("expected a power of two up to {MAX_SIDE}")),
    }
}

#[derive(Serialize)]
struct Output {
    scene: String,
    preset: &'static str,
    /// Not known of a saved scene.
    cost_model: Option<&'static str>,
    sample_rays: usize,
    level: &'static str,
    threads: usize,
    rounds: u32,
    primitives: usize,
    bytes: usize,
    bytes_per_primitive: f64,
    seconds: Seconds,
    workloads: Vec<Measured>,
}

#[derive(Serialize)]
struct Seconds {
    read: f64,
    build: f64,
}

/// One workload, timed by the wall clock.
#[derive(Serialize)]
struct Measured {
    name: &'static str,
    rays: usize,
    /// Millions of rays per second.
    median_mrays: f64,
    min_mrays: f64,
    max_mrays: f64,
    /// Share of the rays answered in beams, and of those searched for from the ray before.
    beam_share: f64,
    entry_share: f64,
    /// Where all rays go through the wave; none for the first hits.
    per_ray: Option<PerRay>,
}

/// Counted events per ray.
#[derive(Serialize)]
struct PerRay {
    skipped: f64,
    looked: f64,
    steps: f64,
    leaves: f64,
    blocks: f64,
    clear: f64,
    open: f64,
}

impl PerRay {
    fn new(events: &BatchEvents, rays: usize) -> Self {
        let per = |x: u64| x as f64 / rays.max(1) as f64;
        PerRay {
            skipped: per(events.skipped),
            looked: per(events.looked),
            steps: per(events.steps),
            leaves: per(events.leaves),
            blocks: per(events.blocks),
            clear: per(events.clear),
            open: per(events.open),
        }
    }
}

/// What rays are cast at.
struct Subject {
    name: String,
    preset: &'static str,
    cost_model: Option<&'static str>,
    sample_rays: usize,
    tree: WideTree,
    geometry: Arc<Geometry>,
    view: View,
    seconds: Seconds,
}

impl Subject {
    fn build(args: &Args) -> anyhow::Result<Subject> {
        let (preset, model) = args.controls.names()?;
        let loaded = engine::load(&args.scene)?;
        // Another picture than the one that is measured, so that no ray is in both.
        let settings = args.controls.settings(&loaded, (args.side / 2).max(1), args.threads)?;
        let (tree, report) = engine::build_wide(&loaded.geometry, &settings)?;
        let view = saved::view_of(&loaded);
        Ok(Subject {
            name: loaded.scene.name,
            preset: preset.name(),
            cost_model: Some(model.name()),
            sample_rays: settings.rays.len(),
            tree,
            geometry: loaded.geometry,
            view,
            seconds: Seconds { read: loaded.seconds, build: report.seconds },
        })
    }

    fn open(args: &Args) -> anyhow::Result<Subject> {
        if let Some(option) = args.controls.given() {
            return Err(usage(format!("a saved scene is not built; leave {option} out")));
        }
        let start = Instant::now();
        let scene = saved::open(&args.scene, false)?;
        let seconds = Seconds { read: start.elapsed().as_secs_f64(), build: 0.0 };
        let view = saved::view_in(&scene);
        let preset = scene.figures.and_then(|figures| Some(figures.preset?.name()));
        Ok(Subject {
            name: args.scene.clone(),
            preset: preset.unwrap_or("saved"),
            cost_model: None,
            sample_rays: 0,
            tree: scene.tree,
            geometry: Arc::new(scene.geometry),
            view,
            seconds,
        })
    }
}

/// Builds or opens, casts and prints.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let kinds = workloads(&args.workloads)?;
    let level = level(args.level.as_deref())?;
    let subject =
        if saved::is_saved(&args.scene) { Subject::open(args)? } else { Subject::build(args)? };
    let Subject { tree, geometry, view, .. } = &subject;
    // A level that the machine lacks was refused above.
    let caster = BatchCaster::new(tree, geometry);
    let caster = caster.with_level(level).unwrap_or(caster).with_threads(args.threads.min(1));

    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.threads).build()?;
    let trace = |rays: &[Ray], out: &mut [BenchHit]| {
        let hits = pool.install(|| caster.closest_hit(rays));
        for (out, (t, prim)) in out.iter_mut().zip(hits.t.into_iter().zip(hits.prim_id)) {
            *out = BenchHit { t, prim };
        }
    };
    let generator = Generator::new(&**geometry, view, Sizes::of_side(args.side), &trace);
    let bar = interrupt::bar(u64::from(args.rounds) * kinds.len() as u64, "bench");
    let mut workloads = Vec::new();
    for kind in kinds {
        let work = generator.workload(kind);
        workloads.push(pool.install(|| measure(&caster, &work, args.rounds, &bar))?);
    }
    bar.finish_and_clear();
    let bytes = tree.bytes();
    let output = Output {
        scene: subject.name.clone(),
        preset: subject.preset,
        cost_model: subject.cost_model,
        sample_rays: subject.sample_rays,
        level: level.name(),
        threads: pool.current_num_threads(),
        rounds: args.rounds,
        primitives: geometry.len(),
        bytes,
        bytes_per_primitive: bytes as f64 / geometry.len().max(1) as f64,
        seconds: subject.seconds,
        workloads,
    };
    if args.json { print_json(&output) } else { print_text(&output) }
}

/// The level of this name, if the machine has it; its best one without a name.
fn level(name: Option<&str>) -> anyhow::Result<Level> {
    let Some(name) = name else { return Ok(Level::best()) };
    let level = named(&Level::ALL, Level::name, name, "SIMD level")?;
    if level.is_available() { Ok(level) } else { Err(usage(format!("this machine lacks {name}"))) }
}

/// Casts the rays of a workload again and again.
fn measure(
    caster: &BatchCaster<'_>,
    work: &Workload,
    rounds: u32,
    bar: &indicatif::ProgressBar,
) -> anyhow::Result<Measured> {
    let (rays, flag) = (&work.rays[..], interrupt::flag());
    let (mut t, mut prim) = (vec![0.0; rays.len()], vec![0; rays.len()]);
    let (mut hit, mut report) = (vec![false; rays.len()], BatchReport::default());
    let mut rates = Vec::new();
    for _ in 0..rounds {
        if flag.load(Ordering::Relaxed) {
            return Err(interrupt::interrupted());
        }
        let start = Instant::now();
        match work.kind.question() {
            Question::Occluded => report = caster.occluded_into(rays, &mut hit),
            Question::AllHits => drop(caster.all_hits(rays)),
            Question::FirstHits(k) => drop(caster.first_hits(rays, k)),
            _ => report = caster.closest_hit_into(rays, &mut t, &mut prim),
        }
        rates.push(rays.len() as f64 * 1e-6 / start.elapsed().as_secs_f64().max(1e-9));
        bar.inc(1);
    }
    let events = match work.kind.question() {
        Question::Occluded => Some(caster.occluded_events(rays)),
        Question::AllHits => Some(caster.all_hits_events(rays)),
        Question::FirstHits(_) => None,
        _ => Some(caster.closest_hit_events(rays)),
    };
    let share = |count: u64| count as f64 / rays.len().max(1) as f64;
    Ok(Measured {
        name: work.kind.name(),
        rays: rays.len(),
        median_mrays: median(&rates),
        min_mrays: rates.iter().copied().fold(f64::INFINITY, f64::min),
        max_mrays: rates.iter().copied().fold(0.0, f64::max),
        beam_share: share(report.beam_rays),
        entry_share: share(report.entry_rays),
        per_ray: events.map(|e| PerRay::new(&e, rays.len())),
    })
}

fn print_text(o: &Output) -> anyhow::Result<()> {
    let model = o.cost_model.filter(|&model| model != CostChoice::default().name());
    let model = model.map_or(String::new(), |model| format!(", {model}"));
    let rays = match o.sample_rays {
        0 => String::new(),
        n => format!(", steered by {} rays", thousands(n as u64)),
    };
    let Output { scene, preset, level, threads, .. } = o;
    say!("{scene}, {preset}{model}{rays}, {level}, {threads} thread(s)");
    say!(
        "  {} primitives, {:.0} bytes each; seconds: read {:.2}, build {:.2}",
        thousands(o.primitives as u64),
        o.bytes_per_primitive,
        o.seconds.read,
        o.seconds.build
    );
    say!(
        "  {:10}{:>11}{:>10}{:>9}{:>9}{:>8}{:>8}{:>8}{:>8}{:>8}",
        "workload",
        "rays",
        "Mrays/s",
        "min",
        "max",
        "beams",
        "steps",
        "leaves",
        "blocks",
        "open"
    );
    for w in &o.workloads {
        say_part!("  {:10}{:>11}", w.name, thousands(w.rays as u64));
        if w.rays == 0 {
            say!("  the view sees nothing to start from");
            continue;
        }
        say_part!("{:>10.2}{:>9.2}{:>9.2}", w.median_mrays, w.min_mrays, w.max_mrays);
        say_part!("{:>7.0}%", 100.0 * w.beam_share);
        match &w.per_ray {
            Some(e) => {
                say!("{:>8.2}{:>8.2}{:>8.2}{:>8.3}", e.steps, e.leaves, e.blocks, e.open)
            }
            None => say!("  (at most {FIRST_HITS} hits a ray)"),
        }
    }
    say!("  Rays per second by the wall clock; events are those of the wave, without beams.");
    Ok(())
}
