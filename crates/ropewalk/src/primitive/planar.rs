//! Clipping of planar loops in `f64`, rounding outward to `f32`, and the area breakpoints of a
//! clipped loop. Shared by triangles, polygons and patches.

use super::AreaRamp;
use crate::aabb::Aabb;

/// Slack of a clip, as a share of the largest coordinate on an axis. The clips run on exact `f64`
/// images of `f32` data. Cutting an edge costs at most 8 roundings (2^-53 each) of the edge's
/// coordinates on every axis, six planes at most 48; a cell widened by 64 of them, 2^-47, keeps
/// whatever touches the closed cell.
pub(super) const CLIP_SLACK: f64 = 1.0 / (1u64 << 47) as f64;

/// A piece thinner than this share of the cell along the axis enters the area function with a
/// constant width: a slope of `1 / thickness^2` would drift in the running quadratic.
const THIN_SHARE: f64 = 1e-3;

/// A piece thinner than this share of the cell is a step: its width would drift likewise.
const STEP_SHARE: f64 = 1e-6;

/// An edge shorter along the axis than this share of its loop has a constant width: the area
/// inside it is off by at most `EDGE_SHARE / 4` of the loop's, and the slope stays below
/// `2 / EDGE_SHARE` of area over thickness squared.
const EDGE_SHARE: f64 = 1e-5;

/// A projection that covers less than this share of its own box is a needle, and its widths would
/// be differences of nearly equal numbers; it is treated as a thin piece. Its area is below the
/// same share of the cell's.
const NEEDLE_SHARE: f64 = 1e-6;

/// The largest `f32` not above `x`.
#[inline]
pub(super) fn round_down(x: f64) -> f32 {
    let f = x as f32;
    if f64::from(f) > x { f.next_down() } else { f }
}

/// The smallest `f32` not below `x`.
#[inline]
pub(super) fn round_up(x: f64) -> f32 {
    let f = x as f32;
    if f64::from(f) < x { f.next_up() } else { f }
}

/// The common part of two boxes, `None` if they have no point in common.
#[inline]
pub(super) fn overlap(a: &Aabb, b: &Aabb) -> Option<Aabb> {
    let c = a.intersection(b);
    (!c.is_empty()).then_some(c)
}

/// A growing box in `f64`.
#[derive(Clone, Copy)]
pub(super) struct Extent {
    pub min: [f64; 3],
    pub max: [f64; 3],
}

impl Extent {
    pub const EMPTY: Extent = Extent { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3] };

    /// A cell, widened by `slack` on each axis.
    #[inline]
    pub fn widened(cell: &Aabb, slack: [f64; 3]) -> Self {
        Extent {
            min: std::array::from_fn(|a| f64::from(cell.min[a]) - slack[a]),
            max: std::array::from_fn(|a| f64::from(cell.max[a]) + slack[a]),
        }
    }

    #[inline]
    pub fn add(&mut self, p: [f64; 3]) {
        for a in 0..3 {
            self.min[a] = self.min[a].min(p[a]);
            self.max[a] = self.max[a].max(p[a]);
        }
    }

    pub fn contains(&self, p: [f64; 3]) -> bool {
        (0..3).all(|a| self.min[a] <= p[a] && p[a] <= self.max[a])
    }

    /// The box of what was added, widened by `slack` and rounded outward.
    #[inline]
    pub fn outward(&self, slack: [f64; 3]) -> Aabb {
        Aabb {
            min: std::array::from_fn(|a| round_down(self.min[a] - slack[a])),
            max: std::array::from_fn(|a| round_up(self.max[a] + slack[a])),
        }
    }
}

/// A half-space of an axis plane: `p[axis] >= bound` if `above`, else `p[axis] <= bound`.
#[derive(Clone, Copy)]
struct HalfSpace {
    axis: usize,
    bound: f64,
    above: bool,
}

impl HalfSpace {
    /// How far `p` lies inside; negative outside.
    #[inline]
    fn depth(&self, p: [f64; 3]) -> f64 {
        let d = p[self.axis] - self.bound;
        if self.above { d } else { -d }
    }

