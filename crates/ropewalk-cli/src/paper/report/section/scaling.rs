//! How the build grows with the scene.

use crate::output::thousands;
use crate::paper::model::{Experiment, ScalingPoint};
use crate::paper::report::chart::{Frame, Point, Series, log_log};
use crate::paper::report::html::{Cell, Table, figure, paragraph};

/// Two charts and the numbers.
pub fn scaling(experiment: &Experiment) -> String {
    let points = &experiment.scaling;
    let Some(first) = points.first() else { return String::new() };
    let mut names: Vec<_> = points.iter().map(|p| p.scene).collect();
    names.dedup();
    let series = |figure: fn(&ScalingPoint) -> f64| {
        let one = |name: &&'static str| Series {
            name,
            points: points.iter().filter(|p| p.scene == *name).map(|p| point(p, figure)).collect(),
            joined: true,
        };
        names.iter().map(one).collect::<Vec<_>>()
    };
    let last = points.iter().map(|p| p.objects).max().unwrap_or(first.objects);
    let frame = |label, y_title, guides| Frame {
        label,
        x_title: "objects, N",
        y_title,
        square: false,
        guides,
    };
    let build = log_log(
        &frame("Build seconds", "build, seconds", vec![n_log_n(first, last)]),
        &series(|p| p.build_seconds),
    );
    let operations =
        log_log(&frame("Operations", "operations a ray", Vec::new()), &series(|p| p.operations));
    paragraph(
        "The exact sweep with perfect splits, built in one thread. On the dashed line time grows as \
         N log2 N from the first point.",
    ) + "<div class=\"charts\">\n"
        + &figure(&build, "Seconds of a build; dashed: N log2 N.")
        + &figure(&operations, "Operations a ray of a rendering of each scene.")
        + "</div>\n"
        + &table(points)
}

fn point(p: &ScalingPoint, figure: fn(&ScalingPoint) -> f64) -> Point {
    let y = figure(p);
    let tip = format!("{}, {} objects: {y:.3}", p.scene, thousands(p.objects));
    Point { x: p.objects as f64, y, tip }
}

/// The curve `N log2 N` through `first`, up to `last` objects.
fn n_log_n(first: &ScalingPoint, last: u64) -> Vec<[f64; 2]> {
    const STEPS: u32 = 24;
    let n0 = first.objects as f64;
    let growth = (last as f64 / n0).max(1.0);
    let place = |i: u32| {
        let n = n0 * growth.powf(f64::from(i) / f64::from(STEPS));
        [n, first.build_seconds * (n * n.log2()) / (n0 * n0.log2())]
    };
    (0..=STEPS).map(place).collect()
}

fn table(points: &[ScalingPoint]) -> String {
    let mut table = Table::new(
        "",
        &[
            "scene",
            "objects",
            "build s",
            "ns / (N log2 N)",
            "objects a second",
            "size",
            "operations",
        ],
    );
    for p in points {
        let cells = [
            Cell::text(p.scene),
            Cell::number(thousands(p.objects)),
            Cell::value(Some(p.build_seconds), 3),
            Cell::value(Some(p.nanoseconds_per_n_log_n), 1),
            Cell::number(thousands((p.objects as f64 / p.build_seconds.max(1e-9)) as u64)),
            Cell::number(thousands(p.size)),
            Cell::value(Some(p.operations), 2),
        ];
        table.row("", &cells);
    }
    table.finish()
}
