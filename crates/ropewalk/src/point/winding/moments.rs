//! Moments of the triangles below each treelet of a wide tree.
//!
//! Seen from far enough, the solid angle of a set of triangles is the Taylor series of the field of a
//! dipole about a point among them (Barill, Dickson, Schmidt, Levin and Jacobson 2018). With `d` from the
//! point asked for to the centre, `R = |d|`, `r` the radius about the centre, `rho = r / R < 1`, area vectors
//! `n dA` and `x` from the centre:
//!
//! ```text
//! 4 pi w = int n.(d + x) / |d + x|^3 dA
//!        = N.d / R^3  -  3 d.M.d / R^5  +  7.5 S(d, d, d) / R^7  +  rest
//! N = int n dA,   M = int n (x) x dA,   S = int n (x) x (x) x dA    symmetric and without traces
//! ```
//! (traces drop out, since the field has no divergence). **The rest**: the term of degree `k` is the gradient
//! of the solid harmonic `|x|^(k+1) P_(k+1)(cos) / R^(k+2)`, whose length is at most `(k + 1) |x|^k / R^(k+2)`,
//! since `(dP/dtheta)^2 + n^2 P^2 <= n^2` for `P = P_n(cos theta)`, a trigonometric polynomial of degree `n` and size 1
//! (the inequality of Bernstein and Szegő). Summed from degree 3 on,
//!
//! ```text
//! |rest| <= int |x|^3 dA (4 - 3 rho) / (1 - rho)^2 / R^5
//! ```
//! Deviation: the paper opens a cell by its distance over its radius alone and bounds nothing.

use crate::point::Triangles;
use crate::wide::{ID_MASK, LEAF, LEVELS, WideTree, code_line};
use rayon::prelude::*;

/// Children of a treelet.
pub(crate) const CHILDREN: usize = 1 << LEVELS;

/// A child without triangles of its own.
pub(crate) const NOTHING: u32 = u32::MAX;

/// What hangs below a treelet, child by child; numbers without unit, lengths over the child's radius.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moments {
    /// About which moments are taken.
    pub center: [[f32; CHILDREN]; 3],
    /// A radius about it that holds all triangles; at least `f32::MIN_POSITIVE`.
    pub radius: [f32; CHILDREN],
    /// At least the area.
    pub area: [f32; CHILDREN],
    /// At least the integral of the cube of the distance from the centre.
    pub third: [f32; CHILDREN],
    /// `N`.
    pub dipole: [[f32; CHILDREN]; 3],
    /// `M`: xx, yy, xy, xz, yz; zz follows from the trace.
    pub second: [[f32; CHILDREN]; 5],
    /// `S`: xxx, xyy, xxy, yyy, xxz, yyz, xyz; the others follow from the traces.
    pub cubic: [[f32; CHILDREN]; 7],
    /// What to look at instead: [`NOTHING`], another of these, or [`LEAF`] and a leaf.
    pub child: [u32; CHILDREN],
}

/// A leaf of the wide tree, and its triangles that no leaf before it has.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Child {
    /// Code in the wide tree.
    pub code: u32,
    /// Where the masks of its blocks begin.
    pub first: u32,
}

/// Moments for the winding numbers of many points; of one tree. About as large as half of the tree.
#[derive(Debug)]
pub struct WindingMoments {
    pub(crate) treelets: Vec<Moments>,
    pub(crate) leaves: Vec<Child>,
    /// For each block of those leaves, in turn, the lanes that count there: each triangle once.
    pub(crate) lanes: Vec<u8>,
    /// [`NOTHING`], a treelet's moments or a leaf, as [`Moments::child`].
    pub(crate) root: u32,
    /// Triangles that count.
    pub(crate) triangles: usize,
    tree: (u32, usize, usize),
}

impl WindingMoments {
    /// Takes the moments of a tree of triangles in `O(N log N)`; on the current rayon pool if `parallel`.
    pub(crate) fn new<G: Triangles>(
        tree: &WideTree,
        geometry: &G,
        parallel: bool,
    ) -> WindingMoments {
        let mut plan = Plan {
            tree,
            seen: vec![false; geometry.count()],
            order: Vec::new(),
            ranges: Vec::new(),
            children: Vec::new(),
            leaves: Vec::new(),
            lanes: Vec::new(),
        };
        let root = plan.visit(tree.root());
        let Plan { order, ranges, children, leaves, lanes, .. } = plan;
        let take = |(ranges, child): (&[(u32, u32); CHILDREN], [u32; CHILDREN])| {
            let mut moments = Moments { child, ..Moments::EMPTY };
            for (c, &(start, end)) in ranges.iter().enumerate() {
                if start < end {
                    moments.take(c, geometry, &order[start as usize..end as usize]);
                }
            }
            moments
        };
        let treelets = if parallel {
            ranges.par_iter().zip(children).map(take).collect()
        } else {
            ranges.iter().zip(children).map(take).collect()
        };
        let triangles = order.len();
        WindingMoments { treelets, leaves, lanes, root, triangles, tree: mark(tree) }
    }

