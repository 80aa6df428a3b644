//! Does a wide tree hold the cells of its binary tree?

use super::compile::ordered;
use super::{
    BLOCK_LINES, Bound, COUNT_OVERFLOW, ID_MASK, LEAF, LEVELS, NO_ID, WIDTH, WideTree, code_line,
};
use crate::geometry::Geometry;
use crate::tree::{BspTree, NodeKind};

/// The first thing found wrong with a wide tree.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum WideFault {
    /// A child code points nowhere.
    #[error("child {child} of treelet {treelet:#x} points outside of the tree")]
    Range {
        /// Code of the treelet.
        treelet: u32,
        /// Its child.
        child: usize,
    },
    /// The planes below a treelet are not those of the binary tree.
    #[error("treelet {treelet:#x} does not hold the planes of node {node}")]
    Planes {
        /// Code of the treelet.
        treelet: u32,
        /// The binary node that it should stand for.
        node: u32,
    },
    /// The primitives of a leaf are not those of the binary tree, triangles first, with the bounds of the others.
    #[error("the blocks of code {code:#x} do not hold the primitives of leaf {node}")]
    Leaf {
        /// The leaf code.
        code: u32,
        /// The binary leaf.
        node: u32,
    },
}

impl WideTree {
    /// Checks every treelet and leaf against the binary tree that it was compiled from, which was built over
    /// `geometry`.
    ///
    /// # Errors
    /// The first [`WideFault`].
    pub fn validate(&self, tree: &BspTree, geometry: &Geometry) -> Result<(), WideFault> {
        let mut stack = vec![(self.root, BspTree::ROOT, 0, 0)];
        while let Some((code, node, parent, child)) = stack.pop() {
            if code & LEAF != 0 || code == 0 {
                self.check_leaf((tree, geometry), code, node, parent, child)?;
                continue;
            }
            let line = code_line(code);
            if line == 0 || line >= self.lines.len() || code & COUNT_OVERFLOW != 0 {
                return Err(WideFault::Range { treelet: parent, child });
            }
            let treelet = self.lines.treelet(line);
            let mut roots = [None; 8];
            let mut open = vec![(node, 0, 0, 0)];
            while let Some((node, level, heap, path)) = open.pop() {
                match tree.kind(node) {
                    NodeKind::Inner { axis, split, left, right } if level < LEVELS => {
                        if treelet.plane[heap] != split || treelet.axis(heap) != axis {
                            return Err(WideFault::Planes { treelet: code, node });
                        }
                        open.push((left, level + 1, 2 * heap + 1, path));
                        open.push((right, level + 1, 2 * heap + 2, path | 1 << (2 - level)));
                    }
                    _ => roots[path] = Some(node),
                }
            }
            for (child, root) in roots.into_iter().enumerate() {
                match root {
                    Some(root) => stack.push((treelet.child[child], root, code, child)),
                    None if treelet.child[child] == 0 => {}
                    None => return Err(WideFault::Planes { treelet: code, node }),
                }
            }
        }
        Ok(())
    }

    fn check_leaf(
        &self,
        (tree, geometry): (&BspTree, &Geometry),
        code: u32,
        node: u32,
        treelet: u32,
        child: usize,
    ) -> Result<(), WideFault> {
        let fault = WideFault::Leaf { code, node };
        let NodeKind::Leaf { first, count } = tree.kind(node) else { return Err(fault) };
        let expected = tree.leaf_refs(first, count);
        if code == 0 {
            return if expected.is_empty() { Ok(()) } else { Err(fault) };
        }
        let lines: Vec<usize> = self.block_lines(code).collect();
        if lines.iter().any(|&line| line == 0 || line + BLOCK_LINES > self.lines.len()) {
            return Err(WideFault::Range { treelet, child });
        }
        let (ordered, counts) = ordered(geometry, expected);
        let blocks = counts.map(|count| count.div_ceil(WIDTH));
        let mut places = Vec::new();
        for (i, &line) in lines.iter().enumerate() {
            let block = self.lines.block(line);
            let is_of_shapes = i >= blocks[0];
            if block.holds_shapes() != is_of_shapes {
                return Err(fault);
            }
            for lane in (0..WIDTH).filter(|&lane| block.id[lane] & ID_MASK != NO_ID) {
                let id = block.id[lane] & ID_MASK;
                let bound = is_of_shapes.then(|| Bound::of(geometry.shape(id)));
                if block.bound(lane) != bound {
                    return Err(fault);
                }
                places.push(id);
            }
        }
        let full = lines.len() == blocks.iter().sum::<usize>();
        if places == ordered && full { Ok(()) } else { Err(fault) }
    }
}
