//! The nearest triangle of a point.

#![allow(unsafe_code)]

use super::step::{Children, Place, PointSimd};
use super::triangle::{box_distance2, distance2, nearest_foot};
use crate::kernel::beam::Doubles;
use crate::kernel::events::Events;
use crate::kernel::exact::{At, place};
use crate::point::{ROUNDING, Triangles, is_near};
use crate::wide::{
    BLOCK_LINES, Block, ID_MASK, LEAF, MAX_WIDE_DEPTH, WIDTH, WideTree, code_line, code_offset,
};

/// The triangle nearest to a point.
#[derive(Clone, Copy, Debug)]
pub struct Found {
    /// Its squared distance, scaled; infinite without a triangle, NaN for a point that is none.
    pub distance2: f64,
    /// Its id; `u32::MAX` without one.
    pub prim_id: u32,
    /// Where it lies; `At::MAX` without one.
    pub at: At,
}

/// No place of a triangle.
const NONE: At = At::MAX;

impl Found {
    const NOTHING: Found = Found { distance2: f64::INFINITY, prim_id: u32::MAX, at: NONE };

    /// The answer for a point that is none.
    pub const INVALID: Found = Found { distance2: f64::NAN, ..Found::NOTHING };
}

/// A cell may be left out if it is farther away than the best triangle by this share of that
/// distance and the scene's diagonal. A distance from a triangle is off by less than 2^-46 of them
/// (docs/numerics.md).
const SLACK: f64 = 1.0 / (1u64 << 44) as f64;

/// The largest squared distance of a cell that may hold a triangle as near as the best one, or of a triangle
/// that is moved by up to `rounding`.
#[inline(always)]
fn limit(distance2: f64, diagonal: f64, rounding: f64) -> f64 {
    let distance = distance2.sqrt();
    let far = distance + SLACK * (distance + diagonal) + rounding;
    far * far
}

/// Relative error of a squared distance of a cell: a gap and its square are rounded to `f32`, three of
/// them are added; twice over.
const CELL_SLACK: f32 = 16.0 * f32::EPSILON / 2.0;

/// The same limit for squared distances of cells in `f32`.
#[inline(always)]
fn cell_limit(farthest: f64) -> f32 {
    // The smallest number, for what underflows.
    (farthest as f32).next_up() * (1.0 + CELL_SLACK) + f32::MIN_POSITIVE
}

/// Cells that a walk may put on its stack: all children of each treelet on the path.
const CELLS: usize = 8 * MAX_WIDE_DEPTH + 1;

/// A cell to be visited.
#[derive(Clone, Copy)]
struct Entry {
    /// Squared distance along each axis.
    along: [f32; 3],
    /// Squared distance.
    distance2: f32,
    /// Code.
    code: u32,
}

/// The nearest triangle of each point.
///
/// # Safety
/// The machine must have the features of `L`, and the caller must enable them.
#[inline(always)]
pub unsafe fn nearest<L: PointSimd, E: Events, G: Triangles>(
    (tree, geometry): (&WideTree, &G),
    points: &[[f64; 3]],
    found: &mut [Found],
    events: &mut E,
) {
    let diagonal = tree.bounds().diagonal();
    let mut stack = [Entry { along: [0.0; 3], distance2: 0.0, code: 0 }; CELLS];
    let mut seed = Found::NOTHING;
    for (point, out) in points.iter().zip(found) {
        let asked = Asked::new(geometry, *point, diagonal);
        if !is_near(point) || !is_near(&asked.scaled) {
            *out = Found::INVALID;
            continue;
        }
        // SAFETY: passed on to the caller.
        *out = unsafe { walk::<L, E, G>(tree, &asked, seed, &mut stack, events) };
        seed = *out;
    }
}

/// A point, and what it is asked about.
struct Asked<'a, G> {
    geometry: &'a G,
    /// In the numbers of the tree.
    placed: [f64; 3],
    scaled: [f64; 3],
    /// Of the tree's box.
    diagonal: f64,
}

impl<'a, G: Triangles> Asked<'a, G> {
    #[inline(always)]
    fn new(geometry: &'a G, point: [f64; 3], diagonal: f64) -> Self {
        let (placed, scaled) = (geometry.placed(point), geometry.scaled(point));
        Asked { geometry, placed, scaled, diagonal }
    }

    /// The squared distance of a triangle; the tree's `corners` are its corners unless they are rounded.
    #[inline(always)]
    fn distance2(&self, prim_id: u32, corners: impl FnOnce() -> [[f64; 3]; 3]) -> f64 {
        if !G::ROUNDED {
            // SAFETY: portable code.
            return unsafe { distance2(self.placed, corners()) };
        }
        let corners = self.geometry.corners(prim_id);
        corners.map_or(f64::INFINITY, |corners| nearest_foot(self.scaled, corners).distance2)
    }

    /// The largest squared distance, as the tree has it, of a triangle that may be as near as one at
    /// `distance2`; and of a cell that may refer to one.
    #[inline(always)]
    fn limits(&self, distance2: f64) -> (f64, f32) {
        let cell = limit(distance2, self.diagonal, 0.0);
        let triangle = if G::ROUNDED { limit(distance2, self.diagonal, ROUNDING) } else { cell };
        (triangle, cell_limit(cell))
    }
}

