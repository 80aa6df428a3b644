//! Casts many rays at the benchmark's scenes and counts every answer of the batch kernels, at every
//! SIMD level, that is not bit for bit that of the `f64` walk:
//! `cargo run --release -p ropewalk-bench --bin campaign -- --rays 1e8`.

use anyhow::Context;
use clap::Parser;
use rayon::prelude::*;
use ropewalk::kernel::Level;
use ropewalk_bench::campaign::{Aim, CHUNK, Campaign, Tallies, Tally};
use ropewalk_bench::harness::{Record, commit, cpu_name, today};
use ropewalk_bench::scene::{Catalog, Mesh};
use ropewalk_bench::scenes::bumpy_sphere;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
use std::time::Instant;

/// Compares the batch kernels with the `f64` walk, ray by ray. Ctrl-C ends it after the chunks under
/// way and keeps what is done.
#[derive(Parser)]
struct Arguments {
    /// Rays over all scenes, such as 1e8; rounded up to whole chunks of 32,768.
    #[arg(long, default_value = "1e6")]
    rays: f64,
    /// Scenes, separated by commas; all of the benchmark's and the closed bumpy-sphere without this.
    #[arg(long, value_delimiter = ',')]
    scenes: Vec<String>,
    /// Another seed casts other rays.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Threads; 0 is one per core.
    #[arg(long, default_value_t = 1)]
    threads: usize,
    /// The folder of the CSV.
    #[arg(long, default_value = "bench/record")]
    out: PathBuf,
    /// The folder of shared scenes.
    #[arg(long, default_value = "../shared/data")]
    data: PathBuf,
    /// The folder of generated scenes.
    #[arg(long, default_value = "target/bench-scenes")]
    generated: PathBuf,
}

/// The closed mesh that the catalog lacks.
const BUMPY: &str = "bumpy-sphere";
const BUMPY_TRIANGLES: usize = 300_000;
/// One chunk of an aim in so many is asked for all hits too.
const ALL_HITS_EVERY: u64 = 16;
/// Seconds between two lines of progress.
const PROGRESS_SECONDS: u64 = 15;

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("campaign: {error:#}");
            ExitCode::from(2)
        }
    }
}

/// True if no answer differs.
fn run(arguments: &Arguments) -> anyhow::Result<bool> {
    static STOP: AtomicBool = AtomicBool::new(false);
    ctrlc::set_handler(|| {
        if STOP.swap(true, Relaxed) {
            std::process::exit(130);
        }
    })?;
    anyhow::ensure!(arguments.rays >= 1.0, "--rays: expected at least 1, found {}", arguments.rays);
    let names = scenes(&arguments.scenes)?;
    let catalog = Catalog { data: arguments.data.clone(), generated: arguments.generated.clone() };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(arguments.threads).build()?;
    let chunks = (arguments.rays / (CHUNK * names.len()) as f64).ceil() as u64;
    let levels: Vec<_> = Level::ALL.into_iter().filter(|l| l.is_available()).collect();
    let levels = levels.iter().map(|l| l.name()).collect::<Vec<_>>().join(" ");
    let (cpu, commit) = (cpu_name(), commit());
    let path =
        arguments.out.join(format!("campaign-{}-{}.csv", today(), commit.replace('+', "-dirty")));
    let mut csv = format!("scene,triangles,closed,aim,{},levels,seed,cpu,commit\n", Tally::COLUMNS);
    let mut all = Tally::default();
    for name in &names {
        let mesh = load(&catalog, name)?;
        let campaign = Campaign::new(&mesh, arguments.threads)?;
        let closed = campaign.is_closed();
        let (tallies, unfinished) =
            pool.install(|| cast(&campaign, name, chunks, arguments.seed, &STOP));
        for (aim, tally) in &tallies {
            let counts = tally.fields().map(|n| n.to_string()).join(",");
            csv += &format!(
                "{name},{},{closed},{},{counts},{levels},{},\"{cpu}\",{commit}\n",
                mesh.faces.len(),
                aim.name(),
                arguments.seed
            );
            all += *tally;
        }
        Record::write(&path, &csv)?;
        eprintln!("{name}: {} rays so far, {} differences", all.rays, all.differences());
        if unfinished {
            eprintln!("campaign: interrupted; what was done is recorded");
            break;
        }
    }
    println!("{} rays at each of: {levels}", all.rays);
    for (column, count) in Tally::COLUMNS.split(',').zip(all.fields()).skip(1) {
        println!("  {column:16} {count:>14}");
    }
    println!("record: {}", path.display());
    Ok(all.differences() == 0)
}

/// The names asked for, or all; an unknown one is an error.
fn scenes(wanted: &[String]) -> anyhow::Result<Vec<String>> {
    if wanted.is_empty() {
        let entries = Catalog::entries().iter().map(|e| e.name.to_owned());
        return Ok(std::iter::once(BUMPY.to_owned()).chain(entries).collect());
    }
    let others: Vec<String> = wanted.iter().filter(|n| *n != BUMPY).cloned().collect();
    if !others.is_empty() {
        Catalog::select(&others)?;
    }
    Ok(wanted.to_vec())
}

fn load(catalog: &Catalog, name: &str) -> anyhow::Result<Mesh> {
    if name == BUMPY {
        return Ok(bumpy_sphere(BUMPY_TRIANGLES));
    }
    let entries = Catalog::select(&[name.to_owned()])?;
    Ok(catalog.load(&entries[0]).with_context(|| name.to_owned())?.mesh)
}

/// Casts `chunks` chunks, aims in turn; true if it was interrupted.
fn cast(
    campaign: &Campaign,
    name: &str,
    chunks: u64,
    seed: u64,
    stop: &AtomicBool,
) -> (Tallies, bool) {
    let aims: Vec<Aim> = campaign.aims().collect();
    let (start, done, told) = (Instant::now(), AtomicU64::new(0), AtomicU64::new(0));
    let one = |number: u64| {
        if stop.load(Relaxed) {
            return None;
        }
        let (round, aim) =
            (number / aims.len() as u64, aims[(number % aims.len() as u64) as usize]);
        let tally = campaign.chunk(aim, number, seed, round.is_multiple_of(ALL_HITS_EVERY));
        let finished = done.fetch_add(1, Relaxed) + 1;
        let seconds = start.elapsed().as_secs();
        if seconds >= told.load(Relaxed) + PROGRESS_SECONDS {
            told.store(seconds, Relaxed);
            eprintln!("  {name}: {finished} of {chunks} chunks in {seconds} s");
        }
        Some((aim, tally))
    };
    let results: Vec<_> = (0..chunks).into_par_iter().map(one).collect();
    let mut tallies = Tallies::new();
    for (aim, tally) in results.iter().flatten() {
        *tallies.entry(*aim).or_default() += *tally;
    }
    (tallies, results.iter().any(Option::is_none))
}
