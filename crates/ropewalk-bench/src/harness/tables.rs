//! A record as tables for docs/performance.md.

use super::statistics::geometric_mean;
use crate::workload::Kind;
use anyhow::Context;
use std::fmt::Write;

/// What the tables need of a row of the CSV.
#[derive(Clone, Debug, PartialEq)]
struct Entry {
    scene: String,
    workload: String,
    engine: String,
    threads: usize,
    /// Millions of rays (or triangles) per second.
    median: f64,
    /// The same by wall time.
    wall: f64,
    to_best: Option<f64>,
    to_robust: Option<f64>,
    to_single: Option<f64>,
}

/// The engine of the tables: ours, and its builder's name.
const OWN: [&str; 2] = ["ropewalk-wave", "ropewalk-wide"];
/// The Rust peers.
const PEERS: [&str; 3] = ["obvhs", "bvh", "parry3d"];

/// The tables of a record's CSV in Markdown: for each number of threads the ratios to the best of
/// Embree's plain entry points by scene, then the means over the scenes against each peer; last the
/// rates with more threads over those with one, by wall time. Rows with an error take no part.
///
/// # Errors
/// If a column is missing or a number malformed.
pub fn tables(csv: &str) -> anyhow::Result<String> {
    let entries = entries(csv)?;
    let mut threads: Vec<usize> = entries.iter().map(|e| e.threads).collect();
    threads.sort_unstable();
    threads.dedup();
    let mut out = String::new();
    for &count in &threads {
        let _ = writeln!(out, "{count} thread(s)\n");
        out += &by_scene(&entries, count);
        out += &by_peer(&entries, count);
    }
    if let [one, .., all] = threads[..] {
        out += &by_threads(&entries, one, all);
    }
    Ok(out)
}

fn own(entries: &[Entry], threads: usize) -> impl Iterator<Item = &Entry> {
    entries.iter().filter(move |e| e.threads == threads && OWN.contains(&e.engine.as_str()))
}

/// The workloads that occur, in the order of the benchmark.
fn workloads(entries: &[Entry]) -> Vec<&'static str> {
    let names = Kind::ALL.into_iter().map(Kind::name);
    names.filter(|name| entries.iter().any(|e| e.workload == *name)).collect()
}

/// The scenes that occur, in the order of the record.
fn scenes(entries: &[Entry]) -> Vec<&str> {
    let mut scenes: Vec<&str> = Vec::new();
    for entry in entries {
        if !scenes.contains(&entry.scene.as_str()) {
            scenes.push(&entry.scene);
        }
    }
    scenes
}

fn by_scene(entries: &[Entry], threads: usize) -> String {
    let workloads = workloads(entries);
    let mut out = format!("| scene | {} |\n|", workloads.join(" | "));
    out += &" --- |".repeat(workloads.len() + 1);
    out.push('\n');
    let ratio = |scene: Option<&str>, workload: &str| {
        let rows = own(entries, threads).filter(|e| e.workload == workload);
        let rows = rows.filter(|e| scene.is_none_or(|s| e.scene == s));
        geometric_mean(rows.filter_map(|e| e.to_best))
    };
    for scene in scenes(entries) {
        let row = workloads.iter().map(|w| show(ratio(Some(scene), w)));
        let _ = writeln!(out, "| {scene} | {} |", row.collect::<Vec<_>>().join(" | "));
    }
    let row = workloads.iter().map(|w| format!("**{}**", show(ratio(None, w))));
    let _ = writeln!(out, "| **geometric mean** | {} |\n", row.collect::<Vec<_>>().join(" | "));
    out
}

fn by_peer(entries: &[Entry], threads: usize) -> String {
    let mut out = format!(
        "| mean over scenes (worst) | best plain Embree | best robust | embree-1 | {} |\n|",
        PEERS.join(" | ")
    );
    out += &" --- |".repeat(4 + PEERS.len());
    out.push('\n');
    for workload in workloads(entries) {
        let rows = || own(entries, threads).filter(|e| e.workload == workload);
        let mut cells = vec![
            cell(rows().map(|e| e.to_best)),
            cell(rows().map(|e| e.to_robust)),
            cell(rows().map(|e| e.to_single)),
        ];
        for peer in PEERS {
            let theirs = |own: &Entry| {
                let same = |e: &&Entry| {
                    let place = (&e.scene, &e.workload, e.threads);
                    e.engine == peer && place == (&own.scene, &own.workload, own.threads)
                };
                entries.iter().find(same).map(|e| own.median / e.median)
            };
            cells.push(cell(rows().map(theirs)));
        }
        let _ = writeln!(out, "| {workload} | {} |", cells.join(" | "));
    }
    out.push('\n');
    out
}

