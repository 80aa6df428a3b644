//! The benchmark against the peers: verifies, times, records. See docs/performance.md.

use anyhow::Context;
use clap::Parser;
use ropewalk_bench::answer::BenchHit;
use ropewalk_bench::harness::{
    Answers, Budget, Builder, Engine, Family, Oracle, Record, Row, Testimony, build_rates,
    calibrate, chart, commit, cpu_name, max_wrong_per_million, rates, summary, today, verify,
};
use ropewalk_bench::own::{Single, TaB, TaBBuilder, Walker, Wave, WaveBuilder};
use ropewalk_bench::peer::{
    BvhBuilder, BvhPeer, Call, Embree, EmbreeBuilder, EmbreeEngine, EmbreeScene, ObvhsBuilder,
    ObvhsPeer, ParryBuilder, ParryPeer, Quality,
};
use ropewalk_bench::scene::{Catalog, Mesh, Scene, SceneEntry};
use ropewalk_bench::workload::{Generator, Kind, Sizes, Workload};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

/// Measures rays per second of ropewalk and its peers on the same rays in one process.
#[derive(Parser)]
struct Arguments {
    /// Scenes, separated by commas; all without this.
    #[arg(long, value_delimiter = ',')]
    scenes: Vec<String>,
    /// Workloads, separated by commas; all without this.
    #[arg(long, value_delimiter = ',')]
    workloads: Vec<String>,
    /// Only engines whose name contains one of these; Embree's plain entry points always run.
    #[arg(long, value_delimiter = ',')]
    engines: Vec<String>,
    /// Rounds of each engine.
    #[arg(long)]
    rounds: Option<usize>,
    /// Seconds of a round; an engine that needs longer gets a subset of the rays.
    #[arg(long)]
    seconds: Option<f64>,
    /// The same for peers other than Embree.
    #[arg(long)]
    peer_seconds: Option<f64>,
    /// Seconds of all builds of an engine on a scene; three are made in any case.
    #[arg(long)]
    build_seconds: Option<f64>,
    /// Fewer rays and rounds, for trying out; the record goes to target/bench-quick.
    #[arg(long)]
    quick: bool,
    /// Numbers of threads, or `all`.
    #[arg(long, value_delimiter = ',', default_value = "1,all")]
    threads: Vec<String>,
    /// Embree's shared library; without this it is looked for in .venv-bench.
    #[arg(long)]
    embree: Option<PathBuf>,
    /// The folder of shared scenes.
    #[arg(long, default_value = "../shared/data")]
    data: PathBuf,
    /// The folder of generated scenes.
    #[arg(long, default_value = "target/bench-scenes")]
    generated: PathBuf,
    /// Write each scene's view as NAME.pgm to this folder and measure nothing.
    #[arg(long)]
    pictures: Option<PathBuf>,
    /// Where the record goes.
    #[arg(long)]
    out: Option<PathBuf>,
}

/// What a run does, checked.
struct Plan {
    kinds: Vec<Kind>,
    engines: Vec<String>,
    threads: Vec<usize>,
    budget: Budget,
    sizes: Sizes,
    /// Embree's library.
    library: PathBuf,
    /// The device for tracing and for builds with one thread.
    device: Arc<Embree>,
}

impl Plan {
    fn wants(&self, engine: &str, family: Family) -> bool {
        let listed = || self.engines.iter().any(|e| engine.contains(e.as_str()));
        family == Family::Embree || self.engines.is_empty() || listed()
    }
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("bench: {error:#}");
            ExitCode::from(2)
        }
    }
}

