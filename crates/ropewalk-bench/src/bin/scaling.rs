//! Cost per ray, build time and memory from 10^4 to 10^7 triangles:
//! `cargo run --release -p ropewalk-bench --bin scaling`. Each point is measured in a process of its
//! own, one thread, so that its peak of memory is its own. Where `scripts/bench` has installed Embree,
//! its packets of 16 are asked the same rays in turn.

use anyhow::Context;
use clap::Parser;
use ropewalk::build::{BuildSettings, Preset};
use ropewalk_bench::answer::BenchHit;
use ropewalk_bench::harness::{
    Clock, Curve, Engine, Record, Spread, commit, cpu_name, curves, peak_resident, reset_peak,
    resident, today,
};
use ropewalk_bench::own::{Wave, geometry};
use ropewalk_bench::peer::{Call, Embree, EmbreeEngine, EmbreeScene, Quality};
use ropewalk_bench::scene::{Mesh, Scene, View};
use ropewalk_bench::scenes::{bumpy_sphere, soup_mesh, terrain_mesh};
use ropewalk_bench::workload::{Generator, Kind, Sizes};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::sync::Arc;

/// Measures diffuse rays of the default preset over families of scenes of growing size.
#[derive(Parser)]
struct Arguments {
    /// Families, separated by commas; all without this.
    #[arg(long, value_delimiter = ',')]
    families: Vec<String>,
    /// The largest number of triangles.
    #[arg(long, default_value = "1e7")]
    max: f64,
    /// Rounds over the rays; the median is recorded.
    #[arg(long, default_value_t = 7)]
    rounds: usize,
    /// Preset of the build.
    #[arg(long, default_value = "balanced")]
    preset: String,
    /// Where CSV and chart go.
    #[arg(long, default_value = "bench/record")]
    out: PathBuf,
    /// Prints the row of one family at one size; what a run starts for each point.
    #[arg(long, value_names = ["FAMILY", "TRIANGLES"], num_args = 2)]
    one: Option<Vec<String>>,
}

/// A kind of scene that exists at every size.
struct Family {
    name: &'static str,
    color: &'static str,
    mesh: fn(usize) -> Mesh,
    view: View,
}

const FAMILIES: [Family; 3] = [
    // Seen from inside: every ray hits.
    Family {
        name: "bumpy-sphere",
        color: "#e15759",
        mesh: bumpy_sphere,
        view: View {
            eye: [0.2, 0.1, 0.05],
            at: [1.0, 0.3, 0.2],
            up: [0.0, 0.0, 1.0],
            fov_degrees: 90.0,
            light: [0.0, 0.0, 0.3],
        },
    },
    Family {
        name: "terrain",
        color: "#59a14f",
        mesh: terrain_mesh,
        view: View {
            eye: [0.5, -0.4, 0.7],
            at: [0.5, 0.5, 0.0],
            up: [0.0, 0.0, 1.0],
            fov_degrees: 50.0,
            light: [0.2, 0.3, 3.0],
        },
    },
    Family {
        name: "soup",
        color: "#4e79a7",
        mesh: soup_mesh,
        view: View {
            eye: [-0.6, -0.4, 1.2],
            at: [0.5, 0.5, 0.5],
            up: [0.0, 0.0, 1.0],
            fov_degrees: 45.0,
            light: [-1.0, 0.2, 2.0],
        },
    },
];

const COLUMNS: &str = "family,triangles,ns_per_ray,ns_min,ns_max,steps_per_ray,leaves_per_ray,\
    blocks_per_ray,build_seconds,result_bytes,build_peak_bytes,peak_over_result,bytes_per_triangle,\
    embree_16_ns";
const SIDE: usize = 512;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let done = match &arguments.one {
        Some(one) => point(&arguments, &one[0], &one[1]),
        None => run(&arguments),
    };
    if let Err(error) = done {
        eprintln!("scaling: {error:#}");
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}

fn family(name: &str) -> anyhow::Result<&'static Family> {
    let known = || FAMILIES.each_ref().map(|f| f.name).join(", ");
    let found = FAMILIES.iter().find(|f| f.name == name);
    found.with_context(|| format!("unknown family {name}; the families are {}", known()))
}