/// The nearest triangle of one point. `seed` may hold a triangle that is likely to be near.
///
/// # Safety
/// As for [`nearest`].
#[inline(always)]
unsafe fn walk<L: PointSimd, E: Events, G: Triangles>(
    tree: &WideTree,
    asked: &Asked<'_, G>,
    seed: Found,
    stack: &mut [Entry; CELLS],
    events: &mut E,
) -> Found {
    let mut best = Found::NOTHING;
    if tree.root() == 0 {
        return best;
    }
    events.rays(1);
    let (lines, point) = (tree.lines(), asked.placed);
    let (mut farthest, mut near) = (f64::MAX, cell_limit(f64::MAX));
    if seed.at != NONE {
        let (block, lane) = (lines.block(seed.at as usize / WIDTH), seed.at as usize % WIDTH);
        best = Found { distance2: asked.distance2(seed.prim_id, || corners(block, lane)), ..seed };
        (farthest, near) = asked.limits(best.distance2);
    }
    let mut along = [0.0; 3];
    for a in 0..3 {
        let (low, high) = (f64::from(tree.bounds().min[a]), f64::from(tree.bounds().max[a]));
        let gap = (low - point[a]).max(0.0).max(point[a] - high) as f32;
        along[a] = gap * gap;
    }
    stack[0] = Entry { along, distance2: 0.0, code: tree.root() };
    let mut sp = 1;
    let [x, y, z] = point;
    let place = Place([x, y, z, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let mut children = Children::EMPTY;
    while sp > 0 {
        sp -= 1;
        let cell = stack[sp];
        if cell.distance2 > near {
            continue;
        }
        if cell.code & LEAF == 0 {
            events.step();
            let treelet = lines.treelet(code_line(cell.code));
            // SAFETY: passed on to the caller.
            let mut within =
                unsafe { L::children(&place, treelet, &cell.along, near, &mut children) };
            let bottom = sp;
            while within != 0 {
                let c = within.trailing_zeros() as usize & 7;
                within &= within - 1;
                let along = [children.along[0][c], children.along[1][c], children.along[2][c]];
                let (distance2, code) = (children.distance2[c], treelet.child[c]);
                // SAFETY: passed on to the caller.
                unsafe { L::prefetch(lines.as_ptr().wrapping_add(code_offset(code))) };
                // The nearest on top.
                let mut at = sp;
                while at > bottom && stack[at - 1].distance2 < distance2 {
                    stack[at] = stack[at - 1];
                    at -= 1;
                }
                stack[at] = Entry { along, distance2, code };
                sp += 1;
            }
            continue;
        }
        events.leaf();
        let first = code_line(cell.code);
        let count = tree.block_count(cell.code) as usize;
        for line in (first..first + count * BLOCK_LINES).step_by(BLOCK_LINES) {
            events.block();
            let block = lines.block(line);
            // SAFETY: passed on to the caller.
            if unsafe { look::<L, E, G>(asked, block, line, farthest, &mut best, events) } {
                (farthest, near) = asked.limits(best.distance2);
            }
        }
    }
    best
}

/// Looks at the triangles of a block; true if one is nearer than the best so far.
///
/// # Safety
/// As for [`nearest`].
#[inline(always)]
unsafe fn look<L: PointSimd, E: Events, G: Triangles>(
    asked: &Asked<'_, G>,
    block: &Block,
    line: usize,
    farthest: f64,
    best: &mut Found,
    events: &mut E,
) -> bool {
    let (before, point) = (best.distance2, asked.placed);
    for first in (0..WIDTH).step_by(L::Doubles::LANES) {
        // SAFETY: passed on to the caller; `LANES` divides `WIDTH`.
        unsafe {
            let p = [
                L::Doubles::splat(point[0]),
                L::Doubles::splat(point[1]),
                L::Doubles::splat(point[2]),
            ];
            let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = &block.vertex;
            let a = widen::<L::Doubles>([ax, ay, az], first);
            let b = widen::<L::Doubles>([bx, by, bz], first);
            let c = widen::<L::Doubles>([cx, cy, cz], first);
            let near = box_distance2(p, [a, b, c]).le(L::Doubles::splat(farthest));
            if near == 0 {
                continue;
            }
            events.found(near, 0);
            let all = distance2(p, [a, b, c]);
            let reach = if G::ROUNDED { farthest } else { best.distance2 };
            let mut lanes = all.le(L::Doubles::splat(reach));
            if lanes == 0 {
                continue;
            }
            let mut row = [0.0; WIDTH];
            all.store(&mut row);
            while lanes != 0 {
                let i = lanes.trailing_zeros() as usize % WIDTH;
                let lane = first + i;
                let prim_id = block.id[lane % WIDTH] & ID_MASK;
                lanes &= lanes - 1;
                if G::ROUNDED && prim_id == best.prim_id {
                    continue;
                }
                // A rounded distance only says which triangles to measure.
                let distance2 = if G::ROUNDED {
                    asked.distance2(prim_id, || corners(block, lane))
                } else {
                    row[i]
                };
                let is_first = distance2 == best.distance2 && prim_id < best.prim_id;
                if distance2 < best.distance2 || is_first {
                    *best = Found { distance2, prim_id, at: place(line, lane) };
                }
            }
        }
    }
    best.distance2 < before
}

/// Eight or fewer corners from `first` on.
///
/// # Safety
/// As for [`nearest`].
#[inline(always)]
unsafe fn widen<D: Doubles>([x, y, z]: [&[f32; WIDTH]; 3], first: usize) -> [D; 3] {
    // SAFETY: passed on to the caller.
    unsafe { [D::widen(&x[first..]), D::widen(&y[first..]), D::widen(&z[first..])] }
}

/// The corners of one triangle.
#[inline(always)]
fn corners(block: &Block, lane: usize) -> [[f64; 3]; 3] {
    let mut corners = [[0.0; 3]; 3];
    for i in 0..3 {
        for a in 0..3 {
            corners[i][a] = f64::from(block.vertex[i][a][lane]);
        }
    }
    corners
}
