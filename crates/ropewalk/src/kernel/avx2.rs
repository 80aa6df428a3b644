//! AVX2 and FMA: the compressing store is a permutation from a table.

#![cfg(target_arch = "x86_64")]
#![allow(unsafe_code)]

use super::beam::{Eight, FourDoubles, larger_size_avx2};
use super::level::{Found, Nearest, Range, Root, Simd};
use super::look::look;
use super::near::near;
use super::slot::{Loaded, Slot};
use super::vicinity::Cells;
use super::x86::{self, Children, Lanes};
use crate::ray::Ray;
use crate::wide::{Block, ID_MASK, Treelet, WIDTH};
use std::arch::x86_64::*;

/// AVX2 and FMA.
#[derive(Clone, Copy)]
pub struct Avx2;

/// For each mask the lanes that it keeps, in order.
#[repr(C, align(64))]
pub struct CompressTable(pub [[u8; 8]; 256]);

/// The table.
pub static COMPRESS: CompressTable = {
    let mut table = [[0; 8]; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut lane, mut kept) = (0, 0);
        while lane < 8 {
            if mask >> lane & 1 == 1 {
                table[mask][kept] = lane as u8;
                kept += 1;
            }
            lane += 1;
        }
        mask += 1;
    }
    CompressTable(table)
};

impl Simd for Avx2 {
    type Doubles = FourDoubles;

    #[inline(always)]
    unsafe fn load(slot: &mut Slot, ray: &Ray, index: u32, root: &Root) -> Loaded {
        // SAFETY: passed on to the caller.
        unsafe { x86::load(slot, ray, index, root) }
    }

    #[inline(always)]
    unsafe fn miss_box(rays: &[Ray], index: &[u32; WIDTH], root: &Root) -> u32 {
        // SAFETY: passed on to the caller.
        unsafe { x86::miss_box(rays, index, root) }
    }

    #[inline(always)]
    unsafe fn step(slot: &mut Slot, treelet: &Treelet, sp: usize) -> usize {
        debug_assert!(sp + WIDTH <= super::slot::STACK);
        // SAFETY: the caller vouches for the features; the stores lie in the slot (sp + 8 entries
        // fit: STACK's doc).
        unsafe {
            let children = x86::children::<Avx2>(slot, treelet, sp);
            replace(slot, children, sp)
        }
    }

    #[inline(always)]
    unsafe fn enter(slot: &mut Slot, cells: &Cells) -> usize {
        // SAFETY: the caller vouches for the features; there is room for eight entries.
        unsafe {
            let children = x86::cells(slot, cells);
            replace(slot, children, 1)
        }
    }

    #[inline(always)]
    unsafe fn meets<const ROUNDED: bool, const WHOLE: bool>(slot: &Slot, block: &Block) -> u32 {
        // SAFETY: passed on to the caller.
        unsafe { look::<Eight, &Block, ROUNDED, WHOLE>(slot, block) }
    }

    #[inline(always)]
    unsafe fn near(slot: &Slot, ray: &Ray, block: &Block) -> u32 {
        // SAFETY: passed on to the caller.
        unsafe { near::<Eight>(slot, ray, block) }
    }

    #[inline(always)]
    unsafe fn test<const ROUNDED: bool>(slot: &Slot, block: &Block, range: &mut Range) -> Found {
        // SAFETY: the caller vouches for the features; the stores fill the rows of `range`.
        unsafe {
            let lanes = x86::lanes::<Avx2, ROUNDED>(slot, block);
            let limit = _mm256_set1_ps(slot.limit);
            let t_min = _mm256_set1_ps(slot.t_min);
            let meets = meets(&lanes, limit, t_min);
            let (low, high) = x86::parameters(&lanes);
            _mm256_store_ps(range.low.as_mut_ptr(), low);
            _mm256_store_ps(range.high.as_mut_ptr(), high);
            let above = _mm256_cmp_ps::<_CMP_GT_OQ>(lanes.low, lanes.slack);
            let under = _mm256_cmp_ps::<_CMP_LT_OQ>(lanes.high, lanes.minus_slack);
            let inside = _mm256_and_ps(meets, _mm256_or_ps(above, under));
            let reached = _mm256_and_ps(
                _mm256_cmp_ps::<_CMP_LE_OQ>(low, limit),
                _mm256_cmp_ps::<_CMP_GE_OQ>(high, t_min),
            );
            let reached = _mm256_and_ps(reached, inside);
            let whole = _mm256_and_ps(
                _mm256_cmp_ps::<_CMP_GE_OQ>(low, t_min),
                _mm256_cmp_ps::<_CMP_LE_OQ>(high, limit),
            );
            let id = _mm256_load_si256(block.id.as_ptr().cast());
            let sides = _mm256_andnot_si256(_mm256_set1_epi32(ID_MASK as i32), id);
            let both = _mm256_cmpeq_epi32(sides, _mm256_setzero_si256());
            let whole = _mm256_and_ps(whole, _mm256_castsi256_ps(both));
            let clear = _mm256_and_ps(reached, whole);
            let open =
                _mm256_or_ps(_mm256_andnot_ps(inside, meets), _mm256_andnot_ps(clear, reached));
            let (clear, open) = (_mm256_movemask_ps(clear), _mm256_movemask_ps(open));
            Found { clear: clear as u32, open: open as u32 }
        }
    }

