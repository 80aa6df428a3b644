//! Inside, outside or on the surface: crossings of the ray from a point along +z, without rounding.
//!
//! The ray is thought of as moved by an infinitely small step along x and an infinitely smaller one
//! along y, so that it meets no edge and no vertex (simulation of simplicity: Edelsbrunner and Mücke
//! 1990). Each sign is computed in `f64` and again without rounding where it is in doubt, so what is
//! counted is what geometry says, for any point and any triangle.

use super::expansion::{Expansion, sign};

/// Where a point is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Side {
    /// The ray along +z crosses an even number of triangles.
    Outside,
    /// The point lies on a triangle, its edges and vertices included.
    On,
    /// The ray along +z crosses an odd number of triangles.
    Inside,
}

/// What the ray from a point along +z does with a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Crossing {
    /// It passes.
    Passes,
    /// It crosses the triangle.
    Crosses,
    /// It starts on the triangle.
    Starts,
}

/// Coordinates nearer to zero than this count as zero, so that no product underflows.
const TINY: f64 = 1e-100;

/// A point with tiny coordinates set to zero.
#[inline(always)]
pub fn flushed(point: [f64; 3]) -> [f64; 3] {
    point.map(|x| if x.abs() < TINY { 0.0 } else { x })
}

/// What the ray from `p`, which must be [`flushed`], along +z does with a triangle that is not
/// degenerate.
pub fn crossing(p: [f64; 3], [a, b, c]: [[f64; 3]; 3]) -> Crossing {
    let low: [f64; 3] = std::array::from_fn(|i| a[i].min(b[i]).min(c[i]));
    let high: [f64; 3] = std::array::from_fn(|i| a[i].max(b[i]).max(c[i]));
    let within = |i: usize| low[i] <= p[i] && p[i] <= high[i];
    if !within(0) || !within(1) || p[2] > high[2] {
        return Crossing::Passes;
    }
    let side = if p[2] >= low[2] {
        let side = side_of_plane(a, b, c, p);
        if side == 0 && (0..3).all(|axis| holds(axis, a, b, c, p)) {
            return Crossing::Starts;
        }
        Some(side)
    } else {
        None
    };
    // The sides of the moved ray, which are zero only where an edge is parallel to it.
    let turns = moved_turn(a, b, p);
    if turns == 0 || moved_turn(b, c, p) != turns || moved_turn(c, a, p) != turns {
        return Crossing::Passes;
    }
    if side.is_none_or(|side| side == -turns) { Crossing::Crosses } else { Crossing::Passes }
}

/// Whether a point of the triangle's plane lies in the triangle as seen along an axis; true where the
/// triangle is seen edge-on.
fn holds(axis: usize, a: [f64; 3], b: [f64; 3], c: [f64; 3], p: [f64; 3]) -> bool {
    let axes = [(axis + 1) % 3, (axis + 2) % 3];
    let turns = [turn(axes, a, b, p), turn(axes, b, c, p), turn(axes, c, a, p)];
    !(turns.contains(&1) && turns.contains(&-1))
}

/// A difference of two products is off by less than this share of the sum of their sizes: four
/// roundings of 2^-53 each, twice over.
pub const TURN_ERROR: f64 = 1.0 / (1u64 << 50) as f64;

/// The sign of the area of `a`, `b`, `p` as seen along the axis that is not in `axes`.
pub fn turn([x, y]: [usize; 2], a: [f64; 3], b: [f64; 3], p: [f64; 3]) -> i32 {
    let m = (b[x] - a[x]) * (p[y] - a[y]);
    let n = (b[y] - a[y]) * (p[x] - a[x]);
    let (area, size) = (m - n, m.abs() + n.abs());
    if area.abs() > TURN_ERROR * size { sign(area) } else { exact_turn([x, y], a, b, p) }
}

#[cold]
fn exact_turn([x, y]: [usize; 2], a: [f64; 3], b: [f64; 3], p: [f64; 3]) -> i32 {
    let mut area = Expansion::<12>::new();
    area.add_product(a[x], b[y]);
    area.add_product(-a[y], b[x]);
    area.add_product(b[x], p[y]);
    area.add_product(-a[x], p[y]);
    area.add_product(-b[y], p[x]);
    area.add_product(a[y], p[x]);
    area.sign()
}

/// The same seen along z for the moved ray through `p`; zero only if `a` and `b` are the same from
/// there.
fn moved_turn(a: [f64; 3], b: [f64; 3], p: [f64; 3]) -> i32 {
    let turns = turn([0, 1], a, b, p);
    if turns != 0 {
        return turns;
    }
    // What a step along x does, then one along y.
    if a[1] == b[1] { sign(b[0] - a[0]) } else { sign(a[1] - b[1]) }
}

/// A scalar product with a normal is off by less than this share of the sum of the sizes of its
/// products: some ten roundings, four times over.
const PLANE_ERROR: f64 = 1.0 / (1u64 << 47) as f64;

/// The side of the plane of a triangle on which a point lies: 1 in front.
pub fn side_of_plane(a: [f64; 3], b: [f64; 3], c: [f64; 3], p: [f64; 3]) -> i32 {
    let (mut sum, mut size) = (0.0, 0.0);
    for i in 0..3 {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let m = (b[j] - a[j]) * (c[k] - a[k]);
        let n = (b[k] - a[k]) * (c[j] - a[j]);
        let offset = p[i] - a[i];
        sum += (m - n) * offset;
        size += (m.abs() + n.abs()) * offset.abs();
    }
    if sum.abs() > PLANE_ERROR * size { sign(sum) } else { exact_side_of_plane([a, b, c], p) }
}

/// The normal is `a x b + b x c + c x a`, and its product with `a` is `(b x c) a`.
#[cold]
fn exact_side_of_plane(v: [[f64; 3]; 3], p: [f64; 3]) -> i32 {
    let mut sum = Expansion::<96>::new();
    for i in 0..3 {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        for e in 0..3 {
            let (from, to) = (v[e], v[(e + 1) % 3]);
            for (x, y) in [(from[j], to[k]), (-from[k], to[j])] {
                sum.add_product_of_three(x, y, p[i]);
                if e == 1 {
                    sum.add_product_of_three(-x, y, v[0][i]);
                }
            }
        }
    }
    sum.sign()
}
