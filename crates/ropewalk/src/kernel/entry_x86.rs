//! The entry search in 256-bit registers, the same for both x86-64 levels.

#![cfg(target_arch = "x86_64")]
#![allow(unsafe_code)]

use super::avx2::Avx2;
use super::avx512::Avx512;
use super::beam::{Eight, Pair, Sixteen};
use super::entry::{Corners, Locate, REACH, Segment, path};
use super::entry_packet::{Columns, PACKET};
use super::x86::{self, SIGN};
use crate::ray::Ray;
use crate::wide::{AXIS_SHIFTS, Block, Treelet, WIDTH};
use std::arch::x86_64::*;

/// [`Locate::segment`].
///
/// # Safety
/// The machine must have AVX2 and FMA, and the caller must enable them.
#[inline(always)]
unsafe fn segment(ray: &Ray, slack: f32) -> Segment {
    // SAFETY: the caller vouches for the features; a ray is eight floats, see `load`; the stores
    // fill the aligned corners and the four floats of the end.
    unsafe {
        let sign = _mm_set1_ps(-0.0);
        let origin = _mm_loadu_ps(ray.origin.as_ptr());
        let dir = _mm_loadu_ps(std::ptr::from_ref(ray).cast::<f32>().add(3));
        let from = _mm_fmadd_ps(dir, _mm_set1_ps(ray.t_min), origin);
        let to = _mm_fmadd_ps(dir, _mm_set1_ps(ray.t_max), origin);
        let slack = _mm_set1_ps(slack);
        let low = _mm_sub_ps(_mm_min_ps(_mm_min_ps(from, to), origin), slack);
        let high = _mm_add_ps(_mm_max_ps(_mm_max_ps(from, to), origin), slack);
        let mut segment = Segment { corners: Corners([0.0; 8]), end: [0.0; 4] };
        let corners = _mm256_set_m128(_mm_xor_ps(high, sign), low);
        _mm256_store_ps(segment.corners.0.as_mut_ptr(), corners);
        _mm_storeu_ps(segment.end.as_mut_ptr(), to);
        segment
    }
}

/// [`Locate::put`].
///
/// # Safety
/// The machine must have AVX2 and FMA, and the caller must enable them.
#[inline(always)]
unsafe fn put(to: &mut Ray, ray: &Ray) {
    let Ray { origin: o, dir: d, t_min, t_max } = *ray;
    // SAFETY: the caller vouches for the features; a ray is eight floats in this order.
    unsafe {
        let row = _mm256_setr_ps(o[0], o[1], o[2], d[0], d[1], d[2], t_min, t_max);
        _mm256_storeu_ps(std::ptr::from_mut(to).cast(), row);
    }
}

/// [`Locate::lies_in`].
///
/// # Safety
/// The machine must have AVX2 and FMA, and the caller must enable them.
#[inline(always)]
unsafe fn lies_in(segment: &Segment, cell: &Corners) -> bool {
    // SAFETY: the caller vouches for the features; corners are aligned.
    unsafe {
        let corners = _mm256_load_ps(segment.corners.0.as_ptr());
        let holds = _mm256_cmp_ps::<_CMP_GE_OQ>(corners, _mm256_load_ps(cell.0.as_ptr()));
        _mm256_movemask_ps(holds) & 0x77 == 0x77
    }
}

/// The axes of a treelet's planes, one a lane; the last lane has axis 0.
#[inline(always)]
unsafe fn axes(treelet: &Treelet) -> __m256i {
    // SAFETY: passed on to the caller; treelets are aligned.
    unsafe {
        let shifts = _mm256_loadu_si256(AXIS_SHIFTS.as_ptr().cast());
        _mm256_srlv_epi32(_mm256_set1_epi32(treelet.axes as i32), shifts)
    }
}

/// The lanes in which a point, repeated in both halves, is at least as large as the plane.
#[inline(always)]
unsafe fn above(point: __m256, axes: __m256i, planes: __m256) -> usize {
    // SAFETY: passed on to the caller; treelets are aligned.
    unsafe {
        let at = _mm256_permutevar_ps(point, axes);
        _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_GE_OQ>(at, planes)) as usize & 127
    }
}