    /// True if they were taken of a tree of that form; of another one they mean nothing.
    pub fn fits(&self, tree: &WideTree) -> bool {
        self.tree == mark(tree)
    }

    /// Bytes of memory.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.treelets[..]) + size_of_val(&self.leaves[..]) + self.lanes.len()
    }
}

fn mark(tree: &WideTree) -> (u32, usize, usize) {
    (tree.root(), tree.treelets(), tree.lines().len())
}

/// Hands each triangle to the first leaf that refers to it.
struct Plan<'a> {
    tree: &'a WideTree,
    seen: Vec<bool>,
    /// Triangles in the order of their leaves.
    order: Vec<u32>,
    /// For each treelet and child, its part of them.
    ranges: Vec<[(u32, u32); CHILDREN]>,
    children: Vec<[u32; CHILDREN]>,
    leaves: Vec<Child>,
    lanes: Vec<u8>,
}

impl Plan<'_> {
    /// What stands for a code of the tree.
    fn visit(&mut self, code: u32) -> u32 {
        let start = self.order.len();
        if code & LEAF != 0 {
            let first = self.lanes.len() as u32;
            for line in self.tree.block_lines(code) {
                let block = self.tree.lines().block(line);
                let mut lanes = 0;
                for (lane, id) in block.id.iter().enumerate() {
                    let id = (id & ID_MASK) as usize;
                    let is_triangle = !block.vertex[0][0][lane].is_nan();
                    if is_triangle && self.seen.get(id) == Some(&false) {
                        self.seen[id] = true;
                        self.order.push(id as u32);
                        lanes |= 1 << lane;
                    }
                }
                self.lanes.push(lanes);
            }
            if self.order.len() == start {
                self.lanes.truncate(first as usize);
                return NOTHING;
            }
            self.leaves.push(Child { code, first });
            return LEAF | (self.leaves.len() - 1) as u32;
        }
        if code == 0 {
            return NOTHING;
        }
        let at = self.ranges.len();
        self.ranges.push([(0, 0); CHILDREN]);
        self.children.push([NOTHING; CHILDREN]);
        let treelet = *self.tree.lines().treelet(code_line(code));
        for (c, &code) in treelet.child.iter().enumerate() {
            let start = self.order.len() as u32;
            self.children[at][c] = self.visit(code);
            self.ranges[at][c] = (start, self.order.len() as u32);
        }
        at as u32
    }
}

/// What rounding to `f32` may take from a number, upwards.
const UP: f64 = 1.0 + 1.0 / (1 << 20) as f64;

/// By how much rounding in `f64` moves placed corners and points near by, together.
const PLACING: f64 = 1.0 / (1u64 << 50) as f64;

/// An area that rounding sweeps counts as so much that is rounded as moments are, by `2^-24`, and at least twice
/// (docs/numerics.md).
const SWEPT: f64 = (1 << 23) as f64;

/// The least radius of rounded triangles; [`PLACING`] is nothing beside it.
const LEAST_RADIUS: f32 = 1.0 / (1u64 << 40) as f32;

impl Moments {
    const EMPTY: Moments = Moments {
        center: [[0.0; CHILDREN]; 3],
        radius: [f32::MIN_POSITIVE; CHILDREN],
        area: [0.0; CHILDREN],
        third: [0.0; CHILDREN],
        dipole: [[0.0; CHILDREN]; 3],
        second: [[0.0; CHILDREN]; 5],
        cubic: [[0.0; CHILDREN]; 7],
        child: [NOTHING; CHILDREN],
    };

