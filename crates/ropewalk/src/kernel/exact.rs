//! What the filters leave open: decided in `f64`, as the reference walks do.

#![allow(unsafe_code)]

use super::beam::Doubles;
use super::slot::Slot;
use crate::primitive::{EDGE_FILTER, Triangle};
use crate::ray::{Hit, Ray, Shear};
use crate::wide::{ID_MASK, Lines, WIDTH};

/// A triangle where it lies: the line of its block times eight plus its lane.
pub type At = u32;

/// The place of a lane of the block at `line`.
#[inline(always)]
pub fn place(line: usize, lane: usize) -> At {
    (line * WIDTH + lane) as u32
}

/// The triangles and rays of a batch, for exact tests.
#[derive(Clone, Copy)]
pub struct Exact<'a> {
    /// The tree's memory.
    pub lines: &'a Lines,
    /// All rays.
    pub rays: &'a [Ray],
}

impl Exact<'_> {
    /// The hit of a ray on a triangle, if it lies in the ray's range.
    ///
    /// The block has just been tested, so it is at hand where the geometry's own copy would not be.
    #[inline(always)]
    pub fn hit(&self, ray: u32, at: At) -> Option<Hit> {
        let (block, lane) = (self.lines.block(at as usize / WIDTH), at as usize % WIDTH);
        let ray = &self.rays[ray as usize];
        let corner = |i: usize, axis: usize| block.vertex[i][axis][lane];
        let met = Triangle::meet(corner, &Shear::new(ray), block.sides(lane))?;
        let t = met.t as f32;
        let accepted = t.is_finite() && ray.t_min <= t && t <= ray.t_max;
        accepted.then_some(Hit {
            t,
            prim_id: block.id[lane] & ID_MASK,
            u: met.u as f32,
            v: met.v as f32,
        })
    }
}

/// What the reference test says about a triangle in each lane; lanes in neither mask are too close to
/// an edge or seen edge-on.
pub struct Met<D> {
    /// Parameters of the hits, not yet rounded.
    pub t: D,
    /// Lanes that hit, not minding sides and range.
    pub hit: u32,
    /// Lanes that miss.
    pub miss: u32,
    /// Lanes that see the front.
    pub front: u32,
}

/// The reference test, operation by operation, where none of its special cases arises. Origin,
/// direction and corners (by vertex and axis) are in the axis order of the ray's [`Shear`]; whether
/// it is swapped does not matter.
///
/// # Safety
/// The machine must have the features of `D`'s level, and the caller must enable them.
#[inline(always)]
pub unsafe fn meet<D: Doubles>(
    origin: [D; 3],
    [dx, dy, dz]: [D; 3],
    corners: [[D; 3]; 3],
) -> Met<D> {
    // SAFETY: passed on to the caller.
    let (zero, one, share) = unsafe { (D::splat(0.0), D::splat(1.0), D::splat(EDGE_FILTER)) };
    let (sx, sy, sz) = (dx.div(dz), dy.div(dz), one.div(dz));
    let a = sheared(corners[0], origin, [sx, sy]);
    let b = sheared(corners[1], origin, [sx, sy]);
    let c = sheared(corners[2], origin, [sx, sy]);
    let ((u, pu), (v, pv), (w, pw)) = (edge(c, b), edge(a, c), edge(b, a));
    let (low, high) = (u.min(v).min(w), u.max(v).max(w));
    let det = u + v + w;
    let wide = (share * (pu + pv + pw)).le(det.abs());
    let depth = (u * a[2] + v * b[2] + w * c[2]).div(det);
    let near = a[2].min(b[2]).min(c[2]);
    let far = a[2].max(b[2]).max(c[2]);
    Met {
        t: sz * depth.max(near).min(far),
        hit: (zero.lt(low) | high.lt(zero)) & wide,
        miss: low.lt(zero) & zero.lt(high),
        front: zero.lt(det),
    }
}

/// A corner in the frames of the rays: sheared across, and its depth.
#[inline(always)]
fn sheared<D: Doubles>(corner: [D; 3], origin: [D; 3], [sx, sy]: [D; 2]) -> [D; 3] {
    let z = corner[2] - origin[2];
    [corner[0] - origin[0] - sx * z, corner[1] - origin[1] - sy * z, z]
}

