//! Sixteen rays side by side, and the frame in which a group of them is coherent.

#![allow(unsafe_code)]

use super::shaft::Shaft;
use super::vector::Vector;
use crate::aabb::Aabb;
use crate::ray::Ray;

/// Rays of a packet.
pub const RAYS: usize = 16;

/// All lanes of a packet.
pub const ALL: u32 = (1 << RAYS) - 1;

/// Half an ulp of 1.
const U: f32 = f32::EPSILON / 2.0;

/// Slack of the shaft's origins in units of `U` times the largest coordinate in play. A bound
/// `(plane - origin) * inv` is off by five roundings (origin, slope, inverse, difference, product),
/// relative to a difference of twice that coordinate at most; 16 would do.
pub const COORDINATE_SLACK: f32 = 64.0 * U;

/// Error of a depth in units of its size: difference, interpolation and its sum, one rounding each.
/// The errors of two depths part two hits by eight roundings, so that their parameters differ by
/// more than rounding to `f32` can hide.
pub const DEPTH_SLACK: f32 = 4.0 * U;

/// Twice the error of a sheared vertex relative to a ray, in units of its depth: difference, shear and
/// the ray's own coordinate are off by less than six roundings. An edge function multiplies the
/// vertices of an edge, so the sizes of both count.
pub const CORNER_SLACK: f32 = 12.0 * U;

/// Rounding error of an edge function in units of the product of the sizes across: three terms of two
/// products and their sums are off by 24 roundings at most, the vertices' own rounding adds eight.
pub const PRODUCT_SLACK: f32 = 40.0 * U;

/// Error of the place where a ray crosses the plane of depth 0, in units of the way
/// across from its origin: origin, slope (twice), product and difference.
const CROSSING_SLACK: f32 = 6.0 * U;

/// Rays may miss the common focus, or differ from the common direction over the reach, by so much.
const STRAY: f32 = 256.0 * U;

/// Most that rays may miss a point where others met, in units of what those missed it by.
const STRAY_AGAIN: f32 = 1.5;

/// Largest distance of a focus from the leading ray's origin, in units of the scene's reach.
const FOCUS: f32 = 16.0;

/// Largest difference of slopes in a group.
const SPREAD: f32 = 0.25;

/// No hit so far.
pub const NONE: u32 = u32::MAX;
const NONE_BITS: f32 = f32::from_bits(NONE);

/// Sixteen rays, one lane each.
#[repr(C, align(64))]
#[derive(Clone)]
pub struct Packet {
    /// Where the ray of lane 0 stands in the batch; the others follow.
    pub first: u32,
    /// Origins by axis.
    pub origin: [[f32; RAYS]; 3],
    /// Directions by axis.
    pub dir: [[f32; RAYS]; 3],
    /// Smallest and largest accepted parameters.
    pub t: [[f32; RAYS]; 2],
    slope: [[f32; RAYS]; 2],
    /// Length of a parameter in depth.
    pub scale: [f32; RAYS],
    /// Depth of the origins.
    pub start: [f32; RAYS],
    /// The rays' two coordinates in their family.
    pub at: [[f32; RAYS]; 2],
    /// Middle of the coordinates of the valid lanes.
    pub middle: [f32; 2],
    /// Largest distance from the middle.
    pub radius: [f32; 2],
    /// Bounds of the smallest accepted depth.
    pub z_min: [[f32; RAYS]; 2],
    /// Bounds of the depth of the best hit, or of the largest accepted depth.
    pub best: [[f32; RAYS]; 2],
    /// Bits of where the best hit lies, an [`At`](crate::kernel::exact::At), or of [`NONE`].
    pub found: [f32; RAYS],
    /// Bits of the primitive of the best hit.
    pub prim: [f32; RAYS],
    /// Lanes that belong to the group.
    pub lanes: u32,
    /// Lanes that the reference test shears along the frame's axis too.
    pub upright: u32,
    /// Lanes that are not done.
    pub active: u32,
    /// Smallest depth that may matter to an active lane.
    pub nearest: f32,
    /// Largest depth that may matter to an active lane.
    pub farthest: f32,
    /// Error of the depth of an origin.
    pub rounding: f32,
}

