//! Where a short segment enters the tree: the smallest treelet that holds all it can hit.
//!
//! ```text
//! up the path of the last segment until a cell holds this one, then down from there:
//!     it reaches no child with primitives    no hit; the empty cell of its end is remembered
//!     it reaches one                         on to that one; a leaf is remembered and is the entry
//!     it reaches several                     the entry
//! ```
//! A segment in the cell remembered needs no search, and one that meets none of the boxes of the
//! triangles in the leaves that it reaches hits nothing.
//!
//! A segment stands for its box here, widened by more than the rounding of its ends and the slack of
//! docs/numerics.md, so that whatever brute force hits lies in a cell that the box reaches: where the
//! search starts changes what it costs, never what is hit.

#![allow(unsafe_code)]

use super::beam::Vector;
use super::entry_packet::{Columns, PACKET};
use super::events::Events;
use super::slot::TINY;
use crate::aabb::Aabb;
use crate::point::Cell;
use crate::ray::Ray;
use crate::wide::{
    BLOCK_LINES, Block, LEAF, LINE, MAX_WIDE_DEPTH, Treelet, UpTable, WideTree, code_line,
    code_offset, treelet_code,
};

/// A box: the lower corner, then the negated upper one, each with a fourth lane of padding. One box
/// holds another if none of its lanes is larger.
#[repr(C, align(32))]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corners(pub [f32; 8]);

impl Corners {
    /// A box that holds nothing.
    pub const NOTHING: Corners = Corners([f32::INFINITY; 8]);
}

/// The part of a ray in its range.
#[derive(Clone, Copy, Debug)]
pub struct Segment {
    /// Its box with the ray's origin, widened.
    pub corners: Corners,
    /// Its end, rounded; the fourth lane is padding.
    pub end: [f32; 4],
}

/// For each combination of planes that a box lies wholly on one side of: the children it may reach.
#[repr(C, align(64))]
pub struct ReachTable {
    /// Bit `h` of the index: the box lies above plane `h`.
    pub above: [u8; 128],
    /// Bit `h` of the index: the box lies below plane `h`.
    pub below: [u8; 128],
    /// Bit `h` of the index: a point lies above plane `h`; the child that holds it.
    pub child: [u8; 128],
}

/// The one table of the crate.
pub static REACH: ReachTable = {
    let mut table = ReachTable { above: [0; 128], below: [0; 128], child: [0; 128] };
    let mut bits = 0;
    while bits < 128 {
        let mut child = 0;
        while child < 8 {
            let planes = path(child);
            let (mut above, mut below, mut level) = (true, true, 0);
            while level < 3 {
                let bit = bits >> planes[level] & 1 == 1;
                let upper = child >> (2 - level) & 1 == 1;
                above &= upper || !bit;
                below &= !upper || !bit;
                level += 1;
            }
            table.above[bits] |= (above as u8) << child;
            table.below[bits] |= (below as u8) << child;
            child += 1;
        }
        let h1 = 1 + (bits & 1);
        let h2 = 2 * h1 + 1 + (bits >> h1 & 1);
        table.child[bits] = ((bits & 1) << 2 | (bits >> h1 & 1) << 1 | bits >> h2 & 1) as u8;
        bits += 1;
    }
    table
};

/// The planes on the way to a child.
#[inline(always)]
pub const fn path(child: usize) -> [usize; 3] {
    [0, 1 + (child >> 2), 3 + (child >> 1)]
}

/// What the entry search does, written for each level.
///
/// # Safety
/// The methods may only run on a machine with the level's features.
pub trait Locate: Copy {
    /// One number of each segment of a packet.
    type Row: Vector;

    /// The numbers of some rays by their places.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn columns(rays: &[Ray; PACKET], columns: &mut Columns);

    /// Writes a ray in one piece: written number by number it could not be read back as vectors at once,
    /// which costs more than all else about a segment in an empty cell.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn put(to: &mut Ray, ray: &Ray);

    /// The segment of a ray; its box, which holds the origin too, widened by `slack` on each side.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn segment(ray: &Ray, slack: f32) -> Segment;

    /// True if the segment lies in a cell; false for NaN.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn lies_in(segment: &Segment, cell: &Corners) -> bool;

    /// The children of a treelet that hold primitives and that the segment's box reaches.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn reached(segment: &Segment, treelet: &Treelet) -> u32;

    /// The child on whose side of all planes the end lies.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn child_of_end(segment: &Segment, treelet: &Treelet) -> usize;

    /// True if the segment's box meets the box of a triangle of a block.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn overlaps(segment: &Segment, block: &Block) -> bool;

    /// The cell of a child of the treelet of `cell`.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn narrow(cell: &Corners, treelet: &Treelet, child: usize) -> Corners;
}

/// A cell by its code.
#[repr(C, align(64))]
#[derive(Clone, Copy)]
struct Place {
    cell: Corners,
    code: u32,
}

