//! The surface-area expectation beside the count.

use crate::paper::model::{Experiment, MethodResult, Predicted};
use crate::paper::published::MACDONALD_BOOTH_MEASURED;
use crate::paper::report::chart::{Frame, Point, Series, log_log};
use crate::paper::report::html::{figure, paragraph};
use crate::paper::statistics::median;

struct Figure {
    name: &'static str,
    predicted: fn(&Predicted) -> f64,
    measured: fn(&MethodResult) -> f64,
    macdonald_booth: f64,
}

const FIGURES: [Figure; 3] = [
    Figure {
        name: "inner nodes visited",
        predicted: |p| p.traversal_steps,
        measured: |m| m.per_ray.traversal_steps,
        macdonald_booth: MACDONALD_BOOTH_MEASURED[0],
    },
    Figure {
        name: "leaves visited",
        predicted: |p| p.leaf_visits,
        measured: |m| m.per_ray.leaf_visits,
        macdonald_booth: MACDONALD_BOOTH_MEASURED[1],
    },
    Figure {
        name: "intersection tests",
        predicted: |p| p.intersection_tests,
        measured: |m| m.per_ray.intersection_tests,
        macdonald_booth: MACDONALD_BOOTH_MEASURED[2],
    },
];

/// Three scatter charts.
pub fn predicted(experiment: &Experiment) -> String {
    let charts: String = FIGURES.iter().map(|f| chart(experiment, f)).collect();
    if charts.is_empty() {
        return charts;
    }
    paragraph(
        "The surface-area heuristic predicts what a line costs that hits the scene's box and ends \
         nowhere. Real rays end at surfaces, start inside and are not uniform: they gather where the \
         objects are, above all over a wide ground. A point below the diagonal is a tree that is \
         cheaper than predicted. MacDonald and Booth measured 0.75 of the \
         predicted inner nodes, 0.83 of the leaves and 1.03 of the tests over random scenes and rays.",
    ) + &format!("<div class=\"charts\">\n{charts}</div>\n")
}

fn chart(experiment: &Experiment, f: &Figure) -> String {
    let mut series = [
        Series { name: "reference", points: Vec::new(), joined: false },
        Series { name: "combined", points: Vec::new(), joined: false },
        Series { name: "all other trees", points: Vec::new(), joined: false },
    ];
    let mut ratios = Vec::new();
    for scene in &experiment.scenes {
        for m in scene.methods.iter().filter(|m| !m.roped) {
            let Some(p) = &m.predicted else { continue };
            let (x, y) = ((f.predicted)(p), (f.measured)(m));
            if x <= 0.0 || y <= 0.0 {
                continue;
            }
            let place = match m.role {
                "reference" => 0,
                "combined" => 1,
                _ => 2,
            };
            let tip = format!("{}, {}: predicted {x:.2}, measured {y:.2}", scene.name, m.name);
            series[place].points.push(Point { x, y, tip });
            ratios.push(y / x);
        }
    }
    if ratios.is_empty() {
        return String::new();
    }
    let frame = Frame {
        label: &format!("Predicted against measured {}", f.name),
        x_title: &format!("predicted {}", f.name),
        y_title: &format!("measured {}", f.name),
        square: true,
        guides: Vec::new(),
    };
    let caption = format!(
        "Measured over predicted {}: {:.2} on the median of all trees; MacDonald and Booth: {:.2}.",
        f.name,
        median(&ratios),
        f.macdonald_booth
    );
    figure(&log_log(&frame, &series), &caption)
}
