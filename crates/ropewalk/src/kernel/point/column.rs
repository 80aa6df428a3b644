//! The ray from a point along +z: which triangles it crosses.

#![allow(unsafe_code)]

use super::{BeamSimd, STACK};
use crate::kernel::beam::Vector;
use crate::kernel::events::Events;
use crate::point::{Crossing, ROUNDING, Side, Triangles, crossing, flushed};
use crate::wide::{BLOCK_LINES, Block, ID_MASK, LEAF, WIDTH, WideTree, code_line};

/// A point as `f32` numbers see it.
struct Column<'a, G> {
    geometry: &'a G,
    /// In the numbers of the tree.
    placed: [f64; 3],
    /// In those in which crossings are decided.
    scaled: [f64; 3],
    /// The largest numbers that are not above the placed point or what rounding may make of it.
    below: [f32; 3],
    /// The smallest numbers that are not below it.
    above: [f32; 3],
}

impl<'a, G: Triangles> Column<'a, G> {
    fn new(geometry: &'a G, placed: [f64; 3], scaled: [f64; 3]) -> Self {
        let rounding = if G::ROUNDED { ROUNDING } else { 0.0 };
        let upper = placed.map(|x| x + rounding);
        let lower = placed.map(|x| x - rounding);
        let down = |x: f64| if f64::from(x as f32) > x { (x as f32).next_down() } else { x as f32 };
        let up = |x: f64| if f64::from(x as f32) < x { (x as f32).next_up() } else { x as f32 };
        // A triangle's box holds the point if it is not above `below` and not below `above`.
        Column { geometry, placed, scaled, below: upper.map(down), above: lower.map(up) }
    }
}

/// On which side of the surface each point is.
///
/// # Safety
/// The machine must have the features of `L`, and the caller must enable them.
#[inline(always)]
pub unsafe fn sides<L: BeamSimd, E: Events, G: Triangles>(
    (tree, geometry): (&WideTree, &G),
    points: &[[f64; 3]],
    sides: &mut [Side],
    events: &mut E,
) {
    let mut crossed = Vec::new();
    let [low, high] = geometry.extent();
    for (point, side) in points.iter().zip(sides) {
        let scaled = flushed(geometry.scaled(*point));
        let mut within = tree.root() != 0;
        for a in 0..3 {
            within &= low[a] <= scaled[a] && scaled[a] <= high[a];
        }
        *side = Side::Outside;
        if within {
            crossed.clear();
            let placed = flushed(geometry.placed(*point));
            let column = Column::new(geometry, placed, scaled);
            // SAFETY: passed on to the caller.
            *side = unsafe { walk::<L, E, G>(tree, &column, &mut crossed, events) };
        }
    }
}

/// On which side of the surface a point is, which must lie in the tree's box. `crossed` is scratch
/// memory.
///
/// # Safety
/// As for [`sides`].
#[inline(always)]
unsafe fn walk<L: BeamSimd, E: Events, G: Triangles>(
    tree: &WideTree,
    column: &Column<'_, G>,
    crossed: &mut Vec<u32>,
    events: &mut E,
) -> Side {
    events.rays(1);
    let (lines, p) = (tree.lines(), column.placed);
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
                let mut lanes = unsafe { meets::<L>(column.below, column.above, block) };
                if lanes != 0 {
                    events.found(lanes, 0);
                }
                while lanes != 0 {
                    let lane = lanes.trailing_zeros() as usize % WIDTH;
                    let prim_id = block.id[lane] & ID_MASK;
                    let corners = if G::ROUNDED {
                        column.geometry.corners(prim_id)
                    } else {
                        Some(corners(block, lane))
                    };
                    match corners.map_or(Crossing::Passes, |c| crossing(column.scaled, c)) {
                        Crossing::Passes => {}
                        Crossing::Crosses => crossed.push(prim_id),
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

/// The lanes of the triangles whose boxes the column between `below` and `above` meets.
///
/// # Safety
/// As for [`sides`].
#[inline(always)]
unsafe fn meets<L: BeamSimd>(below: [f32; 3], above: [f32; 3], block: &Block) -> u32 {
    const { assert!(L::Triangles::LANES == WIDTH) };
    let mut lanes = (1 << WIDTH) - 1;
    for axis in 0..3 {
        // SAFETY: passed on to the caller; the rows have as many numbers as there are lanes.
        unsafe {
            let a = L::Triangles::load(&block.vertex[0][axis]);
            let b = L::Triangles::load(&block.vertex[1][axis]);
            let c = L::Triangles::load(&block.vertex[2][axis]);
            lanes &= L::Triangles::splat(above[axis]).le(a.max(b).max(c));
            if axis < 2 {
                lanes &= a.min(b).min(c).le(L::Triangles::splat(below[axis]));
            }
        }
    }
    lanes
}

fn corners(block: &Block, lane: usize) -> [[f64; 3]; 3] {
    let mut corners = [[0.0; 3]; 3];
    for i in 0..3 {
        for a in 0..3 {
            corners[i][a] = f64::from(block.vertex[i][a][lane]);
        }
    }
    corners
}
