//! The leaves of a tree with their boxes, numbered.

use crate::aabb::Aabb;
use crate::rope::link::Link;
use crate::tree::{BspTree, NodeKind};

/// A leaf as a rope walk sees it: all that a visit needs, in one cache line.
#[repr(align(64))]
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cell {
    /// The leaf's box.
    pub bounds: Aabb,
    /// The leaf among the tree's nodes.
    pub node: u32,
    /// First reference of the leaf.
    pub first: u32,
    /// Number of references.
    pub count: u32,
    /// What lies behind each face; face `2 * axis` is the lower, `2 * axis + 1` the upper one.
    pub links: [Link; 6],
}

const _: () = assert!(size_of::<Cell>() == 64);

/// All leaves in depth-first order, and the way back from nodes to leaves.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Cells {
    pub cells: Vec<Cell>,
    /// Number of the leaf by index of the node; `NONE` at inner nodes.
    pub number: Vec<u32>,
}

impl Cells {
    pub const NONE: u32 = u32::MAX;

    /// The leaves of `tree`, all links outside.
    pub fn new(tree: &BspTree) -> Self {
        let mut out = Cells { cells: Vec::new(), number: vec![Self::NONE; tree.nodes().len()] };
        tree.for_each_node(|node, kind, &bounds, _| {
            if let NodeKind::Leaf { first, count } = kind {
                out.number[node as usize] = out.cells.len() as u32;
                out.cells.push(Cell { bounds, node, first, count, links: [Link::OUTSIDE; 6] });
            }
        });
        out
    }

    /// Heap bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.cells[..]) + size_of_val(&self.number[..])
    }
}
