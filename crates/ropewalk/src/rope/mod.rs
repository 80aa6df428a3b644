//! Ropes (neighbour links) and rope trees over the leaves of a tree.
//!
//! Both let a walk go from leaf to leaf without a stack. They differ in what a face with several
//! neighbours holds: a link to a tree node above them all ([`Ropes`]), or a two-dimensional BSP
//! over just them ([`RopeTrees`]).

mod cells;
mod link;
mod rope_trees;
mod ropes;
mod thread;
mod validate;

pub use rope_trees::RopeTrees;
pub use ropes::Ropes;

pub(crate) use cells::{Cell, Cells};
pub(crate) use link::{Link, Target};

/// What is wrong with links, or with the tree that they are wanted for.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RopeError {
    /// Links cannot address so large a tree.
    #[error("the tree has {nodes} nodes; links reach {max}")]
    TooManyNodes {
        /// Nodes of the tree.
        nodes: usize,
        /// The limit.
        max: usize,
    },
    /// A check failed.
    #[error("leaf {leaf}, face {face}: {what}")]
    Invalid {
        /// Number of the leaf in depth-first order.
        leaf: usize,
        /// `2 * axis`, plus 1 for the upper face.
        face: usize,
        /// What is wrong.
        what: &'static str,
    },
}

impl RopeError {
    fn invalid(leaf: usize, face: usize, what: &'static str) -> Self {
        RopeError::Invalid { leaf, face, what }
    }
}

/// An inner node of a rope tree; its axis stands in the links that lead to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RopeNode {
    pub split: f32,
    pub below: Link,
    pub above: Link,
}

/// Links of all leaves and the rope-tree nodes behind them: what a rope walk follows, whichever
/// kind it is.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Threads {
    pub cells: Cells,
    pub nodes: Vec<RopeNode>,
}

impl Threads {
    fn bytes(&self) -> usize {
        self.cells.bytes() + size_of_val(&self.nodes[..])
    }

    fn bytes_per_leaf(&self) -> f64 {
        self.bytes() as f64 / self.cells.cells.len().max(1) as f64
    }
}
