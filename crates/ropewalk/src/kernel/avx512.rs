//! AVX-512 on 256-bit registers: masks and compressing stores in place of tables.

#![cfg(target_arch = "x86_64")]
#![allow(unsafe_code)]

use super::level::Simd;
use super::slot::Slot;
use super::x86::{self, Children, Lanes};
use crate::wide::{Block, Treelet, WIDTH};
use std::arch::x86_64::*;

/// AVX-512 F, VL, BW, DQ.
#[derive(Clone, Copy)]
pub struct Avx512;

impl Simd for Avx512 {
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
    unsafe fn candidates(slot: &Slot, block: &Block) -> u32 {
        // SAFETY: the caller vouches for the features.
        unsafe {
            let Lanes { low, high, slack, minus_slack, near, far, limit, t_min } =
                x86::lanes(slot, block);
            let below = _mm256_cmp_ps_mask::<_CMP_LT_OQ>(low, minus_slack);
            let outside = _mm256_mask_cmp_ps_mask::<_CMP_GT_OQ>(below, high, slack);
            let in_range = _mm256_cmp_ps_mask::<_CMP_LE_OQ>(near, limit);
            let in_range = _mm256_mask_cmp_ps_mask::<_CMP_GE_OQ>(in_range, far, t_min);
            u32::from(in_range & !outside)
        }
    }

    #[inline(always)]
    unsafe fn prefetch(address: *const u8) {
        x86::prefetch(address);
    }
}