/// All points, smallest first; CSV and chart.
fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let families: Vec<&Family> = if arguments.families.is_empty() {
        FAMILIES.iter().collect()
    } else {
        arguments.families.iter().map(|n| family(n)).collect::<anyhow::Result<_>>()?
    };
    let sizes = (8..).map(|k| 10f64.powf(f64::from(k) / 2.0)).take_while(|&n| n <= arguments.max);
    let sizes: Vec<usize> = sizes.map(|n| n.round() as usize).collect();
    let (cpu, commit) = (cpu_name(), commit());
    let mut csv = format!("{COLUMNS},preset,cpu,commit\n");
    let mut lines = Vec::new();
    for family in families {
        let (mut points, mut theirs) = (Vec::new(), Vec::new());
        for size in &sizes {
            let child = Command::new(std::env::current_exe()?)
                .args(["--rounds", &arguments.rounds.to_string(), "--preset", &arguments.preset])
                .args(["--one", family.name, &size.to_string()])
                .stderr(Stdio::inherit())
                .output()?;
            anyhow::ensure!(child.status.success(), "{} of {size} triangles failed", family.name);
            let row = String::from_utf8(child.stdout)?;
            let row = row.trim();
            eprintln!("{row}");
            csv += &format!("{row},{},\"{cpu}\",{commit}\n", arguments.preset);
            let number = |column: usize| -> anyhow::Result<f64> {
                Ok(row.split(',').nth(column).context("a row is too short")?.parse()?)
            };
            points.push((number(1)?, number(2)?));
            theirs.extend(number(13).ok().map(|ns| (points[points.len() - 1].0, ns)));
        }
        lines.extend(family_curves(family, points, theirs));
    }
    let stem = format!("scaling-{}-{}", today(), commit.replace('+', "-dirty"));
    let chart = curves(
        "Nanoseconds a diffuse ray, one thread; dashed: Embree's packets of 16, and in proportion to log N",
        "triangles",
        "ns a ray",
        &lines,
    );
    Record::write(&arguments.out.join(format!("{stem}.csv")), &csv)?;
    Record::write(&arguments.out.join("scaling.svg"), &chart)?;
    println!("record: {stem}.csv   chart: scaling.svg, in {}", arguments.out.display());
    Ok(())
}

/// The measured curve, and dashed Embree's and the logarithm through the first point.
fn family_curves(family: &Family, points: Vec<(f64, f64)>, theirs: Vec<(f64, f64)>) -> Vec<Curve> {
    let Some(&(first, cost)) = points.first() else { return Vec::new() };
    let ideal = points.iter().map(|&(n, _)| (n, cost * n.ln() / first.ln())).collect();
    let curve = |name: String, dashed, points| Curve { name, color: family.color, dashed, points };
    vec![
        curve(family.name.to_owned(), false, points),
        curve(format!("Embree ({})", family.name), true, theirs),
        curve(format!("log N ({})", family.name), true, ideal),
    ]
}

/// Measures one point and prints its row.
fn point(arguments: &Arguments, name: &str, size: &str) -> anyhow::Result<()> {
    let family = family(name)?;
    let size: usize = size.parse().with_context(|| format!("expected a number, found {size}"))?;
    let preset = Preset::ALL.into_iter().find(|p| p.name() == arguments.preset);
    let preset = preset.with_context(|| format!("no preset {}", arguments.preset))?;
    let settings = BuildSettings { threads: 1, ..BuildSettings::preset(preset) };
    let scene = Scene { mesh: (family.mesh)(size), view: family.view };
    let geometry = geometry(&scene.mesh)?;
    reset_peak();
    let (before, clock) = (resident().unwrap_or(0), Clock::start());
    let engine = Wave::over(geometry, &settings)?;
    let build = clock.elapsed().0;
    let peak = peak_resident().unwrap_or(0).saturating_sub(before);

    let trace = |rays: &[ropewalk::Ray], out: &mut [BenchHit]| engine.closest(rays, out);
    let sizes = Sizes { side: SIDE, ..Sizes::QUICK };
    let rays = Generator::new(&scene.mesh, &scene.view, sizes, &trace).workload(Kind::Diffuse).rays;
    anyhow::ensure!(!rays.is_empty(), "the view sees nothing");
    let mut hits = vec![BenchHit::MISS; rays.len()];
    let peer = embree(&scene.mesh)?;
    let mut engines: Vec<&dyn Engine> = vec![&engine];
    engines.extend(peer.as_ref().map(|e| e as &dyn Engine));
    let mut samples = vec![Vec::new(); engines.len()];
    for _ in 0..arguments.rounds.max(1) {
        for (engine, samples) in engines.iter().zip(&mut samples) {
            let clock = Clock::start();
            engine.closest(&rays, &mut hits);
            samples.push(clock.elapsed().0 * 1e9 / rays.len() as f64);
        }
    }
    let spread = Spread::of(&samples[0]).context("no rounds")?;
    let theirs = samples.get(1).and_then(|s| Spread::of(s));
    let events = engine.caster().closest_hit_events(&rays);
    let (n, triangles) = (rays.len() as f64, scene.mesh.faces.len());
    let bytes = engine.bytes();
    println!(
        "{name},{triangles},{:.1},{:.1},{:.1},{:.2},{:.2},{:.2},{build:.3},{bytes},{peak},{:.2},{:.1},{}",
        spread.median,
        spread.min,
        spread.max,
        events.steps as f64 / n,
        events.leaves as f64 / n,
        events.blocks as f64 / n,
        peak as f64 / bytes as f64,
        bytes as f64 / triangles as f64,
        theirs.map_or(String::new(), |s| format!("{:.1}", s.median))
    );
    Ok(())
}

/// Embree's packets over its high-quality build, if its library is there.
fn embree(mesh: &Mesh) -> anyhow::Result<Option<EmbreeEngine>> {
    let Some(library) = Embree::find(Path::new(".venv-bench")) else { return Ok(None) };
    let quality = Quality { high: true, robust: false, filter: false };
    let scene = EmbreeScene::build(&Embree::load(&library, 1)?, mesh, quality)?;
    Ok(Some(EmbreeEngine::new(&Arc::new(scene), Call::Packet)))
}