impl Packet {
    /// A packet without rays.
    pub const EMPTY: Packet = Packet {
        first: 0,
        origin: [[0.0; RAYS]; 3],
        dir: [[0.0; RAYS]; 3],
        t: [[0.0; RAYS]; 2],
        slope: [[0.0; RAYS]; 2],
        scale: [0.0; RAYS],
        start: [0.0; RAYS],
        at: [[0.0; RAYS]; 2],
        middle: [0.0; 2],
        radius: [0.0; 2],
        z_min: [[0.0; RAYS]; 2],
        best: [[0.0; RAYS]; 2],
        found: [NONE_BITS; RAYS],
        prim: [NONE_BITS; RAYS],
        lanes: 0,
        upright: 0,
        active: 0,
        nearest: 0.0,
        farthest: 0.0,
        rounding: 0.0,
    };

    /// Puts up to sixteen rays from `first` on side by side.
    #[inline(always)]
    pub fn load(&mut self, rays: &[Ray], first: u32) {
        let count = rays.len().min(RAYS);
        self.lanes = ((1u32 << count) - 1) & ALL;
        self.first = first;
        for (lane, ray) in rays[..count].iter().enumerate() {
            for a in 0..3 {
                self.origin[a][lane] = ray.origin[a];
                self.dir[a][lane] = ray.dir[a];
            }
            (self.t[0][lane], self.t[1][lane]) = (ray.t_min, ray.t_max);
        }
    }

    /// The lanes whose rays are valid, run along `frame`'s axis, and have slopes like those of its
    /// leading ray; their slopes are noted.
    ///
    /// # Safety
    /// As for [`Vector::splat`].
    #[inline(always)]
    pub unsafe fn like<V: Vector>(&mut self, frame: &Frame) -> u32 {
        // SAFETY: passed on to the caller; rows have `RAYS` numbers.
        unsafe {
            let zero = V::splat(0.0);
            let [kx, ky, kz] = frame.axis;
            let scale = V::load(&self.dir[kz]) * V::splat(frame.sign);
            let mut like = V::splat(DIR_MIN).le(scale) & scale.le(V::splat(DIR_MAX));
            let inv = V::splat(1.0).div(scale);
            let spread = V::splat(SPREAD);
            self.upright = u32::MAX;
            for (i, k) in [kx, ky].into_iter().enumerate() {
                let slope = V::load(&self.dir[k]) * inv;
                like &= (slope - V::splat(frame.slope[i])).abs().le(spread);
                like &= if frame.slope[i] < 0.0 { slope.le(zero) } else { zero.le(slope) };
                // The first of the largest components counts.
                let across = V::load(&self.dir[k]).abs();
                self.upright &= if k < kz { across.lt(scale) } else { across.le(scale) };
                slope.store(&mut self.slope[i]);
            }
            scale.store(&mut self.scale);
            for origin in &self.origin {
                like &= V::load(origin).abs().le(V::splat(COORDINATE_MAX));
            }
            like & V::load(&self.t[0]).le(V::load(&self.t[1])) & self.lanes
        }
    }

    /// Depths of the origins, and where the rays cross the frame's plane of depth 0.
    #[inline(always)]
    unsafe fn cross<V: Vector>(&mut self, frame: &Frame) {
        // SAFETY: passed on to the caller.
        unsafe {
            let [kx, ky, kz] = frame.axis;
            let x = V::load(&self.origin[kx]) - V::splat(frame.point[kx]);
            let y = V::load(&self.origin[ky]) - V::splat(frame.point[ky]);
            let z = V::load(&self.origin[kz]) - V::splat(frame.point[kz]);
            let start = z * V::splat(frame.sign);
            let x = V::load(&self.slope[0]).neg_mul_add(start, x);
            let y = V::load(&self.slope[1]).neg_mul_add(start, y);
            start.store(&mut self.start);
            x.store(&mut self.at[0]);
            y.store(&mut self.at[1]);
        }
    }
}

/// Largest distance of the packets' origins from a point, on any axis.
#[inline(always)]
unsafe fn away<V: Vector>(packets: &[Packet], point: [f32; 3]) -> f32 {
    // SAFETY: passed on to the caller; rows have `RAYS` numbers.
    unsafe {
        let zero = V::splat(0.0);
        let mut far = zero;
        for p in packets {
            let mut most = zero;
            for (row, x) in p.origin.iter().zip(point) {
                most = most.larger_size(V::load(row) - V::splat(x));
            }
            far = far.max(most.select(p.lanes, zero));
        }
        far.highest()
    }
}

