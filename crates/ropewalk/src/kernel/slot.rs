//! One ray in flight.

use crate::aabb::Aabb;
use crate::ray::{PreparedRay, Ray};
use crate::wide::{LEAF, MAX_WIDE_DEPTH};

/// Entries of a slot's stack: each treelet on a path replaces one entry by at most eight, and a
/// store writes eight lanes whatever their number. Slot 0 is the sentinel.
pub const STACK: usize = 7 * MAX_WIDE_DEPTH + 1 + 8;

/// Relative slack of an interval end: `(plane - origin) * inv` carries three roundings of `2^-24`,
/// so two ends that meet in exact arithmetic differ by at most six.
pub const INTERVAL_SLACK: f32 = 8.0 * f32::EPSILON / 2.0;

/// See [`Slot::edge_slack`].
const EDGE_SLACK: f32 = 32.0 * f32::EPSILON / 2.0;

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
    /// A little below the smallest accepted parameter.
    pub t_min_low: f32,
    /// Shear constants `(dx/dz, dy/dz, 1/dz)`.
    pub shear: [f32; 3],
    /// A little above the largest parameter that still matters.
    pub limit_high: f32,
    /// Largest parameter that still matters.
    pub limit: f32,
    /// Error of an edge function per sum of the sheared coordinates' sizes.
    ///
    /// With `u = 2^-24` and `D` the largest offset of the scene's box from the origin, a sheared
    /// coordinate is off by at most `6 u D` and an edge function `p_x q_y - p_y q_x` by at most
    /// `20 u D (|x| + |y|)`, `|x|` and `|y|` being the largest sheared coordinates; `32 u D` is kept.
    pub edge_slack: f32,
    /// Axis order of the shear.
    pub k: [u32; 3],
    /// Primitive of the best hit.
    pub best_id: u32,
    /// Index of the ray in the batch.
    pub ray: u32,
    /// Index of the top of the stack.
    pub sp: u32,
    /// True if a direction component is zero.
    pub may_lie_in_plane: bool,
    /// The ray in double precision, made when the first candidate comes.
    pub prepared: Option<PreparedRay>,
    /// Codes of the cells still to visit.
    pub code: [u32; STACK],
    /// Where the ray enters them.
    pub enter: [f32; STACK],
    /// Where it leaves them.
    pub exit: [f32; STACK],
    _pad: [u32; 17],
}

const _: () = assert!(size_of::<Slot>() / 64 % 2 == 1);

impl Slot {
    /// A slot without a ray.
    pub fn new() -> Self {
        Slot {
            origin: [0.0; 4],
            inv: [0.0; 4],
            shear_origin: [0.0; 3],
            t_min_low: 0.0,
            shear: [0.0; 3],
            limit_high: 0.0,
            limit: 0.0,
            edge_slack: 0.0,
            k: [0, 1, 2],
            best_id: 0,
            ray: 0,
            sp: 0,
            may_lie_in_plane: false,
            prepared: None,
            code: [0; STACK],
            enter: [0.0; STACK],
            exit: [0.0; STACK],
            _pad: [0; 17],
        }
    }

    /// Puts `ray` into the slot with `root` on its stack; false if it cannot hit anything in
    /// `bounds`.
    #[inline(always)]
    pub fn load(&mut self, ray: &Ray, index: u32, bounds: &Aabb, root: u32) -> bool {
        if !ray.is_valid() {
            return false;
        }
        let (mut enter, mut exit) = (ray.t_min, ray.t_max);
        let mut inside = true;
        let (mut kz, mut reach) = (0, 0.0f32);
        self.may_lie_in_plane = ray.dir.contains(&0.0);
        for a in 0..3 {
            let (o, d) = (ray.origin[a], ray.dir[a]);
            let inv = 1.0 / d;
            self.origin[a] = o;
            self.inv[a] = inv;
            kz = if d.abs() > ray.dir[kz].abs() { a } else { kz };
            let (lo, hi) = (bounds.min[a] - o, bounds.max[a] - o);
            reach = reach.max(lo.abs()).max(hi.abs());
            if d == 0.0 {
                inside &= lo <= 0.0 && hi >= 0.0;
            } else {
                let (near, far) = (lo * inv, hi * inv);
                enter = enter.max(near.min(far));
                exit = exit.min(near.max(far));
            }
        }
        if !(inside && enter <= exit * (1.0 + INTERVAL_SLACK)) {
            return false;
        }
        let dz = ray.dir[kz];
        let (mut kx, mut ky) = ((kz + 1) % 3, (kz + 2) % 3);
        if dz < 0.0 {
            std::mem::swap(&mut kx, &mut ky);
        }
        let inv_z = 1.0 / dz;
        self.k = [kx as u32, ky as u32, kz as u32];
        self.shear_origin = [ray.origin[kx], ray.origin[ky], ray.origin[kz]];
        self.shear = [ray.dir[kx] * inv_z, ray.dir[ky] * inv_z, inv_z];
        self.t_min_low = ray.t_min - ray.t_min.abs() * INTERVAL_SLACK;
        self.edge_slack = EDGE_SLACK * reach;
        self.prepared = None;
        self.set_limit(ray.t_max);
        self.best_id = u32::MAX;
        self.ray = index;
        self.code[0] = LEAF; // the sentinel: a leaf without blocks ends the ray
        self.code[1] = root;
        self.enter[1] = enter;
        self.exit[1] = exit;
        self.sp = 1;
        true
    }

    /// Lowers the largest parameter that still matters.
    #[inline(always)]
    pub fn set_limit(&mut self, limit: f32) {
        self.limit = limit;
        self.limit_high = limit + limit.abs() * INTERVAL_SLACK;
    }

    /// The ray in double precision, its range ending at the limit.
    #[inline(always)]
    pub fn prepare(&mut self, rays: &[Ray]) -> &PreparedRay {
        let ray = &rays[self.ray as usize];
        let limit = self.limit;
        // `load` has refused what cannot be prepared.
        let prepared = self.prepared.get_or_insert_with(|| PreparedRay::new(ray).expect("loaded"));
        prepared.t_max = limit;
        prepared
    }
}