fn by_threads(entries: &[Entry], one: usize, all: usize) -> String {
    let mut out = format!(
        "| rays per second, {all} threads over {one} | ropewalk | best plain Embree |\n\
         | --- | --- | --- |\n"
    );
    for workload in workloads(entries) {
        let rate = |scene: &str, threads: usize, ours: bool| {
            let rows = entries.iter().filter(|e| {
                let place = (e.scene.as_str(), e.workload.as_str(), e.threads);
                // A medium-quality build is another product, as in the ratios.
                let plain = e.engine.starts_with("embree")
                    && !e.engine.starts_with("embree-medium")
                    && !e.engine.ends_with("-robust");
                let engine = if ours { OWN.contains(&e.engine.as_str()) } else { plain };
                engine && place == (scene, workload, threads)
            });
            rows.map(|e| e.wall).reduce(f64::max)
        };
        let scale = |ours: bool| {
            let scenes = scenes(entries);
            let ratios = scenes.iter().map(|s| Some(rate(s, all, ours)? / rate(s, one, ours)?));
            cell(ratios.collect::<Vec<_>>().into_iter())
        };
        let _ = writeln!(out, "| {workload} | {} | {} |", scale(true), scale(false));
    }
    out
}

/// Mean and worst of what is there.
fn cell(ratios: impl Iterator<Item = Option<f64>>) -> String {
    let ratios: Vec<f64> = ratios.flatten().collect();
    let worst = ratios.iter().copied().reduce(f64::min);
    match worst {
        Some(worst) => format!("{} ({worst:.2})", show(geometric_mean(ratios))),
        None => String::new(),
    }
}

fn show(ratio: Option<f64>) -> String {
    ratio.map_or(String::new(), |r| format!("{r:.2}"))
}

fn entries(csv: &str) -> anyhow::Result<Vec<Entry>> {
    let mut rows = csv.lines().map(fields);
    let head = rows.next().context("the record is empty")?;
    let column = |name: &str| {
        let found = head.iter().position(|h| h == name);
        found.with_context(|| format!("the record has no column {name}"))
    };
    let names = ["scene", "workload", "engine", "threads", "median_mrays", "median_wall_mrays"];
    let ratios = ["ratio_to_best_embree", "ratio_to_best_robust", "ratio_to_embree_1", "error"];
    let mut at = Vec::new();
    for name in names.into_iter().chain(ratios) {
        at.push(column(name)?);
    }
    let mut entries = Vec::new();
    for (line, row) in rows.enumerate() {
        let field = |i: usize| row.get(at[i]).map_or("", String::as_str);
        let number = |i: usize| -> anyhow::Result<f64> {
            field(i).parse().with_context(|| {
                format!("line {}: expected a number, found \"{}\"", line + 2, field(i))
            })
        };
        let optional = |i: usize| if field(i).is_empty() { Ok(None) } else { number(i).map(Some) };
        if !field(9).is_empty() || field(4).is_empty() {
            continue;
        }
        entries.push(Entry {
            scene: field(0).to_owned(),
            workload: field(1).to_owned(),
            engine: field(2).to_owned(),
            threads: number(3)? as usize,
            median: number(4)?,
            wall: optional(5)?.unwrap_or(number(4)?),
            to_best: optional(6)?,
            to_robust: optional(7)?,
            to_single: optional(8)?,
        });
    }
    Ok(entries)
}

/// The fields of a line (RFC 4180); the record has no line feeds in fields.
fn fields(line: &str) -> Vec<String> {
    let (mut fields, mut quoted) = (vec![String::new()], false);
    for c in line.chars() {
        match c {
            // A quote inside of quotes is written twice: it closes and opens again.
            '"' => quoted = !quoted,
            ',' if !quoted => fields.push(String::new()),
            c => {
                if let Some(field) = fields.last_mut() {
                    field.push(c);
                }
            }
        }
    }
    fields
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::harness::{Family, Rate, Record, Row, Spread};

    #[test]
    fn ratios_are_those_of_the_record() {
        let mut record = Record { cpu: "a, b".into(), ..Record::default() };
        for (scene, factor) in [("x", 1.0), ("y", 4.0)] {
            for threads in [1, 2] {
                let row = |engine: &str, family, rate: f64| Row {
                    workload: Some(Kind::Diffuse),
                    threads,
                    family,
                    rate: Some(Rate {
                        spread: Spread { median: rate, min: rate, max: rate },
                        wall_median: rate * threads as f64,
                    }),
                    ..Row::error(scene, engine, "")
                };
                record.add(vec![
                    row("embree-1", Family::Embree, 1.0),
                    row("embree-16-robust", Family::EmbreeRobust, 0.5),
                    row("obvhs", Family::Peer, 0.25),
                    row("ropewalk-wave", Family::Own, factor),
                ]);
            }
        }
        record.rows.push(Row::error("z", "*", "not \"there\", alas"));
        let text = tables(&record.csv()).unwrap();
        assert!(text.contains("| x | 1.00 |\n| y | 4.00 |\n| **geometric mean** | **2.00** |"));
        let peers = "| diffuse | 2.00 (1.00) | 4.00 (2.00) | 2.00 (1.00) | 8.00 (4.00) |  |  |";
        assert!(text.contains(peers), "{text}");
        assert!(text.contains("| diffuse | 2.00 (2.00) | 2.00 (2.00) |"), "{text}");
        assert!(tables("scene,workload\n").is_err());
    }
}
