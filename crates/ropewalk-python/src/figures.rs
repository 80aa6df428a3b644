//! Figures of a build that Python shows, of a scene just built or of one that was saved.

use ropewalk::build::{BuildReport, CostChoice};
use ropewalk::tree::TreeStats;

/// What is left of a build's report once it has been saved.
pub struct Build {
    /// Primitives, degenerate ones included.
    pub primitives: usize,
    /// Primitives without area.
    pub degenerate: usize,
    /// References per primitive.
    pub duplication: f64,
    /// Figures of the binary tree.
    pub tree: TreeStats,
    /// The cost model; not known of a scene that was opened.
    pub cost_model: Option<CostChoice>,
    /// Sample rays that the build was given.
    pub sample_rays: usize,
    /// Seconds of the build; 0 for a scene that was opened.
    pub seconds: f64,
}

impl From<&BuildReport> for Build {
    fn from(report: &BuildReport) -> Build {
        Build {
            primitives: report.primitives,
            degenerate: report.degenerate,
            duplication: report.duplication,
            tree: report.tree.clone(),
            cost_model: CostChoice::of(&report.settings),
            sample_rays: report.settings.rays.len(),
            seconds: report.seconds,
        }
    }
}