    #[inline(always)]
    unsafe fn nearest(clear: u32, range: &Range) -> Nearest {
        // SAFETY: the caller vouches for the features; the loads are of whole aligned rows.
        unsafe {
            let bits = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
            let lanes = _mm256_and_si256(_mm256_set1_epi32(clear as i32), bits);
            let lanes = _mm256_castsi256_ps(_mm256_cmpeq_epi32(lanes, bits));
            let high = _mm256_load_ps(range.high.as_ptr());
            let high = _mm256_blendv_ps(_mm256_set1_ps(f32::INFINITY), high, lanes);
            let least = x86::least(high);
            let lane = _mm256_and_ps(lanes, _mm256_cmp_ps::<_CMP_EQ_OQ>(high, least));
            let lane = (_mm256_movemask_ps(lane).trailing_zeros() & 7) as usize;
            let low = _mm256_load_ps(range.low.as_ptr());
            let rivals = _mm256_and_ps(lanes, _mm256_cmp_ps::<_CMP_LE_OQ>(low, least));
            let rivals = _mm256_movemask_ps(rivals) as u32 & !(1 << lane);
            Nearest { lane, high: _mm256_cvtss_f32(least), rivals }
        }
    }

    #[inline(always)]
    unsafe fn others(block: &Block, prim_id: u32) -> u32 {
        // SAFETY: the caller vouches for the features; the load is of a whole aligned row.
        unsafe {
            let id = _mm256_load_si256(block.id.as_ptr().cast());
            let id = _mm256_and_si256(id, _mm256_set1_epi32(ID_MASK as i32));
            let same = _mm256_cmpeq_epi32(id, _mm256_set1_epi32(prim_id as i32));
            !_mm256_movemask_ps(_mm256_castsi256_ps(same)) as u32 & 0xFF
        }
    }

    #[inline(always)]
    unsafe fn keep(lanes: u32, row: &[u32; WIDTH], kept: &mut [u32; WIDTH]) {
        // SAFETY: the caller vouches for the features; the loads are of a whole row and one of the
        // table's 256 entries, the store is as long as the row.
        unsafe {
            let order = _mm_loadl_epi64(COMPRESS.0.as_ptr().add(lanes as usize & 255).cast());
            let row = _mm256_loadu_si256(row.as_ptr().cast());
            let row = _mm256_permutevar8x32_epi32(row, _mm256_cvtepu8_epi32(order));
            _mm256_storeu_si256(kept.as_mut_ptr().cast(), row);
        }
    }

    #[inline(always)]
    unsafe fn prefetch(address: *const u8) {
        x86::prefetch(address);
    }
}

/// Puts the children that a ray reaches in place of an entry of its stack; returns the new stack pointer.
#[inline(always)]
unsafe fn replace(slot: &mut Slot, children: Children, sp: usize) -> usize {
    let Children { code: children, enter, exit, widened } = children;
    // SAFETY: passed on to the caller.
    unsafe {
        let empty = _mm256_cmpeq_epi32(children, _mm256_setzero_si256());
        let reached = _mm256_cmp_ps::<_CMP_LE_OQ>(enter, widened);
        let kept = _mm256_andnot_ps(_mm256_castsi256_ps(empty), reached);
        let mask = _mm256_movemask_ps(kept) as u8;

        let lanes = _mm_loadl_epi64(COMPRESS.0.as_ptr().add(mask as usize).cast());
        let lanes = _mm256_cvtepu8_epi32(lanes);
        let code = slot.code.as_mut_ptr().add(sp);
        _mm256_storeu_si256(code.cast(), _mm256_permutevar8x32_epi32(children, lanes));
        let at = slot.enter.as_mut_ptr().add(sp);
        _mm256_storeu_ps(at, _mm256_permutevar8x32_ps(enter, lanes));
        let at = slot.exit.as_mut_ptr().add(sp);
        _mm256_storeu_ps(at, _mm256_permutevar8x32_ps(exit, lanes));
        sp + mask.count_ones() as usize - 1
    }
}

/// Lanes that the ray may hit between `t_min` and `limit`, as a vector mask.
#[inline(always)]
unsafe fn meets(lanes: &Lanes, limit: __m256, t_min: __m256) -> __m256 {
    // SAFETY: the caller vouches for the features.
    unsafe {
        let below = _mm256_cmp_ps::<_CMP_LT_OQ>(lanes.low, lanes.minus_slack);
        let outside = _mm256_and_ps(below, _mm256_cmp_ps::<_CMP_GT_OQ>(lanes.high, lanes.slack));
        let nearest = _mm256_sub_ps(lanes.near, lanes.blur);
        let farthest = _mm256_add_ps(lanes.far, lanes.blur);
        let meets = _mm256_and_ps(
            _mm256_cmp_ps::<_CMP_LE_OQ>(nearest, limit),
            _mm256_cmp_ps::<_CMP_GE_OQ>(farthest, t_min),
        );
        _mm256_andnot_ps(outside, meets)
    }
}

impl x86::Manner for Avx2 {
    #[inline(always)]
    unsafe fn max<const LANES: i32>(bound: __m256, t: __m256) -> __m256 {
        // SAFETY: the caller vouches for the features; max and min return their second operand where
        // the first is NaN.
        unsafe { _mm256_blend_ps::<LANES>(bound, _mm256_max_ps(t, bound)) }
    }

    #[inline(always)]
    unsafe fn min<const LANES: i32>(bound: __m256, t: __m256) -> __m256 {
        // SAFETY: as above.
        unsafe { _mm256_blend_ps::<LANES>(bound, _mm256_min_ps(t, bound)) }
    }

    #[inline(always)]
    unsafe fn larger_size(a: __m256, b: __m256) -> __m256 {
        // SAFETY: passed on to the caller.
        unsafe { larger_size_avx2(a, b) }
    }
}
