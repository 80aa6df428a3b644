//! What particles cost that are moved along lists of segments, beside queries for the same segments.
//!
//! `particle_profile SCENES [ROUNDS [WAYS]]`, names separated by commas: nanoseconds of thread CPU time a segment on one thread,
//! interleaved, for the walks of the benchmark: the nearest hit of each segment, all of which are known (`closest`); a
//! walker that reports all crossings (`run`), one that stops at the first of each particle (`stop`), and one that is asked
//! for one segment of each particle at a time (`advance`, first segments only).

use ropewalk::build::{BuildSettings, Preset};
use ropewalk::walker::{Encounter, Walker};
use ropewalk_bench::harness::{Clock, Engine, Spread};
use ropewalk_bench::own::Wave;
use ropewalk_bench::scene::Catalog;
use ropewalk_bench::workload::{Generator, Kind, Sizes};
use std::path::PathBuf;

/// Segments of each particle that are asked for one at a time.
const STEPS: usize = 16;

/// How segments are walked.
const WAYS: [&str; 4] = ["closest", "run", "stop", "advance"];

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let names: Vec<String> = arguments.first().map_or_else(Vec::new, |list| {
        list.split(',').filter(|name| !name.is_empty()).map(str::to_owned).collect()
    });
    let rounds: usize = arguments.get(1).map_or(Ok(7), |n| n.parse())?;
    let ways = arguments.get(2).cloned().unwrap_or_else(|| WAYS.join(","));
    let asked = |i: usize| ways.split(',').any(|way| way == WAYS[i]);
    let catalog =
        Catalog { data: PathBuf::from("../shared/data"), generated: "target/bench-scenes".into() };
    println!(
        "{:17} {:9} {:>8} {:>8} {:>8} {:>8} {:>9} {:>8}",
        "scene", "workload", "closest", "run", "stop", "advance", "crossings", "clear"
    );
    for entry in Catalog::select(&names)? {
        let scene = catalog.load(&entry)?;
        let settings = BuildSettings { threads: 1, ..BuildSettings::preset(Preset::Balanced) };
        let engine = Wave::with_settings(&scene.mesh, &settings)?;
        let trace = |rays: &[ropewalk::Ray], out: &mut [_]| engine.closest(rays, out);
        let sizes = Sizes { side: 64, chords: 1024, walk: 1 << 18 };
        let generator = Generator::new(&scene.mesh, &scene.view, sizes, &trace);
        for kind in [Kind::Walk1, Kind::Walk02] {
            let work = generator.workload(kind);
            let caster = Wave::caster(&engine);
            let mut offsets: Vec<usize> = work.chains.iter().map(|&at| at as usize).collect();
            let starts: Vec<[f32; 3]> = offsets.iter().map(|&at| work.rays[at].origin).collect();
            offsets.push(work.rays.len());
            let directions: Vec<[f32; 3]> = work.rays.iter().map(|ray| ray.dir).collect();
            let lengths: Vec<f32> = work.rays.iter().map(|ray| ray.t_max).collect();
            // The first segments of particles that have so many.
            let long: Vec<usize> = offsets
                .windows(2)
                .filter(|row| row[1] - row[0] >= STEPS)
                .map(|row| row[0])
                .collect();
            let first: Vec<[f32; 3]> = long.iter().map(|&at| work.rays[at].origin).collect();
            let steps: Vec<(Vec<[f32; 3]>, Vec<f32>)> = (0..STEPS)
                .map(|i| {
                    let of = |at: &usize| (directions[at + i], lengths[at + i]);
                    long.iter().map(of).unzip()
                })
                .collect();
            let mut all = [const { Vec::new() }; 4];
            let (mut crossings, mut clear) = (0, 0.0);
            for i in (0..rounds).flat_map(|_| 0..4).filter(|&i| asked(i)) {
                let at = if i == 3 { &first } else { &starts };
                let walker = Walker::new(engine.tree(), engine.geometry(), at.clone())?;
                let (mut walker, mut segments) = (walker.with_threads(1), work.rays.len());
                let clock = Clock::start();
                match i {
                    0 => drop(caster.closest_hit(&work.rays)),
                    1 | 2 => {
                        let encounter = [Encounter::Pass, Encounter::Stop][i - 1];
                        let events = walker.run(&offsets, &directions, &lengths, encounter);
                        segments = events.walked.iter().map(|&n| n as usize).sum();
                        if i == 1 {
                            crossings = events.t.len();
                            clear = events.report.clear as f64 / events.report.segments as f64;
                        }
                    }
                    _ => {
                        segments = STEPS * first.len();
                        for (directions, lengths) in &steps {
                            walker.advance(directions, lengths, Encounter::Pass);
                        }
                    }
                }
                all[i].push(clock.elapsed().0 * 1e9 / segments as f64);
            }
            let ns = all.map(|all| Spread::of(&all).map_or(f64::NAN, |spread| spread.median));
            println!(
                "{:17} {:9} {:8.1} {:8.1} {:8.1} {:8.1} {crossings:9} {clear:8.3}",
                entry.name,
                kind.name(),
                ns[0],
                ns[1],
                ns[2],
                ns[3],
            );
        }
    }
    Ok(())
}
