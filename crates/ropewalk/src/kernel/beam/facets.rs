//! Eight triangles as a beam sees them: edge functions linear in the rays' two coordinates.

#![allow(unsafe_code)]

use super::frame::{CORNER_SLACK, DEPTH_SLACK, Frame, PRODUCT_SLACK, Packet};
use super::vector::Vector;
use crate::kernel::exact::At;
use crate::kernel::query::BatchQuery;
use crate::wide::{Block, ID_MASK, SIDES_BACK, SIDES_FRONT, WIDTH};

/// A row: one number a triangle.
type Row = [f32; WIDTH];

/// The triangles of a block in a frame.
///
/// With the vertices sheared along the frame's slope, `x` and `y` across and `z` along it, and `h = z`
/// for rays through a common point, `h = 1` for parallel ones, the edge function of `p` and `q` for the
/// ray at `(a, b)` is that of `(x - a h, y - b h)`:
///
/// ```text
/// (p_x q_y - p_y q_x) + a (p_y h_q - h_p q_y) + b (h_p q_x - p_x h_q)
/// ```
/// Rows are stored with the sign that makes the sum of the three positive in the middle of the beam.
#[repr(C, align(64))]
pub struct Facets {
    /// Constant, and factors of `a` and `b`, of the three edge functions.
    edge: [[Row; 3]; 3],
    /// Depths of the vertices.
    depth: [Row; 3],
    /// Nearest and farthest depth, widened by their error.
    range: [Row; 2],
    /// Error of an edge function.
    slack: Row,
    /// Error of an interpolated depth times the sum of the edge functions.
    blur: Row,
    /// Rounding error of a depth.
    rounding: Row,
    /// Triangles that cannot be hit from the side that the middle of the beam sees, one bit each.
    culled: u32,
}

/// Two packets as a block sees them: a lane for each of its triangles and each of the two.
#[repr(C, align(64))]
#[derive(Clone)]
pub struct Couple {
    middle: [[f32; 2 * WIDTH]; 2],
    radius: [[f32; 2 * WIDTH]; 2],
    nearest: [f32; 2 * WIDTH],
    farthest: [f32; 2 * WIDTH],
}

impl Couple {
    /// No packets.
    pub const EMPTY: Couple = Couple {
        middle: [[0.0; 2 * WIDTH]; 2],
        radius: [[0.0; 2 * WIDTH]; 2],
        nearest: [0.0; 2 * WIDTH],
        farthest: [0.0; 2 * WIDTH],
    };

    /// Puts a packet in place 0 or 1.
    #[inline(always)]
    pub fn set(&mut self, place: usize, packet: &Packet) {
        let lanes = WIDTH * place..WIDTH * (place + 1);
        for i in 0..2 {
            self.middle[i][lanes.clone()].fill(packet.middle[i]);
            self.radius[i][lanes.clone()].fill(packet.radius[i]);
        }
        self.nearest[lanes].fill(packet.nearest);
        self.set_farthest(place, packet);
    }

    /// The same where only the depth of hits has changed.
    #[inline(always)]
    pub fn set_farthest(&mut self, place: usize, packet: &Packet) {
        self.farthest[WIDTH * place..WIDTH * (place + 1)].fill(packet.farthest);
    }
}

/// Which triangles may be hit by two packets, a byte of bits for each of the two.
pub struct Facing {
    /// Those that all rays see from one side.
    pub clear: u32,
    /// Those that may be seen edge-on.
    pub edge_on: u32,
}

impl Facets {
    /// Facets without triangles.
    pub const EMPTY: Facets = Facets {
        edge: [[[0.0; WIDTH]; 3]; 3],
        depth: [[0.0; WIDTH]; 3],
        range: [[0.0; WIDTH]; 2],
        slack: [0.0; WIDTH],
        blur: [0.0; WIDTH],
        rounding: [0.0; WIDTH],
        culled: 0,
    };