/// Largest distance of the scene from a point, on any axis.
#[inline(always)]
fn scene(bounds: &Aabb, point: [f32; 3]) -> f32 {
    (0..3).fold(0.0f32, |reach, a| {
        let (low, high) = (bounds.min[a] - point[a], bounds.max[a] - point[a]);
        reach.max(low.abs()).max(high.abs())
    })
}

/// Bounds of coordinates and directions within which no product overflows or vanishes.
const COORDINATE_MAX: f32 = 1e12;
const REACH_MIN: f32 = 1e-9;
const DIR_MIN: f32 = 1e-15;
const DIR_MAX: f32 = 1e15;

/// The frame of a group: depth along an axis, rays through a common point or in a common direction.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// The axes across and, last, along the rays, in the winding of the triangle test's shear.
    pub axis: [usize; 3],
    /// Sign of the directions along the axis.
    pub sign: f32,
    /// The common point, or any point of a parallel group.
    pub point: [f32; 3],
    /// Slopes of the leading ray, or of the middle.
    pub slope: [f32; 2],
    /// True if the rays meet in `point`, false if they are parallel.
    pub concentric: bool,
    /// Largest distance of the scene and of the origins from `point` on an axis.
    pub reach: f32,
    /// Largest distance of a ray from where the family has it.
    pub stray: f32,
}

impl Frame {
    /// The frame of a leading ray, or `None` for one without direction.
    #[inline(always)]
    pub fn of(ray: &Ray) -> Option<Frame> {
        let d = ray.dir;
        let z = (0..3).fold(0, |best, a| if d[a].abs() > d[best].abs() { a } else { best });
        let (mut x, mut y) = ((z + 1) % 3, (z + 2) % 3);
        if d[z] < 0.0 {
            std::mem::swap(&mut x, &mut y);
        }
        let scale = d[z].abs();
        if !(DIR_MIN..=DIR_MAX).contains(&scale) {
            return None;
        }
        Some(Frame {
            axis: [x, y, z],
            sign: 1f32.copysign(d[z]),
            point: ray.origin,
            slope: [d[x] / scale, d[y] / scale],
            concentric: true,
            reach: 0.0,
            stray: 0.0,
        })
    }

    /// True if a ray runs like the leading ray: what [`Packet::like`] asks of a lane, for one ray.
    #[inline(always)]
    pub fn fits(&self, ray: &Ray) -> bool {
        let [x, y, z] = self.axis.map(|k| ray.dir[k]);
        let scale = z * self.sign;
        let near = |d: f32, slope: f32| (d - slope * scale).abs() <= SPREAD * scale;
        scale > 0.0 && near(x, self.slope[0]) && near(y, self.slope[1])
    }

    /// Finds the family of the packets' lanes; `None` if they have none in this scene. `met` is where the
    /// rays of a beam before met, which is tried first, and by what share of the reach they missed it.
    ///
    /// # Safety
    /// As for [`Vector::splat`].
    #[inline(always)]
    pub unsafe fn fit<V: Vector>(
        mut self,
        packets: &mut [Packet],
        bounds: &Aabb,
        met: &mut Option<([f32; 3], f32)>,
    ) -> Option<Frame> {
        // SAFETY: passed on to the caller.
        unsafe {
            let leader = self.point;
            let around = away::<V>(packets, leader);
            self.reach = scene(bounds, leader).max(around);
            if around == 0.0 {
                self.cross_all::<V>(packets);
            } else if let Some((point, missed)) = *met
                && self.meets::<V>(packets, bounds, point, STRAY_AGAIN * missed)
            {
            } else {
                self.point = leader;
                self.reach = scene(bounds, leader).max(around);
                self.cross_all::<V>(packets);
                let (focus, spread) = self.focus::<V>(packets);
                self.concentric = focus.abs() <= FOCUS * self.reach;
                if self.concentric {
                    let [kx, ky, kz] = self.axis;
                    let [x, y] = self.mean::<V>(packets, |p| &p.at);
                    let [sx, sy] = self.mean::<V>(packets, |p| &p.slope);
                    let mut point = leader;
                    point[kx] += x + sx * focus;
                    point[ky] += y + sy * focus;
                    point[kz] += focus * self.sign;
                    self.concentric = self.meets::<V>(packets, bounds, point, STRAY);
                    *met = self.concentric.then_some((point, self.stray / self.reach));
                }
                if !self.concentric {
                    self.point = leader;
                    self.reach = scene(bounds, leader).max(around);
                    self.cross_all::<V>(packets);
                    self.stray = (2.0 * spread + CROSSING_SLACK) * self.reach;
                    if self.stray > STRAY * self.reach {
                        return None;
                    }
                }
            }
            let far = self.point.iter().fold(self.reach, |m, x| m.max(x.abs()));
            (self.reach >= REACH_MIN && far <= COORDINATE_MAX).then_some(self)
        }
    }

