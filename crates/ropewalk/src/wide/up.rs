//! From any treelet to the ones above it: what queries need that start where the last one ended.
//!
//! The tree itself leads down only. The table is made on request and costs [`UpTable::bytes`]: 32 bytes a
//! treelet, and a fifth of a byte a line to find a treelet's number by its line.

use super::lines::LINE;
use super::{LEAF, LEVELS, Treelet, WideTree, code_line};
use crate::aabb::Aabb;

/// A treelet's cell and what is above it.
///
/// ```text
/// bytes  0..12   lower corner        bytes 16..28   upper corner, negated
/// bytes 12..16   number of the treelet above; of the root its own
/// bytes 28..32   line of the treelet
/// ```
#[repr(C, align(32))]
#[derive(Clone, Copy, Debug)]
pub struct Above(pub [f32; 8]);

impl Above {
    /// Number of the treelet above.
    #[inline(always)]
    pub fn parent(&self) -> usize {
        self.0[3].to_bits() as usize
    }

    /// Line of the treelet.
    #[inline(always)]
    pub fn line(&self) -> u32 {
        self.0[7].to_bits()
    }
}

/// All treelets of a tree, numbered in the order of their lines; the root is 0.
#[derive(Debug)]
pub struct UpTable {
    above: Vec<Above>,
    /// Which of 64 lines hold treelets.
    mask: Vec<u64>,
    /// Treelets before these lines.
    rank: Vec<u32>,
}

impl UpTable {
    /// The table of a tree, empty if its root is no treelet. The root's cell is `outer`, or larger than
    /// the tree's box: what lies outside of the box changes nothing.
    pub(super) fn new(tree: &WideTree, outer: &Aabb) -> UpTable {
        let words = tree.lines().len().div_ceil(64);
        let mut table = UpTable {
            above: Vec::with_capacity(tree.treelets()),
            mask: vec![0; words],
            rank: Vec::with_capacity(words),
        };
        if tree.root() == 0 || tree.root() & LEAF != 0 {
            return table;
        }
        let [low, high] = [outer.min, outer.max];
        let cell = [low[0], low[1], low[2], 0.0, -high[0], -high[1], -high[2], 0.0];
        // Last in, first out, so that treelets come in the order of their lines.
        let mut stack = vec![(tree.root(), 0usize, cell)];
        while let Some((code, parent, mut cell)) = stack.pop() {
            let (line, number) = (code_line(code), table.above.len());
            cell[3] = f32::from_bits(parent as u32);
            cell[7] = f32::from_bits(line as u32);
            table.above.push(Above(cell));
            table.mask[line / 64] |= 1 << (line % 64);
            let treelet = tree.lines().treelet(line);
            for child in (0..1usize << LEVELS).rev() {
                let code = treelet.child[child];
                if code != 0 && code & LEAF == 0 {
                    stack.push((code, number, narrowed(&cell, treelet, child)));
                }
            }
        }
        let mut before = 0;
        for word in &table.mask {
            table.rank.push(before);
            before += word.count_ones();
        }
        debug_assert!(table.above.is_sorted_by_key(Above::line));
        table
    }

    /// Bytes of the table.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.above[..]) + size_of_val(&self.mask[..]) + size_of_val(&self.rank[..])
    }

    /// The number of the treelet at a line; `None` if there is none.
    #[inline(always)]
    pub fn number(&self, line: u32) -> Option<usize> {
        let (word, bit) = (line as usize / 64, line % 64);
        let mask = *self.mask.get(word)?;
        let before = (mask & ((1 << bit) - 1)).count_ones();
        (mask >> bit & 1 == 1).then(|| (self.rank[word] + before) as usize)
    }

    /// A treelet by its number.
    #[inline(always)]
    pub fn above(&self, number: usize) -> &Above {
        &self.above[number]
    }
}

/// The cell of a child.
fn narrowed(cell: &[f32; 8], treelet: &Treelet, child: usize) -> [f32; 8] {
    let (mut cell, mut heap) = (*cell, 0);
    for level in (0..LEVELS).rev() {
        let upper = child >> level & 1;
        let (axis, plane) = (treelet.axis(heap), treelet.plane[heap]);
        let (lane, plane) = if upper == 1 { (axis, plane) } else { (axis + 4, -plane) };
        cell[lane] = cell[lane].max(plane);
        heap = 2 * heap + 1 + upper;
    }
    cell
}

const _: () = assert!(2 * size_of::<Above>() == LINE);