    /// The triangles of `block` for rays within `radius` of the frame's slope or point.
    ///
    /// # Safety
    /// As for [`Vector::splat`].
    #[inline(always)]
    pub unsafe fn project<V: Vector>(&mut self, frame: &Frame, radius: [f32; 2], block: &Block) {
        // SAFETY: passed on to the caller; rows have `WIDTH` numbers.
        unsafe {
            let a = corner::<V>(frame, &block.vertex[0]);
            let b = corner::<V>(frame, &block.vertex[1]);
            let c = corner::<V>(frame, &block.vertex[2]);
            // The edges in the order of the triangle test, so that signs agree.
            let edges = [edge(c, b), edge(a, c), edge(b, a)];
            let sum = edges[0][0] + edges[1][0] + edges[2][0];
            for e in 0..3 {
                for factor in 0..3 {
                    edges[e][factor].flip(sum).store(&mut self.edge[e][factor]);
                }
            }
            a[2].store(&mut self.depth[0]);
            b[2].store(&mut self.depth[1]);
            c[2].store(&mut self.depth[2]);
            let (near, far) = (a[2].min(b[2]).min(c[2]), a[2].max(b[2]).max(c[2]));
            let away = near.larger_size(far);
            let rounding = V::splat(DEPTH_SLACK) * away;
            rounding.store(&mut self.rounding);
            (near - rounding).store(&mut self.range[0]);
            (far + rounding).store(&mut self.range[1]);
            // Extent of the vertices, and of vertices and rays.
            let h = if frame.concentric { away } else { V::splat(1.0) };
            let (low_x, high_x) = (a[0].min(b[0]).min(c[0]), a[0].max(b[0]).max(c[0]));
            let (low_y, high_y) = (a[1].min(b[1]).min(c[1]), a[1].max(b[1]).max(c[1]));
            let (size_x, size_y) = (high_x - low_x, high_y - low_y);
            let wide_x = V::splat(radius[0]).mul_add(h, low_x.larger_size(high_x));
            let wide_y = V::splat(radius[1]).mul_add(h, low_y.larger_size(high_y));
            let across = V::splat(CORNER_SLACK).mul_add(away, V::splat(2.0 * frame.stray));
            let rounded = V::splat(PRODUCT_SLACK) * wide_x * wide_y;
            across.mul_add(wide_x + wide_y, rounded).store(&mut self.slack);
            let blur = across.mul_add(size_x + size_y, rounded) * (far - near);
            (blur + blur).store(&mut self.blur);
            self.culled = culled(block, V::splat(0.0).lt(sum));
        }
    }

    /// Edge function `e` in the middles of two packets, how far it may be from that in each, and its
    /// two factors.
    #[inline(always)]
    unsafe fn reach<V: Vector>(&self, e: usize, couple: &Couple) -> [V; 4] {
        // SAFETY: passed on to the caller; rows have `WIDTH` numbers, those of couples twice as many.
        unsafe {
            let (a, b) = (V::load(&couple.middle[0]), V::load(&couple.middle[1]));
            let (ra, rb) = (V::load(&couple.radius[0]), V::load(&couple.radius[1]));
            let [constant, by_a, by_b] = &self.edge[e];
            let (by_a, by_b) = (twice::<V>(by_a), twice::<V>(by_b));
            let middle = b.mul_add(by_b, a.mul_add(by_a, twice(constant)));
            let reach = rb.mul_add(by_b.abs(), ra.mul_add(by_a.abs(), twice(&self.slack)));
            [middle, reach, by_a, by_b]
        }
    }

