//! Every figure of every method, a table a scene.

use crate::output::thousands;
use crate::paper::model::{Experiment, SceneResult};
use crate::paper::report::html::{Cell, Table, escape, note, paragraph};

/// One folded table a scene, the first open.
pub fn scenes(experiment: &Experiment) -> String {
    let mut html = paragraph(
        "Counted events are means over all rays of the rendering, times are medians in one thread. \
         The size of a tree is its inner nodes plus the references in its leaves.",
    );
    for (i, scene) in experiment.scenes.iter().enumerate() {
        let open = if i == 0 { " open" } else { "" };
        html += &format!(
            "<details{open}>\n<summary>{}, {} objects, {} rays</summary>\n{}{}</details>\n",
            escape(&scene.name),
            thousands(scene.objects),
            thousands(scene.rays.total()),
            rays(scene),
            table(scene)
        );
    }
    html
}

fn rays(scene: &SceneResult) -> String {
    let r = &scene.rays;
    let n = thousands;
    note(&format!(
        "{} primary rays ({} hit), {} reflected and {} refracted ({} hit), {} shadow rays ({} \
         blocked); counted over {}, timed over {}.",
        n(r.primary),
        n(r.primary_hits),
        n(r.reflection),
        n(r.refraction),
        n(r.secondary_hits),
        n(r.shadow),
        n(r.shadow_hits),
        n(scene.counted_rays),
        n(scene.timed_rays)
    ))
}

fn table(scene: &SceneResult) -> String {
    let mut table = Table::new(
        "",
        &[
            "method",
            "operations",
            "tests",
            "steps",
            "leaves",
            "empty",
            "\u{b5}s a ray",
            "build s",
            "size",
            "depth",
            "op. / ref.",
            "time / ref.",
            "size / ref.",
            "op. / exact",
            "time / exact",
        ],
    );
    for m in &scene.methods {
        let (p, to_reference, to_exact) =
            (&m.per_ray, &m.ratio_to_macdonald_booth, &m.ratio_to_exact);
        let cells = [
            Cell::text(m.name),
            Cell::value(Some(m.operations), 2),
            Cell::value(Some(p.intersection_tests), 2),
            Cell::value(Some(p.traversal_steps), 2),
            Cell::value(Some(p.leaf_visits), 2),
            Cell::value(Some(p.empty_leaf_visits), 2),
            Cell::value(Some(m.microseconds_per_ray), 3),
            Cell::value(Some(m.seconds.build), 3),
            Cell::number(thousands(m.size)),
            Cell::number(m.tree.depth.to_string()),
            Cell::ratio(to_reference.operations),
            Cell::ratio(to_reference.time),
            Cell::ratio(to_reference.size),
            Cell::ratio(to_exact.operations),
            Cell::ratio(to_exact.time),
        ];
        table.row(m.role, &cells);
    }
    table.finish()
}
