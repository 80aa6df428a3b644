//! How to judge and repeat the numbers.

use crate::paper::model::Experiment;
use crate::paper::report::html::{escape, paragraph};
use crate::paper::statistics::median;

/// Machine, date, command, protocol.
pub fn protocol(experiment: &Experiment) -> String {
    let p = &experiment.protocol;
    let machine = &experiment.machine;
    let methods = || experiment.scenes.iter().flat_map(|s| &s.methods);
    let spreads: Vec<_> = methods().map(|m| m.trace_spread).collect();
    let slow = methods().filter(|m| m.timed_builds == 1 && m.size > 0).count();
    let mut html = paragraph(&format!(
        "Rays are those of a rendering by the rules of the databases: 513 x 513 eye rays through the \
         corners of the pixels, depth 5, one shadow ray a light. Every method answers the same rays; \
         before anything is timed all answers are compared, first hits bit for bit as (t, primitive) \
         (one by one on the timed rays, by a digest on all). Events are counted over all recorded rays in {} threads, without mailboxes.",
        p.counting_threads
    ));
    html += &paragraph(&format!(
        "Times are of one thread over at most {} rays spread evenly over the rendering. Methods are \
         interleaved: in each of {} rounds every method builds and traces once, and medians are \
         reported. The rounds of one method lie {:.1} % of their median apart on the median, so a \
         difference in time below that is not one.",
        crate::output::thousands(p.timed_rays as u64),
        p.rounds,
        100.0 * median(&spreads)
    ));
    html += &paragraph(&format!(
        "{slow} trees took more than {} seconds and were built once. Methods of more than about a \
         hundred operations a ray are timed and counted on an even subsample of the rays; the naive search tests every object for every ray by definition.",
        p.slow_build_seconds
    ));
    html += &format!(
        "<p>{}, {} cores, {}. ropewalk {}, {}. To repeat it: <code>{}</code></p>\n",
        escape(&machine.cpu),
        machine.cores,
        machine.os,
        experiment.version,
        experiment.date,
        escape(&experiment.command)
    );
    html
}
