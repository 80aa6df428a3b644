//! Estimated probabilities of ray termination against sampled lines.

use crate::paper::model::Experiment;
use crate::paper::report::html::{Cell, Table, note, paragraph};

/// A row a scene, a pair of columns an estimator.
pub fn estimator(experiment: &Experiment) -> String {
    let Some(first) = experiment.scenes.first() else { return String::new() };
    let methods: Vec<_> = first
        .methods
        .iter()
        .filter(|m| m.name.starts_with("termination") && m.estimator.is_some())
        .map(|m| m.name)
        .collect();
    if methods.is_empty() {
        return String::new();
    }
    let headings: Vec<_> = methods
        .iter()
        .flat_map(|name| [format!("{name}: bias"), "mean error".to_owned()])
        .collect();
    let mut columns = vec!["scene", "truth", "beta"];
    columns.extend(headings.iter().map(String::as_str));
    let mut table = Table::new("", &columns);
    for scene in &experiment.scenes {
        let first = methods.first().and_then(|name| scene.method(name)?.estimator);
        let mut cells = vec![
            Cell::text(&scene.name),
            Cell::value(first.map(|e| e.mean_truth), 3),
            Cell::value(first.and_then(|e| e.beta), 2),
        ];
        for name in &methods {
            let error = scene.method(name).and_then(|m| m.estimator);
            cells.push(Cell::number(
                error.map_or("\u{2013}".to_owned(), |e| format!("{:+.3}", e.bias)),
            ));
            cells.push(Cell::value(error.map(|e| e.mean_absolute), 3));
        }
        table.row("", &cells);
    }
    paragraph(
        "The corrected measure needs the probability that a ray which enters a child ends there. It \
         is estimated while the plane sweeps; here the estimates of the planes that were taken are \
         held against lines sampled through the same cells.",
    ) + &table.finish()
        + &note(
            "Truth is the mean sampled probability and beta the calibrated exponent of the \
             surface-area estimate, both for the first estimator. Bias is estimate minus sampled \
             truth; the mean error is of absolute differences, about 0.01 of it the noise of the \
             sampled truth.",
        )
}
