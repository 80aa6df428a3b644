//! Build speed and memory: `cargo run --release -p ropewalk-bench --bin build_speed [MAX_N] [MEASURE]`.
//!
//! Builds random soups and grid meshes of 10^4 to 10^6 triangles in one thread by the exact sweep
//! with clipping and prints one CSV row each, smallest first, so that the peak of the resident set
//! (which never falls) belongs to the row's own build. MEASURE is `macdonald-booth` (default),
//! `termination` or `macdonald-booth-1990`.

use ropewalk::Geometry;
use ropewalk::build::{BuildSettings, Measure, build};
use ropewalk_bench::harness::peak_resident;
use ropewalk_bench::scenes::{grid_mesh, random_soup};
use std::process::ExitCode;

const SIZES: [usize; 5] = [10_000, 30_000, 100_000, 300_000, 1_000_000];

fn main() -> ExitCode {
    let mut args = std::env::args().skip(1);
    let max = args.next().and_then(|a| a.parse().ok()).unwrap_or(usize::MAX);
    let measure = match args.next().as_deref() {
        None | Some("macdonald-booth") => Measure::MacDonaldBooth,
        Some("macdonald-booth-1990") => Measure::MacDonaldBooth1990,
        Some("termination") => Measure::Termination,
        Some(other) => {
            eprintln!("unknown measure {other}");
            return ExitCode::from(2);
        }
    };
    println!(
        "scene,n,seconds,cpu_seconds,mtri_per_cpu_s,cpu_ns_per_n_log2_n,vm_hwm_mib,inner,leaves,references,predicted_cost"
    );
    for n in SIZES.into_iter().filter(|&n| n <= max) {
        for (scene, geometry) in [("grid", grid_mesh(n)), ("soup", random_soup(n))] {
            if let Err(error) = row(scene, &geometry, measure) {
                eprintln!("{error}");
                return ExitCode::FAILURE;
            }
        }
    }
    ExitCode::SUCCESS
}

/// Builds once and prints the row.
fn row(
    scene: &str,
    geometry: &Geometry,
    measure: Measure,
) -> Result<(), ropewalk::build::BuildError> {
    let settings = BuildSettings { measure, threads: 1, ..BuildSettings::default() };
    let cpu_before = thread_cpu_seconds();
    let (_tree, report) = build(geometry, &settings, &())?;
    let cpu = match (cpu_before, thread_cpu_seconds()) {
        (Some(before), Some(after)) => after - before,
        _ => report.seconds,
    };
    let n = geometry.len() as f64;
    println!(
        "{scene},{},{:.3},{cpu:.3},{:.3},{:.1},{},{},{},{},{:.2}",
        geometry.len(),
        report.seconds,
        n / cpu * 1e-6,
        cpu * 1e9 / (n * n.log2()),
        peak_resident().map_or("unknown".into(), |bytes| (bytes >> 20).to_string()),
        report.tree.inner_nodes,
        report.tree.leaves,
        report.tree.references,
        report.tree.predicted_intersection_tests + report.tree.predicted_inner_visits,
    );
    Ok(())
}

/// Processor time of this thread, where Linux tells it: unlike the wall clock it does not count
/// what other processes take.
fn thread_cpu_seconds() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(stat.split_whitespace().next()?.parse::<f64>().ok()? * 1e-9)
}
