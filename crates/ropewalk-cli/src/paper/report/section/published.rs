//! The best tree beside structures that others measured on the same scenes.

use crate::paper::model::Experiment;
use crate::paper::published::SOURCE;
use crate::paper::report::html::{Cell, Table, note, paragraph};
use ropewalk::method::Method;

/// The table of N_IT + N_TS.
pub fn published(experiment: &Experiment) -> String {
    let mut table = Table::new(
        "N_IT + N_TS a ray (tests / steps)",
        &["scene", "best tree", "octree", "grid", "/ octree", "/ grid", "fewest"],
    );
    let (mut rows, mut over_octree, mut over_grid) = (0, 0, 0);
    for scene in &experiment.scenes {
        let (Some(outside), Some(best)) = (&scene.published, scene.method(Method::DEFAULT)) else {
            continue;
        };
        let show = |tests: f64, steps: f64| {
            Cell::number(format!("{:.1} ({tests:.1} / {steps:.1})", tests + steps))
        };
        let (octree, grid) = (outside.octree, outside.grid);
        let to_octree = best.operations / octree.operations();
        let to_grid = best.operations / grid.operations();
        rows += 1;
        over_octree += usize::from(to_octree < 1.0);
        over_grid += usize::from(to_grid < 1.0);
        let cells = [
            Cell::text(&scene.name),
            show(best.per_ray.intersection_tests, best.per_ray.traversal_steps),
            show(octree.intersection_tests, octree.traversal_steps),
            show(grid.intersection_tests, grid.traversal_steps),
            Cell::ratio(Some(to_octree)),
            Cell::ratio(Some(to_grid)),
            Cell::number(outside.winner(best.operations)),
        ];
        table.row("", &cells);
    }
    if rows == 0 {
        return String::new();
    }
    paragraph(&format!(
        "The best tree needs fewer operations than the best published octree on {over_octree} of \
         {rows} scenes and fewer than the best published grid on {over_grid} of {rows}."
    )) + &table.finish()
        + &note(&format!(
            "{SOURCE}. A step of an octree or a grid is another operation than that of a BSP tree: \
             the sum compares counts, not times."
        ))
}
