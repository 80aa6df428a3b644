//! From the binary tree to treelets and blocks.

use super::lines::{BLOCK_LINES, LINE, Lines};
use super::{
    Block, COUNT_OVERFLOW, CompileError, LEVELS, MAX_LINES, SIDES_BACK, SIDES_BOTH, SIDES_FRONT,
    Treelet, WIDTH, WideTree, leaf_code, treelet_code,
};
use crate::geometry::Geometry;
use crate::primitive::{Primitive, Shape, Sides};
use crate::tree::{BspTree, NodeKind};

impl WideTree {
    /// Compiles `tree`, which was built over `geometry`.
    ///
    /// Laid out depth first: behind a treelet come the blocks of its leaves, then the subtrees of
    /// its other children, so that a subtree is contiguous and a leaf close to its treelet.
    ///
    /// # Errors
    /// [`CompileError`] if the tree is too large for its codes or for memory.
    pub fn compile(tree: &BspTree, geometry: &Geometry) -> Result<WideTree, CompileError> {
        let (treelets, blocks) = count(tree);
        // Line 0 is a dummy, so that the code 0 means an empty cell everywhere.
        let needed = 1 + treelets + blocks * BLOCK_LINES;
        if needed > MAX_LINES {
            return Err(CompileError::TooLarge { needed, max: MAX_LINES });
        }
        let lines = Lines::new(needed).map_err(|error| CompileError::Memory {
            bytes: needed * LINE,
            reason: error.to_string(),
        })?;
        let mut compiler =
            Compiler { tree, geometry, lines, next: 1, overflow: Vec::new(), has_shapes: false };
        let root = match tree.kind(BspTree::ROOT) {
            NodeKind::Leaf { first, count } => compiler.leaf(first, count),
            NodeKind::Inner { .. } => compiler.subtree(BspTree::ROOT),
        };
        debug_assert_eq!(compiler.next as usize, needed);
        Ok(WideTree {
            bounds: tree.bounds(),
            root,
            lines: compiler.lines,
            treelets,
            blocks,
            overflow: compiler.overflow,
            has_shapes: compiler.has_shapes,
        })
    }
}

/// Treelets and blocks that a tree needs.
fn count(tree: &BspTree) -> (usize, usize) {
    let (mut treelets, mut blocks) = (0, 0);
    let mut stack = vec![(BspTree::ROOT, 0)];
    while let Some((node, level)) = stack.pop() {
        match tree.kind(node) {
            NodeKind::Leaf { count, .. } => blocks += (count as usize).div_ceil(WIDTH),
            NodeKind::Inner { left, right, .. } => {
                treelets += usize::from(level == 0);
                let below = (level + 1) % LEVELS;
                stack.extend([(left, below), (right, below)]);
            }
        }
    }
    (treelets, blocks)
}

struct Compiler<'a> {
    tree: &'a BspTree,
    geometry: &'a Geometry,
    lines: Lines,
    /// The first line not taken.
    next: u32,
    overflow: Vec<(u32, u32)>,
    has_shapes: bool,
}

impl Compiler<'_> {
    /// Takes lines from the front of what is left.
    fn take(&mut self, lines: usize) -> u32 {
        let first = self.next;
        self.next += lines as u32;
        first
    }

    /// Writes the subtree of an inner node; its code.
    fn subtree(&mut self, node: u32) -> u32 {
        let line = self.take(1);
        let mut treelet = Treelet::EMPTY;
        let mut roots = [None; 8];
        self.fill(&mut treelet, &mut roots, node, 0, 0, 0);
        for (child, root) in treelet.child.iter_mut().zip(roots) {
            if let Some(NodeKind::Leaf { first, count }) = root.map(|root| self.tree.kind(root)) {
                *child = self.leaf(first, count);
            }
        }
        for (child, root) in treelet.child.iter_mut().zip(roots) {
            if let Some(root) = root
                && let NodeKind::Inner { .. } = self.tree.kind(root)
            {
                *child = self.subtree(root);
            }
        }
        self.lines.set_treelet(line as usize, &treelet);
        treelet_code(line)
    }

    /// Takes the planes of up to three levels below `node` and notes the roots of what hangs below.
    fn fill(
        &self,
        treelet: &mut Treelet,
        roots: &mut [Option<u32>; 8],
        node: u32,
        level: usize,
        heap: usize,
        child: usize,
    ) {
        match self.tree.kind(node) {
            NodeKind::Inner { axis, split, left, right } if level < LEVELS => {
                treelet.plane[heap] = split;
                treelet.axes |= (axis as u32) << (4 * heap);
                let upper = child | 1 << (2 - level);
                self.fill(treelet, roots, left, level + 1, 2 * heap + 1, child);
                self.fill(treelet, roots, right, level + 1, 2 * heap + 2, upper);
            }
            _ => roots[child] = Some(node),
        }
    }

    /// Writes the blocks of a leaf, its primitives in ascending order; its code.
    fn leaf(&mut self, first_ref: u32, count: u32) -> u32 {
        if count == 0 {
            return 0;
        }
        let blocks = count.div_ceil(WIDTH as u32);
        let first = self.take(blocks as usize * BLOCK_LINES);
        let mut line = first as usize;
        let refs = self.tree.leaf_refs(first_ref, count);
        for lanes in refs.chunks(WIDTH) {
            let mut block = Block::EMPTY;
            for (lane, &prim) in lanes.iter().enumerate() {
                let sides = match self.geometry.sides(prim) {
                    Sides::Both => SIDES_BOTH,
                    Sides::Front => SIDES_FRONT,
                    Sides::Back => SIDES_BACK,
                };
                block.id[lane] = prim | sides;
                match self.geometry.shape(prim) {
                    // A degenerate triangle keeps its id and NaN vertices: it is never hit.
                    Shape::Triangle(triangle) if triangle.is_degenerate() => {}
                    Shape::Triangle(triangle) => {
                        for (rows, vertex) in block.vertex.iter_mut().zip(triangle.vertices) {
                            for (row, x) in rows.iter_mut().zip(vertex) {
                                row[lane] = x;
                            }
                        }
                    }
                    _ => self.has_shapes = true,
                }
            }
            self.lines.set_block(line, &block);
            line += BLOCK_LINES;
        }
        if blocks >= COUNT_OVERFLOW {
            self.overflow.push((first, blocks));
        }
        leaf_code(first, blocks)
    }
}
