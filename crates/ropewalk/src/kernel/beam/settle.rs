//! What the reference test says, for all lanes of a packet at once where it goes the straight way.

#![allow(unsafe_code)]

use super::frame::{NONE, Packet, RAYS};
use super::shaft::BeamSimd;
use super::vector::{Doubles, Vector};
use crate::kernel::exact::{At, Exact, meet, widen};
use crate::wide::{ID_MASK, Lines, SIDES_BACK, SIDES_FRONT, WIDTH};

/// A triangle for each lane: vertices by axis of the frame.
#[repr(C, align(64))]
pub struct Corners([[[f32; RAYS]; 3]; 3]);

/// What the reference test says about the triangle of each lane.
pub struct Judgement {
    /// Parameters of the hits.
    pub t: [f32; RAYS],
    /// Lanes that hit, in their range, not minding sides.
    pub hit: u32,
    /// Lanes that miss.
    pub miss: u32,
    /// Lanes that see the front.
    pub front: u32,
}

/// What a packet has found: parameters, primitives, and the lanes to be asked again.
pub type Settled = ([f32; RAYS], [u32; RAYS], u32);

/// The lanes that see a triangle from a side on which it can be hit.
#[inline(always)]
pub fn accepted(lines: &Lines, at: At, front: u32) -> u32 {
    match lines.block(at as usize / WIDTH).id[at as usize % WIDTH] & !ID_MASK {
        SIDES_FRONT => front,
        SIDES_BACK => !front,
        _ => u32::MAX,
    }
}

impl Corners {
    /// No triangles.
    pub const EMPTY: Corners = Corners([[[0.0; RAYS]; 3]; 3]);

    /// Puts the triangle `at` into some lanes.
    ///
    /// # Safety
    /// As for [`Vector::splat`].
    #[inline(always)]
    unsafe fn put<V: Vector>(&mut self, lines: &Lines, at: At, axis: [usize; 3], lanes: u32) {
        let vertex = &lines.block(at as usize / WIDTH).vertex;
        let at = at as usize % WIDTH;
        for i in 0..3 {
            for a in 0..3 {
                let row = &mut self.0[i][a];
                // SAFETY: passed on to the caller; rows have `RAYS` numbers.
                unsafe { V::splat(vertex[i][axis[a]][at]).select(lanes, V::load(row)).store(row) };
            }
        }
    }

    /// Puts the triangle `at` into all lanes.
    pub fn fill(&mut self, lines: &Lines, at: At, axis: [usize; 3]) {
        let vertex = &lines.block(at as usize / WIDTH).vertex;
        let at = at as usize % WIDTH;
        for (corner, rows) in self.0.iter_mut().zip(vertex) {
            for (row, k) in corner.iter_mut().zip(axis) {
                *row = [rows[k][at]; RAYS];
            }
        }
    }
}

/// [`meet`] for the rays of a packet and their ranges: lanes that are neither a hit nor a miss are
/// too close to an edge, seen edge-on, or sheared along another axis than the frame's.
///
/// # Safety
/// As for [`Vector::splat`].
#[inline(always)]
pub unsafe fn judge<L: BeamSimd>(
    packet: &Packet,
    corners: &Corners,
    axis: [usize; 3],
) -> Judgement {
    let mut judgement = Judgement { t: [0.0; RAYS], hit: 0, miss: 0, front: 0 };
    for first in (0..RAYS).step_by(L::Doubles::LANES) {
        // SAFETY: passed on to the caller; `LANES` divides `RAYS`.
        unsafe { judge_lanes::<L::Doubles>(packet, corners, axis, first, &mut judgement) };
    }
    judgement.hit &= packet.upright;
    judgement.miss &= packet.upright;
    judgement
}

/// Bound of a sum of products in units of half an ulp of 1 times the sum of their sizes: a term of three factors,
/// of which two are differences, and their own product a difference again, is off by seven roundings, the sums add three.
const TERMS_SLACK: f32 = 16.0 * f32::EPSILON / 2.0;

/// Far beyond the reference test's own error in units of the largest product: some 30 terms in `f64`.
const REFERENCE_SLACK: f32 = 1.0 / (1u64 << 44) as f32;

/// Far above what underflows in `f32`; see [`behind`].
const TINY: f32 = 1e-30;

