//! What saving and opening a scene costs, and what processes that open it share.
//!
//! `open_speed SCENES [ROUNDS]`, names separated by commas: milliseconds to save, to open a map of a file in the
//! page cache, with all checksums, and to read it into memory (median and least by the wall clock, median of CPU time); then million rays per second of
//! diffuse rays over the tree as built, mapped and read, in turn; then two processes open the file, cast the same
//! rays, and say what of the map they hold: all of it (Rss), its share (Pss), and what is theirs alone.

use anyhow::{Context, ensure};
use ropewalk::build::{BuildSettings, Preset};
use ropewalk::file::{Check, Contents};
use ropewalk::kernel::BatchCaster;
use ropewalk::wide::WideTree;
use ropewalk::{Geometry, Ray};
use ropewalk_bench::answer::BenchHit;
use ropewalk_bench::harness::{Clock, Spread};
use ropewalk_bench::own::geometry;
use ropewalk_bench::scene::{Catalog, Scene};
use ropewalk_bench::workload::{Generator, Kind, Random, Sizes, Workload};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// Side of the picture from which the rays come.
const SIDE: usize = 512;

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [flag, path] = &arguments[..]
        && flag == "--hold"
    {
        return hold(Path::new(path));
    }
    let names = arguments.first().map_or("", String::as_str).split(',').filter(|s| !s.is_empty());
    let names: Vec<String> = names.map(str::to_owned).collect();
    let rounds: usize = arguments.get(1).map_or(Ok(9), |n| n.parse())?;
    let catalog =
        Catalog { data: PathBuf::from("../shared/data"), generated: "target/bench-scenes".into() };
    let folder = Path::new("target/saved-scenes");
    std::fs::create_dir_all(folder)?;
    for entry in Catalog::select(&names)? {
        let scene = catalog.load(&entry)?;
        let path = folder.join(format!("{}.rope", entry.name));
        measure(&scene, &path, rounds)?;
        std::fs::remove_file(&path)?;
    }
    Ok(())
}

/// Milliseconds by the wall clock and of CPU time.
fn time<T>(work: impl FnOnce() -> T) -> ([f64; 2], T) {
    let clock = Clock::start();
    let value = work();
    let (cpu, wall) = clock.elapsed();
    ([1e3 * wall, 1e3 * cpu], value)
}

fn measure(scene: &Scene, path: &Path, rounds: usize) -> anyhow::Result<()> {
    let geometry = geometry(&scene.mesh)?;
    let settings = BuildSettings { threads: 1, ..BuildSettings::preset(Preset::Balanced) };
    let (tree, _) = WideTree::build(&geometry, &settings, &())?;
    let (saving, saved) = time(|| ropewalk_file::save(path, &Contents::new(&tree, &geometry)));
    let saved = saved?;
    println!(
        "{}: {} triangles, {:.1} MiB, {} treelets, {} blocks; saved in {:.0} ms",
        scene.mesh.name,
        geometry.len(),
        saved.bytes as f64 / f64::from(1 << 20),
        tree.treelets(),
        tree.blocks(),
        saving[0]
    );
    let open = |check| {
        let each = (0..rounds).map(|_| {
            let (ms, opened) = time(|| ropewalk_file::open(path, check));
            opened.map(|_| ms)
        });
        each.collect::<Result<Vec<[f64; 2]>, _>>()
    };
    let read = || {
        let (ms, opened) = time(|| ropewalk_file::read(path, Check::Structure));
        opened.map(|_| ms)
    };
    for (name, times) in [
        ("map", open(Check::Structure)?),
        ("map, checksums", open(Check::Everything)?),
        ("read", (0..rounds).map(|_| read()).collect::<Result<_, _>>()?),
    ] {
        let of = |clock: usize| {
            let times: Vec<f64> = times.iter().map(|both| both[clock]).collect();
            Spread::of(&times).context("at least one round")
        };
        let (wall, cpu) = (of(0)?, of(1)?);
        println!(
            "  opened ({name}): median {:.2} ms, least {:.2} ms; CPU median {:.2} ms",
            wall.median, wall.min, cpu.median
        );
    }

    let mapped = ropewalk_file::open(path, Check::Structure)?;
    let read = ropewalk_file::read(path, Check::Structure)?;
    let rays = rays(scene, &tree, &geometry);
    let mut seconds = [const { Vec::new() }; 3];
    let mut hits = Vec::new();
    for _ in 0..rounds {
        for (i, tree) in [&tree, &mapped.tree, &read.tree].into_iter().enumerate() {
            let caster = BatchCaster::new(tree, &geometry).with_threads(1);
            let (ms, found) = time(|| caster.closest_hit(&rays.rays));
            seconds[i].push(ms[1] / 1e3);
            hits.push(found);
        }
    }
    ensure!(hits.iter().all(|hit| *hit == hits[0]), "answers differ");
    let rate = |i: usize| {
        let median = Spread::of(&seconds[i]).map_or(f64::NAN, |spread| spread.median);
        rays.rays.len() as f64 * 1e-6 / median
    };
    println!(
        "  {} diffuse rays, Mrays/s of CPU time: built {:.2}, mapped {:.2}, read {:.2}",
        rays.rays.len(),
        rate(0),
        rate(1),
        rate(2)
    );
    drop((mapped, read));
    share(path)
}

