//! The portable level: what the SIMD levels must equal bit for bit.

#![allow(unsafe_code)]

use super::beam::PortableLanes;
use super::entry::{Corners, Locate, REACH, Segment, path};
use super::entry_packet::{Columns, PACKET};
use super::level::{
    DEPTH_SLACK, Found, Nearest, ROUNDED_DEPTH, ROUNDED_SIZE, Range, Root, Simd, WEIGHT_SLACK,
};
use super::near::near;
use super::slot::{Loaded, Slot, TINY};
use super::vicinity::Cells;
use crate::ray::Ray;
use crate::wide::{Block, ID_MASK, ORDER, SIDES_BOTH, Treelet, WIDTH};

/// Portable code.
#[derive(Clone, Copy)]
pub struct Scalar;

impl Simd for Scalar {
    type Doubles = f64;

    #[inline(always)]
    unsafe fn load(slot: &mut Slot, ray: &Ray, index: u32, scene: &Root) -> Loaded {
        slot.load(ray, index, &scene.bounds, scene.code)
    }

    #[inline(always)]
    unsafe fn step(slot: &mut Slot, treelet: &Treelet, sp: usize) -> usize {
        let mut t = [0.0f32; 7];
        let mut signs = 0;
        for (h, t) in t.iter_mut().enumerate() {
            let a = treelet.axis(h);
            *t = (treelet.plane[h] - slot.origin[a]) * slot.inv[a];
            signs |= usize::from(slot.inv[a].is_sign_negative()) << h;
        }
        let (t_in, t_out) = (slot.enter[sp], slot.exit[sp]);
        let mut sp = sp;
        for (j, &packed) in ORDER.0[signs].iter().enumerate() {
            let path = [0, packed as usize >> 3 & 7, packed as usize >> 6 & 7];
            let (mut enter, mut exit) = (t_in, t_out);
            for (level, h) in path.into_iter().enumerate() {
                // A NaN (a ray in the plane) bounds neither side.
                if j & (4 >> level) == 0 {
                    enter = if t[h] > enter { t[h] } else { enter };
                } else {
                    exit = if t[h] < exit { t[h] } else { exit };
                }
            }
            let code = treelet.child[packed as usize & 7];
            if code != 0 && enter <= exit + slot.slack {
                slot.code[sp] = code;
                slot.enter[sp] = enter;
                slot.exit[sp] = exit;
                sp += 1;
            }
        }
        sp - 1
    }

    #[inline(always)]
    unsafe fn enter(slot: &mut Slot, cells: &Cells) -> usize {
        let (t_in, t_out) = (slot.enter[1], slot.exit[1]);
        let mut sp = 1;
        for (lane, &code) in cells.code.iter().enumerate() {
            let (mut enter, mut exit) = (t_in, t_out);
            for (a, side) in cells.side.iter().enumerate() {
                let t = |side: f32| (side - slot.origin[a]) * slot.inv[a];
                let near = usize::from(slot.inv[a].is_sign_negative());
                let (first, last) = (t(side[near][lane]), t(side[1 - near][lane]));
                enter = if first > enter { first } else { enter };
                exit = if last < exit { last } else { exit };
            }
            if code != 0 && enter <= exit + slot.slack {
                (slot.code[sp], slot.enter[sp], slot.exit[sp]) = (code, enter, exit);
                sp += 1;
            }
        }
        sp - 1
    }

    #[inline(always)]
    unsafe fn meets<const ROUNDED: bool, const WHOLE: bool>(slot: &Slot, block: &Block) -> u32 {
        // SAFETY: portable code.
        let found = unsafe { Self::test::<ROUNDED>(slot, block, &mut Range::default()) };
        found.clear | found.open
    }

    #[inline(always)]
    unsafe fn near(slot: &Slot, ray: &Ray, block: &Block) -> u32 {
        // SAFETY: portable code.
        unsafe { near::<PortableLanes<WIDTH>>(slot, ray, block) }
    }

    #[inline(always)]
    unsafe fn test<const ROUNDED: bool>(slot: &Slot, block: &Block, range: &mut Range) -> Found {
        let k = slot.k.map(|a| a as usize);
        let [sx, sy, sz] = slot.shear;
        let mut found = Found::default();
        for lane in 0..WIDTH {
            let [a, b, c] = std::array::from_fn(|i| {
                let z = block.vertex[i][k[2]][lane] - slot.shear_origin[2];
                let x = block.vertex[i][k[0]][lane] - slot.shear_origin[0];
                let y = block.vertex[i][k[1]][lane] - slot.shear_origin[1];
                [x - sx * z, y - sy * z, sz * z]
            });
            let edge = |p: [f32; 3], q: [f32; 3]| p[0] * q[1] - p[1] * q[0];
            let (u, v, w) = (edge(c, b), edge(a, c), edge(b, a));
            let (smallest, largest) = (u.min(v).min(w), u.max(v).max(w));
            let size = |i: usize| a[i].abs().max(b[i].abs()).max(c[i].abs());
            let (near, far) = (a[2].min(b[2]).min(c[2]), a[2].max(b[2]).max(c[2]));
            let (mut reach, mut sum) = (near.abs().max(far.abs()), size(0) + size(1));
            if ROUNDED {
                (reach, sum) = (reach + ROUNDED_DEPTH, sum + ROUNDED_SIZE);
            }
            let slack = slot.edge_slack * sum * (reach + slot.half_scale * sum) + TINY;
            let outside = smallest < -slack && largest > slack;
            let blur = DEPTH_SLACK * reach;
            if outside || !(near - blur <= slot.limit && far + blur >= slot.t_min) {
                continue;
            }
            let bit = 1 << lane;
            if !(smallest > slack || largest < -slack) {
                found.open |= bit;
                continue;
            }
            let det = u + v + w;
            let t = (u * a[2] + v * b[2] + w * c[2]) / det;
            let blur = blur + (far - near) * WEIGHT_SLACK * (slack / det.abs());
            let (low, high) = (t - blur, t + blur);
            range.low[lane] = low;
            range.high[lane] = high;
            if low <= slot.limit && high >= slot.t_min {
                let whole = low >= slot.t_min && high <= slot.limit;
                let clear = whole && block.id[lane] & !ID_MASK == SIDES_BOTH;
                *if clear { &mut found.clear } else { &mut found.open } |= bit;
            }
        }
        found
    }

