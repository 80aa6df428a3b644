//! From the binary tree to treelets and blocks.

use super::lines::{BLOCK_LINES, LINE, Lines};
use super::{
    Block, Bound, COUNT_OVERFLOW, CompileError, LEVELS, MAX_LINES, SIDES_BACK, SIDES_BOTH,
    SIDES_FRONT, Treelet, WIDTH, WideTree, leaf_code, treelet_code,
};
use crate::build::{self, BuildError, BuildReport, BuildSettings, Monitor};
use crate::geometry::Geometry;
use crate::primitive::{Primitive, Shape, Sides, Triangle};
use crate::tree::{BspTree, NodeKind};
use rayon::prelude::*;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

impl WideTree {
    /// Builds a binary tree over `geometry` and compiles it, both with `settings.threads` threads;
    /// the same tree for any number. [`BuildSettings::preset`] has settings made for it. Of the
    /// binary tree only the report is left; its time includes the compilation.
    ///
    /// # Errors
    /// See [`build`](build::build); [`BuildError::Compile`] where the tree cannot be compiled.
    pub fn build(
        geometry: &Geometry,
        settings: &BuildSettings,
        monitor: &dyn Monitor,
    ) -> Result<(WideTree, BuildReport), BuildError> {
        Self::build_without(&|_, triangle| triangle.is_degenerate(), geometry, settings, monitor)
    }

    /// [`WideTree::build`] without the triangles that `is_left_out` names: their lanes are never hit.
    pub(crate) fn build_without(
        is_left_out: LeftOut<'_>,
        geometry: &Geometry,
        settings: &BuildSettings,
        monitor: &dyn Monitor,
    ) -> Result<(WideTree, BuildReport), BuildError> {
        let start = Instant::now();
        let mut settings = settings.effective()?;
        if let Some(limit) = settings.memory_limit {
            settings.max_duplication =
                build::memory::duplication_within(limit, geometry.len(), &settings)?;
        }
        build::in_pool(settings.threads, || {
            let (tree, mut report) = build::build_here(geometry, &settings, monitor)?;
            if let Some(limit) = settings.memory_limit {
                let (treelets, blocks) = count(&tree, geometry);
                // The binary tree is still there while the wide one is filled from runs of 12 bytes.
                let wide = (1 + treelets + blocks * BLOCK_LINES) * LINE;
                let needed = (wide + report.tree.bytes + blocks * size_of::<Run>()) as u64;
                if needed > limit {
                    return Err(BuildError::Memory { needed, limit });
                }
            }
            let parallel = settings.threads != 1;
            let wide = Self::compile_with(&tree, geometry, parallel, is_left_out)?;
            report.seconds = start.elapsed().as_secs_f64();
            Ok((wide, report))
        })?
    }

    /// Compiles `tree`, which was built over `geometry`.
    ///
    /// In a leaf triangles come before all others, which begin a block of their own.
    ///
    /// Laid out depth first: behind a treelet come the blocks of its leaves, then the subtrees of
    /// its other children, so that a subtree is contiguous and a leaf close to its treelet.
    ///
    /// # Errors
    /// [`CompileError`] if the tree is too large for its codes or for memory.
    pub fn compile(tree: &BspTree, geometry: &Geometry) -> Result<WideTree, CompileError> {
        Self::compile_with(tree, geometry, false, &|_, triangle| triangle.is_degenerate())
    }

