//! Leaves by number: which one holds a point, and the box of each.

use crate::aabb::Aabb;
use crate::wide::{ID_MASK, LEAF, LEVELS, NO_ID, Treelet, WideTree, code_line};

/// A leaf of one wide tree, empty ones included. It means nothing to other trees; asked about one that
/// it does not belong to, they say so or name another leaf, and nothing worse happens.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Cell(
    /// Line of the treelet times eight plus the child; 0 where the root is a leaf.
    u32,
);

impl Cell {
    const ROOT: Cell = Cell(0);

    /// The line of its treelet, if it is a cell of a tree.
    #[inline(always)]
    pub(crate) fn line(self) -> u32 {
        self.0 / CHILDREN
    }

    /// As a number, to be stored.
    pub fn to_bits(self) -> u32 {
        self.0
    }

    /// From such a number; any is allowed.
    pub fn from_bits(bits: u32) -> Cell {
        Cell(bits)
    }
}

/// A child of a treelet.
const CHILDREN: u32 = 1 << LEVELS;

/// True if there is nothing below a code.
fn is_leaf(code: u32) -> bool {
    code == 0 || code & LEAF != 0
}

/// The leaf whose cell holds a point; a point in a plane belongs to the upper side. `None` outside of
/// the tree's box, and for NaN.
pub fn locate(tree: &WideTree, point: [f64; 3]) -> Option<Cell> {
    let bounds = tree.bounds();
    let within =
        |a: usize| f64::from(bounds.min[a]) <= point[a] && point[a] <= f64::from(bounds.max[a]);
    if !(0..3).all(within) {
        return None;
    }
    let (mut code, mut cell) = (tree.root(), Cell::ROOT);
    while !is_leaf(code) {
        let line = code_line(code);
        let treelet = tree.lines().treelet(line);
        let mut heap = 0;
        while heap < 7 {
            let below = point[treelet.axis(heap)] < f64::from(treelet.plane[heap]);
            heap = 2 * heap + 2 - usize::from(below);
        }
        cell = Cell(line as u32 * CHILDREN + heap as u32 - 7);
        code = treelet.child[heap - 7];
    }
    Some(cell)
}

/// The box of a leaf; `None` if the tree has no such leaf.
pub fn cell_box(tree: &WideTree, cell: Cell) -> Option<Aabb> {
    let (mut code, mut bounds) = (tree.root(), *tree.bounds());
    if is_leaf(code) {
        return (cell == Cell::ROOT).then_some(bounds);
    }
    let wanted = (cell.0 / CHILDREN) as usize;
    loop {
        let line = code_line(code);
        let treelet = tree.lines().treelet(line);
        // A subtree lies in one piece, after those of the children before it.
        let child = if line == wanted {
            (cell.0 % CHILDREN) as usize
        } else {
            let holds = |&child: &usize| {
                let code = treelet.child[child];
                !is_leaf(code) && code_line(code) <= wanted
            };
            (0..CHILDREN as usize).rev().find(holds)?
        };
        let mut heap = 0;
        for level in (0..LEVELS).rev() {
            let upper = child >> level & 1;
            let plane = treelet.plane[heap];
            if plane < f32::INFINITY {
                let (below, above) = bounds.split(treelet.axis(heap), plane);
                bounds = if upper == 1 { above } else { below };
            } else if upper == 1 {
                return None;
            }
            heap = 2 * heap + 1 + upper;
        }
        code = treelet.child[child];
        if line == wanted {
            return is_leaf(code).then_some(bounds);
        }
    }
}

/// All leaves in the order of their numbers.
pub fn cells(tree: &WideTree) -> Vec<Cell> {
    if is_leaf(tree.root()) {
        return vec![Cell::ROOT];
    }
    let (mut cells, mut stack) = (Vec::new(), vec![tree.root()]);
    while let Some(code) = stack.pop() {
        let line = code_line(code);
        let treelet = tree.lines().treelet(line);
        // A leaf higher up fills the lowest child of its absent planes; the others are no cells.
        for child in (0..CHILDREN as usize).rev() {
            let code = treelet.child[child];
            if !is_leaf(code) {
                stack.push(code);
            } else if is_cell(treelet, child) {
                cells.push(Cell(line as u32 * CHILDREN + child as u32));
            }
        }
    }
    cells.sort_unstable();
    cells
}

/// True if a child lies on the lower side of all planes on the way to it that are absent.
fn is_cell(treelet: &Treelet, child: usize) -> bool {
    let mut heap = 0;
    for level in (0..LEVELS).rev() {
        let upper = child >> level & 1;
        if upper == 1 && treelet.plane[heap] == f32::INFINITY {
            return false;
        }
        heap = 2 * heap + 1 + upper;
    }
    true
}

/// The primitives of a leaf, each once; none if the tree has no such leaf.
pub fn cell_primitives(tree: &WideTree, cell: Cell) -> Vec<u32> {
    let mut code = tree.root();
    if cell_box(tree, cell).is_none() {
        return Vec::new();
    }
    if !is_leaf(code) {
        let treelet = tree.lines().treelet((cell.0 / CHILDREN) as usize);
        code = treelet.child[(cell.0 % CHILDREN) as usize];
    }
    if code == 0 {
        return Vec::new();
    }
    let blocks = tree.block_lines(code).map(|line| tree.lines().block(line));
    let ids = blocks.flat_map(|block| block.id).filter(|id| id & ID_MASK != NO_ID);
    ids.map(|id| id & ID_MASK).collect()
}