fn rays(scene: &Scene, tree: &WideTree, geometry: &Geometry) -> Workload {
    let caster = BatchCaster::new(tree, geometry);
    let trace = |rays: &[Ray], out: &mut [BenchHit]| {
        let hits = caster.closest_hit(rays);
        for (out, (t, prim)) in out.iter_mut().zip(hits.t.into_iter().zip(hits.prim_id)) {
            *out = BenchHit { t, prim };
        }
    };
    Generator::new(&scene.mesh, &scene.view, Sizes::of_side(SIDE), &trace).workload(Kind::Diffuse)
}

/// Opens the file in two processes and prints what each holds of it.
fn share(path: &Path) -> anyhow::Result<()> {
    let program = std::env::current_exe()?;
    let start = || -> anyhow::Result<Child> {
        let mut child = Command::new(&program)
            .arg("--hold")
            .arg(path)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        let mut line = String::new();
        BufReader::new(child.stdout.as_mut().context("a pipe")?).read_line(&mut line)?;
        ensure!(line == "ready\n", "the process says {line:?}");
        Ok(child)
    };
    let mut children = [start()?, start()?];
    for child in &children {
        let map = map_of(child.id(), path)?;
        let mib = |key: &str| map(key) as f64 / 1024.0;
        println!(
            "  process: Rss {:.1} MiB, Pss {:.1} MiB, private {:.1} MiB of the map; anonymous memory {:.1} MiB",
            mib("Rss:"),
            mib("Pss:"),
            mib("Private_Clean:") + mib("Private_Dirty:"),
            anonymous(child.id())? as f64 / 1024.0,
        );
    }
    for child in &mut children {
        child.stdin.take().context("a pipe")?.write_all(b"\n")?;
        child.wait()?;
    }
    Ok(())
}

/// The fields of the file's map in a process, in KiB.
fn map_of(pid: u32, path: &Path) -> anyhow::Result<impl Fn(&str) -> u64 + use<>> {
    let path = path.canonicalize()?;
    let smaps = std::fs::read_to_string(format!("/proc/{pid}/smaps"))?;
    let lines = smaps.lines().skip_while(|line| !line.ends_with(&*path.to_string_lossy()));
    let lines: Vec<String> = lines.skip(1).take(25).map(str::to_owned).collect();
    ensure!(!lines.is_empty(), "the process has not mapped the file");
    Ok(move |key: &str| {
        let line = lines.iter().find(|line| line.starts_with(key));
        line.and_then(|line| line.split_whitespace().nth(1)?.parse().ok()).unwrap_or(0)
    })
}

/// Anonymous memory of a process in KiB.
fn anonymous(pid: u32) -> anyhow::Result<u64> {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status"))?;
    let line = status.lines().find(|line| line.starts_with("RssAnon:")).context("RssAnon")?;
    Ok(line.split_whitespace().nth(1).context("a number")?.parse()?)
}

/// A process that opens a file, visits all of it, and waits.
fn hold(path: &Path) -> anyhow::Result<()> {
    let scene = ropewalk_file::open(path, Check::Structure)?;
    let (bounds, mut random) = (*scene.tree.bounds(), Random::new(1));
    let mut point = || {
        std::array::from_fn(|a| {
            bounds.min[a] + (bounds.max[a] - bounds.min[a]) * random.unit() as f32
        })
    };
    let ray = |_| {
        let (from, to): ([f32; 3], [f32; 3]) = (point(), point());
        Ray::new(from, std::array::from_fn(|a| to[a] - from[a]))
    };
    let rays: Vec<Ray> = (0..1 << 18).map(ray).collect();
    let caster = BatchCaster::new(&scene.tree, &scene.geometry).with_threads(1);
    caster.count_hits(&rays);
    println!("ready");
    std::io::stdin().read_line(&mut String::new())?;
    drop(scene);
    Ok(())
}