/// The way from the root to where the last segment was: the treelets and their cells.
///
/// It belongs to one tree and one batch: no code in it comes from outside.
pub struct Path {
    /// The leaf in which the last segment was and its cell, which may hold nothing.
    leaf: Place,
    slack: f32,
    depth: usize,
    places: [Place; MAX_WIDE_DEPTH],
}

/// The box of a segment is widened by this share of the largest coordinate.
///
/// With `u = 2^-24` and `S` that coordinate, both ends of a segment inside of the root's cell are off
/// by at most `3 u S` (`t dir` is at most `2 S`), another `2 u S` where ranges end one `f32` later than
/// they say, and `u S` where the widened corner is rounded; the slack of the exact walks is `2^-15` of
/// `u S`.
pub const WIDER: f32 = 8.0 * f32::EPSILON / 2.0;

impl Path {
    /// The root of a tree, or `None` if it is not a treelet: then there is nothing to search.
    pub fn new(tree: &WideTree) -> Option<Path> {
        if tree.root() == 0 || tree.root() & LEAF != 0 {
            return None;
        }
        let cell = outer_corners(tree);
        let places = [Place { cell, code: tree.root() }; MAX_WIDE_DEPTH];
        let leaf = Place { cell: Corners::NOTHING, code: 0 };
        Some(Path { leaf, slack: slack_of(tree), depth: 0, places })
    }

    /// The code of the cell from which a ray is to be walked; `None` if it hits nothing.
    ///
    /// # Safety
    /// The machine must have the features of `L`, and the caller must enable them; `tree` must be
    /// that of this path.
    #[inline(always)]
    pub unsafe fn enter<L: Locate, E: Events>(
        &mut self,
        tree: &WideTree,
        ray: &Ray,
        events: &mut E,
    ) -> Option<u32> {
        // SAFETY: passed on to the caller.
        let code =
            unsafe { self.enter_segment::<L, E>(tree, &L::segment(ray, self.slack), events) };
        if code == 0 {
            events.skipped(1);
            return None;
        }
        Some(code)
    }

    /// True if a segment lies in the root's cell: from elsewhere nothing is searched for.
    ///
    /// # Safety
    /// As for [`Path::enter`].
    #[inline(always)]
    pub(super) unsafe fn holds<L: Locate>(&self, segment: &Segment) -> bool {
        // SAFETY: passed on to the caller.
        unsafe { L::lies_in(segment, &self.places[0].cell) }
    }

    /// By how much boxes of segments are widened.
    #[inline(always)]
    pub(super) fn slack(&self) -> f32 {
        self.slack
    }

    /// The code of the cell from which what is in a box is to be walked; 0 if nothing is near.
    ///
    /// # Safety
    /// As for [`Path::enter`].
    #[inline(always)]
    pub(super) unsafe fn enter_segment<L: Locate, E: Events>(
        &mut self,
        tree: &WideTree,
        segment: &Segment,
        events: &mut E,
    ) -> u32 {
        // SAFETY: passed on to the caller.
        unsafe {
            if L::lies_in(segment, &self.leaf.cell) {
                let code = self.leaf.code;
                if Self::is_clear::<L, E>(tree, segment, code, events) { 0 } else { code }
            } else {
                self.search::<L, E>(tree, segment, events)
            }
        }
    }

    /// Moves the path to where the segment is; the code of its entry, 0 if it hits nothing.
    #[inline(always)]
    unsafe fn search<L: Locate, E: Events>(
        &mut self,
        tree: &WideTree,
        segment: &Segment,
        events: &mut E,
    ) -> u32 {
        // SAFETY: passed on to the caller; `depth` stays below the number of treelets on a path,
        // and the codes of a tree lead to its cells.
        unsafe {
            while !L::lies_in(segment, &self.places.get_unchecked(self.depth).cell) {
                if self.depth == 0 {
                    return self.places[0].code;
                }
                self.depth -= 1;
            }
            loop {
                let Place { cell, code } = *self.places.get_unchecked(self.depth);
                let treelet = &*tree.lines().as_ptr().add(code_offset(code)).cast::<Treelet>();
                events.looked();
                let reached = L::reached(segment, treelet);
                if reached == 0 {
                    let cell = L::narrow(&cell, treelet, L::child_of_end(segment, treelet));
                    self.leaf = Place { cell, code: 0 };
                    return 0;
                }
                if reached & (reached - 1) != 0 {
                    let clear = Self::are_clear::<L, E>(tree, segment, treelet, reached, events);
                    return if clear { 0 } else { code };
                }
                let child = reached.trailing_zeros() as usize & 7;
                let code = treelet.child[child];
                let place = Place { cell: L::narrow(&cell, treelet, child), code };
                if code & LEAF != 0 {
                    self.leaf = place;
                    let clear = Self::is_clear::<L, E>(tree, segment, code, events);
                    return if clear { 0 } else { code };
                }
                self.depth += 1;
                *self.places.get_unchecked_mut(self.depth) = place;
            }
        }
    }