/// [`Locate::reached`].
///
/// # Safety
/// The machine must have AVX2 and FMA, and the caller must enable them.
#[inline(always)]
unsafe fn reached(segment: &Segment, treelet: &Treelet) -> u32 {
    // SAFETY: the caller vouches for the features; corners and treelets are aligned, the tables'
    // indices below 128.
    unsafe {
        let corners = _mm256_load_ps(segment.corners.0.as_ptr());
        let low = _mm256_permute2f128_ps::<0x00>(corners, corners);
        let high = _mm256_permute2f128_ps::<0x11>(corners, corners);
        let (axes, planes) = (axes(treelet), _mm256_load_ps(treelet.plane.as_ptr()));
        let over = above(low, axes, planes);
        let under = above(high, axes, _mm256_xor_ps(planes, SIGN));
        let code = _mm256_load_si256(treelet.child.as_ptr().cast());
        let empty = _mm256_cmpeq_epi32(code, _mm256_setzero_si256());
        let used = !_mm256_movemask_ps(_mm256_castsi256_ps(empty)) as u8;
        u32::from(*REACH.above.get_unchecked(over) & *REACH.below.get_unchecked(under) & used)
    }
}

/// [`Locate::child_of_end`].
///
/// # Safety
/// The machine must have AVX2 and FMA, and the caller must enable them.
#[inline(always)]
unsafe fn child_of_end(segment: &Segment, treelet: &Treelet) -> usize {
    // SAFETY: the caller vouches for the features; treelets are aligned, the index is below 128.
    unsafe {
        let end = _mm_loadu_ps(segment.end.as_ptr());
        let end = _mm256_set_m128(end, end);
        let planes = _mm256_load_ps(treelet.plane.as_ptr());
        *REACH.child.get_unchecked(above(end, axes(treelet), planes)) as usize
    }
}

/// [`Locate::overlaps`].
///
/// # Safety
/// The machine must have AVX2 and FMA, and the caller must enable them.
#[inline(always)]
unsafe fn overlaps(segment: &Segment, block: &Block) -> bool {
    // SAFETY: the caller vouches for the features; all loads are of whole aligned rows.
    unsafe {
        let across = _mm256_and_ps(meets_on(segment, block, 0), meets_on(segment, block, 1));
        _mm256_movemask_ps(_mm256_and_ps(across, meets_on(segment, block, 2))) != 0
    }
}

/// The triangles whose boxes a segment's box meets on an axis, as a vector mask.
#[inline(always)]
unsafe fn meets_on(segment: &Segment, block: &Block, axis: usize) -> __m256 {
    // SAFETY: passed on to the caller; the loads are of whole aligned rows.
    unsafe {
        let p = _mm256_load_ps(block.vertex[0][axis].as_ptr());
        let q = _mm256_load_ps(block.vertex[1][axis].as_ptr());
        let r = _mm256_load_ps(block.vertex[2][axis].as_ptr());
        let low = _mm256_min_ps(_mm256_min_ps(p, q), r);
        let high = _mm256_max_ps(_mm256_max_ps(p, q), r);
        let begins = _mm256_set1_ps(segment.corners.0[axis]);
        let ends = _mm256_set1_ps(-segment.corners.0[axis + 4]);
        _mm256_and_ps(
            _mm256_cmp_ps::<_CMP_LE_OQ>(low, ends),
            _mm256_cmp_ps::<_CMP_GE_OQ>(high, begins),
        )
    }
}

/// [`Locate::narrow`].
///
/// # Safety
/// The machine must have AVX2 and FMA, and the caller must enable them; `child` must be below 8.
#[inline(always)]
unsafe fn narrow(cell: &Corners, treelet: &Treelet, child: usize) -> Corners {
    // SAFETY: the caller vouches for the features and the child, so that its planes are below 7;
    // corners are aligned.
    unsafe {
        let mut corners = _mm256_load_ps(cell.0.as_ptr());
        let lanes = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
        for (level, h) in path(child).into_iter().enumerate() {
            let lower = !(child >> (2 - level)) as u32 & 1;
            let plane = treelet.plane.get_unchecked(h).to_bits() ^ lower << 31;
            let lane = treelet.axis(h) as u32 | lower << 2;
            let here = _mm256_cmpeq_epi32(lanes, _mm256_set1_epi32(lane as i32));
            let plane = _mm256_castsi256_ps(_mm256_set1_epi32(plane as i32));
            let tighter = _mm256_max_ps(corners, plane);
            corners = _mm256_blendv_ps(corners, tighter, _mm256_castsi256_ps(here));
        }
        let mut narrowed = Corners::NOTHING;
        _mm256_store_ps(narrowed.0.as_mut_ptr(), corners);
        narrowed
    }
}