/// True if every scene was there and every answer right.
fn run(arguments: &Arguments) -> anyhow::Result<bool> {
    let entries = Catalog::select(&arguments.scenes)?;
    let catalog = Catalog { data: arguments.data.clone(), generated: arguments.generated.clone() };
    let plan = plan(arguments)?;
    if let Some(folder) = &arguments.pictures {
        return pictures(&plan, &catalog, &entries, folder);
    }
    let mut record = Record {
        cpu: cpu_name(),
        commit: commit(),
        settings: format!(
            "Embree {} high; rounds {}; clock {}; side {}; {}",
            plan.device.version(),
            plan.budget.rounds,
            "thread CPU (1 thread), wall (more)",
            plan.sizes.side,
            if cfg!(target_feature = "avx2") { "compiled for this CPU" } else { "baseline x86-64" }
        ),
        rows: Vec::new(),
    };
    eprintln!("{}, commit {}; {}", record.cpu, record.commit, record.settings);
    let out = arguments.out.clone().unwrap_or_else(|| {
        PathBuf::from(if arguments.quick { "target/bench-quick" } else { "bench/record" })
    });
    let dated = out.join(format!("{}-{}.csv", today(), record.commit.replace('+', "-dirty")));
    for entry in &entries {
        match catalog.load(entry) {
            Ok(scene) => run_scene(&plan, &scene, &mut record)?,
            Err(error) => {
                eprintln!("{}: {error:#}", entry.name);
                record.rows.push(Row::error(entry.name, "*", format!("{error:#}")));
            }
        }
        Record::write(&dated, &record.csv())?;
    }
    if plan.kinds.contains(&Kind::Build) {
        run_parallel_builds(&plan, &catalog, &entries, &mut record)?;
    }
    Record::write(&dated, &record.csv())?;
    println!("{}", summary(&record));
    if is_whole(arguments) {
        Record::write(&out.join("latest.csv"), &record.csv())?;
        Record::write(&out.join("latest.svg"), &chart(&record))?;
        println!("record: {}   chart: {}", dated.display(), out.join("latest.svg").display());
    } else {
        println!("record: {}   latest.csv and latest.svg stay: this is a part", dated.display());
    }
    Ok(record.rows.iter().all(|r| r.error.is_empty()))
}

/// True if the record takes the place of the latest one: all scenes, all workloads, and our batch engines at least.
fn is_whole(arguments: &Arguments) -> bool {
    let asked = |own: &str| arguments.engines.iter().any(|engine| own.contains(engine.as_str()));
    let engines =
        arguments.engines.is_empty() || asked("ropewalk-wave") && asked("ropewalk-walker");
    arguments.scenes.is_empty() && arguments.workloads.is_empty() && engines
}

/// Grey pictures of the views: dark where a surface is seen edge-on, black where nothing is.
fn pictures(
    plan: &Plan,
    catalog: &Catalog,
    entries: &[SceneEntry],
    folder: &Path,
) -> anyhow::Result<bool> {
    std::fs::create_dir_all(folder)?;
    for entry in entries {
        let scene = catalog.load(entry)?;
        let quality = Quality { high: false, robust: true, filter: false };
        let tree = Arc::new(EmbreeScene::build(&plan.device, &scene.mesh, quality)?);
        let engine = EmbreeEngine::new(&tree, Call::Single);
        let trace = |rays: &[ropewalk::Ray], out: &mut [BenchHit]| engine.closest(rays, out);
        let grey = Generator::new(&scene.mesh, &scene.view, plan.sizes, &trace).picture();
        let mut file = format!("P5 {0} {0} 255\n", plan.sizes.side).into_bytes();
        file.extend(grey);
        std::fs::write(folder.join(format!("{}.pgm", entry.name)), file)?;
    }
    Ok(true)
}

fn plan(arguments: &Arguments) -> anyhow::Result<Plan> {
    let kinds = if arguments.workloads.is_empty() {
        Kind::ALL.to_vec()
    } else {
        let known = || Kind::ALL.map(Kind::name).join(", ");
        let parse = |n: &String| {
            Kind::named(n)
                .with_context(|| format!("unknown workload {n}; the workloads are {}", known()))
        };
        arguments.workloads.iter().map(parse).collect::<Result<_, _>>()?
    };
    let available = std::thread::available_parallelism()?.get();
    let parse = |n: &String| match n.as_str() {
        "all" => Ok(available),
        n => n.parse().with_context(|| format!("threads: expected a number or all, found {n}")),
    };
    let mut threads = arguments.threads.iter().map(parse).collect::<Result<Vec<_>, _>>()?;
    threads.sort_unstable();
    threads.dedup();
    anyhow::ensure!(threads.first().is_some_and(|&t| t > 0), "at least one thread is needed");
    let (mut budget, sizes) =
        if arguments.quick { (Budget::QUICK, Sizes::QUICK) } else { (Budget::FULL, Sizes::FULL) };
    budget.rounds = arguments.rounds.unwrap_or(budget.rounds);
    anyhow::ensure!(budget.rounds > 0, "at least one round is needed");
    for (own, given) in [
        (&mut budget.seconds_per_round, arguments.seconds),
        (&mut budget.peer_seconds, arguments.peer_seconds),
        (&mut budget.build_seconds, arguments.build_seconds),
    ] {
        *own = given.unwrap_or(*own);
        anyhow::ensure!(*own > 0.0, "seconds: expected a number above 0, found {own}");
    }
    let library = match &arguments.embree {
        Some(path) => path.clone(),
        None => Embree::find(Path::new(".venv-bench"))
            .context("no libembree4 found below .venv-bench; scripts/bench installs it")?,
    };
    let device = Embree::load(&library, 1)?;
    let engines = arguments.engines.clone();
    Ok(Plan { kinds, engines, threads, budget, sizes, library, device })
}

