//! The free knobs of the reference: leaf size and depth.

use crate::paper::model::{Experiment, SensitivityCell};
use crate::paper::report::html::{Cell, Table, escape, note, paragraph};
use crate::paper::statistics::mean;

/// Heat tables of the mean over the scenes, and one a scene.
pub fn sensitivity(experiment: &Experiment) -> String {
    let cells = &experiment.sensitivity;
    if cells.is_empty() {
        return String::new();
    }
    let all: Vec<_> = cells.iter().collect();
    let mut html = paragraph(
        "How a tree ends is a free choice, and the gain depends on it. Each cell is the ratio to the \
         reference ended in the same way; the headline stands at leaves of 2 and depth auto, which is \
         1.2 log2 N + 2.",
    );
    html += &heat("Combined / reference, operations", &all, SensitivityCell::combined_ratio);
    html += &heat("Exact sweep / reference, operations", &all, SensitivityCell::exact_ratio);
    html += &best_settings(experiment);
    for scene in &experiment.scenes {
        let own: Vec<_> = cells.iter().filter(|c| c.scene == scene.name).collect();
        if own.is_empty() || experiment.scenes.len() == 1 {
            continue;
        }
        html += &format!(
            "<details>\n<summary>{}</summary>\n{}</details>\n",
            escape(&scene.name),
            heat("Combined / reference, operations", &own, SensitivityCell::combined_ratio)
        );
    }
    html
}

/// Rows are depths, columns leaf sizes, each cell the mean ratio.
fn heat(caption: &str, cells: &[&SensitivityCell], ratio: fn(&SensitivityCell) -> f64) -> String {
    let sizes = distinct(cells.iter().map(|c| c.leaf_size));
    let depths = distinct(cells.iter().map(|c| c.max_depth.as_str()));
    let mut headings = vec!["depth".to_owned()];
    headings.extend(sizes.iter().map(|s| format!("leaf \u{2264} {s}")));
    let headings: Vec<_> = headings.iter().map(String::as_str).collect();
    let mut table = Table::new(caption, &headings);
    for depth in depths {
        let mut row = vec![Cell::text(depth)];
        for size in &sizes {
            let here = cells.iter().filter(|c| c.leaf_size == *size && c.max_depth == depth);
            let value = mean(&here.map(|c| ratio(c)).collect::<Vec<_>>());
            row.push(Cell::number(format!("{value:.3}")).heat(value));
        }
        table.row("", &row);
    }
    table.finish()
}

/// Each method at the setting that suits it best.
fn best_settings(experiment: &Experiment) -> String {
    let mut table = Table::new(
        "Operations a ray at each side's own best setting (leaf size, depth)",
        &["scene", "reference", "setting", "combined", "setting", "ratio"],
    );
    for scene in &experiment.scenes {
        let own = || experiment.sensitivity.iter().filter(|c| c.scene == scene.name);
        let least = |figure: fn(&SensitivityCell) -> f64| {
            own().min_by(|a, b| figure(a).total_cmp(&figure(b)))
        };
        let (Some(r), Some(c)) = (least(|c| c.reference), least(|c| c.combined)) else { continue };
        let setting =
            |c: &SensitivityCell| Cell::number(format!("{}, {}", c.leaf_size, c.max_depth));
        let cells = [
            Cell::text(&scene.name),
            Cell::value(Some(r.reference), 2),
            setting(r),
            Cell::value(Some(c.combined), 2),
            setting(c),
            Cell::ratio(Some(c.combined / r.reference)),
        ];
        table.row("", &cells);
    }
    table.finish()
        + &note("The fairest comparison: nobody is held to a setting that suits the other side.")
}

fn distinct<T: PartialEq>(values: impl Iterator<Item = T>) -> Vec<T> {
    let mut seen = Vec::new();
    for value in values {
        if !seen.contains(&value) {
            seen.push(value);
        }
    }
    seen
}
