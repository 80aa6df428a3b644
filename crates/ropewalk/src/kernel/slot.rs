//! One ray in flight.

use crate::aabb::Aabb;
use crate::ray::Ray;
use crate::wide::{Flips, LEAF, MAX_WIDE_DEPTH};

/// Entries of a slot's stack: each treelet on a path replaces one entry by at most eight, and a
/// store writes eight lanes whatever their number. Slot 0 is the sentinel.
pub const STACK: usize = 7 * MAX_WIDE_DEPTH + 1 + 8;

/// Relative slack of an interval end: `(plane - origin) * inv` carries three roundings of `2^-24`,
/// so two ends that meet in exact arithmetic differ by at most six.
pub const INTERVAL_SLACK: f32 = 8.0 * f32::EPSILON / 2.0;

/// A parameter made larger by [`INTERVAL_SLACK`].
#[inline(always)]
pub fn later(t: f32) -> f32 {
    t + t.abs() * INTERVAL_SLACK
}

/// See [`Slot::near_zero`].
pub const NEAR_ZERO: f32 = 1.0 / (1u64 << 36) as f32;

/// See [`Slot::edge_slack`].
pub const EDGE_SLACK: f32 = 16.0 * f32::EPSILON / 2.0;

/// Added to every bound of an edge function, so that products that underflow decide nothing.
pub const TINY: f32 = 1e-36;

/// Rays whose origin or direction leave this range, and scenes that do, would overflow in the
/// filters' products; they are traced by the exact walk.
pub const LARGE: f32 = 1e12;

/// The largest direction component is at least this.
pub const SMALL: f32 = 1e-12;

/// What became of a ray that was to be put into a slot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Loaded {
    /// It is under way.
    Ready,
    /// It cannot hit anything.
    Misses,
    /// Its numbers are too large or too small for the filters.
    Extreme,
}

/// A ray in flight: constants of the steps and tests, the state of the query, the stack.
///
/// The stride is an odd number of cache lines, so that the slots of a wave do not alias in L1.
#[repr(C, align(64))]
pub struct Slot {
    /// Origin; the fourth lane is padding.
    pub origin: [f32; 4],
    /// `1 / dir`, infinite where `dir` is zero.
    pub inv: [f32; 4],
    /// Origin in the shear's axis order.
    pub shear_origin: [f32; 3],
    /// Error bounds of the edge functions: `edge_slack S (T + half_scale S)`, where `S` is the sum of
    /// the largest sheared coordinates `|x|` and `|y|` and `T` the largest parameter of a triangle.
    ///
    /// With `u = 2^-24` and `Z` the largest offset along the shear's axis, a sheared coordinate is
    /// off by at most `u (2 |x| + 5 Z)`: the offsets by one rounding each, `dx/dz` by two, and three
    /// in `x - (dx/dz) z`, where `|dx/dz| <= 1`. So an edge function `p_x q_y - p_y q_x`, which adds
    /// at most four roundings of its products, is off by at most `u S (10 Z + 3 S)`; what is kept is
    /// `16 u S (Z + S / 2)`. `T` is `Z |1/dz|`, so that `edge_slack` is `16 u |dz|` and `half_scale`
    /// is `|1/dz| / 2`.
    pub edge_slack: f32,
    /// Shear constants `(dx/dz, dy/dz, 1/dz)`.
    pub shear: [f32; 3],
    /// Smallest accepted parameter.
    pub t_min: f32,
    /// Axis order of the shear.
    pub k: [u32; 3],
    /// Index of the ray in the batch.
    pub ray: u32,
    /// Upper bound of the parameters that still matter.
    pub limit: f32,
    /// Lower bound of the best hit's parameter; infinite without one.
    pub best_low: f32,
    /// Primitive of the best hit.
    pub best_id: u32,
    /// Where its triangle lies, or `u32::MAX` if `limit` is its exact parameter.
    pub best_at: u32,
    /// See `edge_slack`.
    pub half_scale: f32,
    /// Absolute slack of intervals, on top of the relative one: a hit in a plane through the origin
    /// has `t = 0`, but `f64` may find it on either side of that, off by at most 2^-41 of the largest
    /// coordinate over the largest direction component; 2^-36 is kept.
    pub near_zero: f32,
    /// Signs of the direction.
    pub flips: Flips,
    /// Index of the top of the stack.
    pub sp: u32,
    /// True if a direction component is zero.
    pub may_lie_in_plane: bool,
    /// By how much an interval may end before it begins and still be one: [`INTERVAL_SLACK`] of the largest
    /// parameter at the ends of the root's interval. Those of cells lie between them where they matter.
    pub slack: f32,
    /// How far beyond the limit a cell must begin to be left out with all that follow: `near_zero`, the slack, and
    /// once more the slack, since what follows may begin by so much earlier.
    pub past: f32,
    /// Codes of the cells still to visit.
    pub code: [u32; STACK],
    /// Where the ray enters them.
    pub enter: [f32; STACK],
    /// Where it leaves them.
    pub exit: [f32; STACK],
    _pad: [u32; 9],
}

const _: () = assert!(size_of::<Slot>() / 64 % 2 == 1);

impl Slot {
    /// A slot without a ray.
    pub const fn new() -> Self {
        Slot {
            origin: [0.0; 4],
            inv: [0.0; 4],
            shear_origin: [0.0; 3],
            edge_slack: 0.0,
            shear: [0.0; 3],
            t_min: 0.0,
            k: [0, 1, 2],
            ray: 0,
            limit: 0.0,
            best_low: 0.0,
            best_id: 0,
            best_at: 0,
            half_scale: 0.0,
            near_zero: 0.0,
            flips: Flips::new(0),
            sp: 0,
            may_lie_in_plane: false,
            slack: 0.0,
            past: 0.0,
            code: [0; STACK],
            enter: [0.0; STACK],
            exit: [0.0; STACK],
            _pad: [0; 9],
        }
    }

