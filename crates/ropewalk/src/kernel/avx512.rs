//! AVX-512 on 256-bit registers: masks and compressing stores in place of tables.

#![cfg(target_arch = "x86_64")]
#![allow(unsafe_code)]

use super::level::{Found, Nearest, Range, Root, Simd};
use super::list::{List, Lists};
use super::slot::{Loaded, Slot};
use super::x86::{self, Children, Lanes};
use crate::ray::Ray;
use crate::wide::{Block, ID_MASK, Treelet, WIDTH};
use std::arch::x86_64::*;

/// AVX-512 F, VL, BW, DQ.
#[derive(Clone, Copy)]
pub struct Avx512;

impl Simd for Avx512 {
    #[inline(always)]
    unsafe fn load(slot: &mut Slot, ray: &Ray, index: u32, root: &Root) -> Loaded {
        // SAFETY: passed on to the caller.
        unsafe { x86::load(slot, ray, index, root) }
    }

    #[inline(always)]
    unsafe fn step(slot: &mut Slot, treelet: &Treelet, sp: usize) -> usize {
        debug_assert!(sp + WIDTH <= super::slot::STACK);
        // SAFETY: the caller vouches for the features; the stores lie in the slot (sp + 8 entries
        // fit: STACK's doc).
        unsafe {
            let Children { code: children, enter, exit, widened } =
                x86::children(slot, treelet, sp);
            let used = _mm256_test_epi32_mask(children, children);
            let mask = _mm256_mask_cmp_ps_mask::<_CMP_LE_OQ>(used, enter, widened);

            let code = slot.code.as_mut_ptr().add(sp);
            _mm256_storeu_si256(code.cast(), _mm256_maskz_compress_epi32(mask, children));
            let at = slot.enter.as_mut_ptr().add(sp);
            _mm256_storeu_ps(at, _mm256_maskz_compress_ps(mask, enter));
            let at = slot.exit.as_mut_ptr().add(sp);
            _mm256_storeu_ps(at, _mm256_maskz_compress_ps(mask, exit));
            sp + mask.count_ones() as usize - 1
        }
    }

    #[inline(always)]
    unsafe fn add(lists: &mut Lists, moved: &List, n: usize) {
        // SAFETY: the caller vouches for the features; a list has room for eight lanes more than
        // there are slots.
        unsafe {
            let mut from = 0;
            while from < n {
                let used = ((1u32 << (n - from).min(8)) - 1) as u8;
                let slot = _mm256_loadu_si256(moved.slot.as_ptr().add(from).cast());
                let code = _mm256_loadu_si256(moved.code.as_ptr().add(from).cast());
                let leaf = used & _mm256_movepi32_mask(code);
                let ended = _mm256_mask_testn_epi32_mask(used, code, code);
                let put = |list: &mut List, mask: u8| {
                    let slot = _mm256_maskz_compress_epi32(mask, slot);
                    let code = _mm256_maskz_compress_epi32(mask, code);
                    let at = list.len & 31;
                    _mm256_storeu_si256(list.slot.as_mut_ptr().add(at).cast(), slot);
                    _mm256_storeu_si256(list.code.as_mut_ptr().add(at).cast(), code);
                    list.len += mask.count_ones() as usize;
                };
                put(&mut lists.waiting, leaf);
                put(&mut lists.stepping, used & !leaf & !ended);
                put(&mut lists.free, ended);
                from += 8;
            }
        }
    }

    #[inline(always)]
    unsafe fn meets(slot: &Slot, block: &Block) -> u32 {
        // SAFETY: the caller vouches for the features.
        unsafe {
            let lanes = x86::lanes(slot, block);
            let (limit, t_min) = (_mm256_set1_ps(slot.limit), _mm256_set1_ps(slot.t_min));
            u32::from(meets(&lanes, limit, t_min))
        }
    }

