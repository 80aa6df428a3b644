//! The claim and what was measured.

use crate::paper::model::Experiment;
use crate::paper::report::chart;
use crate::paper::report::html::{Cell, Table, escape, figure, note, paragraph};
use crate::paper::verdict::{Headline, Summary, Verdict, percent};
use ropewalk::method::Method;

/// Title, big numbers, one paragraph, the ratio on each scene.
pub fn headline(experiment: &Experiment) -> String {
    let headline = &experiment.headline;
    let mut html = format!(
        "<h1>Surface-area BSP trees with rope trees: the 1997 experiment</h1>\n\
         <p class=\"sub\">{} of the Standard Procedural Databases at {} size, {}. \
         ropewalk {}, {}.</p>\n",
        match experiment.scenes.len() {
            1 => "One scene".to_owned(),
            n => format!("{n} scenes"),
        },
        experiment.size,
        escape(&experiment.machine.cpu),
        experiment.version,
        experiment.date
    );
    let Some(combined) = &headline.combined else { return html };
    html += "<div class=\"big\">\n";
    let mut big = |ratio: f64, what: &str| {
        html += &format!("<div><b>{}</b><span>{what}</span></div>\n", percent(ratio));
    };
    big(combined.operations.mean, "operations, all ingredients against the reference");
    big(combined.time.mean, "time of a ray");
    big(combined.size.mean, "size of the tree");
    if let Some(best) = &headline.best {
        big(best.operations.mean, "operations, best tree (ended by cost)");
    }
    html += "</div>\n";
    html += &paragraph(&headline.sentence);
    html += &paragraph(
        "An operation is an intersection test or a visit of an inner node, counted alike. The \
         reference is MacDonald and Booth's 1990 tree from nine sampled planes on each axis, walked \
         as Sung and Shirley do. Both sides end at leaves of two or at depth 1.2 log2 N + 2.",
    );
    html += "<div class=\"charts\">\n";
    html += &charts_of_scenes(experiment);
    html += "</div>\n";
    html += &means(headline);
    html
}

/// Operations, time and size, each over the reference's.
fn charts_of_scenes(experiment: &Experiment) -> String {
    type Figure = fn(&Verdict) -> &Option<Summary>;
    let figures: [(&str, Figure); 3] = [
        ("operations", |v| &v.operations),
        ("time of a ray", |v| &v.time),
        ("size of the tree", |v| &v.size),
    ];
    let find = |name: &str| experiment.verdicts.iter().find(|v| v.method == name);
    let chart = |(name, pick): (&str, Figure)| {
        let series: Vec<_> = [Method::EXACT, "combined", Method::DEFAULT]
            .into_iter()
            .filter_map(|method| Some((method, pick(find(method)?).as_ref()?)))
            .collect();
        let caption =
            format!("The {name} over the reference's, scene by scene; below 1 is better.");
        figure(&chart::scene_bars(&series, name), &caption)
    };
    figures.map(chart).concat()
}

fn means(headline: &Headline) -> String {
    let mut table = Table::new(
        "Means of the ratios over the scenes, arithmetic and geometric",
        &["", "operations", "geom.", "all steps", "geom.", "time", "geom.", "size", "geom."],
    );
    for (name, f) in headline.rows() {
        let mut cells = vec![Cell::text(name)];
        for s in [&f.operations, &f.all_steps, &f.time, &f.size] {
            cells.extend([Cell::ratio(Some(s.mean)), Cell::value(Some(s.geometric_mean), 3)]);
        }
        table.row("", &cells);
    }
    table.finish()
        + &note("All steps add rope crossings and steps in rope trees to the operations.")
}