fn run_scene(plan: &Plan, scene: &Scene, record: &mut Record) -> anyhow::Result<()> {
    let mesh = &scene.mesh;
    eprintln!("{}: {} triangles", mesh.name, mesh.faces.len());
    let traced: Vec<Kind> = plan.kinds.iter().copied().filter(|&k| k != Kind::Build).collect();
    if !traced.is_empty() {
        let filters = traced.iter().any(|k| matches!(k, Kind::AllHits | Kind::FirstHits));
        let engines = engines(plan, mesh, filters)?;
        let tracer = &engines[0];
        let trace = |rays: &[ropewalk::Ray], out: &mut [BenchHit]| tracer.closest(rays, out);
        let generator = Generator::new(&scene.mesh, &scene.view, plan.sizes, &trace);
        for kind in traced {
            run_workload(plan, mesh, &generator.workload(kind), &engines, record)?;
        }
    }
    if plan.kinds.contains(&Kind::Build) && plan.threads.contains(&1) {
        run_builds(plan, mesh, &plan.device, 1, record);
    }
    Ok(())
}

/// Builds with more threads, after everything else: the worker threads of Embree's device spin as
/// long as it is open.
fn run_parallel_builds(
    plan: &Plan,
    catalog: &Catalog,
    entries: &[SceneEntry],
    record: &mut Record,
) -> anyhow::Result<()> {
    for &threads in plan.threads.iter().filter(|&&t| t > 1) {
        let device = Embree::load(&plan.library, threads)?;
        // A scene that cannot be loaded has its row already.
        for scene in entries.iter().filter_map(|entry| catalog.load(entry).ok()) {
            run_builds(plan, &scene.mesh, &device, threads, record);
        }
    }
    Ok(())
}

/// All engines on a mesh, `embree-1` first.
fn engines(plan: &Plan, mesh: &Mesh, filters: bool) -> anyhow::Result<Vec<Box<dyn Engine>>> {
    let mut engines: Vec<Box<dyn Engine>> = Vec::new();
    for robust in [false, true] {
        let family = if robust { Family::EmbreeRobust } else { Family::Embree };
        if !plan.wants("robust", family) {
            continue;
        }
        let build = |filter| {
            let quality = Quality { high: true, robust, filter };
            EmbreeScene::build(&plan.device, mesh, quality).map(Arc::new)
        };
        let scene = build(false)?;
        for call in [Call::Single, Call::Packet, Call::PacketCoherent] {
            engines.push(Box::new(EmbreeEngine::new(&scene, call)));
        }
        if filters {
            engines.push(Box::new(EmbreeEngine::new(&build(true)?, Call::Filter)));
        }
    }
    if plan.wants("obvhs", Family::Peer) {
        engines.push(Box::new(ObvhsPeer::build(mesh)));
    }
    if plan.wants("bvh", Family::Peer) {
        engines.push(Box::new(BvhPeer::build(mesh)));
    }
    if plan.wants("parry3d", Family::Peer) {
        engines.push(Box::new(ParryPeer::build(mesh)?));
    }
    if plan.wants("ropewalk-ta-b", Family::Own) {
        engines.push(Box::new(TaB::build(mesh, 1)?));
    }
    let wants = |name| plan.wants(name, Family::Own);
    if ["ropewalk-wave", "ropewalk-single", "ropewalk-walker"].iter().any(|name| wants(name)) {
        let wave = Wave::build(mesh, 1)?;
        if wants("ropewalk-single") {
            engines.push(Box::new(Single(wave.clone())));
        }
        if wants("ropewalk-walker") {
            engines.push(Box::new(Walker(wave.clone())));
        }
        if wants("ropewalk-wave") {
            engines.push(Box::new(wave));
        }
    }
    Ok(engines)
}