    #[inline(always)]
    unsafe fn test(slot: &Slot, block: &Block, range: &mut Range) -> Found {
        // SAFETY: the caller vouches for the features; the stores fill the rows of `range`.
        unsafe {
            let lanes = x86::lanes(slot, block);
            let limit = _mm256_set1_ps(slot.limit);
            let t_min = _mm256_set1_ps(slot.t_min);
            let meets = meets(&lanes, limit, t_min);
            let (low, high) = x86::parameters(&lanes);
            _mm256_store_ps(range.low.as_mut_ptr(), low);
            _mm256_store_ps(range.high.as_mut_ptr(), high);
            let above = _mm256_cmp_ps_mask::<_CMP_GT_OQ>(lanes.low, lanes.slack);
            let under = _mm256_cmp_ps_mask::<_CMP_LT_OQ>(lanes.high, lanes.minus_slack);
            let inside = meets & (above | under);
            let reached = _mm256_mask_cmp_ps_mask::<_CMP_LE_OQ>(inside, low, limit);
            let reached = _mm256_mask_cmp_ps_mask::<_CMP_GE_OQ>(reached, high, t_min);
            let clear = _mm256_mask_cmp_ps_mask::<_CMP_GE_OQ>(reached, low, t_min);
            let clear = _mm256_mask_cmp_ps_mask::<_CMP_LE_OQ>(clear, high, limit);
            let id = _mm256_load_si256(block.id.as_ptr().cast());
            let sides = _mm256_set1_epi32(!ID_MASK as i32);
            let clear = _mm256_mask_testn_epi32_mask(clear, id, sides);
            let open = (meets & !inside) | (reached & !clear);
            Found { clear: u32::from(clear), open: u32::from(open) }
        }
    }

    #[inline(always)]
    unsafe fn nearest(clear: u32, range: &Range) -> Nearest {
        // SAFETY: the caller vouches for the features; the loads are of whole aligned rows.
        unsafe {
            let clear = clear as u8;
            let far = _mm256_set1_ps(f32::INFINITY);
            let high = _mm256_mask_load_ps(far, clear, range.high.as_ptr());
            let least = x86::least(high);
            let lane = _mm256_mask_cmp_ps_mask::<_CMP_EQ_OQ>(clear, high, least);
            let lane = (lane.trailing_zeros() & 7) as usize;
            let low = _mm256_load_ps(range.low.as_ptr());
            let rivals = _mm256_mask_cmp_ps_mask::<_CMP_LE_OQ>(clear, low, least);
            let rivals = u32::from(rivals) & !(1 << lane);
            Nearest { lane, high: _mm256_cvtss_f32(least), rivals }
        }
    }

    #[inline(always)]
    unsafe fn others(block: &Block, prim_id: u32) -> u32 {
        // SAFETY: the caller vouches for the features; the load is of a whole aligned row.
        unsafe {
            let id = _mm256_load_si256(block.id.as_ptr().cast());
            let id = _mm256_and_si256(id, _mm256_set1_epi32(ID_MASK as i32));
            u32::from(_mm256_cmpneq_epi32_mask(id, _mm256_set1_epi32(prim_id as i32)))
        }
    }

    #[inline(always)]
    unsafe fn prefetch(address: *const u8) {
        x86::prefetch(address);
    }
}

/// Lanes that the ray may hit between `t_min` and `limit`.
#[inline(always)]
unsafe fn meets(lanes: &Lanes, limit: __m256, t_min: __m256) -> u8 {
    // SAFETY: the caller vouches for the features.
    unsafe {
        let below = _mm256_cmp_ps_mask::<_CMP_LT_OQ>(lanes.low, lanes.minus_slack);
        let outside = _mm256_mask_cmp_ps_mask::<_CMP_GT_OQ>(below, lanes.high, lanes.slack);
        let nearest = _mm256_sub_ps(lanes.near, lanes.blur);
        let farthest = _mm256_add_ps(lanes.far, lanes.blur);
        let meets = _mm256_mask_cmp_ps_mask::<_CMP_LE_OQ>(!outside, nearest, limit);
        _mm256_mask_cmp_ps_mask::<_CMP_GE_OQ>(meets, farthest, t_min)
    }
}
