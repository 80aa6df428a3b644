//! AVX-512 on 256-bit registers: masks and compressing stores in place of tables.

#![cfg(target_arch = "x86_64")]
#![allow(unsafe_code)]

use super::beam::{Eight512, EightDoubles, Sixteen, larger_size_avx512};
use super::level::{Found, Nearest, Range, Root, Simd};
use super::list::{List, Lists};
use super::look::look;
use super::near::near;
use super::order::{order, room};
use super::slot::{Loaded, Slot};
use super::vicinity::Cells;
use super::x86::{self, Children, Lanes};
use crate::ray::Ray;
use crate::wide::{Block, ID_MASK, Treelet, WIDTH};
use std::arch::x86_64::*;

/// AVX-512 F, VL, BW, DQ.
#[derive(Clone, Copy)]
pub struct Avx512;

impl Simd for Avx512 {
    type Doubles = EightDoubles;

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
            let children = x86::children::<Avx512>(slot, treelet, sp);
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
                put(&mut lists.waiting, slot, code, leaf);
                put(&mut lists.stepping, slot, code, used & !leaf & !ended);
                put(&mut lists.free, slot, code, ended);
                from += 8;
            }
        }
    }

    #[inline(always)]
    unsafe fn meets<const ROUNDED: bool, const WHOLE: bool>(slot: &Slot, block: &Block) -> u32 {
        // SAFETY: passed on to the caller.
        unsafe { look::<Eight512, &Block, ROUNDED, WHOLE>(slot, block) }
    }

    const TWO: bool = true;

    #[inline(always)]
    unsafe fn meets_two<const ROUNDED: bool, const WHOLE: bool>(
        slot: &Slot,
        blocks: [&Block; 2],
    ) -> u32 {
        // SAFETY: passed on to the caller.
        unsafe { look::<Sixteen, [&Block; 2], ROUNDED, WHOLE>(slot, blocks) }
    }

    #[inline(always)]
    unsafe fn near(slot: &Slot, ray: &Ray, block: &Block) -> u32 {
        // SAFETY: passed on to the caller.
        unsafe { near::<Eight512>(slot, ray, block) }
    }

    #[inline(always)]
    unsafe fn test<const ROUNDED: bool>(slot: &Slot, block: &Block, range: &mut Range) -> Found {
        // SAFETY: the caller vouches for the features; the stores fill the rows of `range`.
        unsafe {
            let lanes = x86::lanes::<Avx512, ROUNDED>(slot, block);
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
    unsafe fn keep(lanes: u32, row: &[u32; WIDTH], kept: &mut [u32; WIDTH]) {
        // SAFETY: the caller vouches for the features; both rows have eight numbers.
        unsafe {
            let row = _mm256_loadu_si256(row.as_ptr().cast());
            let row = _mm256_maskz_compress_epi32(lanes as u8, row);
            _mm256_storeu_si256(kept.as_mut_ptr().cast(), row);
        }
    }

    #[inline(always)]
    unsafe fn order(keys: &mut [u64], t: &mut [f32], prim: &mut [u32]) -> usize {
        let n = keys.len();
        if n > 2 * WIDTH {
            return order(keys, t, prim);
        }
        assert!(t.len().min(prim.len()) >= room(n), "no room");
        // SAFETY: the caller vouches for the features; loads are masked by the number of keys, and
        // there is room for the stores: eight lanes, and eight behind eight at most if there are
        // more than eight keys.
        unsafe {
            let none = _mm512_set1_epi64(-1);
            let used = (1u32 << n) - 1;
            let keys = keys.as_ptr().cast::<i64>();
            let first = sort(_mm512_mask_loadu_epi64(none, used as u8, keys));
            if n <= WIDTH {
                return write(none, first, used as u8, t.as_mut_ptr(), prim.as_mut_ptr());
            }
            let rest = (used >> WIDTH) as u8;
            let second = sort(_mm512_mask_loadu_epi64(none, rest, keys.add(WIDTH)));
            let back = _mm512_setr_epi64(7, 6, 5, 4, 3, 2, 1, 0);
            let second = _mm512_permutexvar_epi64(back, second);
            let low = merge(_mm512_min_epu64(first, second));
            let high = merge(_mm512_max_epu64(first, second));
            let (t, prim) = (t.as_mut_ptr(), prim.as_mut_ptr());
            let n = write(none, low, 0xFF, t, prim);
            n + write(low, high, rest, t.add(n), prim.add(n))
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

/// Appends the lanes of a mask to a list.
#[inline(always)]
unsafe fn put(list: &mut List, slot: __m256i, code: __m256i, mask: u8) {
    // SAFETY: passed on to the caller; a list has room for eight lanes more than there are slots.
    unsafe {
        let slot = _mm256_maskz_compress_epi32(mask, slot);
        let code = _mm256_maskz_compress_epi32(mask, code);
        let at = list.len & 31;
        _mm256_storeu_si256(list.slot.as_mut_ptr().add(at).cast(), slot);
        _mm256_storeu_si256(list.code.as_mut_ptr().add(at).cast(), code);
        list.len += mask.count_ones() as usize;
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

/// A constant mask that the compiler does not know: it would put a blend behind each masked operation.
#[inline]
#[target_feature(enable = "avx512f,avx512dq")]
fn mask<const LANES: i32>() -> __mmask8 {
    let mut mask = LANES as u8;
    // SAFETY: no instruction.
    unsafe {
        std::arch::asm!("/* {0} */", inout(kreg) mask, options(pure, nomem, nostack, preserves_flags));
    }
    mask
}

impl x86::Manner for Avx512 {
    #[inline(always)]
    unsafe fn max<const LANES: i32>(bound: __m256, t: __m256) -> __m256 {
        // SAFETY: the caller vouches for the features.
        unsafe { _mm256_mask_max_ps(bound, mask::<LANES>(), t, bound) }
    }

    #[inline(always)]
    unsafe fn min<const LANES: i32>(bound: __m256, t: __m256) -> __m256 {
        // SAFETY: the caller vouches for the features.
        unsafe { _mm256_mask_min_ps(bound, mask::<LANES>(), t, bound) }
    }

    #[inline(always)]
    unsafe fn larger_size(a: __m256, b: __m256) -> __m256 {
        // SAFETY: passed on to the caller.
        unsafe { larger_size_avx512(a, b) }
    }
}

/// The smaller of two lanes where the mask has no bit, the larger where it has.
#[inline(always)]
unsafe fn exchange(x: __m512i, y: __m512i, larger: u8) -> __m512i {
    // SAFETY: the caller vouches for the features.
    unsafe { _mm512_mask_max_epu64(_mm512_min_epu64(x, y), larger, x, y) }
}

/// Sorts eight lanes that rise and then fall, or the other way around.
#[inline(always)]
unsafe fn merge(x: __m512i) -> __m512i {
    // SAFETY: the caller vouches for the features.
    unsafe {
        let x = exchange(x, _mm512_shuffle_i64x2::<0b01_00_11_10>(x, x), 0b1111_0000);
        let x = exchange(x, _mm512_shuffle_i64x2::<0b10_11_00_01>(x, x), 0b1100_1100);
        exchange(x, _mm512_shuffle_epi32::<0b01_00_11_10>(x), 0b1010_1010)
    }
}

/// Sorts eight lanes by Batcher's bitonic network.
#[inline(always)]
unsafe fn sort(x: __m512i) -> __m512i {
    // SAFETY: the caller vouches for the features.
    unsafe {
        let x = exchange(x, _mm512_shuffle_epi32::<0b01_00_11_10>(x), 0b0110_0110);
        let x = exchange(x, _mm512_shuffle_i64x2::<0b10_11_00_01>(x, x), 0b0011_1100);
        let x = exchange(x, _mm512_shuffle_epi32::<0b01_00_11_10>(x), 0b0101_1010);
        merge(x)
    }
}

/// Writes the hits of some sorted keys, except those that are like the one before; `last` holds the
/// one before the first in its last lane. Returns how many.
#[inline(always)]
unsafe fn write(last: __m512i, keys: __m512i, used: u8, t: *mut f32, prim: *mut u32) -> usize {
    // SAFETY: the caller vouches for the features, and for eight lanes at both places.
    unsafe {
        let before = _mm512_alignr_epi64::<7>(keys, last);
        let kept = _mm512_mask_cmpneq_epu64_mask(used, keys, before);
        let keys = _mm512_maskz_compress_epi64(kept, keys);
        _mm256_storeu_si256(prim.cast(), _mm512_cvtepi64_epi32(keys));
        let ordered = _mm512_cvtepi64_epi32(_mm512_srli_epi64::<32>(keys));
        // As in `hit_of`.
        let sign = _mm256_set1_epi32(i32::MIN);
        let negative = _mm256_cmpgt_epi32_mask(_mm256_setzero_si256(), ordered);
        let flip = _mm256_mask_mov_epi32(_mm256_set1_epi32(-1), negative, sign);
        _mm256_storeu_si256(t.cast(), _mm256_xor_si256(ordered, flip));
        kept.count_ones() as usize
    }
}
