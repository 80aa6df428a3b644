//! Whether a segment crosses a triangle, without rounding.
//!
//! Both ends are thought of as moved by the same infinitely small step: along x, one infinitely smaller
//! along y, and one smaller again along z (simulation of simplicity: Edelsbrunner and Mücke 1990). The
//! moved ends lie in no plane of a triangle and the moved segment meets no edge, so it either crosses the
//! inside of a triangle or does not come near it. The step is the same for all segments: the moved
//! segments of a particle join, so nothing is crossed twice or not at all where they do.

use crate::point::expansion::{Expansion, sign};
use crate::point::side::{TURN_ERROR, side_of_plane, turn};

/// A crossing of a segment and a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossed {
    /// The share of the segment before it, 0 to 1; rounded.
    pub share: f64,
    /// The triangle.
    pub prim_id: u32,
    /// True if the segment goes from the front to the back.
    pub entering: bool,
}

/// Where the segment from `p` to `q` crosses a triangle that is not degenerate: the share of the segment
/// before that, and whether it goes from the front to the back.
///
/// No product of three coordinates may overflow, and neither it nor its rounding errors may underflow.
#[inline]
pub fn crossing(p: [f64; 3], q: [f64; 3], triangle: &[[f64; 3]; 3]) -> Option<(f64, bool)> {
    let apart = |i: usize| {
        let [a, b, c] = triangle.map(|v| v[i]);
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        p[i].max(q[i]) < low || p[i].min(q[i]) > high
    };
    if apart(0) || apart(1) || apart(2) {
        return None;
    }
    let &[a, b, c] = triangle;
    let (from, to) = (side(a, b, c, p), side(a, b, c, q));
    if from == to {
        return None;
    }
    // The moved ends lie on both sides, so no edge is parallel to the segment and no turn is 0.
    let turns = moved_turn(p, q, a, b);
    if moved_turn(p, q, b, c) != turns || moved_turn(p, q, c, a) != turns {
        return None;
    }
    let (before, behind) = (height(a, b, c, p).abs(), height(a, b, c, q).abs());
    let whole = before + behind;
    let share = if whole > 0.0 { before / whole } else { 0.0 };
    Some((share, from > to))
}

/// The side of a triangle's plane on which the moved point lies: 1 in front, -1 behind.
fn side(a: [f64; 3], b: [f64; 3], c: [f64; 3], p: [f64; 3]) -> i32 {
    let side = side_of_plane(a, b, c, p);
    if side != 0 {
        return side;
    }
    // What a step along each axis does: the signs of the normal.
    let normal = [[1, 2], [2, 0], [0, 1]].map(|axes| turn(axes, a, b, c));
    normal.into_iter().find(|&n| n != 0).unwrap_or(0)
}

/// The side on which the moved line from `p` to `q` passes the line from `a` to `b`.
fn moved_turn(p: [f64; 3], q: [f64; 3], a: [f64; 3], b: [f64; 3]) -> i32 {
    let side = side_of_plane(p, q, a, b);
    if side != 0 {
        return side;
    }
    // The volume of p, q, a, b changes by the product of the step and `(q - p) x (b - a)`.
    let steps = [[1, 2], [2, 0], [0, 1]].map(|axes| cross(axes, [p, q], [a, b]));
    steps.into_iter().find(|&n| n != 0).unwrap_or(0)
}

/// The sign of a component of the cross product of two differences.
fn cross([x, y]: [usize; 2], [p, q]: [[f64; 3]; 2], [a, b]: [[f64; 3]; 2]) -> i32 {
    let m = (q[x] - p[x]) * (b[y] - a[y]);
    let n = (q[y] - p[y]) * (b[x] - a[x]);
    let (area, size) = (m - n, m.abs() + n.abs());
    if area.abs() > TURN_ERROR * size {
        return sign(area);
    }
    let mut sum = Expansion::<16>::new();
    for (from, to, factor) in [(p, a, 1.0), (p, b, -1.0), (q, a, -1.0), (q, b, 1.0)] {
        sum.add_product(factor * from[x], to[y]);
        sum.add_product(-factor * from[y], to[x]);
    }
    sum.sign()
}

/// Distance from a triangle's plane in some unit, rounded.
fn height(a: [f64; 3], b: [f64; 3], c: [f64; 3], p: [f64; 3]) -> f64 {
    let (mut sum, u, v) = (0.0, [0, 1, 2].map(|i| b[i] - a[i]), [0, 1, 2].map(|i| c[i] - a[i]));
    for i in 0..3 {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        sum += (u[j] * v[k] - u[k] * v[j]) * (p[i] - a[i]);
    }
    sum
}
