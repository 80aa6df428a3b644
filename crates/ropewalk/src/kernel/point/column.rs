//! The ray from a point along +z: which triangles it crosses.

#![allow(unsafe_code)]

use super::{BeamSimd, STACK};
use crate::kernel::beam::Vector;
use crate::kernel::events::Events;
use crate::point::{Crossing, Side, crossing, flushed};
use crate::wide::{BLOCK_LINES, Block, ID_MASK, LEAF, WIDTH, WideTree, code_line};

/// A point as `f32` numbers see it.
struct Column {
    point: [f64; 3],
    /// The largest numbers that are not above it.
    below: [f32; 3],
    /// The smallest numbers that are not below it.
    above: [f32; 3],
}

impl Column {
    fn new(point: [f64; 3]) -> Column {
        let near = point.map(|x| x as f32);
        let below = std::array::from_fn(|a| {
            if f64::from(near[a]) > point[a] { near[a].next_down() } else { near[a] }
        });
        let above = std::array::from_fn(|a| {
            if f64::from(near[a]) < point[a] { near[a].next_up() } else { near[a] }
        });
        Column { point, below, above }
    }
}

/// On which side of the surface each point is.
///
/// # Safety
/// The machine must have the features of `L`, and the caller must enable them.
#[inline(always)]
pub unsafe fn sides<L: BeamSimd, E: Events>(
    tree: &WideTree,
    points: &[[f64; 3]],
    sides: &mut [Side],
    events: &mut E,
) {
    let mut crossed = Vec::new();
    for (point, side) in points.iter().zip(sides) {
        let p = flushed(*point);
        let bounds = tree.bounds();
        let mut within = tree.root() != 0;
        for a in 0..3 {
            within &= f64::from(bounds.min[a]) <= p[a] && p[a] <= f64::from(bounds.max[a]);
        }
        *side = Side::Outside;
        if within {
            crossed.clear();
            // SAFETY: passed on to the caller.
            *side = unsafe { walk::<L, E>(tree, &Column::new(p), &mut crossed, events) };
        }
    }
}

/// On which side of the surface a point is, which must lie in the tree's box. `crossed` is scratch
/// memory.
///
/// # Safety
/// As for [`sides`].
#[inline(always)]
unsafe fn walk<L: BeamSimd, E: Events>(
    tree: &WideTree,
    column: &Column,
    crossed: &mut Vec<u32>,
    events: &mut E,
) -> Side {
    events.rays(1);
    let (lines, p) = (tree.lines(), column.point);
    let mut stack = [(0, 0); STACK];
    let (mut code, mut heap, mut sp) = (tree.root(), 0, 0);
    loop {
        // Down to a leaf; where the point is in a plane, or below it across z, both ways.
        while code & LEAF == 0 && code != 0 {
            let treelet = lines.treelet(code_line(code));
            events.step();
            while heap < 7 {
                let axis = treelet.axis(heap);
                let plane = treelet.plane[heap];
                let (lower, upper) = (p[axis] <= f64::from(plane), p[axis] >= f64::from(plane));
                let both = lower && (upper || axis == 2) && plane < f32::INFINITY;
                stack[sp] = (code, 2 * heap + 2);
                sp += usize::from(both);
                heap = 2 * heap + 1 + usize::from(!lower);
            }
            code = treelet.child[heap - 7];
            heap = 0;
        }
        if code != 0 {
            events.leaf();
            let first = code_line(code);
            let count = tree.block_count(code) as usize;
            for line in (first..first + count * BLOCK_LINES).step_by(BLOCK_LINES) {
                events.block();
                let block = lines.block(line);
                // SAFETY: passed on to the caller.
                let mut lanes = unsafe { meets::<L>(column, block) };
                if lanes != 0 {
                    events.found(lanes, 0);
                }
                while lanes != 0 {
                    let lane = lanes.trailing_zeros() as usize % WIDTH;
                    match crossing(p, &corners(block, lane)) {
                        Crossing::Passes => {}
                        Crossing::Crosses => crossed.push(block.id[lane] & ID_MASK),
                        Crossing::Starts => return Side::On,
                    }
                    lanes &= lanes - 1;
                }
            }
        }
        if sp == 0 {
            break;
        }
        sp -= 1;
        (code, heap) = stack[sp];
    }
    // A triangle in several leaves counts once.
    crossed.sort_unstable();
    crossed.dedup();
    if crossed.len() % 2 == 1 { Side::Inside } else { Side::Outside }
}

/// The lanes of the triangles whose boxes the column meets.
///
/// # Safety
/// As for [`sides`].
#[inline(always)]
unsafe fn meets<L: BeamSimd>(column: &Column, block: &Block) -> u32 {
    const { assert!(L::Triangles::LANES == WIDTH) };
    let mut lanes = (1 << WIDTH) - 1;
    for axis in 0..3 {
        // SAFETY: passed on to the caller; the rows have as many numbers as there are lanes.
        unsafe {
            let a = L::Triangles::load(&block.vertex[0][axis]);
            let b = L::Triangles::load(&block.vertex[1][axis]);
            let c = L::Triangles::load(&block.vertex[2][axis]);
            lanes &= L::Triangles::splat(column.above[axis]).le(a.max(b).max(c));
            if axis < 2 {
                lanes &= a.min(b).min(c).le(L::Triangles::splat(column.below[axis]));
            }
        }
    }
    lanes
}

fn corners(block: &Block, lane: usize) -> [[f32; 3]; 3] {
    let mut corners = [[0.0; 3]; 3];
    for i in 0..3 {
        for a in 0..3 {
            corners[i][a] = block.vertex[i][a][lane];
        }
    }
    corners
}
