//! Ropes: one link per face of a leaf (MacDonald and Booth 1990, section 7).

use crate::rope::cells::Cells;
use crate::rope::link::{Link, Target};
use crate::rope::thread::{Neighbour, for_each_leaf};
use crate::rope::validate::check;
use crate::rope::{RopeError, Threads};
use crate::tree::{BspTree, NodeKind};

/// One link per face of every leaf: to the neighbouring leaf where one leaf covers the face, else
/// to the smallest inner node that covers all of the face's neighbours, else outside.
#[derive(Clone, Debug, PartialEq)]
pub struct Ropes {
    threads: Threads,
}

impl Ropes {
    /// Threads the leaves of `tree`.
    ///
    /// # Errors
    /// [`RopeError::TooManyNodes`] beyond 2^29 nodes.
    pub fn build(tree: &BspTree) -> Result<Ropes, RopeError> {
        let mut cells = checked_cells(tree)?;
        let mut number = 0;
        for_each_leaf(tree, |_, _, ropes| {
            let links = ropes.map(|rope| single_link(tree, &cells, rope));
            cells.cells[number].links = links;
            number += 1;
        });
        Ok(Ropes { threads: Threads { cells, nodes: Vec::new() } })
    }

    /// Checks every link against a fresh search of the tree.
    ///
    /// # Errors
    /// [`RopeError::Invalid`] names the first leaf and face at fault.
    pub fn validate(&self, tree: &BspTree) -> Result<(), RopeError> {
        let split = |link: &Link| matches!(link.target(), Target::Split { .. });
        let cells = &self.threads.cells.cells;
        if let Some(leaf) = cells.iter().position(|cell| cell.links.iter().any(split)) {
            return Err(RopeError::invalid(leaf, 0, "a rope leads to a rope tree"));
        }
        check(&self.threads, tree)
    }

    /// Bytes of all links, boxes of leaves and tables.
    pub fn bytes(&self) -> usize {
        self.threads.bytes()
    }

    /// [`Ropes::bytes`] over the number of leaves.
    pub fn bytes_per_leaf(&self) -> f64 {
        self.threads.bytes_per_leaf()
    }

    /// Number of leaves.
    pub fn leaf_count(&self) -> usize {
        self.threads.cells.cells.len()
    }

    pub(crate) fn threads(&self) -> &Threads {
        &self.threads
    }
}

/// The numbered leaves of a tree that links can address.
pub(super) fn checked_cells(tree: &BspTree) -> Result<Cells, RopeError> {
    match tree.nodes().len() {
        nodes if nodes > Link::MAX => Err(RopeError::TooManyNodes { nodes, max: Link::MAX }),
        _ => Ok(Cells::new(tree)),
    }
}

/// The link to a neighbour: by number if it is a leaf.
pub(super) fn single_link(tree: &BspTree, cells: &Cells, neighbour: Neighbour) -> Link {
    match neighbour {
        None => Link::OUTSIDE,
        Some(node) => match tree.kind(node) {
            NodeKind::Leaf { .. } => Link::leaf(cells.number[node as usize]),
            NodeKind::Inner { .. } => Link::node(node),
        },
    }
}