/// [`Locate::columns`], eight rays at a time.
///
/// # Safety
/// The machine must have AVX2, and the caller must enable it.
#[inline(always)]
unsafe fn columns(rays: &[Ray; PACKET], columns: &mut Columns) {
    for half in 0..2 {
        // SAFETY: the caller vouches for the features; a ray is eight floats, columns are aligned.
        unsafe {
            let rows = x86::rows(std::array::from_fn(|i| &rays[WIDTH * half + i]));
            for i in 0..8 {
                _mm256_store_ps(columns.0[i].as_mut_ptr().add(WIDTH * half), rows[i]);
            }
        }
    }
}

/// The same, sixteen rays at once.
///
/// # Safety
/// The machine must have AVX-512, and the caller must enable it.
#[inline(always)]
unsafe fn columns_512(rays: &[Ray; PACKET], columns: &mut Columns) {
    for half in 0..2 {
        // SAFETY: the caller vouches for the features; a ray is eight floats, columns are aligned.
        unsafe {
            let mut rows = [_mm512_setzero_ps(); 4];
            for (i, row) in rows.iter_mut().enumerate() {
                // Every fourth ray, so that the quarters come out in their order.
                let mut quarters = [_mm_setzero_ps(); 4];
                for (j, quarter) in quarters.iter_mut().enumerate() {
                    let ray = std::ptr::from_ref(&rays[i + 4 * j]).cast::<f32>();
                    *quarter = _mm_loadu_ps(ray.add(4 * half));
                }
                *row = _mm512_castps128_ps512(quarters[0]);
                *row = _mm512_insertf32x4::<1>(*row, quarters[1]);
                *row = _mm512_insertf32x4::<2>(*row, quarters[2]);
                *row = _mm512_insertf32x4::<3>(*row, quarters[3]);
            }
            let [a, b, c, d] = rows;
            let (e, f) = (_mm512_unpacklo_ps(a, b), _mm512_unpackhi_ps(a, b));
            let (g, h) = (_mm512_unpacklo_ps(c, d), _mm512_unpackhi_ps(c, d));
            let to = columns.0.as_mut_ptr().add(4 * half);
            _mm512_store_ps(to.cast(), _mm512_shuffle_ps::<0x44>(e, g));
            _mm512_store_ps(to.add(1).cast(), _mm512_shuffle_ps::<0xEE>(e, g));
            _mm512_store_ps(to.add(2).cast(), _mm512_shuffle_ps::<0x44>(f, h));
            _mm512_store_ps(to.add(3).cast(), _mm512_shuffle_ps::<0xEE>(f, h));
        }
    }
}

macro_rules! locate {
    ($level:ty, $row:ty, $columns:ident) => {
        impl Locate for $level {
            type Row = $row;

            #[inline(always)]
            unsafe fn columns(rays: &[Ray; PACKET], columns: &mut Columns) {
                // SAFETY: passed on to the caller.
                unsafe { $columns(rays, columns) }
            }

            #[inline(always)]
            unsafe fn put(to: &mut Ray, ray: &Ray) {
                // SAFETY: passed on to the caller.
                unsafe { put(to, ray) }
            }

            #[inline(always)]
            unsafe fn segment(ray: &Ray, slack: f32) -> Segment {
                // SAFETY: passed on to the caller.
                unsafe { segment(ray, slack) }
            }

            #[inline(always)]
            unsafe fn lies_in(segment: &Segment, cell: &Corners) -> bool {
                // SAFETY: passed on to the caller.
                unsafe { lies_in(segment, cell) }
            }

            #[inline(always)]
            unsafe fn reached(segment: &Segment, treelet: &Treelet) -> u32 {
                // SAFETY: passed on to the caller.
                unsafe { reached(segment, treelet) }
            }

            #[inline(always)]
            unsafe fn child_of_end(segment: &Segment, treelet: &Treelet) -> usize {
                // SAFETY: passed on to the caller.
                unsafe { child_of_end(segment, treelet) }
            }

            #[inline(always)]
            unsafe fn overlaps(segment: &Segment, block: &Block) -> bool {
                // SAFETY: passed on to the caller.
                unsafe { overlaps(segment, block) }
            }

            #[inline(always)]
            unsafe fn narrow(cell: &Corners, treelet: &Treelet, child: usize) -> Corners {
                // SAFETY: passed on to the caller.
                unsafe { narrow(cell, treelet, child) }
            }
        }
    };
}
locate!(Avx2, Pair<Eight>, columns);
locate!(Avx512, Sixteen, columns_512);