    /// Where the edge from `p` to `q` crosses the plane; their depths `dp`, `dq` differ in sign.
    #[inline]
    fn cut(&self, p: [f64; 3], q: [f64; 3], dp: f64, dq: f64) -> [f64; 3] {
        let t = dp / (dp - dq);
        let mut x: [f64; 3] = std::array::from_fn(|a| p[a] + t * (q[a] - p[a]));
        x[self.axis] = self.bound;
        x
    }
}

/// The six half-spaces of a box.
fn half_spaces(cell: &Extent) -> impl Iterator<Item = HalfSpace> {
    let (min, max) = (cell.min, cell.max);
    (0..3).flat_map(move |axis| {
        [
            HalfSpace { axis, bound: min[axis], above: true },
            HalfSpace { axis, bound: max[axis], above: false },
        ]
    })
}

/// A convex loop of few vertices on the stack. Points have a fourth coordinate, 0, so that each
/// fills a SIMD register.
pub(super) struct SmallLoop {
    /// Two buffers, used in turn.
    points: [[[f64; 4]; SmallLoop::CAPACITY]; 2],
    current: usize,
    len: usize,
}

impl SmallLoop {
    /// A power of two, so that indices can be masked.
    const CAPACITY: usize = 16;

    /// A triangle cut by six planes has at most nine vertices. Rounding can make an edge that lies
    /// in a plane cross it more than once: a cut adds at most half as many vertices as there are.
    const LONGEST: usize = 10;

    #[inline]
    pub fn new<const N: usize>(corners: [[f64; 3]; N]) -> Self {
        let mut points = [[[0.0; 4]; Self::CAPACITY]; 2];
        for (point, [x, y, z]) in points[0].iter_mut().zip(corners) {
            *point = [x, y, z, 0.0];
        }
        SmallLoop { points, current: 0, len: N }
    }

    #[inline]
    pub fn points(&self) -> &[[f64; 4]] {
        &self.points[self.current][..self.len]
    }

    /// Cuts the loop to the points not below (`ABOVE`) or not above a plane (Sutherland, Hodgman
    /// 1974). `None` if it has run out of room, in which case the caller falls back on boxes.
    ///
    /// Crossings are computed and points written always and kept only where they count: the sides
    /// come at random, and a wrong guess would cost more.
    #[inline]
    fn cut<const AXIS: usize, const ABOVE: bool>(&mut self, bound: f64) -> Option<()> {
        const MASK: usize = SmallLoop::CAPACITY - 1;
        if self.len == 0 || self.len > Self::LONGEST {
            return (self.len == 0).then_some(());
        }
        let [first, second] = &mut self.points;
        let (from, to) = if self.current == 0 { (first, second) } else { (second, first) };
        let depth = |p: &[f64; 4]| if ABOVE { p[AXIS] - bound } else { bound - p[AXIS] };
        let mut len = 0;
        let mut p = from[(self.len - 1) & MASK];
        let mut dp = depth(&p);
        for i in 0..self.len {
            let q = from[i & MASK];
            let dq = depth(&q);
            let t = dp / (dp - dq);
            let mut x: [f64; 4] = std::array::from_fn(|a| p[a] + t * (q[a] - p[a]));
            x[AXIS] = bound;
            to[len & MASK] = x;
            len += usize::from((dp < 0.0) & (dq > 0.0) | (dp > 0.0) & (dq < 0.0));
            to[len & MASK] = q;
            len += usize::from(dq >= 0.0);
            (p, dp) = (q, dq);
        }
        self.current ^= 1;
        self.len = len;
        Some(())
    }

