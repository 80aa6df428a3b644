//! The check of a tree's links: what every kernel relies on.
//!
//! A tree is laid out depth first: behind a treelet come the blocks of its leaves in the order of its
//! children, then the subtrees of its other children, each in one piece. So each link is known but for the
//! sizes of subtrees, and the check asks for exactly that: all lines but the first belong to one treelet or
//! one block, and no path is longer than the kernels' stacks allow. Whatever else the lines hold then,
//! nothing in them leads out of them, and a walk that takes each link once ends.

use super::error::{FileError, Part};
use super::header::Tag;
use crate::kernel::prefetch_line;
use crate::wide::{
    BLOCK_LINES, COUNT_OVERFLOW, LEAF, LINE, Lines, MAX_WIDE_DEPTH, Treelet, code_line,
};

/// A subtree to be checked.
#[derive(Clone, Copy)]
struct Subtree {
    line: usize,
    /// The first line behind it.
    end: usize,
    /// Treelets above it.
    depth: usize,
    /// Where its code stands.
    code_at: u64,
}

/// Subtrees that wait for their treelets to come from memory.
const AHEAD: usize = 16;

/// Subtrees to be checked, in any order: each is asked for some time before it is looked at.
struct Waiting {
    stack: Vec<Subtree>,
    /// A ring of those that have been asked for.
    asked: [Subtree; AHEAD],
    /// How many have been put into the ring and taken out of it.
    put: usize,
    taken: usize,
}

impl Waiting {
    fn new() -> Self {
        let none = Subtree { line: 0, end: 0, depth: 0, code_at: 0 };
        Waiting { stack: Vec::new(), asked: [none; AHEAD], put: 0, taken: 0 }
    }

    fn next(&mut self, lines: &Lines) -> Option<Subtree> {
        while self.put - self.taken < AHEAD {
            let Some(subtree) = self.stack.pop() else { break };
            prefetch_line(lines.as_ptr().wrapping_add(subtree.line * LINE));
            self.asked[self.put % AHEAD] = subtree;
            self.put += 1;
        }
        if self.taken == self.put {
            return None;
        }
        self.taken += 1;
        Some(self.asked[(self.taken - 1) % AHEAD])
    }
}

/// The axes of a treelet that [`Treelet::set_axis`] can make: which planes are across y and z decides
/// all other bits.
fn axes_are_valid(axes: u32) -> bool {
    let (y, z) = (axes >> 14 & 0x7F, axes >> 21 & 0x7F);
    axes >> 28 == 0 && y & z == 0 && axes & 0x3FFF == spread(y) | spread(z) << 1
}

/// Seven bits, each two apart from the next.
fn spread(x: u32) -> u32 {
    let x = (x | x << 4) & 0x070F;
    let x = (x | x << 2) & 0x1333;
    (x | x << 1) & 0x1555
}

/// What is being checked.
pub struct Links<'a> {
    /// The lines.
    pub lines: &'a Lines,
    /// Leaves of many blocks, by their first lines in ascending order, with the numbers of their blocks.
    pub overflow: &'a [(u32, u32)],
    /// Where the lines begin in the file.
    pub offset: u64,
    /// Where the overflow list begins in the file.
    pub overflow_offset: u64,
}

/// Numbers of treelets and blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counted {
    pub treelets: u64,
    pub blocks: u64,
    /// Leaves of the overflow list.
    overflow: usize,
}

