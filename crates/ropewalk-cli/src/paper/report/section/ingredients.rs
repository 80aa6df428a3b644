//! A card a method: the verdict and its strips.

use crate::paper::model::Experiment;
use crate::paper::report::chart::{self, StripAxis};
use crate::paper::report::html::{escape, note, paragraph};
use crate::paper::verdict::Verdict;

/// All verdicts, grouped by what they are held against.
pub fn ingredients(experiment: &Experiment) -> String {
    let mut html = paragraph(
        "Each ingredient is added alone to the exact sweep and held against it. A dot is a scene, \
         the bar is the mean over the scenes, and left of 1 is better. Means within 2 % count as no \
         change. The axis is logarithmic; what lies outside it sits on its edge.",
    );
    let groups: [(&str, &[&str]); 3] = [
        ("All together", &["combined"]),
        ("One by one", &["exact", "ingredient"]),
        ("What came before", &["baseline"]),
    ];
    for (title, roles) in groups {
        let verdicts: Vec<_> = experiment
            .verdicts
            .iter()
            .filter(|v| roles.contains(&v.role) && v.all_steps.is_none())
            .collect();
        let cards = cards(&verdicts);
        if !verdicts.is_empty() {
            html += &format!("<h3>{title}</h3>\n{cards}");
        }
    }
    html + &note("Ropes and rope trees follow in a section of their own.")
}

/// Cards side by side, all on one axis.
pub fn cards(verdicts: &[&Verdict]) -> String {
    let summaries = verdicts.iter().flat_map(|v| v.figures()).map(|(_, summary)| summary);
    let axis = StripAxis::for_ratios(summaries);
    let cards: String = verdicts.iter().map(|v| card(v, axis)).collect();
    format!("<div class=\"cards\">\n{cards}</div>\n")
}

fn card(verdict: &Verdict, axis: &StripAxis) -> String {
    let figures: Vec<_> = verdict.figures().collect();
    let label = format!("{} over {}, a dot a scene", verdict.method, verdict.against);
    format!(
        "<article class=\"card\">\n<h3>{}</h3>\n<p class=\"sub\"><code>{}</code> against \
         <code>{}</code></p>\n<p>{}</p>\n{}</article>\n",
        escape(verdict.title),
        verdict.method,
        verdict.against,
        escape(&verdict.sentence),
        chart::strips(&figures, axis, &label)
    )
}