    #[inline(always)]
    unsafe fn nearest(clear: u32, range: &Range) -> Nearest {
        let is_clear = |lane: &usize| clear >> lane & 1 == 1;
        let mut nearest = Nearest { lane: 0, high: f32::INFINITY, rivals: 0 };
        for lane in (0..WIDTH).filter(is_clear) {
            if range.high[lane] < nearest.high {
                nearest = Nearest { lane, high: range.high[lane], rivals: 0 };
            }
        }
        for lane in (0..WIDTH).filter(is_clear) {
            let rival = lane != nearest.lane && range.low[lane] <= nearest.high;
            nearest.rivals |= u32::from(rival) << lane;
        }
        nearest
    }

    #[inline(always)]
    unsafe fn others(block: &Block, prim_id: u32) -> u32 {
        let differs = |lane: usize| block.id[lane] & ID_MASK != prim_id;
        (0..WIDTH).map(|lane| u32::from(differs(lane)) << lane).sum()
    }

    #[inline(always)]
    unsafe fn keep(lanes: u32, row: &[u32; WIDTH], kept: &mut [u32; WIDTH]) {
        let mut n = 0;
        for (lane, &x) in row.iter().enumerate() {
            kept[n & (WIDTH - 1)] = x;
            n += (lanes >> lane & 1) as usize;
        }
    }

    #[inline(always)]
    unsafe fn prefetch(_address: *const u8) {}
}

impl Locate for Scalar {
    type Row = PortableLanes<PACKET>;

    #[inline(always)]
    unsafe fn columns(rays: &[Ray; PACKET], columns: &mut Columns) {
        for (i, Ray { origin: o, dir: d, t_min, t_max }) in rays.iter().enumerate() {
            for (column, x) in
                columns.0.iter_mut().zip([o[0], o[1], o[2], d[0], d[1], d[2], *t_min, *t_max])
            {
                column[i] = x;
            }
        }
    }

    #[inline(always)]
    unsafe fn put(to: &mut Ray, ray: &Ray) {
        *to = *ray;
    }

    #[inline(always)]
    unsafe fn segment(ray: &Ray, slack: f32) -> Segment {
        let mut segment = Segment { corners: Corners([0.0; 8]), end: [0.0; 4] };
        for a in 0..3 {
            let from = ray.origin[a] + ray.dir[a] * ray.t_min;
            let to = ray.origin[a] + ray.dir[a] * ray.t_max;
            segment.corners.0[a] = from.min(to).min(ray.origin[a]) - slack;
            segment.corners.0[a + 4] = -(from.max(to).max(ray.origin[a]) + slack);
            segment.end[a] = to;
        }
        segment
    }

    #[inline(always)]
    unsafe fn lies_in(segment: &Segment, cell: &Corners) -> bool {
        [0, 1, 2, 4, 5, 6].into_iter().all(|i| segment.corners.0[i] >= cell.0[i])
    }

    #[inline(always)]
    unsafe fn reached(segment: &Segment, treelet: &Treelet) -> u32 {
        let (mut above, mut below, mut used) = (0, 0, 0);
        for (h, &plane) in treelet.plane.iter().enumerate() {
            let axis = treelet.axis(h);
            above |= usize::from(segment.corners.0[axis] >= plane) << h;
            below |= usize::from(segment.corners.0[axis + 4] >= -plane) << h;
        }
        for (child, &code) in treelet.child.iter().enumerate() {
            used |= u32::from(code != 0) << child;
        }
        u32::from(REACH.above[above] & REACH.below[below]) & used
    }

    #[inline(always)]
    unsafe fn child_of_end(segment: &Segment, treelet: &Treelet) -> usize {
        let above = |h: usize| usize::from(segment.end[treelet.axis(h)] >= treelet.plane[h]) << h;
        REACH.child[(0..7).map(above).sum::<usize>()] as usize
    }

    #[inline(always)]
    unsafe fn overlaps(segment: &Segment, block: &Block) -> bool {
        let meets = |lane: usize, axis: usize| {
            let [p, q, r] = [0, 1, 2].map(|i| block.vertex[i][axis][lane]);
            let [low, minus_high] = [segment.corners.0[axis], segment.corners.0[axis + 4]];
            p.min(q).min(r) <= -minus_high && p.max(q).max(r) >= low
        };
        (0..WIDTH).any(|lane| (0..3).all(|axis| meets(lane, axis)))
    }

    #[inline(always)]
    unsafe fn narrow(cell: &Corners, treelet: &Treelet, child: usize) -> Corners {
        let mut corners = *cell;
        for (level, h) in path(child).into_iter().enumerate() {
            let upper = child >> (2 - level) & 1 == 1;
            let plane = if upper { treelet.plane[h] } else { -treelet.plane[h] };
            let corner = &mut corners.0[treelet.axis(h) + if upper { 0 } else { 4 }];
            *corner = corner.max(plane);
        }
        corners
    }
}