    /// The moments of a child's triangles.
    fn take<G: Triangles>(&mut self, c: usize, geometry: &G, ids: &[u32]) {
        // There is nothing else in a tree of triangles.
        let corners = |&id: &u32| geometry.placed_corners(id).unwrap_or([[0.0; 3]; 3]);
        // The centre of gravity, rounded: moments are taken about what is stored.
        let (mut sum, mut total) = ([0.0; 3], 0.0);
        let [first, ..] = ids.first().map_or([[0.0; 3]; 3], corners);
        for [a, b, c] in ids.iter().map(corners) {
            let area = length(area_vector([a, b, c]));
            total += area;
            for i in 0..3 {
                sum[i] += area * (a[i] + b[i] + c[i] - 3.0 * first[i]);
            }
        }
        let center: [f32; 3] = std::array::from_fn(|i| {
            let offset = if total > 0.0 { sum[i] / (3.0 * total) } else { 0.0 };
            (first[i] + offset) as f32
        });
        let about =
            |p: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| p[i] - f64::from(center[i])) };
        let reach = |t: [[f64; 3]; 3]| t.map(|p| length(about(p))).into_iter().fold(0.0, f64::max);
        let farthest = ids.iter().map(corners).map(reach).fold(0.0, f64::max);
        let least = if G::ROUNDED { LEAST_RADIUS } else { f32::MIN_POSITIVE };
        let radius = ((farthest * UP) as f32).max(least);
        let unit = 1.0 / f64::from(radius);

        let (mut area, mut third) = (0.0, 0.0);
        let (mut dipole, mut second, mut cubic) = ([0.0; 3], [[0.0; 3]; 3], [[[0.0; 3]; 3]; 3]);
        for triangle in ids.iter().map(corners) {
            let v = triangle.map(|p| about(p).map(|x| x * unit));
            let s: [f64; 3] = std::array::from_fn(|i| v[0][i] + v[1][i] + v[2][i]);
            let n = area_vector(v);
            let size = length(n);
            // The mean of x (x) x over the triangle.
            let mean = |j: usize, k: usize| {
                (v[0][j] * v[0][k] + v[1][j] * v[1][k] + v[2][j] * v[2][k] + s[j] * s[k]) / 12.0
            };
            let far = v.map(length).into_iter().fold(0.0, f64::max);
            area += size;
            if G::ROUNDED {
                let edge = |i: usize| length([0, 1, 2].map(|a| v[i][a] - v[(i + 1) % 3][a]));
                let moved = PLACING * unit;
                area += SWEPT * moved * (edge(0) + edge(1) + edge(2) + 8.0 * moved);
            }
            third += size * far * (mean(0, 0) + mean(1, 1) + mean(2, 2));
            for i in 0..3 {
                dipole[i] += n[i];
                for j in 0..3 {
                    second[i][j] += n[i] * s[j] / 3.0;
                    for k in j..3 {
                        cubic[i][j][k] += n[i] * mean(j, k);
                    }
                }
            }
        }
        let m = |i: usize, j: usize| 0.5 * (second[i][j] + second[j][i]);
        let trace = (m(0, 0) + m(1, 1) + m(2, 2)) / 3.0;
        let second = [m(0, 0) - trace, m(1, 1) - trace, m(0, 1), m(0, 2), m(1, 2)];
        let at = |i: usize, j: usize, k: usize| cubic[i][j.min(k)][j.max(k)];
        let s = |i: usize, j: usize, k: usize| (at(i, j, k) + at(j, i, k) + at(k, i, j)) / 3.0;
        // A symmetric form loses 1/5 of the sum of its three products with the unit form.
        let t: [f64; 3] = std::array::from_fn(|i| (s(i, 0, 0) + s(i, 1, 1) + s(i, 2, 2)) / 5.0);
        let cubic = [
            s(0, 0, 0) - 3.0 * t[0],
            s(0, 1, 1) - t[0],
            s(0, 0, 1) - t[1],
            s(1, 1, 1) - 3.0 * t[1],
            s(0, 0, 2) - t[2],
            s(1, 1, 2) - t[2],
            s(0, 1, 2),
        ];
        for i in 0..3 {
            self.center[i][c] = center[i];
            self.dipole[i][c] = dipole[i] as f32;
        }
        self.radius[c] = radius;
        self.area[c] = ((area * UP) as f32).next_up();
        self.third[c] = ((third * UP) as f32).next_up();
        for (row, x) in self.second.iter_mut().zip(second) {
            row[c] = x as f32;
        }
        for (row, x) in self.cubic.iter_mut().zip(cubic) {
            row[c] = x as f32;
        }
    }
}

/// Half of the cross product of two edges.
fn area_vector([a, b, c]: [[f64; 3]; 3]) -> [f64; 3] {
    let (p, q) = ([0, 1, 2].map(|i| b[i] - a[i]), [0, 1, 2].map(|i| c[i] - a[i]));
    let n = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
    n.map(|x| 0.5 * x)
}

fn length(p: [f64; 3]) -> f64 {
    (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt()
}