    /// Takes a point as that where the rays meet, and says whether they stray from it by `most` times the reach at most.
    #[inline(always)]
    unsafe fn meets<V: Vector>(
        &mut self,
        packets: &mut [Packet],
        bounds: &Aabb,
        point: [f32; 3],
        most: f32,
    ) -> bool {
        // SAFETY: passed on to the caller.
        unsafe {
            self.point = point;
            self.reach = scene(bounds, point).max(away::<V>(packets, point));
            self.cross_all::<V>(packets);
            self.stray = self.miss::<V>(packets);
            self.stray <= most * self.reach
        }
    }

    /// Bound of the distance by which a ray misses the point.
    #[inline(always)]
    unsafe fn miss<V: Vector>(&self, packets: &[Packet]) -> f32 {
        // SAFETY: passed on to the caller.
        unsafe {
            let zero = V::splat(0.0);
            let (mut miss, mut offset) = (zero, zero);
            for p in packets {
                let across = V::load(&p.at[0]).larger_size(V::load(&p.at[1]));
                let slope = V::load(&p.slope[0]).larger_size(V::load(&p.slope[1]));
                miss = miss.max(across.select(p.lanes, zero));
                let product = (slope * V::load(&p.start)).abs();
                offset = offset.max(product.select(p.lanes, zero));
            }
            CROSSING_SLACK.mul_add(offset.highest(), miss.highest())
        }
    }

    #[inline(always)]
    unsafe fn cross_all<V: Vector>(&self, packets: &mut [Packet]) {
        for packet in packets {
            // SAFETY: passed on to the caller.
            unsafe { packet.cross::<V>(self) };
        }
    }

    /// Smallest and largest values of two rows over all lanes.
    #[inline(always)]
    unsafe fn extent<V: Vector>(
        &self,
        packets: &[Packet],
        rows: impl Fn(&Packet) -> &[[f32; RAYS]; 2],
    ) -> [[f32; 2]; 2] {
        // SAFETY: passed on to the caller.
        unsafe {
            let mut extent = [[0.0; 2]; 2];
            for i in 0..2 {
                let mut low = V::splat(f32::INFINITY);
                let mut high = V::splat(f32::NEG_INFINITY);
                for p in packets {
                    let x = V::load(&rows(p)[i]);
                    low = low.min(x.select(p.lanes, low));
                    high = high.max(x.select(p.lanes, high));
                }
                extent[i] = [low.lowest(), high.highest()];
            }
            extent
        }
    }

    #[inline(always)]
    unsafe fn mean<V: Vector>(
        &self,
        packets: &[Packet],
        rows: impl Fn(&Packet) -> &[[f32; RAYS]; 2],
    ) -> [f32; 2] {
        // SAFETY: passed on to the caller.
        unsafe {
            let zero = V::splat(0.0);
            let count: u32 = packets.iter().map(|p| p.lanes.count_ones()).sum();
            let mut mean = [0.0; 2];
            for i in 0..2 {
                let mut sum = zero;
                for p in packets {
                    sum = sum + V::load(&rows(p)[i]).select(p.lanes, zero);
                }
                mean[i] = sum.sum() / count as f32;
            }
            mean
        }
    }

    /// The depth at which the rays come closest to one point, by least squares, and the largest
    /// deviation of a slope from the leading ray's.
    #[inline(always)]
    unsafe fn focus<V: Vector>(&self, packets: &[Packet]) -> (f32, f32) {
        // SAFETY: passed on to the caller.
        unsafe {
            let mean = self.mean::<V>(packets, |p| &p.slope);
            let zero = V::splat(0.0);
            let (mut squares, mut products, mut spread) = (zero, zero, zero);
            for p in packets {
                for i in 0..2 {
                    let slope = V::load(&p.slope[i]);
                    let off = (slope - V::splat(mean[i])).select(p.lanes, zero);
                    squares = off.mul_add(off, squares);
                    products = off.mul_add(V::load(&p.at[i]).select(p.lanes, zero), products);
                    let off = (slope - V::splat(self.slope[i])).abs();
                    spread = spread.max(off.select(p.lanes, zero));
                }
            }
            let squares = squares.sum();
            let focus = if squares > 0.0 { -products.sum() / squares } else { f32::INFINITY };
            (focus, spread.highest())
        }
    }