    /// True if so many children of a treelet are leaves and a segment meets none of their boxes.
    #[inline(always)]
    unsafe fn are_clear<L: Locate, E: Events>(
        tree: &WideTree,
        segment: &Segment,
        treelet: &Treelet,
        mut children: u32,
        events: &mut E,
    ) -> bool {
        while children != 0 {
            let code = treelet.child[children.trailing_zeros() as usize & 7];
            // SAFETY: passed on to the caller.
            let clear =
                unsafe { code & LEAF != 0 && Self::is_clear::<L, E>(tree, segment, code, events) };
            if !clear {
                return false;
            }
            children &= children - 1;
        }
        true
    }

    /// True if a segment meets none of the boxes of a leaf's triangles.
    #[inline(always)]
    unsafe fn is_clear<L: Locate, E: Events>(
        tree: &WideTree,
        segment: &Segment,
        code: u32,
        events: &mut E,
    ) -> bool {
        if code == 0 {
            return true;
        }
        if tree.has_shapes() {
            return false;
        }
        let mut line = code_line(code);
        for _ in 0..tree.block_count(code) {
            events.boxed();
            // SAFETY: the codes of a tree lead to its blocks; the rest passed on to the caller.
            unsafe {
                let block = &*tree.lines().as_ptr().add(line * LINE).cast::<Block>();
                if L::overlaps(segment, block) {
                    return false;
                }
            }
            line += BLOCK_LINES;
        }
        true
    }
}

/// The cell of the root.
pub fn outer_corners(tree: &WideTree) -> Corners {
    let Aabb { min: low, max: high } = tree.outer_box();
    let none = f32::NEG_INFINITY;
    Corners([low[0], low[1], low[2], none, -high[0], -high[1], -high[2], none])
}

/// The slack of the segments in a tree; see [`WIDER`].
pub fn slack_of(tree: &WideTree) -> f32 {
    let outer = tree.outer_box();
    let coordinates = outer.min.iter().chain(&outer.max).filter(|x| x.is_finite());
    WIDER * coordinates.fold(0.0f32, |a, x| a.max(x.abs())) + TINY
}

/// Where segments enter the tree that start in known cells.
pub struct Climb<'a> {
    up: &'a UpTable,
    slack: f32,
    /// Segments with a cell that led to a treelet below the root.
    pub started: u64,
    /// Other segments with a cell.
    pub climbed: u64,
}

impl<'a> Climb<'a> {
    /// In a tree with a table of what is above; `None` if it has none, or no treelets.
    pub fn new(tree: &'a WideTree) -> Option<Climb<'a>> {
        let is_treelet = tree.root() != 0 && tree.root() & LEAF == 0;
        let up = tree.up().filter(|_| is_treelet)?;
        Some(Climb { up, slack: slack_of(tree), started: 0, climbed: 0 })
    }

    /// The code of the cell from which a ray is to be walked; `None` if it hits nothing. Any cell will
    /// do: from one that the ray is not near to, the way up is long.
    ///
    /// # Safety
    /// The machine must have the features of `L`, and the caller must enable them; `tree` must be
    /// that of this climb.
    #[inline(always)]
    pub unsafe fn enter<L: Locate, E: Events>(
        &mut self,
        tree: &WideTree,
        ray: &Ray,
        cell: Option<Cell>,
        events: &mut E,
    ) -> Option<u32> {
        let Some(mut at) = cell.and_then(|cell| self.up.number(cell.line())) else {
            self.climbed += u64::from(cell.is_some());
            return Some(tree.root());
        };
        // SAFETY: passed on to the caller; the codes of a tree lead to its cells.
        let code = unsafe {
            let segment = L::segment(ray, self.slack);
            let mut above = self.up.above(at);
            while at != 0 && !L::lies_in(&segment, &Corners(above.0)) {
                at = above.parent();
                above = self.up.above(at);
            }
            if at == 0 {
                self.climbed += 1;
                return Some(tree.root());
            }
            self.started += 1;
            let mut code = treelet_code(above.line());
            loop {
                let treelet = &*tree.lines().as_ptr().add(code_offset(code)).cast::<Treelet>();
                events.looked();
                let reached = L::reached(&segment, treelet);
                if reached == 0 {
                    break 0;
                }
                if reached & (reached - 1) != 0 {
                    let clear = Path::are_clear::<L, E>(tree, &segment, treelet, reached, events);
                    break if clear { 0 } else { code };
                }
                code = treelet.child[reached.trailing_zeros() as usize & 7];
                if code & LEAF != 0 {
                    let clear = Path::is_clear::<L, E>(tree, &segment, code, events);
                    break if clear { 0 } else { code };
                }
            }
        };
        if code == 0 {
            events.skipped(1);
            return None;
        }
        Some(code)
    }
}
