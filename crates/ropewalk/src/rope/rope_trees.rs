//! Rope trees: per face of a leaf a two-dimensional BSP over exactly the leaves that touch it.

use crate::aabb::Aabb;
use crate::rope::cells::Cells;
use crate::rope::link::{Link, Target};
use crate::rope::ropes::{checked_cells, single_link};
use crate::rope::thread::{Side, for_each_leaf, side_of_face};
use crate::rope::validate::{behind_link, check};
use crate::rope::{RopeError, RopeNode, Threads};
use crate::traverse::LeafId;
use crate::tree::{BspTree, NodeKind};
use std::collections::HashMap;

/// A rope tree per face of every leaf (Havran 1997). A face with one neighbour has a plain link;
/// equal subtrees are stored once.
///
/// No new planes appear: a rope tree is the descent of the neighbouring subtree constrained to the
/// face. Splits along the face's normal take the adjacent child, splits that do not cut the face
/// the side that covers it, and the rest become nodes; a node with one child is its child.
#[derive(Clone, Debug, PartialEq)]
pub struct RopeTrees {
    threads: Threads,
    faces_over_budget: usize,
}

impl RopeTrees {
    /// Threads the leaves of `tree`, without a limit on memory.
    ///
    /// # Errors
    /// [`RopeError::TooManyNodes`] beyond 2^29 nodes of the tree. A rope-tree node beyond 2^29 is
    /// treated like one over budget.
    pub fn build(tree: &BspTree) -> Result<RopeTrees, RopeError> {
        Self::build_within(tree, usize::MAX)
    }

    /// As [`RopeTrees::build`] with at most `max_bytes` for rope-tree nodes: a face whose tree no
    /// longer fits keeps its single link. Links and boxes of leaves are not part of the budget.
    ///
    /// # Errors
    /// As [`RopeTrees::build`].
    pub fn build_within(tree: &BspTree, max_bytes: usize) -> Result<RopeTrees, RopeError> {
        let cells = checked_cells(tree)?;
        let max_nodes = (max_bytes / size_of::<RopeNode>()).min(Link::MAX);
        let nodes = Vec::new();
        let mut weaver =
            Weaver { tree, cells, nodes, shared: HashMap::new(), max_nodes, over_budget: 0 };
        let mut number = 0;
        for_each_leaf(tree, |_, cell, ropes| {
            for (face, &rope) in ropes.iter().enumerate() {
                weaver.cells.cells[number].links[face] = match rope {
                    None => Link::OUTSIDE,
                    Some(node) => weaver.face(node, cell, face),
                };
            }
            number += 1;
        });
        let Weaver { cells, mut nodes, over_budget, .. } = weaver;
        nodes.shrink_to_fit();
        Ok(RopeTrees { threads: Threads { cells, nodes }, faces_over_budget: over_budget })
    }

    /// Checks that every rope tree holds exactly the leaves that touch its face, each under the
    /// part of the face that it covers.
    ///
    /// # Errors
    /// [`RopeError::Invalid`] names the first leaf and face at fault.
    pub fn validate(&self, tree: &BspTree) -> Result<(), RopeError> {
        check(&self.threads, tree)?;
        let links = self.threads.cells.cells.iter().flat_map(|cell| cell.links);
        let single = links.filter(|link| matches!(link.target(), Target::Node(_))).count();
        match single == self.faces_over_budget {
            true => Ok(()),
            false => Err(RopeError::invalid(0, 0, "not all single links are over budget")),
        }
    }

    /// The leaves that touch a face of a leaf (`2 * axis`, plus 1 for the upper face) from across;
    /// empty at the border of the scene, and where `leaf` is no leaf or `face` no face.
    pub fn neighbours(&self, tree: &BspTree, leaf: LeafId, face: usize) -> Vec<LeafId> {
        let cells = &self.threads.cells;
        let number = cells.number.get(leaf.0 as usize).copied().unwrap_or(Cells::NONE);
        let Some(cell) = cells.cells.get(number as usize).filter(|_| face < 6) else {
            return Vec::new();
        };
        let found = behind_link(&self.threads, tree, &cell.bounds, face, cell.links[face]);
        let id = |number: u32| LeafId(cells.cells[number as usize].node);
        found.unwrap_or_default().into_iter().map(id).collect()
    }

    /// Bytes of all links, rope-tree nodes, boxes of leaves and tables.
    pub fn bytes(&self) -> usize {
        self.threads.bytes()
    }

    /// [`RopeTrees::bytes`] over the number of leaves.
    pub fn bytes_per_leaf(&self) -> f64 {
        self.threads.bytes_per_leaf()
    }

    /// Number of leaves.
    pub fn leaf_count(&self) -> usize {
        self.threads.cells.cells.len()
    }

    /// Number of stored rope-tree nodes, equal subtrees counted once.
    pub fn node_count(&self) -> usize {
        self.threads.nodes.len()
    }

    /// Number of faces that kept a single link to an inner node for lack of memory.
    pub fn faces_over_budget(&self) -> usize {
        self.faces_over_budget
    }

    pub(crate) fn threads(&self) -> &Threads {
        &self.threads
    }
}

/// Makes rope trees out of subtrees.
struct Weaver<'a> {
    tree: &'a BspTree,
    cells: Cells,
    nodes: Vec<RopeNode>,
    /// Nodes by axis and content: equal subtrees are one.
    shared: HashMap<(u8, RopeNodeKey), Link>,
    max_nodes: usize,
    over_budget: usize,
}

/// A rope node as a hash key: bits of the split position and both links.
type RopeNodeKey = (u32, Link, Link);

impl Weaver<'_> {
    /// The link of a face whose neighbours all lie below `node`.
    fn face(&mut self, node: u32, cell: &Aabb, face: usize) -> Link {
        self.constrain(node, cell, face).unwrap_or_else(|| {
            self.over_budget += 1;
            single_link(self.tree, &self.cells, Some(node))
        })
    }

    /// The constrained descent; `None` where the budget is spent. `cell` shrinks to the part of
    /// the face that is being served. Recursion is bounded by the depth of the tree.
    fn constrain(&mut self, mut node: u32, cell: &Aabb, face: usize) -> Option<Link> {
        loop {
            let NodeKind::Inner { axis, split, left, right } = self.tree.kind(node) else {
                return Some(Link::leaf(self.cells.number[node as usize]));
            };
            node = match side_of_face(cell, face, axis, split) {
                Side::Lower => left,
                Side::Upper => right,
                Side::Both => {
                    let (below, above) = cell.split(axis, split);
                    let below = self.constrain(left, &below, face)?;
                    let above = self.constrain(right, &above, face)?;
                    return self.store(axis, RopeNode { split, below, above });
                }
            };
        }
    }

    fn store(&mut self, axis: usize, node: RopeNode) -> Option<Link> {
        let key = (axis as u8, (node.split.to_bits(), node.below, node.above));
        if let Some(&link) = self.shared.get(&key) {
            return Some(link);
        }
        if self.nodes.len() >= self.max_nodes {
            return None;
        }
        let link = Link::split(axis, self.nodes.len() as u32);
        self.nodes.push(node);
        self.shared.insert(key, link);
        Some(link)
    }
}