    fn compile_with(
        tree: &BspTree,
        geometry: &Geometry,
        parallel: bool,
        is_left_out: LeftOut<'_>,
    ) -> Result<WideTree, CompileError> {
        let (treelets, blocks) = count(tree, geometry);
        // Line 0 is a dummy, so that the code 0 means an empty cell everywhere.
        let needed = 1 + treelets + blocks * BLOCK_LINES;
        if needed > MAX_LINES {
            return Err(CompileError::TooLarge { needed, max: MAX_LINES });
        }
        let lines = Lines::new(needed).map_err(|error| CompileError::Memory {
            bytes: needed * LINE,
            reason: error.to_string(),
        })?;
        let mut compiler = Compiler {
            tree,
            geometry,
            lines,
            next: 1,
            runs: Vec::with_capacity(blocks),
            overflow: Vec::new(),
            sorted: Vec::new(),
        };
        let root = match tree.kind(BspTree::ROOT) {
            NodeKind::Leaf { first, count } => compiler.leaf(first, count),
            NodeKind::Inner { .. } => compiler.subtree(BspTree::ROOT),
        };
        let Compiler { mut lines, next, runs, overflow, sorted, .. } = compiler;
        debug_assert_eq!(next as usize, needed);
        let refs = |run: &Run| match geometry.has_shapes() {
            true => &sorted[run.first_ref as usize..][..run.count as usize],
            false => tree.leaf_refs(run.first_ref, run.count),
        };
        let has_shapes = fill(&mut lines, &runs, (&refs, geometry, is_left_out), parallel);
        Ok(WideTree {
            bounds: tree.bounds(),
            root,
            lines,
            treelets,
            blocks,
            overflow,
            has_shapes,
            up: OnceLock::new(),
        })
    }
}

/// How many of some primitives are triangles, and how many are others.
fn kinds(geometry: &Geometry, prims: &[u32]) -> [usize; 2] {
    if !geometry.has_shapes() {
        return [prims.len(), 0];
    }
    let triangles = prims.iter().filter(|&&prim| geometry.triangle(prim).is_some()).count();
    [triangles, prims.len() - triangles]
}

/// The primitives of a leaf in the order in which its blocks hold them, and the numbers of both kinds.
pub(super) fn ordered(geometry: &Geometry, prims: &[u32]) -> (Vec<u32>, [usize; 2]) {
    let (mut triangles, others): (Vec<u32>, Vec<u32>) =
        prims.iter().partition(|&&prim| geometry.triangle(prim).is_some());
    let counts = [triangles.len(), others.len()];
    triangles.extend(others);
    (triangles, counts)
}

