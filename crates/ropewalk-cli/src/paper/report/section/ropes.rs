//! Ropes and rope trees trade one kind of step for another, so they have columns of their own.

use super::ingredients::cards;
use crate::paper::model::{Experiment, MethodResult, all_steps};
use crate::paper::report::html::{Cell, Table, paragraph};
use crate::paper::statistics::mean;

/// Cards and a table of steps by kind.
pub fn ropes(experiment: &Experiment) -> String {
    let roped: Vec<_> = experiment.verdicts.iter().filter(|v| v.all_steps.is_some()).collect();
    if roped.is_empty() {
        return String::new();
    }
    let mut html = paragraph(
        "A link replaces a descent from the root. Operations count tests and inner nodes of the BSP \
         as everywhere else; all steps add the faces crossed and the inner nodes of rope trees. Eye \
         rays start at the root; rays that leave a surface start in its leaf, which the renderer \
         knows from the hit before. The column from root counts all steps where it does not.",
    );
    html += &cards(&roped);
    html + &table(experiment)
}

fn table(experiment: &Experiment) -> String {
    let mut table = Table::new(
        "Means over the scenes, a ray",
        &[
            "method",
            "tests",
            "BSP steps",
            "crossings",
            "rope-tree steps",
            "all steps",
            "from root",
            "restarts",
            "\u{b5}s",
            "bytes a leaf",
        ],
    );
    let Some(first) = experiment.scenes.first() else { return String::new() };
    let roped = || experiment.verdicts.iter().filter(|v| v.all_steps.is_some());
    let shown = |name: &str| roped().any(|v| v.method == name || v.against == name);
    for name in first.methods.iter().map(|m| m.name).filter(|name| shown(name)) {
        let found: Vec<_> = experiment.scenes.iter().filter_map(|s| s.method(name)).collect();
        let over = |pick: fn(&MethodResult) -> f64| {
            Some(mean(&found.iter().map(|m| pick(m)).collect::<Vec<_>>()))
        };
        let cells = [
            Cell::text(name),
            Cell::value(over(|m| m.per_ray.intersection_tests), 2),
            Cell::value(over(|m| m.per_ray.traversal_steps), 2),
            Cell::value(over(|m| m.per_ray.rope_crossings), 2),
            Cell::value(over(|m| m.per_ray.rope_tree_steps), 2),
            Cell::value(over(|m| m.all_steps), 2).strong(),
            Cell::value(over(|m| m.from_root.map_or(m.all_steps, |p| all_steps(&p))), 2),
            Cell::value(over(|m| m.per_ray.restarts), 4),
            Cell::value(over(|m| m.microseconds_per_ray), 3),
            Cell::value(over(|m| m.bytes_per_leaf.unwrap_or(0.0)), 1),
        ];
        table.row("", &cells);
    }
    table.finish()
}
