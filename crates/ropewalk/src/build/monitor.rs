//! Watching and cancelling a build.

/// Watches a build from outside. Both methods are called from worker threads, a few hundred times
/// in all for `progress` and once per larger node for `is_cancelled`; both must be quick.
pub trait Monitor: Sync {
    /// Called with the share of the work that is done, 0 to 1. Calls from several threads may
    /// arrive out of order.
    fn progress(&self, _fraction: f64) {}

    /// True once the build should stop with [`BuildError::Cancelled`](super::BuildError).
    fn is_cancelled(&self) -> bool {
        false
    }
}

/// Watches nothing.
impl Monitor for () {}