    /// Cuts the loop to `cell`, by those planes only that `bounds` (the loop's own box) crosses.
    #[inline]
    pub fn clip(mut self, bounds: &Aabb, cell: &Extent) -> Option<SmallLoop> {
        let below = |a: usize| f64::from(bounds.min[a]) < cell.min[a];
        let above = |a: usize| f64::from(bounds.max[a]) > cell.max[a];
        if below(0) {
            self.cut::<0, true>(cell.min[0])?;
        }
        if above(0) {
            self.cut::<0, false>(cell.max[0])?;
        }
        if below(1) {
            self.cut::<1, true>(cell.min[1])?;
        }
        if above(1) {
            self.cut::<1, false>(cell.max[1])?;
        }
        if below(2) {
            self.cut::<2, true>(cell.min[2])?;
        }
        if above(2) {
            self.cut::<2, false>(cell.max[2])?;
        }
        Some(self)
    }

    /// The box of what is left.
    #[inline]
    pub fn extent(&self) -> Extent {
        let (mut min, mut max) = ([f64::INFINITY; 4], [f64::NEG_INFINITY; 4]);
        for p in self.points() {
            for a in 0..4 {
                min[a] = if p[a] < min[a] { p[a] } else { min[a] };
                max[a] = if p[a] > max[a] { p[a] } else { max[a] };
            }
        }
        Extent { min: [min[0], min[1], min[2]], max: [max[0], max[1], max[2]] }
    }

    /// Cuts the loop to the slab of `cell` on one axis.
    pub fn clip_axis(mut self, axis: usize, cell: &Extent) -> Option<SmallLoop> {
        match axis {
            0 => self.cut::<0, true>(cell.min[0]).and_then(|()| self.cut::<0, false>(cell.max[0])),
            1 => self.cut::<1, true>(cell.min[1]).and_then(|()| self.cut::<1, false>(cell.max[1])),
            _ => self.cut::<2, true>(cell.min[2]).and_then(|()| self.cut::<2, false>(cell.max[2])),
        }?;
        Some(self)
    }
}

/// Cuts a loop of any length to a box. A concave loop may come out with edges that run to and fro
/// in the box's faces; they do not count in signed areas.
pub(super) fn clip_long_loop(mut points: Vec<[f64; 3]>, cell: &Extent) -> Vec<[f64; 3]> {
    let mut out = Vec::with_capacity(points.len() + 8);
    for half in half_spaces(cell) {
        let Some(&last) = points.last() else { break };
        out.clear();
        let (mut p, mut dp) = (last, half.depth(last));
        for &q in &points {
            let dq = half.depth(q);
            if (dp < 0.0 && dq > 0.0) || (dp > 0.0 && dq < 0.0) {
                out.push(half.cut(p, q, dp, dq));
            }
            if dq >= 0.0 {
                out.push(q);
            }
            (p, dp) = (q, dq);
        }
        std::mem::swap(&mut points, &mut out);
    }
    points
}

/// The two ends of the part of the segment `p q` inside `cell`.
#[inline]
pub(super) fn clip_segment(p: [f64; 3], q: [f64; 3], cell: &Extent) -> Option<[[f64; 3]; 2]> {
    let (mut t0, mut t1) = (0.0f64, 1.0f64);
    for a in 0..3 {
        let (lo, hi) = if p[a] <= q[a] { (p[a], q[a]) } else { (q[a], p[a]) };
        if hi < cell.min[a] || lo > cell.max[a] {
            return None;
        }
        let d = q[a] - p[a];
        if lo < cell.min[a] {
            let t = (cell.min[a] - p[a]) / d;
            if d > 0.0 { t0 = t0.max(t) } else { t1 = t1.min(t) }
        }
        if hi > cell.max[a] {
            let t = (cell.max[a] - p[a]) / d;
            if d > 0.0 { t1 = t1.min(t) } else { t0 = t0.max(t) }
        }
    }
    let at = |t: f64| std::array::from_fn(|a| p[a] + t * (q[a] - p[a]));
    (t0 <= t1).then(|| [at(t0), at(t1)])
}

