//! A bar chart of the geometric means, as a self-contained SVG.

use super::record::Record;
use super::summary::{lines, thread_counts};
use crate::workload::Kind;
use std::fmt::Write;

const WIDTH: f64 = 900.0;
const LABEL: f64 = 150.0;
const BAR: f64 = 14.0;
const GAP: f64 = 26.0;
/// The axis reaches at least so far, in multiples of the best entry point of Embree.
const MIN_REACH: f64 = 1.2;

fn color(engine: &str) -> &'static str {
    match engine {
        e if e.ends_with("-robust") => "#a9b8cc",
        e if e.starts_with("embree") => "#4e79a7",
        "obvhs" | "bvh" | "parry3d" => "#bab0ac",
        _ => "#e15759",
    }
}

/// One group of bars for each workload: rays per second of each engine over those of the best
/// entry point of Embree, with one thread (or the fewest recorded), geometric mean over scenes.
pub fn chart(record: &Record) -> String {
    let threads = thread_counts(record).first().copied().unwrap_or(1);
    let groups: Vec<_> = Kind::ALL
        .into_iter()
        .map(|kind| (kind, lines(record, kind, threads)))
        .filter(|(_, lines)| !lines.is_empty())
        .collect();
    let longest = groups.iter().flat_map(|(_, l)| l).map(|l| l.to_best).fold(MIN_REACH, f64::max);
    let unit = (WIDTH - LABEL - 60.0) / longest;
    let height: f64 = 60.0 + groups.iter().map(|(_, l)| GAP + BAR * l.len() as f64).sum::<f64>();
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" \
         font-family=\"sans-serif\" font-size=\"11\">\n\
         <rect width=\"{WIDTH}\" height=\"{height}\" fill=\"white\"/>\n\
         <text x=\"8\" y=\"18\" font-size=\"14\">Rays per second over the best entry point of \
         Embree, {threads} thread(s), geometric mean over scenes</text>\n"
    );
    let mut y = 34.0;
    for (kind, lines) in &groups {
        let _ = writeln!(
            svg,
            "<text x=\"8\" y=\"{:.1}\" font-weight=\"bold\">{}</text>",
            y + 12.0,
            kind.name()
        );
        y += 18.0;
        for line in lines {
            let length = line.to_best * unit;
            let _ = writeln!(
                svg,
                "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>\
                 <rect x=\"{LABEL}\" y=\"{:.1}\" width=\"{length:.1}\" height=\"{:.1}\" \
                 fill=\"{}\"/><text x=\"{:.1}\" y=\"{:.1}\">{:.2}</text>",
                LABEL - 6.0,
                y + 11.0,
                line.engine,
                y + 2.0,
                BAR - 3.0,
                color(line.engine),
                LABEL + length + 4.0,
                y + 11.0,
                line.to_best
            );
            y += BAR;
        }
        y += GAP - 18.0;
    }
    let one = LABEL + unit;
    let _ = writeln!(
        svg,
        "<line x1=\"{one:.1}\" y1=\"30\" x2=\"{one:.1}\" y2=\"{:.1}\" stroke=\"#333\" \
         stroke-dasharray=\"3 3\"/>\n</svg>",
        height - 20.0
    );
    svg
}
