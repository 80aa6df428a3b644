//! From the binary tree to treelets and blocks.

use super::{
    Block, COUNT_OVERFLOW, CompileError, MAX_BLOCKS, SIDES_BACK, SIDES_BOTH, SIDES_FRONT, Treelet,
    WIDTH, WideTree, leaf_code,
};
use crate::geometry::Geometry;
use crate::primitive::{Primitive, Shape, Sides};
use crate::tree::{BspTree, NodeKind};

impl WideTree {
    /// Compiles `tree`, which was built over `geometry`.
    ///
    /// Treelets are laid out depth first and the blocks of a leaf follow those of the leaf before
    /// it, so that a subtree is contiguous in both arrays.
    ///
    /// # Errors
    /// [`CompileError`] if the leaves need more blocks than can be addressed.
    pub fn compile(tree: &BspTree, geometry: &Geometry) -> Result<WideTree, CompileError> {
        let mut compiler = Compiler {
            tree,
            geometry,
            // Treelet 0 is a dummy, so that the code 0 means an empty cell everywhere.
            treelets: vec![Treelet::EMPTY],
            blocks: Vec::new(),
            overflow: Vec::new(),
            has_shapes: false,
        };
        let needed = compiler.count_blocks();
        if needed > MAX_BLOCKS {
            return Err(CompileError::TooManyBlocks { needed, max: MAX_BLOCKS });
        }
        compiler.blocks.reserve_exact(needed);
        let root = compiler.code(BspTree::ROOT);
        Ok(WideTree {
            bounds: tree.bounds(),
            root,
            treelets: compiler.treelets,
            blocks: compiler.blocks,
            overflow: compiler.overflow,
            has_shapes: compiler.has_shapes,
        })
    }
}

struct Compiler<'a> {
    tree: &'a BspTree,
    geometry: &'a Geometry,
    treelets: Vec<Treelet>,
    blocks: Vec<Block>,
    overflow: Vec<(u32, u32)>,
    has_shapes: bool,
}

impl Compiler<'_> {
    fn count_blocks(&self) -> usize {
        let leaf = |kind| match kind {
            NodeKind::Leaf { count, .. } => (count as usize).div_ceil(WIDTH),
            NodeKind::Inner { .. } => 0,
        };
        (0..self.tree.nodes().len() as u32).map(|i| leaf(self.tree.kind(i))).sum()
    }

    /// The child code of a binary node.
    fn code(&mut self, node: u32) -> u32 {
        match self.tree.kind(node) {
            NodeKind::Leaf { count: 0, .. } => 0,
            NodeKind::Leaf { first, count } => self.leaf(first, count),
            NodeKind::Inner { .. } => {
                let index = self.treelets.len();
                self.treelets.push(Treelet::EMPTY);
                let mut treelet = Treelet::EMPTY;
                let mut roots = [None; 8];
                self.fill(&mut treelet, &mut roots, node, 0, 0, 0);
                for (child, root) in treelet.child.iter_mut().zip(roots) {
                    *child = root.map_or(0, |root| self.code(root));
                }
                self.treelets[index] = treelet;
                index as u32
            }
        }
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
            NodeKind::Inner { axis, split, left, right } if level < 3 => {
                treelet.plane[heap] = split;
                treelet.axes |= (axis as u32) << (4 * heap);
                let upper = child | 1 << (2 - level);
                self.fill(treelet, roots, left, level + 1, 2 * heap + 1, child);
                self.fill(treelet, roots, right, level + 1, 2 * heap + 2, upper);
            }
            _ => roots[child] = Some(node),
        }
    }

    /// Writes the blocks of a leaf, its primitives in ascending order.
    fn leaf(&mut self, first_ref: u32, count: u32) -> u32 {
        let first = self.blocks.len() as u32;
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
            self.blocks.push(block);
        }
        let count = self.blocks.len() as u32 - first;
        if count >= COUNT_OVERFLOW {
            self.overflow.push((first, count));
        }
        leaf_code(first, count)
    }
}
