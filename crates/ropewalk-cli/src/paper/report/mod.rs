//! The report: one self-contained HTML file, drawings inline, no scripts, light and dark.

mod chart;
mod html;
mod scale;
mod section;
mod svg;

use super::model::Experiment;
use html::escape;

const STYLE: &str = include_str!("style.css");

/// The whole page.
pub fn page(experiment: &Experiment) -> String {
    let sections = [
        ("ingredients", "What each ingredient brings", section::ingredients(experiment)),
        ("ropes", "Ropes and rope trees", section::ropes(experiment)),
        ("scenes", "Scene by scene", section::scenes(experiment)),
        ("published", "Beside published octrees and grids", section::published(experiment)),
        ("predicted", "Predicted and measured", section::predicted(experiment)),
        ("estimator", "How well ray termination is estimated", section::estimator(experiment)),
        ("sensitivity", "Leaf size and depth", section::sensitivity(experiment)),
        ("scaling", "How the build grows", section::scaling(experiment)),
        ("protocol", "How it was measured", section::protocol(experiment)),
    ];
    let shown = || sections.iter().filter(|(_, _, body)| !body.is_empty());
    let links: String = shown()
        .map(|(id, title, _)| format!("<a href=\"#{id}\">{}</a>\n", escape(title)))
        .collect();
    let body: String = shown().map(|(id, title, body)| html::section(id, title, body)).collect();
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n\
         <title>The experiment of the 1997 paper</title>\n<style>\n{STYLE}</style>\n</head>\n\
         <body>\n{}<nav>\n{links}</nav>\n{body}</body>\n</html>\n",
        section::headline(experiment)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::sample;

    #[test]
    fn the_page_is_balanced_and_self_contained() {
        for count in [1, 8] {
            let page = page(&sample::experiment(count));
            html::check_balance(&page).unwrap();
            for outside in ["http:", "https:", "<script", "<link", "<img", "@import", "url("] {
                assert!(!page.contains(outside), "{outside}");
            }
            for bad in ["NaN", "inf%", "&lt;fast&gt; processor\">"] {
                assert!(!page.contains(bad), "{bad}");
            }
            assert!(page.contains("A &lt;fast&gt; processor"));
        }
    }

    #[test]
    fn links_lead_to_sections_that_are_there() {
        let mut experiment = sample::experiment(2);
        experiment.scaling.clear();
        experiment.sensitivity.clear();
        let page = page(&experiment);
        for part in page.split("href=\"#").skip(1) {
            let id = part.split('"').next().unwrap();
            assert_eq!(page.matches(&format!("id=\"{id}\"")).count(), 1, "{id}");
        }
        assert!(!page.contains("#scaling") && !page.contains("#sensitivity"));
        assert!(page.contains("#ropes"));
    }
}
