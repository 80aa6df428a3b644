//! AVX-512 on 256-bit registers: masks and compressing stores in place of tables.

#![cfg(target_arch = "x86_64")]
#![allow(unsafe_code)]

use super::level::Simd;
use super::slot::{INTERVAL_SLACK, Slot};
use crate::wide::{Block, ORDER, Treelet, WIDTH};
use std::arch::x86_64::*;

/// AVX-512 F, VL, BW, DQ.
#[derive(Clone, Copy)]
pub struct Avx512;

impl Simd for Avx512 {
    #[inline(always)]
    unsafe fn step(slot: &mut Slot, treelet: &Treelet, sp: usize) -> usize {
        debug_assert!(sp + WIDTH <= super::slot::STACK);
        // SAFETY: the caller vouches for the features; all loads and stores lie in the aligned
        // treelet, the table (index below 128) and the slot (sp + 8 entries fit: STACK's doc).
        unsafe {
            let origin = _mm256_broadcast_ps(&*slot.origin.as_ptr().cast::<__m128>());
            let inv = _mm256_broadcast_ps(&*slot.inv.as_ptr().cast::<__m128>());
            let planes = _mm256_load_ps(treelet.plane.as_ptr());
            let shifts = _mm256_setr_epi32(0, 4, 8, 12, 16, 20, 24, 28);
            let axes = _mm256_srlv_epi32(_mm256_set1_epi32(treelet.axes as i32), shifts);
            let inv = _mm256_permutevar_ps(inv, axes);
            let origin = _mm256_permutevar_ps(origin, axes);
            let t = _mm256_mul_ps(_mm256_sub_ps(planes, origin), inv);

            let signs = _mm256_movemask_ps(inv) as usize & 127;
            let row = ORDER.0.as_ptr().add(signs).cast::<__m128i>();
            let packed = _mm256_cvtepu16_epi32(_mm_load_si128(row));
            let t0 = _mm256_broadcastss_ps(_mm256_castps256_ps128(t));
            let t1 = _mm256_permutevar8x32_ps(t, _mm256_srli_epi32::<3>(packed));
            let t2 = _mm256_permutevar8x32_ps(t, _mm256_srli_epi32::<6>(packed));
            let children = _mm256_load_si256(treelet.child.as_ptr().cast());
            let children = _mm256_permutevar8x32_epi32(children, packed);

            // max and min return their second operand where the first is NaN: such a plane bounds
            // neither side.
            let enter = _mm256_set1_ps(*slot.enter.get_unchecked(sp));
            let exit = _mm256_set1_ps(*slot.exit.get_unchecked(sp));
            let enter = _mm256_blend_ps::<0x0F>(enter, _mm256_max_ps(t0, enter));
            let exit = _mm256_blend_ps::<0xF0>(exit, _mm256_min_ps(t0, exit));
            let enter = _mm256_blend_ps::<0x33>(enter, _mm256_max_ps(t1, enter));
            let exit = _mm256_blend_ps::<0xCC>(exit, _mm256_min_ps(t1, exit));
            let enter = _mm256_blend_ps::<0x55>(enter, _mm256_max_ps(t2, enter));
            let exit = _mm256_blend_ps::<0xAA>(exit, _mm256_min_ps(t2, exit));

            let widened = _mm256_mul_ps(exit, _mm256_set1_ps(1.0 + INTERVAL_SLACK));
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
        // SAFETY: the caller vouches for the features; all loads are of whole aligned rows.
        unsafe {
            let row = |i: usize, a: usize| {
                let axis = *slot.k.get_unchecked(a) as usize;
                _mm256_load_ps(block.vertex.get_unchecked(i).get_unchecked(axis).as_ptr())
            };
            let origin = slot.shear_origin.map(|x| _mm256_set1_ps(x));
            let [sx, sy, sz] = slot.shear.map(|x| _mm256_set1_ps(x));
            let vertex = |i: usize| {
                let z = _mm256_sub_ps(row(i, 2), origin[2]);
                let x = _mm256_sub_ps(row(i, 0), origin[0]);
                let y = _mm256_sub_ps(row(i, 1), origin[1]);
                [_mm256_fnmadd_ps(sx, z, x), _mm256_fnmadd_ps(sy, z, y), _mm256_mul_ps(sz, z)]
            };
            let (a, b, c) = (vertex(0), vertex(1), vertex(2));
            let edge = |p: [__m256; 3], q: [__m256; 3]| {
                _mm256_fmsub_ps(p[0], q[1], _mm256_mul_ps(p[1], q[0]))
            };
            let (u, v, w) = (edge(c, b), edge(a, c), edge(b, a));
            let low = _mm256_min_ps(_mm256_min_ps(u, v), w);
            let high = _mm256_max_ps(_mm256_max_ps(u, v), w);

            let sign = _mm256_set1_ps(-0.0);
            let size = |i: usize| {
                let [p, q, r] = [a[i], b[i], c[i]].map(|x| _mm256_andnot_ps(sign, x));
                _mm256_max_ps(_mm256_max_ps(p, q), r)
            };
            let slack = _mm256_set1_ps(slot.edge_slack);
            let slack = _mm256_mul_ps(slack, _mm256_add_ps(size(0), size(1)));
            let minus_slack = _mm256_xor_ps(slack, sign);
            let near = _mm256_min_ps(_mm256_min_ps(a[2], b[2]), c[2]);
            let far = _mm256_max_ps(_mm256_max_ps(a[2], b[2]), c[2]);
            let limit = _mm256_set1_ps(slot.limit_high);
            let t_min = _mm256_set1_ps(slot.t_min_low);
            let below = _mm256_cmp_ps_mask::<_CMP_LT_OQ>(low, minus_slack);
            let outside = _mm256_mask_cmp_ps_mask::<_CMP_GT_OQ>(below, high, slack);
            let in_range = _mm256_cmp_ps_mask::<_CMP_LE_OQ>(near, limit);
            let in_range = _mm256_mask_cmp_ps_mask::<_CMP_GE_OQ>(in_range, far, t_min);
            u32::from(in_range & !outside)
        }
    }

    #[inline(always)]
    unsafe fn prefetch(address: *const u8) {
        // SAFETY: a prefetch of any address is harmless.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(address.cast()) }
    }
}