/// The lanes whose rays start beyond the plane of the triangle `at`, so that the reference test misses it: its parameter
/// is below 0 for certain, however close to the triangle they start.
///
/// With the normal `n` of the plane and its vertex `a`, `t = n (a - origin) / n dir`. The signs of both products are taken
/// where they exceed their rounding here and that of the reference test, which multiplies up to three coordinates
/// relative to the origin (`reach` bounds them); differences are exact but for one rounding, so that the bound shrinks with the
/// distance from the triangle.
///
/// # Safety
/// As for [`Vector::splat`].
#[inline(always)]
pub unsafe fn behind<V: Vector>(packet: &Packet, lines: &Lines, at: At) -> u32 {
    let vertex = &lines.block(at as usize / WIDTH).vertex;
    let at = at as usize % WIDTH;
    let a = [0, 1, 2].map(|k| vertex[0][k][at]);
    let e = [0, 1, 2].map(|k| vertex[1][k][at] - a[k]);
    let f = [0, 1, 2].map(|k| vertex[2][k][at] - a[k]);
    let longest = |v: [f32; 3]| v.iter().fold(0.0f32, |m, x| m.max(x.abs()));
    let longest = longest(e).max(longest(f));
    // SAFETY: passed on to the caller; rows have `RAYS` numbers.
    unsafe {
        let zero = V::splat(0.0);
        let (mut way, mut way_size, mut away) = (zero, zero, V::splat(longest));
        let (mut slope, mut slope_size, mut dir_size) = (zero, zero, zero);
        for k in 0..3 {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            let (p, q) = (e[i] * f[j], e[j] * f[i]);
            let (n, size) = (V::splat(p - q), V::splat(p.abs() + q.abs()));
            let off = V::splat(a[k]) - V::load(&packet.origin[k]);
            let dir = V::load(&packet.dir[k]);
            way = n.mul_add(off, way);
            way_size = size.mul_add(off.abs(), way_size);
            away = away.larger_size(off);
            slope = n.mul_add(dir, slope);
            slope_size = size.mul_add(dir.abs(), slope_size);
            dir_size = dir_size.larger_size(dir);
        }
        let reach = away + V::splat(longest);
        let (terms, reference) = (V::splat(TERMS_SLACK), V::splat(REFERENCE_SLACK));
        let squares = reference * reach * reach;
        let slope_slack = terms.mul_add(slope_size, squares * dir_size) + V::splat(TINY);
        let way_slack = terms.mul_add(way_size, squares * reach) + V::splat(TINY);
        let way_slack = slope.abs().mul_add(V::splat(TINY), way_slack);
        let ends = (slope_slack.lt(slope) & way.lt(zero - way_slack))
            | (slope.lt(zero - slope_slack) & way_slack.lt(way));
        ends & zero.le(V::load(&packet.t[0]))
    }
}

/// The lanes from `first` on.
#[inline(always)]
unsafe fn judge_lanes<D: Doubles>(
    packet: &Packet,
    corners: &Corners,
    axis: [usize; 3],
    first: usize,
    judgement: &mut Judgement,
) {
    // SAFETY: passed on to the caller.
    unsafe {
        let [kx, ky, kz] = axis;
        let (o, d) = (&packet.origin, &packet.dir);
        let origin = widen::<D>([&o[kx], &o[ky], &o[kz]], first);
        let dir = widen::<D>([&d[kx], &d[ky], &d[kz]], first);
        let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = &corners.0;
        let a = widen::<D>([ax, ay, az], first);
        let b = widen::<D>([bx, by, bz], first);
        let c = widen::<D>([cx, cy, cz], first);
        let met = meet(origin, dir, [a, b, c]);
        met.t.narrow(&mut judgement.t[first..]);
        // The range is compared after rounding.
        let t = D::widen(&judgement.t[first..]);
        let (t_min, t_max) = (D::widen(&packet.t[0][first..]), D::widen(&packet.t[1][first..]));
        let within = t_min.le(t) & t.le(t_max);
        judgement.hit |= (met.hit & within) << first;
        judgement.miss |= (met.miss | (met.hit & !within)) << first;
        judgement.front |= met.front << first;
    }
}

/// Parameters and primitives of what a packet has found: infinity and [`NONE`] where that is nothing.
/// Last, the lanes whose find the reference test denies, which is never the case.
///
/// # Safety
/// As for [`Vector::splat`].
#[inline(always)]
pub unsafe fn settle<L: BeamSimd>(
    packet: &Packet,
    corners: &mut Corners,
    exact: &Exact<'_>,
    axis: [usize; 3],
) -> Settled {
    let mut t = [f32::INFINITY; RAYS];
    let prim = packet.prim.map(f32::to_bits);
    // SAFETY: passed on to the caller.
    let hits = unsafe { gather::<L>(packet, packet.lanes, corners, exact.lines, axis) };
    if hits == 0 {
        return (t, prim, 0);
    }
    // SAFETY: passed on to the caller.
    let judgement = unsafe { judge::<L>(packet, corners, axis) };
    for lane in 0..RAYS {
        t[lane] = if prim[lane] == NONE { f32::INFINITY } else { judgement.t[lane] };
    }
    let (mut open, mut denied) = (hits & !judgement.hit, 0);
    while open != 0 {
        let lane = open.trailing_zeros() as usize;
        open &= open - 1;
        match exact.hit(packet.first + lane as u32, packet.found[lane].to_bits()) {
            Some(hit) => t[lane] = hit.t,
            None => denied |= 1 << lane,
        }
    }
    (t, prim, denied)
}