/// Difference and size of the two products of an edge function.
#[inline(always)]
fn edge<D: Doubles>(p: [D; 3], q: [D; 3]) -> (D, D) {
    let (m, n) = (p[0] * q[1], p[1] * q[0]);
    (m - n, m.abs() + n.abs())
}

/// The lanes of three rows from `first` on.
///
/// # Safety
/// As for [`meet`].
#[inline(always)]
pub unsafe fn widen<D: Doubles>([x, y, z]: [&[f32]; 3], first: usize) -> [D; 3] {
    // SAFETY: passed on to the caller.
    unsafe { [D::widen(&x[first..]), D::widen(&y[first..]), D::widen(&z[first..])] }
}

/// Triangles that rays hit for sure, one pair a lane, in the axis order of the ray's shear.
#[repr(C, align(64))]
#[derive(Clone, Copy)]
pub struct Pairs {
    /// Coordinates by vertex and axis.
    corner: [[[f32; WIDTH]; 3]; 3],
    origin: [[f32; WIDTH]; 3],
    dir: [[f32; WIDTH]; 3],
}

/// A ray in the axis order of its shear.
#[repr(C)]
#[derive(Clone, Copy, Default)]
pub struct Sheared {
    /// Axis order.
    k: [u32; 3],
    /// Index of the ray in the batch.
    pub ray: u32,
    origin: [f32; 3],
    dir: [f32; 3],
}

impl Sheared {
    /// Writes the ray of a slot where it is to be: put together elsewhere number by number and then copied, it
    /// would be read back before all of it is written, and each ray would wait for that.
    #[inline(always)]
    pub fn set(&mut self, slot: &Slot, rays: &[Ray]) {
        let dir = &rays[slot.ray as usize].dir;
        (self.k, self.ray, self.origin) = (slot.k, slot.ray, slot.shear_origin);
        for (to, k) in self.dir.iter_mut().zip(slot.k) {
            *to = dir[k.min(2) as usize];
        }
    }
}

impl Pairs {
    /// No pairs.
    pub const EMPTY: Pairs =
        Pairs { corner: [[[0.0; WIDTH]; 3]; 3], origin: [[0.0; WIDTH]; 3], dir: [[0.0; WIDTH]; 3] };

    /// Puts a ray and a triangle into a lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, ray: &Sheared, lines: &Lines, at: At) {
        let lane = lane % WIDTH;
        let (vertex, from) = (&lines.block(at as usize / WIDTH).vertex, at as usize % WIDTH);
        for a in 0..3 {
            let axis = ray.k[a].min(2) as usize;
            for i in 0..3 {
                self.corner[i][a][lane] = vertex[i][axis][from];
            }
            self.origin[a][lane] = ray.origin[a];
            self.dir[a][lane] = ray.dir[a];
        }
    }

    /// Writes the parameters of the hits, rounded; returns the lanes in which [`Exact::hit`] must be
    /// asked instead.
    ///
    /// # Safety
    /// As for [`meet`].
    #[inline(always)]
    pub unsafe fn meet<D: Doubles>(&self, t: &mut [f32; WIDTH]) -> u32 {
        let mut hit = 0;
        for first in (0..WIDTH).step_by(D::LANES) {
            // SAFETY: passed on to the caller; `LANES` divides `WIDTH`.
            unsafe {
                let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = &self.corner;
                let ([ox, oy, oz], [dx, dy, dz]) = (&self.origin, &self.dir);
                let a = widen::<D>([ax, ay, az], first);
                let b = widen::<D>([bx, by, bz], first);
                let c = widen::<D>([cx, cy, cz], first);
                let origin = widen::<D>([ox, oy, oz], first);
                let met = meet(origin, widen::<D>([dx, dy, dz], first), [a, b, c]);
                met.t.narrow(&mut t[first..]);
                hit |= met.hit << first;
            }
        }
        !hit & ((1 << WIDTH) - 1)
    }
}