/// Half the sum of cross products: a vector along the loop's normal as long as its area.
pub(super) fn vector_area<const N: usize>(points: &[[f64; N]]) -> [f64; 3] {
    let Some(&o) = points.first() else { return [0.0; 3] };
    let sub = |p: [f64; N]| [p[0] - o[0], p[1] - o[1], p[2] - o[2]];
    let mut sum = [0.0; 3];
    for pair in points.windows(2) {
        let (p, q) = (sub(pair[0]), sub(pair[1]));
        for a in 0..3 {
            let (b, c) = ((a + 1) % 3, (a + 2) % 3);
            sum[a] += 0.5 * (p[b] * q[c] - p[c] * q[b]);
        }
    }
    sum
}

/// Euclidean length.
#[inline]
pub(super) fn length(v: [f64; 3]) -> f64 {
    (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
}

/// Adds the breakpoints of the area left of a plane that sweeps `cell` along `axis`, for a planar
/// loop that was clipped to the cell.
///
/// Seen along one of the other axes the loop lies in a plane `(t, b)`, and by Green's theorem the
/// area left of `t` is the sum over the edges of the signed area between the edge and the line
/// `b = 0`. An edge so changes the width by `b` and the slope by `db/dt` at its first end and takes
/// both back at its second; at a vertex the widths of its two edges cancel.
pub(super) fn loop_ramps<const N: usize>(
    points: &[[f64; N]],
    cell: &Aabb,
    axis: usize,
    out: &mut Vec<AreaRamp>,
) {
    let vector = vector_area(points);
    let area = length(vector);
    if area == 0.0 {
        return;
    }
    let (lower, extent) = (f64::from(cell.min[axis]), cell.extent(axis));
    let local = |p: &[f64; N]| (p[axis] - lower).clamp(0.0, extent);
    let (lo, hi) = points
        .iter()
        .map(local)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), t| (lo.min(t), hi.max(t)));
    let thickness = hi - lo;
    if thickness <= STEP_SHARE * extent {
        out.push(AreaRamp { x: lo, step: area, ..Default::default() });
        return;
    }

    // Look along the axis across which the loop shows the larger face.
    let (b1, b2) = ((axis + 1) % 3, (axis + 2) % 3);
    let (b, projected) =
        if vector[b2].abs() >= vector[b1].abs() { (b1, vector[b2]) } else { (b2, -vector[b1]) };
    let (b_lo, b_hi) = points
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), p| (lo.min(p[b]), hi.max(p[b])));
    let needle = projected.abs() <= NEEDLE_SHARE * (b_hi - b_lo) * thickness;
    if needle || thickness <= THIN_SHARE * extent {
        let width = area / thickness;
        out.push(AreaRamp { x: lo, width, ..Default::default() });
        out.push(AreaRamp { x: hi, width: -width, ..Default::default() });
        return;
    }

    // One breakpoint a vertex; `scale` turns the projected area, signed, into the true one.
    let scale = -area / projected;
    let at = |p: &[f64; N]| (local(p), scale * (p[b] - b_lo));
    let edge = |(t0, b0): (f64, f64), (t1, b1): (f64, f64)| {
        let dt = t1 - t0;
        if dt.abs() > EDGE_SHARE * thickness {
            Edge { first: b0, last: b1, slope: (b1 - b0) / dt }
        } else if dt != 0.0 {
            Edge { first: 0.5 * (b0 + b1), last: 0.5 * (b0 + b1), slope: 0.0 }
        } else {
            Edge::default()
        }
    };
    let n = points.len();
    let mut p = at(&points[n - 1]);
    let mut incoming = edge(at(&points[(2 * n - 2) % n]), p);
    for point in points {
        let q = at(point);
        let outgoing = edge(p, q);
        let ramp = AreaRamp {
            x: p.0,
            step: 0.0,
            width: outgoing.first - incoming.last,
            slope: outgoing.slope - incoming.slope,
        };
        if ramp.width != 0.0 || ramp.slope != 0.0 {
            out.push(ramp);
        }
        (p, incoming) = (q, outgoing);
    }
}

/// What an edge of a loop adds to the width at its first end and takes back at its last one.
#[derive(Default)]
struct Edge {
    first: f64,
    last: f64,
    slope: f64,
}
