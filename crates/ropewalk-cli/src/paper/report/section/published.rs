//! The best tree beside structures that others measured on the same scenes.

use crate::paper::model::Experiment;
use crate::paper::published::SOURCE;
use crate::paper::report::html::{Cell, Table, note, paragraph};
use ropewalk::method::Method;

/// The table of N_IT + N_TS.
pub fn published(experiment: &Experiment) -> String {
    let mut table = Table::new(
        "N_IT + N_TS a ray (tests / steps); with rope trees all steps",
        &["scene", "best tree", "its rope trees", "octree", "grid", "fewest"],
    );
    let (mut rows, mut tree_wins, mut rope_wins) = (0, [0, 0], [0, 0]);
    for scene in &experiment.scenes {
        let (Some(outside), Some(best), Some(ropes)) = (
            &scene.published,
            scene.method(Method::DEFAULT),
            scene.method(Method::BEST_ROPE_TREES),
        ) else {
            continue;
        };
        let show = |tests: f64, steps: f64| {
            Cell::number(format!("{:.1} ({tests:.1} / {steps:.1})", tests + steps))
        };
        let (octree, grid) = (outside.octree, outside.grid);
        rows += 1;
        for (i, other) in [octree.operations(), grid.operations()].into_iter().enumerate() {
            tree_wins[i] += usize::from(best.operations < other);
            rope_wins[i] += usize::from(ropes.all_steps < other);
        }
        let tests = ropes.per_ray.intersection_tests;
        let cells = [
            Cell::text(&scene.name),
            show(best.per_ray.intersection_tests, best.per_ray.traversal_steps),
            show(tests, ropes.all_steps - tests),
            show(octree.intersection_tests, octree.traversal_steps),
            show(grid.intersection_tests, grid.traversal_steps),
            Cell::number(outside.winner(best.operations, ropes.all_steps)),
        ];
        table.row("", &cells);
    }
    if rows == 0 {
        return String::new();
    }
    paragraph(&format!(
        "The best tree, walked from the root, needs fewer operations than the best published \
         octree on {} of {rows} scenes and fewer than the best published grid on {} of {rows}. \
         Walked along its rope trees, with every crossing and every rope-tree step counted, it \
         needs fewer than the octree on {} and fewer than the grid on {}.",
        tree_wins[0], tree_wins[1], rope_wins[0], rope_wins[1]
    )) + &table.finish()
        + &note(&format!(
            "{SOURCE}. A step of an octree or a grid is another operation than that of a BSP tree: \
             the sum compares counts, not times."
        ))
}
