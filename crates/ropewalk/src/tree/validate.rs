//! Checks of every invariant of a tree.

use super::{BspTree, MAX_DEPTH, NodeKind};
use crate::aabb::Aabb;
use crate::geometry::Geometry;
use crate::primitive::Primitive;

/// The first broken invariant that was found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TreeFault {
    /// There is no root.
    #[error("the tree has no nodes; expected at least one leaf")]
    NoNodes,
    /// The root's box does not hold the geometry.
    #[error("the root's box {found:?} does not contain the geometry's box {expected:?}")]
    Bounds {
        /// The root's box.
        found: Aabb,
        /// The geometry's box.
        expected: Aabb,
    },
    /// A child link that is out of range or does not lead forward.
    #[error("node {node}: right child {right} of {nodes} nodes; expected one after the left child")]
    Link {
        /// The parent.
        node: u32,
        /// Its link.
        right: u32,
        /// Number of nodes.
        nodes: usize,
    },
    /// A node reached twice or never.
    #[error("node {node} is reached {times} times; expected once")]
    Reached {
        /// The node.
        node: u32,
        /// How often; 2 stands for more than once.
        times: u32,
    },
    /// A leaf too deep for the traversal stacks.
    #[error("node {node} has depth {depth}; at most {MAX_DEPTH} is allowed")]
    Depth {
        /// The node.
        node: u32,
        /// Its depth.
        depth: usize,
    },
    /// A plane outside its cell, or NaN.
    #[error("node {node}: plane {axis} = {split} lies outside its cell {cell:?}")]
    Plane {
        /// The node.
        node: u32,
        /// Axis of the plane.
        axis: usize,
        /// Position of the plane.
        split: f32,
        /// The node's cell.
        cell: Aabb,
    },
    /// A leaf's run of references out of range or overlapping another leaf's.
    #[error("leaf {node}: references {first}..+{count} of {refs} do not follow the last leaf's")]
    Run {
        /// The leaf.
        node: u32,
        /// First reference.
        first: u32,
        /// Number of references.
        count: u32,
        /// Number of references of the tree.
        refs: usize,
    },
    /// References that are not ascending, or not primitives.
    #[error(
        "leaf {node}: primitive {prim} after {previous:?}; expected ascending ids below {prims}"
    )]
    Order {
        /// The leaf.
        node: u32,
        /// The reference.
        prim: u32,
        /// The one before it.
        previous: Option<u32>,
        /// Number of primitives.
        prims: usize,
    },
    /// A reference to a primitive that does not touch the cell.
    #[error("leaf {node}: primitive {prim} does not touch the cell {cell:?}")]
    Stray {
        /// The leaf.
        node: u32,
        /// The primitive.
        prim: u32,
        /// The leaf's cell.
        cell: Aabb,
    },
    /// A primitive that reaches into a leaf which does not refer to it.
    #[error("leaf {node}: primitive {prim} reaches into the cell {cell:?} but is not referenced")]
    Missing {
        /// The leaf.
        node: u32,
        /// The primitive.
        prim: u32,
        /// The leaf's cell.
        cell: Aabb,
    },
}

impl BspTree {
    /// Checks every invariant against the geometry the tree was built over: links, depth, planes,
    /// runs of references, boxes that touch their cells, and completeness, that is, every
    /// primitive is referenced in every leaf into which a top-down clip of it leads. O(references
    /// x depth) clips.
    ///
    /// # Errors
    /// The first [`TreeFault`] found.
    pub fn validate(&self, geometry: &Geometry) -> Result<(), TreeFault> {
        self.check_structure(geometry)?;
        self.check_references(geometry, false)?;
        self.check_completeness(geometry)
    }

    /// [`BspTree::validate`] for a tree that was built with clipping: in addition, the primitive
    /// itself, not only its box, touches the cell of every leaf that refers to it.
    ///
    /// # Errors
    /// The first [`TreeFault`] found.
    pub fn validate_clipped(&self, geometry: &Geometry) -> Result<(), TreeFault> {
        self.validate(geometry)?;
        self.check_references(geometry, true)
    }

