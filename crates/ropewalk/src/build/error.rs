//! Why a build failed.

/// Why no tree was built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BuildError {
    /// A setting is out of range.
    #[error("build setting `{field}` is {found}; expected {expected}")]
    Setting {
        /// The field of [`BuildSettings`](super::BuildSettings).
        field: &'static str,
        /// Its value.
        found: String,
        /// The valid range.
        expected: &'static str,
    },
    /// The monitor asked to stop.
    #[error("the build was cancelled")]
    Cancelled,
    /// More nodes or references than 30-bit indices can address.
    #[error(
        "the tree needs more than {max} {what}; lower max_duplication or the depth, or raise the leaf size"
    )]
    TooLarge {
        /// Nodes or references.
        what: &'static str,
        /// The limit.
        max: u32,
    },
    /// More memory than [`BuildSettings::memory_limit`](super::BuildSettings::memory_limit) allows.
    #[error("the build needs {needed} bytes beyond its geometry; memory_limit allows {limit}")]
    Memory {
        /// Bytes needed: an estimate before the build, the exact number at its end.
        needed: u64,
        /// The limit.
        limit: u64,
    },
    /// The binary tree cannot be compiled to a wide tree.
    #[error(transparent)]
    Compile(#[from] crate::wide::CompileError),
    /// The thread pool could not be started.
    #[error("cannot start {threads} build threads: {reason}")]
    Threads {
        /// Number asked for.
        threads: usize,
        /// What the pool said.
        reason: String,
    },
}
