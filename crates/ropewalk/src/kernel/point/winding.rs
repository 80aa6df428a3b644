//! Winding numbers by moments: cells far away count as a whole, the triangles of those near one by one.
//!
//! Portable code that is compiled for each level, without fused operations: the same bits everywhere.

#![allow(unsafe_code)]

use crate::point::{
    Moments, NOTHING, Triangles, WindingMoments, half_angle, half_solid_angle, is_near, tangent,
};
use crate::wide::{BLOCK_LINES, Block, ID_MASK, LEAF, WIDTH, WideTree, code_line};
use std::f64::consts::TAU;

/// A winding number and how far it may be from the sum over all triangles.
#[derive(Clone, Copy, Debug)]
pub struct Winding {
    /// The number; NaN for a point that is none.
    pub number: f64,
    /// At most so far from the exact sum.
    pub error: f64,
}

/// A share of the error for a part of the tree, as in [`Moments::child`].
#[derive(Clone, Copy)]
pub struct Part {
    code: u32,
    /// What it may be off by, times 4 pi.
    allowed: f64,
}

/// Cells nearer than this many radii are opened in any case.
const NEAREST: f64 = 1.25;

/// What the bound of a cell that must be opened counts when the allowed error is shared out, times 4 pi.
const OPEN: f64 = 1.0;

/// Rounding of the moments to `f32`, of each of them.
const MOMENT: f64 = 1.0 / (1 << 24) as f64;

/// Rounding of a solid angle of a triangle in a far cell, which is off by some ten roundings of 1 whatever its
/// size, and of a sum of them in shares of all sizes, a triangle: three times over.
const ROUNDING: f64 = 1.0 / (1u64 << 48) as f64;

/// The winding number of each point, off by `accuracy` at most where that is above rounding.
#[inline(always)]
pub fn winding<G: Triangles>(
    scene: (&WideTree, &G),
    moments: &WindingMoments,
    points: &[[f64; 3]],
    accuracy: f64,
    found: &mut [Winding],
) {
    let mut stack = Vec::new();
    for (point, out) in points.iter().zip(found) {
        *out = if is_near(point) && is_near(&scene.1.scaled(*point)) {
            walk(scene, moments, *point, accuracy, &mut stack)
        } else {
            Winding { number: f64::NAN, error: f64::NAN }
        };
    }
}

#[inline(always)]
fn walk<G: Triangles>(
    (tree, geometry): (&WideTree, &G),
    moments: &WindingMoments,
    point: [f64; 3],
    accuracy: f64,
    stack: &mut Vec<Part>,
) -> Winding {
    let (placed, scaled) = (geometry.placed(point), geometry.scaled(point));
    // `far` times 4 pi, `near` times 2 pi; `size` of all that is summed, times 4 pi.
    let (mut far, mut near, mut error, mut size) = (0.0, 0.0, 0.0, 0.0);
    // What parts were allowed and did not need.
    let mut left = 0.0;
    stack.clear();
    stack.push(Part { code: moments.root, allowed: 2.0 * TAU * accuracy });
    while let Some(part) = stack.pop() {
        if part.code == NOTHING {
            continue;
        }
        if part.code & LEAF != 0 {
            let leaf = &moments.leaves[(part.code & !LEAF) as usize];
            let first = code_line(leaf.code);
            for i in 0..tree.block_count(leaf.code) as usize {
                let lanes = moments.lanes[leaf.first as usize + i];
                let block = tree.lines().block(first + i * BLOCK_LINES);
                let (sum, absolute) = if G::ROUNDED {
                    scaled_angles(geometry, block, lanes, scaled)
                } else {
                    angles(block, lanes, placed)
                };
                near += sum;
                size += 2.0 * absolute;
            }
            left += part.allowed;
            continue;
        }
        let cell = &moments.treelets[part.code as usize];
        let seen = see(cell, placed);
        let (mut bounds, mut roots) = (0.0, 0.0);
        for c in 0..WIDTH {
            bounds += seen.bound[c];
            roots += seen.root[c];
        }
        let allowed = part.allowed + left;
        // Everything at once, or what takes less than its share, by roots: few opened cells for the error.
        let share = if bounds <= allowed { f64::INFINITY } else { allowed / roots };
        let (mut taken, mut opened, mut lanes) = (0.0, 0.0, 0u32);
        for c in 0..WIDTH {
            let takes = (seen.size[c] < f64::INFINITY) & (seen.root[c] <= share);
            far += if takes { seen.number[c] } else { 0.0 };
            size += if takes { seen.size[c] } else { 0.0 };
            taken += if takes { seen.bound[c] } else { 0.0 };
            opened += if takes { 0.0 } else { seen.root[c] };
            lanes |= u32::from(!takes) << c;
        }
        error += taken;
        left = allowed - taken;
        if lanes != 0 {
            let each = left.max(0.0) / opened;
            left = 0.0;
            while lanes != 0 {
                let c = lanes.trailing_zeros() as usize % WIDTH;
                lanes &= lanes - 1;
                stack.push(Part { code: cell.child[c], allowed: each * seen.root[c] });
            }
        }
    }
    let rounding = ROUNDING * (size + 1.0) * (moments.triangles as f64 + 100.0);
    Winding {
        number: near / TAU + far / (2.0 * TAU) + 0.0,
        error: (error + rounding) / (2.0 * TAU),
    }
}

/// Numbers of the children of a treelet.
type Row = [f64; WIDTH];