    /// Puts `ray` into the slot with `root` on its stack, unless it cannot hit anything in `bounds`.
    pub fn load(&mut self, ray: &Ray, index: u32, bounds: &Aabb, root: u32) -> Loaded {
        if !ray.is_valid() {
            return Loaded::Misses;
        }
        let (mut enter, mut exit) = (ray.t_min, ray.t_max);
        let mut inside = true;
        for a in 0..3 {
            let (o, d) = (ray.origin[a], ray.dir[a]);
            let inv = 1.0 / d;
            self.origin[a] = o;
            self.inv[a] = inv;
            let (lo, hi) = (bounds.min[a] - o, bounds.max[a] - o);
            if d == 0.0 {
                inside &= lo <= 0.0 && hi >= 0.0;
            } else {
                let (near, far) = (lo * inv, hi * inv);
                enter = enter.max(near.min(far));
                exit = exit.min(near.max(far));
            }
        }
        let size = ray.dir.map(f32::abs);
        let y = usize::from(size[1] > size[0]);
        let kz = if size[2] > size[y] { 2 } else { y };
        self.may_lie_in_plane = self.inv[..3].iter().any(|x| x.is_infinite());
        let vanishing = |a: usize| self.inv[a].is_infinite() && ray.dir[a] != 0.0;
        let far = |x: f32| x.abs() > LARGE;
        let extreme = ray.origin.into_iter().chain(bounds.min).chain(bounds.max).any(far);
        if extreme
            || !(SMALL..=LARGE).contains(&size[kz])
            || (self.may_lie_in_plane && (0..3).any(vanishing))
        {
            self.start(ray, index);
            return Loaded::Extreme;
        }
        let coordinates = ray.origin.iter().chain(&bounds.min).chain(&bounds.max);
        let reach = coordinates.fold(0.0f32, |reach, x| reach.max(x.abs()));
        self.near_zero = NEAR_ZERO * reach * self.inv[kz].abs();
        (enter, exit) = (enter - self.near_zero, exit + self.near_zero);
        if !(inside && enter <= later(exit)) {
            return Loaded::Misses;
        }
        // The winding does not matter here: the filter asks for equal signs, whichever.
        let (kx, ky) = ([1, 2, 0][kz], [2, 0, 1][kz]);
        let inv_z = self.inv[kz];
        self.k = [kx as u32, ky as u32, kz as u32];
        self.shear_origin = [ray.origin[kx], ray.origin[ky], ray.origin[kz]];
        self.shear = [ray.dir[kx] * inv_z, ray.dir[ky] * inv_z, inv_z];
        self.edge_slack = EDGE_SLACK * size[kz];
        self.half_scale = 0.5 * inv_z.abs();
        let sign = |a: usize| u32::from(self.inv[a].is_sign_negative()) << a;
        self.flips = Flips::new(sign(0) | sign(1) | sign(2));
        self.start(ray, index);
        self.push_root(root, enter, exit);
        Loaded::Ready
    }

    /// Takes the cell just visited off the stack; true if nothing is left that matters, `any` hit
    /// being enough or not.
    ///
    /// Cells are popped in the order in which the ray enters them, so one that starts behind the
    /// limit ends the ray, unless any hit is enough: then the limit stays, and cells need no order. Except that a ray in a cutting plane is in the cells on both sides at
    /// once, and then only each cell by itself can be dropped.
    #[inline(always)]
    pub fn pop(&mut self, any: bool) -> bool {
        let mut below = (self.sp as usize).saturating_sub(1).min(STACK - 1);
        if self.may_lie_in_plane {
            below = self.skip_behind(below);
        }
        self.sp = below as u32;
        let behind = self.enter[below] - self.past > self.limit;
        (below == 0) | (!any & behind) | (any & (self.best_id != u32::MAX))
    }

    /// The first cell from `below` down that does not start behind the limit. A call, since the compiler
    /// would ask first whether the stack is empty, which cannot be predicted.
    #[cold]
    #[inline(never)]
    fn skip_behind(&self, mut below: usize) -> usize {
        while below > 0 && self.enter[below] - self.past > self.limit {
            below -= 1;
        }
        below
    }

    /// Empties the stack but for the root.
    #[inline(always)]
    pub fn push_root(&mut self, root: u32, enter: f32, exit: f32) {
        self.code[0] = LEAF; // the sentinel: a leaf without blocks ends the ray
        self.code[1] = root;
        self.enter[1] = enter;
        self.exit[1] = exit;
        self.slack = INTERVAL_SLACK * enter.abs().max(exit.abs());
        self.past = self.near_zero + 2.0 * self.slack;
        self.sp = 1;
    }

    /// Sets the state of the query.
    #[inline(always)]
    pub fn start(&mut self, ray: &Ray, index: u32) {
        self.t_min = ray.t_min;
        self.limit = ray.t_max;
        self.best_low = f32::INFINITY;
        self.best_id = u32::MAX;
        self.best_at = u32::MAX;
        self.ray = index;
    }

    /// Sets the best hit to one whose exact parameter is known.
    #[inline(always)]
    pub fn set_best(&mut self, t: f32, prim_id: u32) {
        self.limit = t;
        self.best_low = t;
        self.best_id = prim_id;
        self.best_at = u32::MAX;
    }
}
