//! `ropewalk paper`: the experiment of the 1997 paper and its report.
//!
//! For each scene the rays of a rendering are recorded once and answered by every method. Answers
//! are compared, events counted over all rays, times taken in interleaved rounds, and each
//! ingredient gets a verdict.

mod candidate;
mod date;
mod experiment;
mod machine;
mod model;
mod published;
mod replay;
mod report;
#[cfg(test)]
mod sample;
mod scaling;
mod scenes;
mod sensitivity;
pub mod statistics;
mod table;
mod verdict;

use crate::interrupt;
use crate::output::{print_json, usage};
use anyhow::{Context, bail};
use experiment::Setup;
use indicatif::ProgressBar;
use model::{Experiment, Protocol};
use ropewalk_scene::write_atomically;
use scenes::{SCENE_COUNT, SceneChoice, Size};
use std::io::Write;
use std::path::{Path, PathBuf};
use verdict::{Headline, judge};

/// Arguments of `paper`.
#[derive(clap::Args)]
pub struct Args {
    /// Scenes, comma-separated: balls, gears, lattice, mount, rings, teapot, tetra, tree; all if
    /// not given
    #[arg(long, value_delimiter = ',', value_name = "LIST")]
    scenes: Vec<String>,
    /// How large the scenes are
    #[arg(long, value_enum, default_value_t = Size::Standard)]
    size: Size,
    /// Rays to time in each scene; events are counted over all rays of its rendering
    #[arg(long, default_value_t = 100_000, value_parser = clap::value_parser!(u32).range(1..))]
    rays: u32,
    /// Threads that count events, 0 is one per core; times are always of one thread
    #[arg(long, default_value_t = 0)]
    threads: usize,
    /// Vary leaf size and depth; on by default where all scenes run
    #[arg(long)]
    sensitivity: bool,
    /// Do not vary leaf size and depth
    #[arg(long, conflicts_with = "sensitivity")]
    no_sensitivity: bool,
    /// Build scenes from 10^4 to 10^6 objects; on by default where all scenes run
    #[arg(long)]
    scaling: bool,
    /// Do not build growing scenes
    #[arg(long, conflicts_with = "scaling")]
    no_scaling: bool,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
    /// Report to write, one self-contained HTML file
    #[arg(short, long, value_name = "REPORT.html")]
    output: Option<PathBuf>,
}

/// Runs the experiment, writes the report and prints the tables or the JSON object.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let scenes = scenes::choose(&args.scenes, args.size).map_err(usage)?;
    if let Some(path) = &args.output {
        check_writable(path)?;
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.threads).build()?;
    let experiment = pool.install(|| conduct(args, &scenes))?;
    if let Some(path) = &args.output {
        let page = report::page(&experiment);
        write_atomically(path, |file| file.write_all(page.as_bytes()))
            .with_context(|| format!("cannot write {}", path.display()))?;
    }
    if args.json {
        return print_json(&experiment);
    }
    std::io::stdout().lock().write_all(table::text(&experiment).as_bytes())?;
    if let Some(path) = &args.output {
        say!("report: {}", path.display());
    }
    Ok(())
}

/// Minutes pass before the report is written: say now where that cannot succeed.
fn check_writable(path: &Path) -> anyhow::Result<()> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    if path.is_dir() {
        bail!("cannot write {}: it is a folder; name a file", path.display());
    }
    if !folder.is_dir() {
        bail!("cannot write {}: there is no folder {}", path.display(), folder.display());
    }
    Ok(())
}

fn conduct(args: &Args, choices: &[SceneChoice]) -> anyhow::Result<Experiment> {
    let whole = choices.len() == SCENE_COUNT;
    let with_sensitivity = args.sensitivity || (whole && !args.no_sensitivity);
    let with_scaling = args.scaling || (whole && !args.no_scaling);
    let per_scene = experiment::steps() + if with_sensitivity { sensitivity::SETTINGS } else { 0 };
    let points = if with_scaling { scaling::POINTS } else { 0 };
    let bar = interrupt::bar(per_scene * choices.len() as u64 + points, "paper");
    let cancel = interrupt::flag();
    let setup =
        Setup { timed_rays: args.rays as usize, size: args.size, cancel: &cancel, bar: &bar };
    let (mut results, mut cells) = (Vec::new(), Vec::new());
    for choice in choices {
        say(&bar, choice.name);
        let (result, recorded) = experiment::run(choice, &setup)?;
        if with_sensitivity {
            let step = || bar.inc(1);
            cells.extend(sensitivity::run(choice.name, &recorded, args.threads, &cancel, step)?);
        }
        results.push(result);
    }
    let points = if with_scaling {
        say(&bar, "scaling");
        scaling::run(&cancel, || bar.inc(1))?
    } else {
        Vec::new()
    };
    bar.finish_and_clear();
    Ok(Experiment {
        version: env!("CARGO_PKG_VERSION"),
        date: date::today(),
        command: command(args, choices, whole),
        machine: machine::Machine::this(),
        size: args.size.name(),
        protocol: Protocol {
            timed_rays: args.rays as usize,
            rounds: experiment::ROUNDS,
            slow_build_seconds: experiment::SLOW_BUILD,
            counting_threads: rayon::current_num_threads(),
        },
        headline: Headline::new(&results),
        verdicts: judge(&results),
        sensitivity: cells,
        scaling: points,
        scenes: results,
    })
}

/// Names the scene at work: on the bar, or on a line of standard error where that is no terminal.
fn say(bar: &ProgressBar, name: &'static str) {
    bar.set_message(name);
    if bar.is_hidden() {
        eprintln!("ropewalk paper: {name}");
    }
}

/// The command that repeats this experiment.
fn command(args: &Args, choices: &[SceneChoice], whole: bool) -> String {
    let mut words = vec!["ropewalk paper".to_owned()];
    if !whole {
        let names: Vec<_> = choices.iter().map(|c| c.name).collect();
        words.push(format!("--scenes {}", names.join(",")));
    }
    words.push(format!("--size {} --rays {}", args.size.name(), args.rays));
    let flags = [
        (args.sensitivity, "--sensitivity"),
        (args.no_sensitivity, "--no-sensitivity"),
        (args.scaling, "--scaling"),
        (args.no_scaling, "--no-scaling"),
    ];
    words.extend(flags.iter().filter(|(on, _)| *on).map(|(_, flag)| (*flag).to_owned()));
    words.push("-o REPORT.html".to_owned());
    words.join(" ")
}