    /// Links, reachability, depth, planes and runs.
    fn check_structure(&self, geometry: &Geometry) -> Result<(), TreeFault> {
        let nodes = self.nodes.len();
        if nodes == 0 {
            return Err(TreeFault::NoNodes);
        }
        if !self.bounds.contains(&geometry.bounds()) {
            return Err(TreeFault::Bounds { found: self.bounds, expected: geometry.bounds() });
        }
        let mut reached = vec![false; nodes];
        let mut next_ref = 0;
        let mut stack = vec![(Self::ROOT, self.bounds, 0)];
        while let Some((node, cell, depth)) = stack.pop() {
            if std::mem::replace(&mut reached[node as usize], true) {
                return Err(TreeFault::Reached { node, times: 2 });
            }
            if depth > MAX_DEPTH {
                return Err(TreeFault::Depth { node, depth });
            }
            match self.kind(node) {
                NodeKind::Inner { axis, split, left, right } => {
                    if right <= left || right as usize >= nodes {
                        return Err(TreeFault::Link { node, right, nodes });
                    }
                    let inside = cell.min[axis] <= split && split <= cell.max[axis];
                    if !inside {
                        return Err(TreeFault::Plane { node, axis, split, cell });
                    }
                    let (lo, hi) = cell.split(axis, split);
                    stack.push((right, hi, depth + 1));
                    stack.push((left, lo, depth + 1));
                }
                NodeKind::Leaf { first, count } => {
                    let refs = self.refs.len();
                    if first as usize != next_ref || first as usize + count as usize > refs {
                        return Err(TreeFault::Run { node, first, count, refs });
                    }
                    next_ref += count as usize;
                }
            }
        }
        match reached.iter().position(|&r| !r) {
            Some(node) => Err(TreeFault::Reached { node: node as u32, times: 0 }),
            None => Ok(()),
        }
    }

    /// Order of the references, and that each touches its cell.
    fn check_references(&self, geometry: &Geometry, clipped: bool) -> Result<(), TreeFault> {
        let mut fault = None;
        self.for_each_node(|node, kind, cell, _| {
            let NodeKind::Leaf { first, count } = kind else { return };
            if fault.is_some() {
                return;
            }
            let mut previous = None;
            for &prim in self.leaf_refs(first, count) {
                if prim as usize >= geometry.len() || previous.is_some_and(|p| p >= prim) {
                    let prims = geometry.len();
                    fault = Some(TreeFault::Order { node, prim, previous, prims });
                    return;
                }
                previous = Some(prim);
                let shape = geometry.shape(prim);
                let touches = if clipped {
                    shape.clipped_bounds(cell).is_some()
                } else {
                    !shape.bounds().intersection(cell).is_empty()
                };
                if !touches {
                    fault = Some(TreeFault::Stray { node, prim, cell: *cell });
                    return;
                }
            }
        });
        fault.map_or(Ok(()), Err)
    }

    fn check_completeness(&self, geometry: &Geometry) -> Result<(), TreeFault> {
        for prim in 0..geometry.len() as u32 {
            let bounds = geometry.shape(prim).bounds();
            self.check_cover(geometry, prim, Self::ROOT, &self.bounds, &bounds)?;
        }
        Ok(())
    }

    /// Checks that the part `part` of a primitive inside `cell` is referenced by the leaves under
    /// `node`. A part that only touches a plane belongs to the side on which it lies, and one that
    /// lies in the plane to either.
    fn check_cover(
        &self,
        geometry: &Geometry,
        prim: u32,
        node: u32,
        cell: &Aabb,
        part: &Aabb,
    ) -> Result<(), TreeFault> {
        let (axis, split, left, right) = match self.kind(node) {
            NodeKind::Inner { axis, split, left, right } => (axis, split, left, right),
            NodeKind::Leaf { first, count } => {
                return match self.leaf_refs(first, count).binary_search(&prim) {
                    Ok(_) => Ok(()),
                    Err(_) => Err(TreeFault::Missing { node, prim, cell: *cell }),
                };
            }
        };
        let (below, above) = cell.split(axis, split);
        let (lo, hi) = (part.min[axis], part.max[axis]);
        if lo == split && hi == split {
            return self
                .check_cover(geometry, prim, left, &below, part)
                .or_else(|_| self.check_cover(geometry, prim, right, &above, part));
        }
        if hi <= split {
            return self.check_cover(geometry, prim, left, &below, part);
        }
        if lo >= split {
            return self.check_cover(geometry, prim, right, &above, part);
        }
        for (child, child_cell) in [(left, below), (right, above)] {
            if let Some(part) = geometry.shape(prim).clipped_bounds(&child_cell) {
                self.check_cover(geometry, prim, child, &child_cell, &part)?;
            }
        }
        Ok(())
    }
}
