//! How the gain depends on the termination, a free knob of the reference.

use super::candidate::Candidate;
use super::experiment::Recorded;
use super::model::SensitivityCell;
use super::replay::Replay;
use super::statistics::evenly;
use crate::interrupt;
use anyhow::Context;
use ropewalk::build::{BuildSettings, Termination};
use ropewalk::method::Method;
use std::sync::atomic::AtomicBool;

/// Largest leaves.
const LEAF_SIZES: [u32; 4] = [1, 2, 4, 8];
/// Depth limits; `None` is `1.2 log2 N + 2`.
const DEPTHS: [Option<u32>; 4] = [None, Some(16), Some(20), Some(30)];
/// Rays over which events are counted.
const RAYS: usize = 50_000;

/// Settings for one scene.
pub const SETTINGS: u64 = (LEAF_SIZES.len() * DEPTHS.len()) as u64;

/// Counts the reference, the exact sweep and the combination at every setting; `step` is called
/// after each.
///
/// # Errors
/// The builder's, and the interruption.
pub fn run(
    scene: &str,
    recorded: &Recorded,
    threads: usize,
    cancel: &AtomicBool,
    step: impl Fn(),
) -> anyhow::Result<Vec<SensitivityCell>> {
    let rays = evenly(&recorded.rays.rays, RAYS);
    let operations = |name: &str, termination: Termination| -> anyhow::Result<f64> {
        let mut method = Method::by_name(name).context("the method is missing")?;
        let build = method.build.take().context("the method has no tree")?;
        method.build = Some(BuildSettings { termination, ..build });
        let candidate = Candidate::build(&recorded.geometry, &method, threads, cancel)?;
        let tally = Replay::from_root(&rays).tally(&candidate.accelerator, cancel);
        let counts = tally.ok_or_else(interrupt::interrupted)?.counts;
        let events = counts.intersection_tests + counts.traversal_steps;
        Ok(events as f64 / rays.len().max(1) as f64)
    };
    let mut cells = Vec::new();
    for max_depth in DEPTHS {
        for leaf_size in LEAF_SIZES {
            let termination = Termination::Fixed { leaf_size, max_depth };
            cells.push(SensitivityCell {
                scene: scene.to_owned(),
                leaf_size,
                max_depth: max_depth.map_or("auto".to_owned(), |d| d.to_string()),
                reference: operations(Method::REFERENCE, termination)?,
                exact: operations(Method::EXACT, termination)?,
                combined: operations("combined", termination)?,
            });
            step();
        }
    }
    Ok(cells)
}