    /// The triangles that some ray of two packets may hit from depth `enter` on.
    ///
    /// # Safety
    /// As for [`Vector::splat`]; `V` must have twice [`WIDTH`] lanes.
    #[inline(always)]
    pub unsafe fn facing<V: Vector>(&self, couple: &Couple, enter: f32) -> Facing {
        // SAFETY: passed on to the caller; rows have `WIDTH` numbers, those of couples twice as many.
        unsafe {
            let (ra, rb) = (V::load(&couple.radius[0]), V::load(&couple.radius[1]));
            let slack = twice::<V>(&self.slack);
            let u = self.reach::<V>(0, couple);
            let v = self.reach::<V>(1, couple);
            let w = self.reach::<V>(2, couple);
            let zero = V::splat(0.0);
            let high = (u[0] + u[1]).min(v[0] + v[1]).min(w[0] + w[1]);
            let low = (u[0] - u[1]).max(v[0] - v[1]).max(w[0] - w[1]);
            let sum = u[0] + v[0] + w[0];
            let reach = ra.mul_add((u[2] + v[2] + w[2]).abs(), slack + slack);
            let reach = rb.mul_add((u[3] + v[3] + w[3]).abs(), reach);
            let clear = reach.lt(sum);
            let farthest = V::load(&couple.farthest);
            let near = twice::<V>(&self.range[0]).max(V::splat(enter));
            let ahead = near.le(farthest) & V::load(&couple.nearest).le(twice(&self.range[1]));
            let front = zero.le(high);
            let culled = self.culled | self.culled << WIDTH;
            Facing {
                clear: clear & ahead & front & !culled,
                edge_on: !clear & ahead & (front | low.le(zero)),
            }
        }
    }
}

/// A row for each of two packets.
#[inline(always)]
unsafe fn twice<V: Vector>(row: &Row) -> V {
    // SAFETY: passed on to the caller; rows have `WIDTH` numbers.
    unsafe { V::load_two(row, row) }
}

/// A vertex of eight triangles in a frame: `x`, `y`, `z` and `h`.
#[inline(always)]
unsafe fn corner<V: Vector>(frame: &Frame, vertex: &[Row; 3]) -> [V; 4] {
    // SAFETY: passed on to the caller; rows have `WIDTH` numbers.
    unsafe {
        let [kx, ky, kz] = frame.axis;
        let z = (V::load(&vertex[kz]) - V::splat(frame.point[kz])) * V::splat(frame.sign);
        let x = V::load(&vertex[kx]) - V::splat(frame.point[kx]);
        let y = V::load(&vertex[ky]) - V::splat(frame.point[ky]);
        let h = if frame.concentric { z } else { V::splat(1.0) };
        let x = V::splat(frame.slope[0]).neg_mul_add(z, x);
        [x, V::splat(frame.slope[1]).neg_mul_add(z, y), z, h]
    }
}

/// Constant and factors of an edge function.
#[inline(always)]
fn edge<V: Vector>(p: [V; 4], q: [V; 4]) -> [V; 3] {
    [p[0] * q[1] - p[1] * q[0], p[1] * q[3] - p[3] * q[1], p[3] * q[0] - p[0] * q[3]]
}

/// The lanes of a packet that a triangle concerns.
pub struct Verdict {
    /// Lanes that it hits for certain, in front of what they hit before.
    pub hit: u32,
    /// Lanes for which `f32` cannot tell.
    pub open: u32,
}

impl Facets {
    /// Edge function `e` of triangle `i` for rays at `(a, b)`.
    #[inline(always)]
    unsafe fn at<V: Vector>(&self, e: usize, i: usize, a: V, b: V) -> V {
        // SAFETY: passed on to the caller.
        unsafe {
            let [constant, by_a, by_b] = &self.edge[e];
            let u = a.mul_add(V::splat(by_a[i]), V::splat(constant[i]));
            b.mul_add(V::splat(by_b[i]), u)
        }
    }

    /// The active rays of a packet that triangle `i`, seen from one side, may lie in the way of, whatever its depth.
    ///
    /// # Safety
    /// As for [`Vector::splat`].
    #[inline(always)]
    pub unsafe fn touched<V: Vector>(&self, i: usize, packet: &Packet) -> u32 {
        // SAFETY: passed on to the caller; rows have `RAYS` numbers.
        unsafe {
            let (a, b) = (V::load(&packet.at[0]), V::load(&packet.at[1]));
            let (u, v, w) = (self.at(0, i, a, b), self.at(1, i, a, b), self.at(2, i, a, b));
            V::splat(-self.slack[i]).le(u.min(v).min(w)) & packet.active
        }
    }

