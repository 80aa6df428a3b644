//! The table at the end of a run: one line for each workload and engine, over all scenes.

use super::record::{Record, Row};
use super::statistics::geometric_mean;
use crate::workload::Kind;
use std::fmt::Write;

/// An engine on a workload over all scenes.
pub(super) struct Line<'a> {
    pub engine: &'a str,
    pub to_best: f64,
    pub to_single: Option<f64>,
    pub worst: (f64, &'a str),
    pub scenes: usize,
}

/// The lines of a workload, best first.
pub(super) fn lines(record: &Record, kind: Kind, threads: usize) -> Vec<Line<'_>> {
    let rows: Vec<&Row> = record
        .rows
        .iter()
        .filter(|r| r.workload == Some(kind) && r.threads == threads && r.error.is_empty())
        .collect();
    let mut engines: Vec<&str> = rows.iter().map(|r| r.engine.as_str()).collect();
    engines.sort_unstable();
    engines.dedup();
    let mut lines: Vec<Line> = engines
        .into_iter()
        .filter_map(|engine| {
            let own = || rows.iter().filter(move |r| r.engine == engine);
            let scored = || own().filter_map(|r| Some((r.ratio_to_best_embree?, &*r.scene)));
            Some(Line {
                engine,
                to_best: geometric_mean(scored().map(|s| s.0))?,
                to_single: geometric_mean(own().filter_map(|r| r.ratio_to_embree_1)),
                worst: scored().min_by(|a, b| a.0.total_cmp(&b.0))?,
                scenes: scored().count(),
            })
        })
        .collect();
    lines.sort_by(|a, b| b.to_best.total_cmp(&a.to_best));
    lines
}

/// The numbers of threads in a record, ascending.
pub(super) fn thread_counts(record: &Record) -> Vec<usize> {
    let rows = record.rows.iter().filter(|r| r.workload.is_some());
    let mut threads: Vec<usize> = rows.map(|r| r.threads).collect();
    threads.sort_unstable();
    threads.dedup();
    threads
}

/// Geometric means over the scenes, and the worst scene of each engine; then all errors.
pub fn summary(record: &Record) -> String {
    let mut out = String::new();
    for threads in thread_counts(record) {
        let _ = writeln!(
            out,
            "\n{threads} thread(s): geometric mean over scenes of the ratio of rays per second\n\
             {:<11}{:<19}{:>12}{:>13}{:>8}  worst scene",
            "workload", "engine", "best Embree", "embree-1", "scenes"
        );
        for kind in Kind::ALL {
            for line in lines(record, kind, threads) {
                let single = line.to_single.map_or("-".into(), |r| format!("{r:.2}"));
                let _ = writeln!(
                    out,
                    "{:<11}{:<19}{:>12.2}{single:>13}{:>8}  {:.2} {}",
                    kind.name(),
                    line.engine,
                    line.to_best,
                    line.scenes,
                    line.worst.0,
                    line.worst.1
                );
            }
        }
    }
    for row in record.rows.iter().filter(|r| !r.error.is_empty()) {
        let workload = row.workload.map_or("*", Kind::name);
        let _ = writeln!(out, "ERROR {} {workload} {}: {}", row.scene, row.engine, row.error);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::harness::{Family, Rate, Spread};

    #[test]
    fn means_worst_scenes_and_errors_are_shown() {
        let mut record = Record::default();
        for (scene, ours) in [("a", 1.0), ("b", 4.0)] {
            let row = |engine: &str, family, median| Row {
                workload: Some(Kind::Diffuse),
                threads: 1,
                family,
                rate: Some(Rate {
                    spread: Spread { median, min: median, max: median },
                    wall_median: median,
                }),
                ..Row::error(scene, engine, "")
            };
            record.add(vec![row("embree-1", Family::Embree, 1.0), row("o", Family::Own, ours)]);
        }
        record.rows.push(Row::error("c", "*", "absent"));
        let lines = lines(&record, Kind::Diffuse, 1);
        assert_eq!((lines[0].engine, lines[0].to_best, lines[0].worst), ("o", 2.0, (1.0, "a")));
        let text = summary(&record);
        assert!(text.contains("ERROR c * *: absent") && text.contains("diffuse"), "{text}");
    }
}
