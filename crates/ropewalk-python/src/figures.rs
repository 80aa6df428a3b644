//! Figures of a build that Python shows, of a scene just built or of one that was saved.

use ropewalk::build::BuildReport;
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
    /// Seconds of the build; 0 for a scene that was opened.
    pub seconds: f64,
}

impl From<&BuildReport> for Build {
    fn from(report: &BuildReport) -> Build {
        let BuildReport { primitives, degenerate, duplication, tree, seconds, .. } = report.clone();
        Build { primitives, degenerate, duplication, tree, seconds }
    }
}