/// Puts what some lanes have found into the corners; returns the lanes that have found something.
///
/// # Safety
/// As for [`Vector::splat`].
#[inline(always)]
pub unsafe fn gather<L: BeamSimd>(
    packet: &Packet,
    lanes: u32,
    corners: &mut Corners,
    lines: &Lines,
    axis: [usize; 3],
) -> u32 {
    // SAFETY: passed on to the caller; rows have `RAYS` numbers.
    unsafe {
        let found = L::Rays::load(&packet.found);
        let mut rest = lanes & !found.equals(NONE);
        let hits = rest;
        while rest != 0 {
            let at = packet.found[rest.trailing_zeros() as usize].to_bits();
            let same = found.equals(at) & rest;
            rest &= !same;
            corners.put::<L::Rays>(lines, at, axis, same);
        }
        hits
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::BuildSettings;
    use crate::geometry::Geometry;
    use crate::kernel::beam::PortableLanes;
    use crate::kernel::exact::place;
    use crate::kernel::random::Random;
    use crate::primitive::{Sides, Triangle};
    use crate::ray::Ray;
    use crate::wide::WideTree;

    /// Rays that start in a triangle, a few ulps beside it, or near it, at many sizes and places, slivers among them.
    #[test]
    fn rays_said_to_start_beyond_a_triangle_miss_it() {
        let mut random = Random(0x5EED_0F7A_91E5);
        let (mut asked, mut behind_count, mut near_count) = (0u32, 0u32, 0u32);
        for round in 0..4000 {
            let size = [1e-20, 1e-6, 1.0, 1e6][round % 4] * (1.0 + random.share());
            let place_of = [0.0, 1.0, 100.0][random.below(3)] * size;
            let middle: [f32; 3] = std::array::from_fn(|_| place_of * random.signed());
            let mut vertex = || std::array::from_fn(|a| middle[a] + size * random.signed());
            let (a, b, mut c): ([f32; 3], [f32; 3], [f32; 3]) = (vertex(), vertex(), vertex());
            if round % 3 == 0 {
                // A sliver.
                let s = random.share();
                c = std::array::from_fn(|k| {
                    a[k] + s * (b[k] - a[k]) + size * 1e-5 * random.signed()
                });
            }
            let from = |random: &mut Random| {
                let (u, v) = (random.share(), random.share());
                let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                let off = [0.0, 1e-7, 1e-6, 1e-3][random.below(4)] * size;
                std::array::from_fn(|k| {
                    a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]) + off * random.signed()
                })
            };
            let rays: Vec<Ray> = (0..RAYS)
                .map(|_| {
                    let origin = from(&mut random);
                    let dir = std::array::from_fn(|_| random.signed());
                    Ray { origin, dir, t_min: 0.0, t_max: f32::INFINITY }
                })
                .collect();
            let mut geometry = Geometry::new();
            geometry.push(Triangle { vertices: [a, b, c] }, Sides::Both).unwrap();
            let (tree, _) = WideTree::build(&geometry, &BuildSettings::default(), &()).unwrap();
            let Some(line) = tree.block_lines(tree.root()).next() else { continue };
            let (at, mut packet) = (place(line, 0), Packet::EMPTY);
            packet.load(&rays, 0);
            let exact = Exact { lines: tree.lines(), rays: &rays };
            // SAFETY: portable code.
            let behind = unsafe { behind::<PortableLanes<RAYS>>(&packet, tree.lines(), at) };
            for lane in 0..RAYS {
                let hit = exact.hit(lane as u32, at);
                asked += 1;
                near_count += u32::from(hit.is_some());
                behind_count += behind >> lane & 1;
                assert!(
                    behind >> lane & 1 == 0 || hit.is_none(),
                    "{:?} hits {:?} at {hit:?}",
                    rays[lane],
                    [a, b, c]
                );
            }
        }
        // Neither "never" nor "always" passes.
        assert!(behind_count > asked / 10, "{behind_count} of {asked} are said to start beyond");
        assert!(near_count > asked / 10, "{near_count} of {asked} hit");
    }
}
