//! The nearest triangle of a point.

#![allow(unsafe_code)]

use super::triangle::{box_distance2, distance2};
use super::{BeamSimd, STACK};
use crate::kernel::beam::Doubles;
use crate::kernel::events::Events;
use crate::kernel::exact::{At, place};
use crate::point::is_near;
use crate::wide::{BLOCK_LINES, Block, ID_MASK, LEAF, WIDTH, WideTree, code_line};

/// The triangle nearest to a point.
#[derive(Clone, Copy, Debug)]
pub struct Found {
    /// Its squared distance; infinite without a triangle, NaN for a point that is none.
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
/// distance and the scene's diagonal. A distance from a triangle is off by less than a quarter of
/// 2^-46 of them (docs/numerics.md).
const SLACK: f64 = 1.0 / (1u64 << 44) as f64;

/// The largest squared distance of a cell that may hold a triangle as near as the best one.
#[inline(always)]
fn limit(distance2: f64, diagonal: f64) -> f64 {
    let distance = distance2.sqrt();
    let far = distance + SLACK * (distance + diagonal);
    far * far
}

/// A cell to be visited: what is below a plane of a treelet.
#[derive(Clone, Copy)]
struct Entry {
    /// Code of the treelet or leaf.
    code: u32,
    /// The plane in heap order; 7 and more are the children.
    heap: u32,
    /// Squared distance of the cell.
    distance2: f64,
    /// Distance of the cell along each axis, with any sign.
    offset: [f64; 4],
}

/// The nearest triangle of each point.
///
/// # Safety
/// The machine must have the features of `L`, and the caller must enable them.
#[inline(always)]
pub unsafe fn nearest<L: BeamSimd, E: Events>(
    tree: &WideTree,
    points: &[[f64; 3]],
    found: &mut [Found],
    events: &mut E,
) {
    let diagonal = tree.bounds().diagonal();
    let mut stack = [Entry { code: 0, heap: 0, distance2: 0.0, offset: [0.0; 4] }; STACK];
    let mut seed = Found::NOTHING;
    for (point, out) in points.iter().zip(found) {
        if !is_near(point) {
            *out = Found::INVALID;
            continue;
        }
        // SAFETY: passed on to the caller.
        *out = unsafe { walk::<L, E>(tree, *point, diagonal, seed, &mut stack, events) };
        seed = *out;
    }
}

/// The nearest triangle of one point. `seed` may hold a triangle that is likely to be near.
///
/// # Safety
/// As for [`nearest`].
#[inline(always)]
unsafe fn walk<L: BeamSimd, E: Events>(
    tree: &WideTree,
    point: [f64; 3],
    diagonal: f64,
    seed: Found,
    stack: &mut [Entry; STACK],
    events: &mut E,
) -> Found {
    let mut best = Found::NOTHING;
    if tree.root() == 0 {
        return best;
    }
    events.ray();
    let lines = tree.lines();
    let p = [point[0], point[1], point[2], 0.0];
    let mut farthest = f64::MAX;
    if seed.at != NONE {
        let (block, lane) = (lines.block(seed.at as usize / WIDTH), seed.at as usize % WIDTH);
        // SAFETY: portable code.
        let distance2 = unsafe { distance2(point, corners(block, lane)) };
        best = Found { distance2, ..seed };
        farthest = limit(distance2, diagonal);
    }
    let mut offset = [0.0; 4];
    for a in 0..3 {
        let (low, high) = (f64::from(tree.bounds().min[a]), f64::from(tree.bounds().max[a]));
        offset[a] = (low - p[a]).max(0.0).max(p[a] - high);
    }
    let mut cell = Entry { code: tree.root(), heap: 0, distance2: square(&offset), offset };
    let mut sp = 0;
    loop {
        // Down to a leaf, by the near side of each plane.
        while cell.code & LEAF == 0 && cell.code != 0 {
            let treelet = lines.treelet(code_line(cell.code));
            events.step();
            while cell.heap < 7 {
                let axis = (treelet.axes >> (2 * cell.heap)) as usize & 3;
                let gap = f64::from(treelet.plane[cell.heap as usize]) - p[axis];
                let upper = u32::from(gap <= 0.0);
                let mut far = Entry { heap: 2 * cell.heap + 2 - upper, ..cell };
                far.offset[axis] = gap;
                far.distance2 = square(&far.offset);
                stack[sp] = far;
                sp += usize::from(far.distance2 <= farthest);
                cell.heap = 2 * cell.heap + 1 + upper;
            }
            cell.code = treelet.child[cell.heap as usize - 7];
            cell.heap = 0;
        }
        if cell.code != 0 {
            events.leaf();
            let first = code_line(cell.code);
            let count = tree.block_count(cell.code) as usize;
            for line in (first..first + count * BLOCK_LINES).step_by(BLOCK_LINES) {
                events.block();
                // SAFETY: passed on to the caller.
                let better = unsafe {
                    look::<L, E>(point, lines.block(line), line, farthest, &mut best, events)
                };
                if better {
                    farthest = limit(best.distance2, diagonal);
                }
            }
        }
        loop {
            if sp == 0 {
                return best;
            }
            sp -= 1;
            if stack[sp].distance2 <= farthest {
                break;
            }
        }
        cell = stack[sp];
    }
}

/// Looks at the triangles of a block; true if one is nearer than the best so far.
///
/// # Safety
/// As for [`nearest`].
#[inline(always)]
unsafe fn look<L: BeamSimd, E: Events>(
    point: [f64; 3],
    block: &Block,
    line: usize,
    farthest: f64,
    best: &mut Found,
    events: &mut E,
) -> bool {
    let before = best.distance2;
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
            let mut lanes = all.le(L::Doubles::splat(best.distance2));
            if lanes == 0 {
                continue;
            }
            let mut row = [0.0; WIDTH];
            all.store(&mut row);
            while lanes != 0 {
                let i = lanes.trailing_zeros() as usize % WIDTH;
                let (lane, distance2) = (first + i, row[i]);
                let prim_id = block.id[lane % WIDTH] & ID_MASK;
                let is_first = distance2 == best.distance2 && prim_id < best.prim_id;
                if distance2 < best.distance2 || is_first {
                    *best = Found { distance2, prim_id, at: place(line, lane) };
                }
                lanes &= lanes - 1;
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

#[inline(always)]
fn square(offset: &[f64; 4]) -> f64 {
    offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2]
}
