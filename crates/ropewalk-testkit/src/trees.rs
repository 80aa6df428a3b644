//! Random valid trees: any planes at all, also through vertices, on the faces of cells, and again
//! in the same place, so that cells are flat and leaves empty.

use crate::rays::Draw;
use ropewalk::primitive::Primitive;
use ropewalk::tree::{BspTree, Node, TreeError};
use ropewalk::{Aabb, Geometry};

/// How wild a random tree is.
#[derive(Clone, Copy, Debug)]
pub struct TreeShape {
    /// Largest depth of a leaf.
    pub max_depth: usize,
    /// Number of nodes from which on every open cell becomes a leaf.
    pub max_nodes: usize,
    /// Cells with this many primitives or fewer mostly become leaves.
    pub leaf_size: usize,
    /// Probability of a plane at a coordinate of a primitive's box or of the cell.
    pub aligned: f64,
    /// Probability that a primitive which only touches the plane from one side is also referred to
    /// from the other side.
    pub generous: f64,
    /// Probability of splitting even a cell that needs no split.
    pub needless: f64,
}

impl Default for TreeShape {
    fn default() -> Self {
        TreeShape {
            max_depth: 20,
            max_nodes: 2000,
            leaf_size: 2,
            aligned: 0.5,
            generous: 0.3,
            needless: 0.3,
        }
    }
}

/// A random tree over `geometry` that obeys the one rule which the walks rely on: each part of a
/// primitive lies in a leaf that refers to the primitive.
///
/// # Errors
/// None are expected: the parts are checked like anybody's.
pub fn random_tree(
    draw: &mut Draw,
    geometry: &Geometry,
    shape: TreeShape,
) -> Result<BspTree, TreeError> {
    let all = (0..geometry.len() as u32).collect();
    let mut grower = Grower { draw, geometry, shape, nodes: Vec::new(), refs: Vec::new() };
    grower.grow(geometry.bounds(), all, 0);
    let Grower { nodes, refs, .. } = grower;
    BspTree::from_nodes(geometry.bounds(), nodes, refs)
}

struct Grower<'a> {
    draw: &'a mut Draw,
    geometry: &'a Geometry,
    shape: TreeShape,
    nodes: Vec<Node>,
    refs: Vec<u32>,
}

impl Grower<'_> {
    fn grow(&mut self, cell: Aabb, prims: Vec<u32>, depth: usize) {
        let wanted = prims.len() > self.shape.leaf_size || self.draw.chance(self.shape.needless);
        let full = depth >= self.shape.max_depth || self.nodes.len() >= self.shape.max_nodes;
        if cell.is_empty() || full || !wanted {
            self.nodes.push(Node::leaf(self.refs.len() as u32, prims.len() as u32));
            self.refs.extend(prims);
            return;
        }
        let (axis, split) = self.plane(&cell, &prims);
        let (below, above) = cell.split(axis, split);
        let (mut lower, mut upper) = (Vec::new(), Vec::new());
        for id in prims {
            let shape = self.geometry.shape(id);
            let (in_lower, in_upper) = (shape.clipped_bounds(&below), shape.clipped_bounds(&above));
            // What lies in the plane itself lies in both closed cells: one reference is enough.
            let mut keep = [in_lower.is_some(), in_upper.is_some()];
            if keep == [true, true] && !self.draw.chance(self.shape.generous) {
                let only_lower = in_upper.is_some_and(|b| b.max[axis] <= split);
                let only_upper = in_lower.is_some_and(|b| b.min[axis] >= split);
                keep = match (only_lower, only_upper) {
                    (true, true) if self.draw.chance(0.5) => [true, false],
                    (_, true) => [false, true],
                    (only_lower, false) => [true, !only_lower],
                };
            }
            lower.extend(keep[0].then_some(id));
            upper.extend(keep[1].then_some(id));
        }
        let parent = self.nodes.len();
        self.nodes.push(Node::leaf(0, 0));
        self.grow(below, lower, depth + 1);
        self.nodes[parent] = Node::inner(axis, split, self.nodes.len() as u32);
        self.grow(above, upper, depth + 1);
    }

    fn plane(&mut self, cell: &Aabb, prims: &[u32]) -> (usize, f32) {
        let axis = if self.draw.chance(0.7) {
            (0..3).fold(0, |best, a| if cell.extent(a) > cell.extent(best) { a } else { best })
        } else {
            self.draw.below(3)
        };
        let (low, high) = (cell.min[axis], cell.max[axis]);
        if self.draw.chance(self.shape.aligned) {
            if prims.is_empty() || self.draw.chance(0.1) {
                return (axis, if self.draw.chance(0.5) { low } else { high });
            }
            let b = self.geometry.shape(prims[self.draw.below(prims.len())]).bounds();
            let x = if self.draw.chance(0.5) { b.min[axis] } else { b.max[axis] };
            return (axis, x.clamp(low, high));
        }
        let middle = 0.5 * (f64::from(low) + f64::from(high));
        let x = self.draw.uniform(f64::from(low), f64::from(high));
        (axis, (((x + middle) * 0.5) as f32).clamp(low, high))
    }
}