/// Treelets and blocks that a tree needs.
fn count(tree: &BspTree, geometry: &Geometry) -> (usize, usize) {
    let (mut treelets, mut blocks) = (0, 0);
    let mut stack = vec![(BspTree::ROOT, 0)];
    while let Some((node, level)) = stack.pop() {
        match tree.kind(node) {
            NodeKind::Leaf { first, count } => {
                let counts = kinds(geometry, tree.leaf_refs(first, count));
                blocks += counts.map(|count| count.div_ceil(WIDTH)).iter().sum::<usize>();
            }
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
    /// What goes into each block; they are filled last, since that is most of the work.
    runs: Vec<Run>,
    overflow: Vec<(u32, u32)>,
    /// The references of all leaves in the order of blocks, where there are others than triangles.
    sorted: Vec<u32>,
}

/// Says of a triangle and its number whether it is never hit.
pub(crate) type LeftOut<'a> = &'a (dyn Fn(u32, &Triangle) -> bool + Sync);

/// The references that go into a block, by their places in the tree or in [`Compiler::sorted`].
#[derive(Clone, Copy)]
struct Run {
    /// Line of the block.
    line: u32,
    first_ref: u32,
    count: u32,
}

/// The references of a run.
type RefsOf<'f, 'a> = &'f (dyn Fn(&Run) -> &'a [u32] + Sync);

/// Blocks that are worth a task of their own.
const MIN_RUNS: usize = 1024;

/// Fills all blocks; true if any holds something else than triangles.
fn fill<'a>(
    lines: &mut Lines,
    runs: &[Run],
    (refs, geometry, is_left_out): (RefsOf<'_, 'a>, &Geometry, LeftOut<'_>),
    parallel: bool,
) -> bool {
    let has_shapes = AtomicBool::new(false);
    let write = |(runs, first, bytes): (&[Run], u32, &mut [u8])| {
        for run in runs {
            let block = block(geometry, is_left_out, refs(run), &has_shapes);
            let at = (run.line - first) as usize * LINE;
            bytes[at..][..size_of::<Block>()].copy_from_slice(bytemuck::bytes_of(&block));
        }
    };
    // Blocks lie in the order of their runs, so that each task gets lines of its own.
    let (mut rest, mut at) = (lines.bytes_mut(), 0);
    let mut tasks = Vec::with_capacity(runs.len().div_ceil(MIN_RUNS));
    for runs in runs.chunks(MIN_RUNS) {
        let end = runs[runs.len() - 1].line + BLOCK_LINES as u32;
        let (bytes, behind) = rest.split_at_mut((end - at) as usize * LINE);
        tasks.push((runs, at, bytes));
        (rest, at) = (behind, end);
    }
    if parallel {
        tasks.into_par_iter().for_each(write);
    } else {
        tasks.into_iter().for_each(write);
    }
    has_shapes.into_inner()
}

/// A block of up to eight primitives; notes whether there are others than triangles.
fn block(
    geometry: &Geometry,
    is_left_out: LeftOut<'_>,
    prims: &[u32],
    has_shapes: &AtomicBool,
) -> Block {
    let mut block = Block::EMPTY;
    for (lane, &prim) in prims.iter().enumerate().take(WIDTH) {
        let sides = match geometry.sides(prim) {
            Sides::Both => SIDES_BOTH,
            Sides::Front => SIDES_FRONT,
            Sides::Back => SIDES_BACK,
        };
        block.id[lane] = prim | sides;
        match geometry.shape(prim) {
            // It keeps its id and NaN vertices: it is never hit.
            Shape::Triangle(triangle) if is_left_out(prim, triangle) => {}
            Shape::Triangle(triangle) => {
                for (rows, vertex) in block.vertex.iter_mut().zip(triangle.vertices) {
                    for (row, x) in rows.iter_mut().zip(vertex) {
                        row[lane] = x;
                    }
                }
            }
            shape => {
                block.set_bound(lane, &Bound::of(shape));
                has_shapes.store(true, Ordering::Relaxed);
            }
        }
    }
    block
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
                treelet.set_axis(heap, axis);
                let upper = child | 1 << (2 - level);
                self.fill(treelet, roots, left, level + 1, 2 * heap + 1, child);
                self.fill(treelet, roots, right, level + 1, 2 * heap + 2, upper);
            }
            _ => roots[child] = Some(node),
        }
    }

    /// Hands out the blocks of a leaf, its triangles and then its other primitives in ascending order; its code.
    fn leaf(&mut self, first_ref: u32, refs: u32) -> u32 {
        if refs == 0 {
            return 0;
        }
        let (mut at, mut counts) = (first_ref, [refs, 0]);
        if self.geometry.has_shapes() {
            at = self.sorted.len() as u32;
            let (sorted, kinds) = ordered(self.geometry, self.tree.leaf_refs(first_ref, refs));
            counts = kinds.map(|count| count as u32);
            self.sorted.extend(sorted);
        }
        let width = WIDTH as u32;
        let blocks = counts[0].div_ceil(width) + counts[1].div_ceil(width);
        let first = self.take(blocks as usize * BLOCK_LINES);
        let mut line = first;
        for refs in counts {
            self.runs.extend((0..refs.div_ceil(width)).map(|i| Run {
                line: line + i * BLOCK_LINES as u32,
                first_ref: at + i * width,
                count: width.min(refs - i * width),
            }));
            line += refs.div_ceil(width) * BLOCK_LINES as u32;
            at += refs;
        }
        if blocks >= COUNT_OVERFLOW {
            self.overflow.push((first, blocks));
        }
        leaf_code(first, blocks)
    }
}