/// The children of a treelet as seen from a point, times 4 pi.
struct Seen {
    /// The sum of the series.
    number: Row,
    /// What it may be off by; [`OPEN`] where it cannot be used, 0 where there is nothing.
    bound: Row,
    /// The root of that.
    root: Row,
    /// At least the sum of the sizes of all solid angles; infinite where the series cannot be used.
    size: Row,
}

#[inline(always)]
fn see(cell: &Moments, [px, py, pz]: [f64; 3]) -> Seen {
    let zero = [0.0; WIDTH];
    let mut seen = Seen { number: zero, bound: zero, root: zero, size: zero };
    // One plain loop without branches, which compilers turn into vectors.
    for c in 0..WIDTH {
        let (dx, dy, dz) = (
            f64::from(cell.center[0][c]) - px,
            f64::from(cell.center[1][c]) - py,
            f64::from(cell.center[2][c]) - pz,
        );
        let (radius, area) = (f64::from(cell.radius[c]), f64::from(cell.area[c]));
        let distance2 = dx * dx + dy * dy + dz * dz;
        // Nearer than that nothing here means anything, but is finite.
        let is_far = distance2 > NEAREST * NEAREST * (radius * radius);
        let inverse = 1.0 / (if is_far { distance2 } else { 4.0 * (radius * radius) }).sqrt();
        let (x, y, z) = (dx * inverse, dy * inverse, dz * inverse);
        let rho = radius * inverse;
        let (rho2, xx, yy, zz) = (rho * rho, x * x, y * y, z * z);
        let dipole = f64::from(cell.dipole[0][c]) * x
            + f64::from(cell.dipole[1][c]) * y
            + f64::from(cell.dipole[2][c]) * z;
        let second = f64::from(cell.second[0][c]) * (xx - zz)
            + f64::from(cell.second[1][c]) * (yy - zz)
            + 2.0
                * (f64::from(cell.second[2][c]) * (x * y)
                    + f64::from(cell.second[3][c]) * (x * z)
                    + f64::from(cell.second[4][c]) * (y * z));
        let cubic = x
            * (f64::from(cell.cubic[0][c]) * (xx - 3.0 * zz)
                + f64::from(cell.cubic[1][c]) * (3.0 * (yy - zz)))
            + y * (f64::from(cell.cubic[3][c]) * (yy - 3.0 * zz)
                + f64::from(cell.cubic[2][c]) * (3.0 * (xx - zz)))
            + z * (f64::from(cell.cubic[4][c]) * (3.0 * xx - zz)
                + f64::from(cell.cubic[5][c]) * (3.0 * yy - zz)
                + f64::from(cell.cubic[6][c]) * (6.0 * (x * y)));
        let near = 1.0 / (1.0 - rho);
        let near2 = near * near;
        let rest = rho2 * rho2 * rho * f64::from(cell.third[c]) * (4.0 - 3.0 * rho) * near2;
        // Entries of M and S are at most 4/3 and 2 areas; the polynomials beside them sum up to 4 and 8.
        let rounded = MOMENT * rho2 * area * (2.0 + 16.0 * rho + 120.0 * rho2);
        let bound = if is_far { rest + rounded } else { OPEN };
        let bound = if area > 0.0 { bound } else { 0.0 };
        seen.number[c] = rho2 * (dipole - rho * (3.0 * second - 7.5 * rho * cubic));
        seen.bound[c] = bound;
        seen.root[c] = bound.sqrt();
        seen.size[c] = if is_far { rho2 * area * near2 } else { f64::INFINITY };
    }
    seen
}

/// The same as [`angles`] of the triangles that those of the block stand for.
#[inline(always)]
fn scaled_angles<G: Triangles>(
    geometry: &G,
    block: &Block,
    lanes: u8,
    point: [f64; 3],
) -> (f64, f64) {
    let (mut sum, mut size) = (0.0, 0.0);
    let mut rest = lanes;
    while rest != 0 {
        let lane = rest.trailing_zeros() as usize % WIDTH;
        rest &= rest - 1;
        if let Some(corners) = geometry.corners(block.id[lane] & ID_MASK) {
            let angle = half_solid_angle(point, corners);
            sum += angle;
            size += angle.abs();
        }
    }
    (sum, size)
}

/// The sum of half of the solid angles in some lanes of a block, and of their sizes.
#[inline(always)]
fn angles(block: &Block, lanes: u8, point: [f64; 3]) -> (f64, f64) {
    let (mut sines, mut cosines) = ([0.0; WIDTH], [0.0; WIDTH]);
    let [px, py, pz] = point;
    let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = &block.vertex;
    for i in 0..WIDTH {
        let a = [f64::from(ax[i]) - px, f64::from(ay[i]) - py, f64::from(az[i]) - pz];
        let b = [f64::from(bx[i]) - px, f64::from(by[i]) - py, f64::from(bz[i]) - pz];
        let c = [f64::from(cx[i]) - px, f64::from(cy[i]) - py, f64::from(cz[i]) - pz];
        (sines[i], cosines[i]) = tangent(a, b, c);
    }
    let (mut sum, mut size) = (0.0, 0.0);
    let mut rest = lanes;
    while rest != 0 {
        let lane = rest.trailing_zeros() as usize % WIDTH;
        rest &= rest - 1;
        let angle = half_angle((sines[lane], cosines[lane]));
        sum += angle;
        size += angle.abs();
    }
    (sum, size)
}
