//! A method made ready for the rays of a scene.

use crate::interrupt;
use ropewalk::build::{self, BuildError, BuildReport, BuildSettings, Termination};
use ropewalk::method::Method;
use ropewalk::{Accelerator, Geometry};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// A tree with its walk, and what it took.
pub struct Candidate {
    /// Answers rays.
    pub accelerator: Accelerator,
    /// What the builder said; `None` for the naive search.
    pub report: Option<BuildReport>,
    /// Seconds for the tree and its ropes; the builder's own quality figures are not part of it.
    pub seconds: f64,
}

impl Candidate {
    /// Builds the tree, and the ropes if the method walks them.
    ///
    /// # Errors
    /// The builder's, and the interruption once `cancel` is set.
    pub fn build(
        geometry: &Arc<Geometry>,
        method: &Method,
        threads: usize,
        cancel: &AtomicBool,
    ) -> anyhow::Result<Self> {
        // An accelerator always holds a tree: a single leaf where none is walked.
        let one_leaf = BuildSettings {
            termination: Termination::Fixed { leaf_size: u32::MAX, max_depth: None },
            late_cutting: false,
            ..BuildSettings::default()
        };
        let settings = method.build.as_ref().unwrap_or(&one_leaf);
        let settings = BuildSettings { threads, ..settings.clone() };
        let (tree, report) = match build::build(geometry, &settings, &Cancel(cancel)) {
            Err(BuildError::Cancelled) => return Err(interrupt::interrupted()),
            other => other?,
        };
        let start = Instant::now();
        let accelerator = Accelerator::new(Arc::clone(geometry), Arc::new(tree), method.walk)?;
        let link_seconds = start.elapsed().as_secs_f64();
        if method.build.is_none() {
            return Ok(Candidate { accelerator, report: None, seconds: 0.0 });
        }
        let seconds = report.seconds + link_seconds;
        Ok(Candidate { accelerator, report: Some(report), seconds })
    }
}

/// Passes Ctrl-C on to the builder.
struct Cancel<'a>(&'a AtomicBool);

impl build::Monitor for Cancel<'_> {
    fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