    /// Tests triangle `i`, seen from one side, with all active rays of a packet; takes certain hits.
    ///
    /// # Safety
    /// As for [`Vector::splat`].
    #[inline(always)]
    pub unsafe fn test<V: Vector, Q: BatchQuery>(
        &self,
        i: usize,
        at: At,
        prim: u32,
        packet: &mut Packet,
    ) -> Verdict {
        // SAFETY: passed on to the caller; rows have `RAYS` numbers.
        unsafe {
            let (a, b) = (V::load(&packet.at[0]), V::load(&packet.at[1]));
            let (u, v, w) = (self.at(0, i, a, b), self.at(1, i, a, b), self.at(2, i, a, b));
            let low = u.min(v).min(w);
            let slack = self.slack[i];
            let touched = V::splat(-slack).le(low) & packet.active;
            if touched == 0 {
                return Verdict { hit: 0, open: 0 };
            }
            let inside = V::splat(2.0 * slack).le(low) & touched;
            let (za, zb, zc) = (self.depth[0][i], self.depth[1][i], self.depth[2][i]);
            let r = V::splat(1.0).div(u + v + w);
            let z = w.mul_add(V::splat(zc - za), v * V::splat(zb - za));
            let z = z.mul_add(r, V::splat(za));
            // The sum of the edge functions is six times their error at least: see `blur`.
            let weight = V::splat(6.0 * slack).mul_add(r, V::splat(1.0)) * r;
            let rounding = V::splat(self.rounding[i] + packet.rounding);
            let blur = weight.mul_add(V::splat(self.blur[i]), rounding);
            let (near, far) = (z - blur, z + blur);
            let (best_low, best_high) = (V::load(&packet.best[0]), V::load(&packet.best[1]));
            let (min_low, min_high) = (V::load(&packet.z_min[0]), V::load(&packet.z_min[1]));
            let hit = inside & far.lt(best_low) & min_high.lt(near);
            // Not certainly behind the best hit or before the range.
            let matters = inside & near.le(best_high) & min_low.le(far) & !hit;
            let unclear = touched & !inside & V::splat(self.range[0][i]).le(best_high);
            if hit == 0 {
            } else if Q::ANY {
                packet.active &= !hit;
            } else {
                near.select(hit, best_low).store(&mut packet.best[0]);
                far.select(hit, best_high).store(&mut packet.best[1]);
                let at = V::splat(f32::from_bits(at));
                at.select(hit, V::load(&packet.found)).store(&mut packet.found);
                let prim = V::splat(f32::from_bits(prim));
                prim.select(hit, V::load(&packet.prim)).store(&mut packet.prim);
            }
            Verdict { hit, open: matters | unclear }
        }
    }

    /// Tests triangle `i`, which may be seen edge-on: nothing is certain.
    ///
    /// # Safety
    /// As for [`Vector::splat`].
    #[inline(always)]
    pub unsafe fn test_edge_on<V: Vector>(&self, i: usize, packet: &Packet) -> Verdict {
        // SAFETY: passed on to the caller; rows have `RAYS` numbers.
        unsafe {
            let (a, b) = (V::load(&packet.at[0]), V::load(&packet.at[1]));
            let (u, v, w) = (self.at(0, i, a, b), self.at(1, i, a, b), self.at(2, i, a, b));
            let (low, high) = (u.min(v).min(w), u.max(v).max(w));
            let slack = self.slack[i];
            let outside = low.lt(V::splat(-slack)) & V::splat(slack).lt(high);
            let ahead = V::splat(self.range[0][i]).le(V::load(&packet.best[1]));
            Verdict { hit: 0, open: packet.active & ahead & !outside }
        }
    }
}

/// The triangles whose visible side is not one on which they can be hit; `front` has the bits of
/// those that show their front.
#[inline(always)]
fn culled(block: &Block, front: u32) -> u32 {
    let sided = block.id.iter().fold(0, |sides, id| sides | id) & !ID_MASK;
    if sided == 0 {
        return 0;
    }
    let hidden = |i: usize| match block.id[i] & !ID_MASK {
        SIDES_FRONT => !front >> i & 1,
        SIDES_BACK => front >> i & 1,
        _ => 0,
    };
    (0..WIDTH).fold(0, |mask, i| mask | hidden(i) << i)
}
