//! The report as text, for people at a terminal.

use super::model::{Experiment, SceneResult};
use super::statistics::mean;
use super::verdict::{HeadlineFigures, percent};
use crate::output::thousands;
use ropewalk::method::Method;
use std::fmt::Write;

/// A table a scene, the verdicts, the means, the headline.
pub fn text(experiment: &Experiment) -> String {
    let mut out = String::new();
    for scene in &experiment.scenes {
        out += &scene_table(scene);
        out.push('\n');
    }
    out += &verdicts(experiment);
    out += &published(experiment);
    out += &sensitivity(experiment);
    out += &scaling(experiment);
    out += &headline(experiment);
    out
}

/// Writing to a string cannot fail.
macro_rules! line {
    ($out:expr, $($arg:tt)*) => {{ let _ = writeln!($out, $($arg)*); }};
}

fn scene_table(scene: &SceneResult) -> String {
    let mut out = String::new();
    let r = &scene.rays;
    line!(
        out,
        "{}: {} objects, {} rays ({} primary, {} reflected, {} refracted, {} shadow)",
        scene.name,
        thousands(scene.objects),
        thousands(r.total()),
        thousands(r.primary),
        thousands(r.reflection),
        thousands(r.refraction),
        thousands(r.shadow)
    );
    line!(
        out,
        "  {:<24}{:>9}{:>9}{:>8}{:>8}{:>7}{:>7}{:>8}{:>9}{:>9}{:>7}{:>7}{:>7}",
        "method",
        "op./ray",
        "N_IT",
        "N_TS",
        "leaves",
        "cross",
        "rope",
        "us/ray",
        "build s",
        "size",
        "op.",
        "time",
        "size"
    );
    for m in &scene.methods {
        let (p, ratio) = (&m.per_ray, &m.ratio_to_macdonald_booth);
        let show = |r: Option<f64>| r.map_or("-".to_owned(), |r| format!("{r:.2}"));
        line!(
            out,
            "  {:<24}{:>9.2}{:>9.2}{:>8.2}{:>8.2}{:>7.2}{:>7.2}{:>8.3}{:>9.3}{:>9}{:>7}{:>7}{:>7}",
            m.name,
            m.operations,
            p.intersection_tests,
            p.traversal_steps,
            p.leaf_visits,
            p.rope_crossings,
            p.rope_tree_steps,
            m.microseconds_per_ray,
            m.seconds.build,
            m.size,
            show(ratio.operations),
            show(ratio.time),
            show(ratio.size)
        );
    }
    line!(out, "  The last three columns are ratios to {}.", Method::REFERENCE);
    out
}

fn verdicts(experiment: &Experiment) -> String {
    let mut out = String::from("What each ingredient brings, mean over the scenes\n");
    for v in &experiment.verdicts {
        line!(out, "  {} ({}), against {}:", v.method, v.title, v.against);
        line!(out, "      {}", v.sentence);
    }
    out.push('\n');
    out
}

fn published(experiment: &Experiment) -> String {
    let mut out = String::new();
    for scene in &experiment.scenes {
        let (Some(outside), Some(best), Some(ropes)) = (
            &scene.published,
            scene.method(Method::DEFAULT),
            scene.method(Method::BEST_ROPE_TREES),
        ) else {
            continue;
        };
        if out.is_empty() {
            line!(out, "Tests and steps a ray beside the best published octree and grid");
            line!(
                out,
                "  {:<10}{:>8}{:>12}{:>8}{:>8}",
                "scene",
                "best",
                "rope trees",
                "octree",
                "grid"
            );
        }
        line!(
            out,
            "  {:<10}{:>8.1}{:>12.1}{:>8.1}{:>8.1}",
            scene.name,
            best.operations,
            ropes.all_steps,
            outside.octree.operations(),
            outside.grid.operations()
        );
    }
    if !out.is_empty() {
        out += "  Rope trees over the same tree: crossings and rope-tree steps counted too.\n\n";
    }
    out
}

fn sensitivity(experiment: &Experiment) -> String {
    let mut out = String::new();
    let mut settings: Vec<_> =
        experiment.sensitivity.iter().map(|c| (c.max_depth.as_str(), c.leaf_size)).collect();
    let mut seen = Vec::new();
    settings.retain(|s| {
        !seen.contains(s) && {
            seen.push(*s);
            true
        }
    });
    if settings.is_empty() {
        return out;
    }
    line!(out, "Operations over the reference's at the same termination, mean over the scenes");
    line!(out, "  {:>6}{:>6}{:>10}{:>10}", "depth", "leaf", "exact", "combined");
    for (depth, leaf) in settings {
        let here = || {
            experiment
                .sensitivity
                .iter()
                .filter(move |c| c.max_depth == depth && c.leaf_size == leaf)
        };
        let exact = mean(&here().map(|c| c.exact_ratio()).collect::<Vec<_>>());
        let combined = mean(&here().map(|c| c.combined_ratio()).collect::<Vec<_>>());
        line!(out, "  {depth:>6}{leaf:>6}{exact:>10.3}{combined:>10.3}");
    }
    out.push('\n');
    out
}

fn scaling(experiment: &Experiment) -> String {
    let mut out = String::new();
    for p in &experiment.scaling {
        if out.is_empty() {
            line!(out, "Build of growing scenes, exact sweep with perfect splits, one thread");
            line!(
                out,
                "  {:<8}{:>11}{:>10}{:>18}{:>10}",
                "scene",
                "objects",
                "seconds",
                "ns / (N log2 N)",
                "op./ray"
            );
        }
        line!(
            out,
            "  {:<8}{:>11}{:>10.3}{:>18.1}{:>10.2}",
            p.scene,
            thousands(p.objects),
            p.build_seconds,
            p.nanoseconds_per_n_log_n,
            p.operations
        );
    }
    if !out.is_empty() {
        out.push('\n');
    }
    out
}

fn headline(experiment: &Experiment) -> String {
    let h = &experiment.headline;
    let mut out = String::from("Means of the ratios, arithmetic (geometric)\n");
    for (name, figures) in h.rows() {
        let HeadlineFigures { operations, all_steps, time, size } = figures;
        let show = |s: &super::verdict::Summary| {
            format!("{} ({})", percent(s.mean), percent(s.geometric_mean))
        };
        line!(
            out,
            "  {name:<32} operations {}, all steps {}, time {}, size {}",
            show(operations),
            show(all_steps),
            show(time),
            show(size)
        );
    }
    line!(out, "\n{}", h.sentence);
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::sample;

    #[test]
    fn every_method_and_scene_is_in_the_text() {
        let text = text(&sample::experiment(3));
        for method in Method::all() {
            assert!(text.contains(method.name), "{}", method.name);
        }
        for scene in ["balls:", "gears:", "lattice:"] {
            assert!(text.contains(scene));
        }
        assert!(text.contains("combined / reference") && text.contains("octree"));
        assert!(!text.contains("NaN"));
    }

    #[test]
    fn rows_line_up() {
        let text = scene_table(&sample::scenes(1)[0]);
        let lengths: Vec<_> = text.lines().skip(1).map(|l| l.chars().count()).collect();
        let (_, rows) = lengths.split_last().unwrap();
        assert!(rows.windows(2).all(|w| w[0] == w[1]), "{text}");
    }
}