    /// Makes the packets ready for tests: coordinates in the family, ranges.
    ///
    /// # Safety
    /// As for [`Vector::splat`].
    #[inline(always)]
    pub unsafe fn place<V: Vector>(&mut self, packets: &mut [Packet]) {
        // SAFETY: passed on to the caller.
        unsafe {
            if self.concentric {
                let slopes = self.extent::<V>(packets, |p| &p.slope);
                self.slope = slopes.map(|[low, high]| 0.5 * (low + high));
            }
            for p in packets {
                if self.concentric {
                    for i in 0..2 {
                        let at = V::load(&p.slope[i]) - V::splat(self.slope[i]);
                        at.store(&mut p.at[i]);
                    }
                }
                self.bound::<V>(p);
            }
        }
    }

    /// The shaft of packets that have their place.
    ///
    /// # Safety
    /// As for [`Vector::splat`].
    #[inline(always)]
    pub unsafe fn shaft<V: Vector>(&self, packets: &[Packet]) -> Shaft {
        // SAFETY: passed on to the caller.
        let (slopes, origins) = unsafe {
            let slopes = self.extent::<V>(packets, |p| &p.slope);
            let concentric = self.concentric;
            let none = [[0.0; 2]; 2];
            (slopes, if concentric { none } else { self.extent::<V>(packets, |p| &p.at) })
        };
        let mut shaft =
            Shaft { first: [0.0; 4], last: [0.0; 4], inv: [0.0; 4], inv_wide: [0.0; 4] };
        let far = self.point.iter().fold(self.reach, |m, x| m.max(x.abs()));
        let slack = COORDINATE_SLACK * far + 2.0 * self.stray;
        for i in 0..2 {
            let k = self.axis[i];
            let [low, high] = origins[i];
            shaft.set(k, [self.point[k] + low - slack, self.point[k] + high + slack], slopes[i]);
        }
        let z = self.axis[2];
        shaft.set(z, [self.point[z] - slack, self.point[z] + slack], [self.sign; 2]);
        shaft
    }

    /// Bounds of the depths at which parameters end; nothing lies farther away than the reach.
    #[inline(always)]
    unsafe fn depth<V: Vector>(&self, t: &[f32; RAYS], scale: V, start: V) -> [V; 2] {
        // SAFETY: passed on to the caller; rows have `RAYS` numbers.
        unsafe {
            let (near, far) = (V::splat(-2.0 * self.reach), V::splat(2.0 * self.reach));
            let z = V::load(t).mul_add(scale, start).min(far).max(near);
            let slack = V::splat(DEPTH_SLACK) * (z.abs() + start.abs());
            [z - slack, z + slack]
        }
    }

    /// Sets the middle and the radius of a packet, and the depths of its ranges.
    #[inline(always)]
    unsafe fn bound<V: Vector>(&self, p: &mut Packet) {
        // SAFETY: passed on to the caller.
        unsafe {
            let (infinite, zero) = (V::splat(f32::INFINITY), V::splat(0.0));
            for i in 0..2 {
                let at = V::load(&p.at[i]);
                let low = at.select(p.lanes, infinite).lowest();
                let high = at.select(p.lanes, zero - infinite).highest();
                p.middle[i] = 0.5 * (low + high);
                p.radius[i] = (high - p.middle[i]).max(p.middle[i] - low) * (1.0 + 4.0 * U);
            }
            let (start, scale) = (V::load(&p.start), V::load(&p.scale));
            let [from, from_high] = self.depth(&p.t[0], scale, start);
            let [to_low, to] = self.depth(&p.t[1], scale, start);
            from.store(&mut p.z_min[0]);
            from_high.store(&mut p.z_min[1]);
            to_low.store(&mut p.best[0]);
            to.store(&mut p.best[1]);
            p.found = [NONE_BITS; RAYS];
            p.prim = [NONE_BITS; RAYS];
            p.active = p.lanes;
            p.rounding = DEPTH_SLACK * start.abs().select(p.lanes, zero).highest();
            p.nearest = from.select(p.lanes, infinite).lowest();
        }
    }
}