impl Links<'_> {
    /// Checks everything that can be reached from `root`, which is all there may be.
    ///
    /// # Errors
    /// [`FileError::Value`] for the first link that is not right.
    pub fn check(&self, root: u32, root_at: u64) -> Result<Counted, FileError> {
        let mut counted = Counted::default();
        let end = self.lines.len();
        let mut waiting = Waiting::new();
        if !self.overflow.is_sorted_by(|a, b| a.0 < b.0) {
            return Err(self.list_fault("out of order", "ascending lines"));
        }
        if root == 0 || root & LEAF != 0 {
            let next = match root {
                0 => 1,
                leaf => self.leaf(leaf, 1, end, root_at, &mut counted)?,
            };
            self.ends(next, end, root_at)?;
        } else {
            self.treelet_code(root, root_at)?;
            if code_line(root) != 1 {
                return Err(self.fault(root_at, "the root's line", code_line(root), 1));
            }
            if end < 2 {
                return Err(self.fault(root_at, "the root's line", 1, "none: there is no line"));
            }
            waiting.stack.push(Subtree { line: 1, end, depth: 0, code_at: root_at });
        }
        while let Some(subtree) = waiting.next(self.lines) {
            if subtree.depth >= MAX_WIDE_DEPTH {
                let expected = format!("at most {MAX_WIDE_DEPTH} treelets");
                return Err(self.fault(subtree.code_at, "a path", "longer", expected));
            }
            counted.treelets += 1;
            let treelet = self.lines.treelet(subtree.line);
            self.planes(treelet, self.at(subtree.line))?;
            let mut next = subtree.line + 1;
            let mut inner = 0u32;
            for (c, &code) in treelet.child.iter().enumerate() {
                if code & LEAF != 0 {
                    let at = self.child_at(subtree.line, c);
                    next = self.leaf(code, next, subtree.end, at, &mut counted)?;
                } else {
                    inner |= u32::from(code != 0) << c;
                }
            }
            // From the last to the first: each ends where the next begins.
            let mut end = subtree.end;
            while inner != 0 {
                let c = 31 - inner.leading_zeros();
                inner ^= 1 << c;
                let (code, at) =
                    (treelet.child[c as usize], self.child_at(subtree.line, c as usize));
                self.treelet_code(code, at)?;
                let line = code_line(code);
                if line < next || line >= end {
                    let expected = format!("{next} to {}", end.saturating_sub(1));
                    return Err(self.fault(at, "a treelet's line", line, expected));
                }
                let depth = subtree.depth + 1;
                waiting.stack.push(Subtree { line, end, depth, code_at: at });
                end = line;
            }
            self.ends(next, end, self.at(subtree.line))?;
        }
        // Each leaf has a line of its own, so that none is found twice.
        if counted.overflow != self.overflow.len() {
            let found = format!("{} leaves long", self.overflow.len());
            return Err(self.list_fault(found, format!("{} leaves", counted.overflow)));
        }
        Ok(counted)
    }

    /// The line behind a leaf that must begin at `next`.
    fn leaf(
        &self,
        code: u32,
        next: usize,
        end: usize,
        at: u64,
        counted: &mut Counted,
    ) -> Result<usize, FileError> {
        let line = code_line(code);
        if line != next {
            return Err(self.fault(at, "a leaf's line", line, next));
        }
        let count = match code & COUNT_OVERFLOW {
            0 => return Err(self.fault(at, "the number of a leaf's blocks", 0, "1 or more")),
            COUNT_OVERFLOW => {
                let found = self.overflow.binary_search_by_key(&line, |&(line, _)| line as usize);
                match found.map(|i| self.overflow[i].1) {
                    Ok(count) if count >= COUNT_OVERFLOW => {
                        counted.overflow += 1;
                        count
                    }
                    _ => {
                        let expected = "a leaf of the overflow list";
                        return Err(self.fault(at, "a leaf of many blocks", line, expected));
                    }
                }
            }
            count => count,
        };
        let most = (end - next) / BLOCK_LINES;
        if count as usize > most {
            let expected = format!("at most {most}");
            return Err(self.fault(at, "the number of a leaf's blocks", count, expected));
        }
        counted.blocks += u64::from(count);
        Ok(next + count as usize * BLOCK_LINES)
    }

    /// Planes are numbers across an axis.
    fn planes(&self, treelet: &Treelet, at: u64) -> Result<(), FileError> {
        if treelet.plane.iter().any(|plane| plane.is_nan()) {
            return Err(self.fault(at, "a plane", "NaN", "a number"));
        }
        if axes_are_valid(treelet.axes) {
            return Ok(());
        }
        let found = format!("{:#010x}", treelet.axes);
        Err(self.fault(at + 28, "the axes of a treelet", found, "axes 0, 1 and 2 with their marks"))
    }

    fn treelet_code(&self, code: u32, at: u64) -> Result<(), FileError> {
        if code & COUNT_OVERFLOW == 0 {
            return Ok(());
        }
        let found = format!("{code:#010x}");
        Err(self.fault(at, "a treelet's code", found, "a code whose last four bits are 0"))
    }

    /// What begins before `end` must end there.
    fn ends(&self, next: usize, end: usize, at: u64) -> Result<(), FileError> {
        if next == end {
            return Ok(());
        }
        Err(self.fault(at, "the first line behind a subtree's own", next, end))
    }

    fn at(&self, line: usize) -> u64 {
        self.offset + (line * LINE) as u64
    }

    fn child_at(&self, line: usize, child: usize) -> u64 {
        self.at(line) + 32 + 4 * child as u64
    }

    #[cold]
    fn list_fault(&self, found: impl ToString, expected: impl ToString) -> FileError {
        let (section, offset) = (Part::Section(Tag::OVERFLOW), self.overflow_offset);
        let (expected, found) = (expected.to_string(), found.to_string());
        FileError::Value { section, offset, what: "the list of large leaves", expected, found }
    }

    #[cold]
    fn fault(
        &self,
        offset: u64,
        what: &'static str,
        found: impl ToString,
        expected: impl ToString,
    ) -> FileError {
        let inside = offset >= self.offset;
        let section = if inside { Part::Section(Tag::TREE) } else { Part::Header };
        let (expected, found) = (expected.to_string(), found.to_string());
        FileError::Value { section, offset, what, expected, found }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn valid_axes_are_those_that_can_be_set() {
        let mut valid = 0;
        for numbers in 0..3usize.pow(7) {
            let mut treelet = Treelet::EMPTY;
            (0..7).for_each(|h| treelet.set_axis(h, numbers / 3usize.pow(h as u32) % 3));
            assert!(axes_are_valid(treelet.axes), "{:#x}", treelet.axes);
            valid += 1;
            for bit in 0..32 {
                assert!(!axes_are_valid(treelet.axes ^ 1 << bit), "{:#x} {bit}", treelet.axes);
            }
        }
        assert_eq!(valid, 2187);
    }
}