/// Verifies all engines that answer the workload, then times them for each number of threads.
fn run_workload(
    plan: &Plan,
    mesh: &Mesh,
    work: &Workload,
    engines: &[Box<dyn Engine>],
    record: &mut Record,
) -> anyhow::Result<()> {
    let kind = work.kind;
    if work.rays.is_empty() {
        record.rows.push(Row {
            workload: Some(kind),
            ..Row::error(&mesh.name, "*", "the view sees nothing to start from")
        });
        return Ok(());
    }
    let able: Vec<&dyn Engine> =
        engines.iter().map(|e| &**e).filter(|e| e.supports(kind.question())).collect();
    let strides: Vec<usize> = able.iter().map(|e| calibrate(*e, work, &plan.budget)).collect();
    let subsets: Vec<Workload> = strides.iter().map(|&s| work.subset(s)).collect();
    let answers: Vec<Answers> = able
        .iter()
        .zip(&subsets)
        .map(|(engine, work)| {
            let mut answers = Answers::for_workload(work);
            answers.fill(*engine, work);
            answers
        })
        .collect();
    let testimonies: Vec<Testimony> = answers
        .iter()
        .zip(&strides)
        .map(|(answers, &stride)| Testimony { answers, stride })
        .collect();
    let verdicts = verify(&Oracle::new(mesh), mesh.faces.len(), work, &testimonies);
    drop(testimonies);
    drop(answers);

    let timed: Vec<(&dyn Engine, &Workload)> = able.iter().copied().zip(&subsets).collect();
    for &threads in &plan.threads {
        let pool = (threads > 1)
            .then(|| rayon::ThreadPoolBuilder::new().num_threads(threads).build())
            .transpose()?;
        let rates = rates(&timed, plan.budget.rounds, pool.as_ref());
        let rows =
            timed.iter().zip(rates).zip(&verdicts).map(|(((engine, work), rate), verdict)| {
                let wrong = verdict.wrong_per_million;
                let error = if wrong > max_wrong_per_million(engine.family()) {
                    format!("{wrong:.0} wrong answers in a million")
                } else {
                    String::new()
                };
                Row {
                    workload: Some(kind),
                    family: engine.family(),
                    level: engine.level().to_owned(),
                    threads,
                    rays: work.rays.len(),
                    rate,
                    verdict: Some(*verdict),
                    ..Row::error(&mesh.name, &engine.name(), error)
                }
            });
        record.add(rows.collect());
        report(record, timed.len());
    }
    Ok(())
}

fn run_builds(plan: &Plan, mesh: &Mesh, device: &Arc<Embree>, threads: usize, record: &mut Record) {
    let mut builders: Vec<Box<dyn Builder + '_>> = Vec::new();
    for (high, robust) in [(true, false), (false, false), (true, true)] {
        let quality = Quality { high, robust, filter: false };
        builders.push(Box::new(EmbreeBuilder { device, mesh, quality }));
    }
    builders.push(Box::new(ObvhsBuilder(mesh)));
    builders.push(Box::new(BvhBuilder(mesh)));
    builders.push(Box::new(ParryBuilder(mesh)));
    builders.push(Box::new(TaBBuilder(mesh)));
    builders.push(Box::new(WaveBuilder(mesh)));
    // A builder that knows only one thread has no row for more.
    builders.retain(|b| plan.wants(&b.name(), b.family()) && (threads == 1 || b.is_parallel()));
    let results = build_rates(&builders, mesh.faces.len(), threads, &plan.budget);
    let rows: Vec<Row> = builders
        .iter()
        .zip(results)
        .map(|(builder, result)| {
            let row = Row {
                workload: Some(Kind::Build),
                family: builder.family(),
                threads,
                rays: mesh.faces.len(),
                ..Row::error(&mesh.name, &builder.name(), "")
            };
            match result {
                Ok((rate, bytes)) => Row {
                    rate: Some(rate),
                    bytes_per_triangle: bytes.map(|b| b as f64 / mesh.faces.len() as f64),
                    ..row
                },
                Err(error) => Row { error: format!("{error:#}"), ..row },
            }
        })
        .collect();
    let count = rows.len();
    record.add(rows);
    report(record, count);
}

/// Prints the last rows.
fn report(record: &Record, count: usize) {
    for row in &record.rows[record.rows.len() - count..] {
        let rate = row.rate.map_or(f64::NAN, |r| r.spread.median);
        let ratio = row.ratio_to_best_embree.map_or("-".into(), |r| format!("{r:.2}x"));
        let verdict = row.verdict.unwrap_or_default();
        let bytes = row.bytes_per_triangle.map_or(String::new(), |b| format!(" {b:.0} B/triangle"));
        eprintln!(
            "  {:<10} {}t {:<18} {rate:>8.3} M/s {ratio:>6}  {} rays, {:.1} mismatches and {:.1} \
             wrong per million{bytes} {}",
            row.workload.map_or("*", Kind::name),
            row.threads,
            row.engine,
            row.rays,
            verdict.mismatches_per_million,
            verdict.wrong_per_million,
            row.error
        );
    }
}
