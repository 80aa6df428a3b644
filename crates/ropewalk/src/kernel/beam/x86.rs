//! Vectors and steps of the x86-64 levels.

#![cfg(target_arch = "x86_64")]
#![allow(unsafe_code)]

use super::frame::{Frame, Packet};
use super::settle::{self, Corners, Judgement, Settled};
use super::shaft::{BeamSimd, Shaft, Stack};
use super::vector::{Doubles, Pair, Vector};
use super::{BeamQuery, Beams};
use crate::kernel::avx2::{Avx2, COMPRESS};
use crate::kernel::avx512::Avx512;
use crate::kernel::exact::Exact;
use crate::kernel::slot::STACK;
use crate::wide::{AXIS_SHIFTS, ORDER, Treelet, WIDTH};
use std::arch::x86_64::*;
use std::ops::{Add, Mul, Range, Sub};

/// Eight lanes of a 256-bit register, AVX2 and FMA.
#[derive(Clone, Copy)]
pub struct Eight(__m256);

/// The same with AVX-512.
#[derive(Clone, Copy)]
pub struct Eight512(__m256);

/// Sixteen lanes of a 512-bit register.
#[derive(Clone, Copy)]
pub struct Sixteen(__m512);

macro_rules! operator {
    ($type:ident, $trait:ident, $method:ident, $intrinsic:ident) => {
        impl $trait for $type {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: values exist only where the features are (see vector.rs).
                unsafe { $type($intrinsic(self.0, other.0)) }
            }
        }
    };
}
operator!(Eight, Add, add, _mm256_add_ps);
operator!(Eight, Sub, sub, _mm256_sub_ps);
operator!(Eight, Mul, mul, _mm256_mul_ps);
operator!(Eight512, Add, add, _mm256_add_ps);
operator!(Eight512, Sub, sub, _mm256_sub_ps);
operator!(Eight512, Mul, mul, _mm256_mul_ps);
operator!(Sixteen, Add, add, _mm512_add_ps);
operator!(Sixteen, Sub, sub, _mm512_sub_ps);
operator!(Sixteen, Mul, mul, _mm512_mul_ps);

/// Four doubles of a 256-bit register.
#[derive(Clone, Copy)]
pub struct FourDoubles(__m256d);

/// Eight doubles of a 512-bit register.
#[derive(Clone, Copy)]
pub struct EightDoubles(__m512d);

operator!(FourDoubles, Add, add, _mm256_add_pd);
operator!(FourDoubles, Sub, sub, _mm256_sub_pd);
operator!(FourDoubles, Mul, mul, _mm256_mul_pd);
operator!(EightDoubles, Add, add, _mm512_add_pd);
operator!(EightDoubles, Sub, sub, _mm512_sub_pd);
operator!(EightDoubles, Mul, mul, _mm512_mul_pd);

/// The methods of a vector of doubles.
macro_rules! doubles {
    ($type:ident, $lanes:literal, $splat:ident,
     $widen:ident of $load:ident, $store:ident of $narrow:ident, $write:ident, $read:ident,
     $(fn $name:ident($self:ident $(, $arg:ident: $ty:ty)*) -> $out:ty $body:block)*) => {
        impl Doubles for $type {
            const LANES: usize = $lanes;
            #[inline(always)]
            unsafe fn splat(x: f64) -> Self {
                // SAFETY: the caller vouches for the features.
                unsafe { $type($splat(x)) }
            }
            #[inline(always)]
            unsafe fn widen(row: &[f32]) -> Self {
                debug_assert!(row.len() >= $lanes);
                // SAFETY: the caller vouches for the features and the length.
                unsafe { $type($widen($load(row.as_ptr()))) }
            }
            #[inline(always)]
            unsafe fn load(row: &[f64]) -> Self {
                debug_assert!(row.len() >= $lanes);
                // SAFETY: as above.
                unsafe { $type($read(row.as_ptr())) }
            }
            #[inline(always)]
            fn narrow(self, row: &mut [f32]) {
                let row = &mut row[..$lanes];
                // SAFETY: values exist only where the features are; the row is long enough.
                unsafe { $store(row.as_mut_ptr(), $narrow(self.0)) }
            }
            #[inline(always)]
            fn store(self, row: &mut [f64]) {
                let row = &mut row[..$lanes];
                // SAFETY: as above.
                unsafe { $write(row.as_mut_ptr(), self.0) }
            }
            $(
                #[inline(always)]
                fn $name($self $(, $arg: $ty)*) -> $out {
                    // SAFETY: values exist only where the features are (see vector.rs).
                    unsafe { $body }
                }
            )*
        }
    };
}

doubles! { FourDoubles, 4, _mm256_set1_pd,
    _mm256_cvtps_pd of _mm_loadu_ps, _mm_storeu_ps of _mm256_cvtpd_ps, _mm256_storeu_pd, _mm256_loadu_pd,
    fn div(self, by: Self) -> Self { FourDoubles(_mm256_div_pd(self.0, by.0)) }
    fn min(self, other: Self) -> Self { FourDoubles(_mm256_min_pd(self.0, other.0)) }
    fn max(self, other: Self) -> Self { FourDoubles(_mm256_max_pd(self.0, other.0)) }
    fn abs(self) -> Self { FourDoubles(_mm256_andnot_pd(_mm256_set1_pd(-0.0), self.0)) }
    fn lt(self, other: Self) -> u32 {
        _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(self.0, other.0)) as u32
    }
    fn le(self, other: Self) -> u32 {
        _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LE_OQ>(self.0, other.0)) as u32
    }
}

doubles! { EightDoubles, 8, _mm512_set1_pd,
    _mm512_cvtps_pd of _mm256_loadu_ps, _mm256_storeu_ps of _mm512_cvtpd_ps, _mm512_storeu_pd, _mm512_loadu_pd,
    fn div(self, by: Self) -> Self { EightDoubles(_mm512_div_pd(self.0, by.0)) }
    fn min(self, other: Self) -> Self { EightDoubles(_mm512_min_pd(self.0, other.0)) }
    fn max(self, other: Self) -> Self { EightDoubles(_mm512_max_pd(self.0, other.0)) }
    fn abs(self) -> Self { EightDoubles(_mm512_abs_pd(self.0)) }
    fn lt(self, other: Self) -> u32 {
        u32::from(_mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, other.0))
    }
    fn le(self, other: Self) -> u32 {
        u32::from(_mm512_cmp_pd_mask::<_CMP_LE_OQ>(self.0, other.0))
    }
}

/// The methods of a vector; each expression sees the features because a value exists.
macro_rules! vector {
    ($type:ident, $lanes:literal, $splat:ident, $load:ident, $load_two:ident, $store:ident,
     $(fn $name:ident($self:ident $(, $arg:ident: $ty:ty)*) -> $out:ty $body:block)*) => {
        impl Vector for $type {
            const LANES: usize = $lanes;
            #[inline(always)]
            unsafe fn splat(x: f32) -> Self {
                // SAFETY: the caller vouches for the features.
                unsafe { $type($splat(x)) }
            }
            #[inline(always)]
            unsafe fn load(row: &[f32]) -> Self {
                debug_assert!(row.len() >= $lanes);
                // SAFETY: the caller vouches for the features and the length.
                unsafe { $type($load(row.as_ptr())) }
            }
            #[inline(always)]
            unsafe fn load_two(low: &[f32], high: &[f32]) -> Self {
                debug_assert!(low.len().min(high.len()) >= $lanes / 2);
                // SAFETY: the caller vouches for the features and the lengths.
                unsafe { $type($load_two(low.as_ptr(), high.as_ptr())) }
            }
            #[inline(always)]
            fn store(self, row: &mut [f32]) {
                let row = &mut row[..$lanes];
                // SAFETY: values exist only where the features are; the row is long enough.
                unsafe { $store(row.as_mut_ptr(), self.0) }
            }
            $(
                #[inline(always)]
                fn $name($self $(, $arg: $ty)*) -> $out {
                    // SAFETY: values exist only where the features are (see vector.rs).
                    unsafe { $body }
                }
            )*
        }
    };
}

/// Two times four numbers.
#[inline(always)]
unsafe fn two_fours(low: *const f32, high: *const f32) -> __m256 {
    // SAFETY: passed on to the caller.
    unsafe { _mm256_set_m128(_mm_loadu_ps(high), _mm_loadu_ps(low)) }
}

/// Two times eight numbers.
#[inline(always)]
unsafe fn two_eights(low: *const f32, high: *const f32) -> __m512 {
    // SAFETY: passed on to the caller.
    unsafe {
        _mm512_insertf32x8::<1>(_mm512_castps256_ps512(_mm256_loadu_ps(low)), _mm256_loadu_ps(high))
    }
}

/// The larger absolute values, by AVX2.
///
/// # Safety
/// The machine must have AVX2, and the caller must enable it.
#[inline(always)]
pub unsafe fn larger_size_avx2(a: __m256, b: __m256) -> __m256 {
    // SAFETY: passed on to the caller.
    unsafe {
        let sign = _mm256_set1_ps(-0.0);
        _mm256_max_ps(_mm256_andnot_ps(sign, a), _mm256_andnot_ps(sign, b))
    }
}

/// The larger absolute values, in one instruction.
///
/// # Safety
/// The machine must have AVX-512 VL and DQ, and the caller must enable them.
#[inline(always)]
pub unsafe fn larger_size_avx512(a: __m256, b: __m256) -> __m256 {
    // SAFETY: passed on to the caller.
    unsafe { _mm256_range_ps::<LARGER_SIZE>(a, b) }
}

/// Of `vrangeps`: the larger absolute value, without its sign.
const LARGER_SIZE: i32 = 0b1011;

/// Eight lanes of a 256-bit register at either level.
macro_rules! eight {
    ($type:ident, $larger_size:ident) => {
        vector! { $type, 8, _mm256_set1_ps, _mm256_loadu_ps, two_fours, _mm256_storeu_ps,
            fn div(self, by: Self) -> Self { $type(_mm256_div_ps(self.0, by.0)) }
            fn mul_add(self, factor: Self, term: Self) -> Self {
                $type(_mm256_fmadd_ps(self.0, factor.0, term.0))
            }
            fn neg_mul_add(self, factor: Self, term: Self) -> Self {
                $type(_mm256_fnmadd_ps(self.0, factor.0, term.0))
            }
            fn min(self, other: Self) -> Self { $type(_mm256_min_ps(self.0, other.0)) }
            fn max(self, other: Self) -> Self { $type(_mm256_max_ps(self.0, other.0)) }
            fn abs(self) -> Self { $type(_mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0)) }
            fn larger_size(self, other: Self) -> Self { $type($larger_size(self.0, other.0)) }
            fn flip(self, of: Self) -> Self {
                $type(_mm256_xor_ps(self.0, _mm256_and_ps(of.0, _mm256_set1_ps(-0.0))))
            }
            fn lt(self, other: Self) -> u32 {
                _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0)) as u32
            }
            fn le(self, other: Self) -> u32 {
                _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0)) as u32
            }
            fn equals(self, bits: u32) -> u32 {
                let same = _mm256_cmpeq_epi32(_mm256_castps_si256(self.0), _mm256_set1_epi32(bits as i32));
                _mm256_movemask_ps(_mm256_castsi256_ps(same)) as u32
            }
            fn select(self, mask: u32, other: Self) -> Self {
                let bit = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
                let set = _mm256_and_si256(_mm256_set1_epi32(mask as i32), bit);
                let set = _mm256_castsi256_ps(_mm256_cmpeq_epi32(set, bit));
                $type(_mm256_blendv_ps(other.0, self.0, set))
            }
            fn lowest(self) -> f32 {
                let half = _mm_min_ps(_mm256_castps256_ps128(self.0), _mm256_extractf128_ps::<1>(self.0));
                let pair = _mm_min_ps(half, _mm_movehl_ps(half, half));
                _mm_cvtss_f32(_mm_min_ss(pair, _mm_movehdup_ps(pair)))
            }
            fn highest(self) -> f32 {
                let half = _mm_max_ps(_mm256_castps256_ps128(self.0), _mm256_extractf128_ps::<1>(self.0));
                let pair = _mm_max_ps(half, _mm_movehl_ps(half, half));
                _mm_cvtss_f32(_mm_max_ss(pair, _mm_movehdup_ps(pair)))
            }
            fn sum(self) -> f32 {
                let half = _mm_add_ps(_mm256_castps256_ps128(self.0), _mm256_extractf128_ps::<1>(self.0));
                let pair = _mm_add_ps(half, _mm_movehl_ps(half, half));
                _mm_cvtss_f32(_mm_add_ss(pair, _mm_movehdup_ps(pair)))
            }
        }
    };
}
eight!(Eight, larger_size_avx2);
eight!(Eight512, larger_size_avx512);

vector! { Sixteen, 16, _mm512_set1_ps, _mm512_loadu_ps, two_eights, _mm512_storeu_ps,
    fn div(self, by: Self) -> Self { Sixteen(_mm512_div_ps(self.0, by.0)) }
    fn mul_add(self, factor: Self, term: Self) -> Self {
        Sixteen(_mm512_fmadd_ps(self.0, factor.0, term.0))
    }
    fn neg_mul_add(self, factor: Self, term: Self) -> Self {
        Sixteen(_mm512_fnmadd_ps(self.0, factor.0, term.0))
    }
    fn min(self, other: Self) -> Self { Sixteen(_mm512_min_ps(self.0, other.0)) }
    fn max(self, other: Self) -> Self { Sixteen(_mm512_max_ps(self.0, other.0)) }
    fn abs(self) -> Self { Sixteen(_mm512_abs_ps(self.0)) }
    fn larger_size(self, other: Self) -> Self {
        Sixteen(_mm512_range_ps::<LARGER_SIZE>(self.0, other.0))
    }
    fn flip(self, of: Self) -> Self {
        Sixteen(_mm512_xor_ps(self.0, _mm512_and_ps(of.0, _mm512_set1_ps(-0.0))))
    }
    fn lt(self, other: Self) -> u32 {
        u32::from(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0))
    }
    fn le(self, other: Self) -> u32 {
        u32::from(_mm512_cmp_ps_mask::<_CMP_LE_OQ>(self.0, other.0))
    }
    fn equals(self, bits: u32) -> u32 {
        let bits = _mm512_set1_epi32(bits as i32);
        u32::from(_mm512_cmpeq_epi32_mask(_mm512_castps_si512(self.0), bits))
    }
    fn select(self, mask: u32, other: Self) -> Self {
        Sixteen(_mm512_mask_blend_ps(mask as u16, other.0, self.0))
    }
    fn lowest(self) -> f32 { _mm512_reduce_min_ps(self.0) }
    fn highest(self) -> f32 { _mm512_reduce_max_ps(self.0) }
    fn sum(self) -> f32 { _mm512_reduce_add_ps(self.0) }
}

/// The eight children of a treelet from far to near, and the shaft's interval in each.
struct Children {
    code: __m256i,
    enter: __m256,
    exit: __m256,
}

/// The numbers of a row at the axes of eight planes.
#[inline(always)]
unsafe fn by_axis(row: &[f32; 4], axes: __m256i) -> __m256 {
    // SAFETY: passed on to the caller; the load is of the whole row.
    unsafe { _mm256_permutevar_ps(_mm256_broadcast_ps(&*row.as_ptr().cast::<__m128>()), axes) }
}

/// The step without its last part: masking and compressing.
///
/// # Safety
/// The machine must have AVX2 and FMA, and the caller must enable them; `sp` must be on the stack.
#[inline(always)]
unsafe fn children(
    shaft: &Shaft,
    stack: &Stack,
    treelet: &Treelet,
    sp: usize,
    limit: f32,
) -> Children {
    debug_assert!(sp + WIDTH <= STACK);
    // SAFETY: the caller vouches for the features; all loads lie in the aligned shaft and treelet,
    // the table (index below 128) and the stack.
    unsafe {
        let planes = _mm256_load_ps(treelet.plane.as_ptr());
        let shifts = _mm256_loadu_si256(AXIS_SHIFTS.as_ptr().cast());
        let axes = _mm256_srlv_epi32(_mm256_set1_epi32(treelet.axes as i32), shifts);
        let (inv, inv_wide) = (by_axis(&shaft.inv, axes), by_axis(&shaft.inv_wide, axes));
        let first = _mm256_sub_ps(planes, by_axis(&shaft.first, axes));
        let last = _mm256_sub_ps(planes, by_axis(&shaft.last, axes));
        // The second operand is returned where the first is NaN (0 times an infinite inverse).
        let low = _mm256_min_ps(_mm256_mul_ps(first, inv_wide), _mm256_mul_ps(first, inv));
        let high = _mm256_max_ps(_mm256_mul_ps(last, inv_wide), _mm256_mul_ps(last, inv));

        let signs = _mm256_movemask_ps(inv) as usize & 127;
        let row = ORDER.0.as_ptr().add(signs).cast::<__m128i>();
        let packed = _mm256_cvtepu16_epi32(_mm_load_si128(row));
        let (at1, at2) = (_mm256_srli_epi32::<3>(packed), _mm256_srli_epi32::<6>(packed));
        let code = _mm256_load_si256(treelet.child.as_ptr().cast());
        let code = _mm256_permutevar8x32_epi32(code, packed);

        let low0 = _mm256_broadcastss_ps(_mm256_castps256_ps128(low));
        let high0 = _mm256_broadcastss_ps(_mm256_castps256_ps128(high));
        let (low1, high1) =
            (_mm256_permutevar8x32_ps(low, at1), _mm256_permutevar8x32_ps(high, at1));
        let (low2, high2) =
            (_mm256_permutevar8x32_ps(low, at2), _mm256_permutevar8x32_ps(high, at2));
        let enter = _mm256_set1_ps(*stack.enter.get_unchecked(sp));
        let exit = _mm256_set1_ps(stack.exit.get_unchecked(sp).min(limit));
        let enter = _mm256_blend_ps::<0x0F>(enter, _mm256_max_ps(low0, enter));
        let exit = _mm256_blend_ps::<0xF0>(exit, _mm256_min_ps(high0, exit));
        let enter = _mm256_blend_ps::<0x33>(enter, _mm256_max_ps(low1, enter));
        let exit = _mm256_blend_ps::<0xCC>(exit, _mm256_min_ps(high1, exit));
        let enter = _mm256_blend_ps::<0x55>(enter, _mm256_max_ps(low2, enter));
        let exit = _mm256_blend_ps::<0xAA>(exit, _mm256_min_ps(high2, exit));
        Children { code, enter, exit }
    }
}

impl BeamSimd for Avx2 {
    type Triangles = Eight;
    type Rays = Pair<Eight>;

    #[inline(always)]
    unsafe fn advance(
        shaft: &Shaft,
        stack: &mut Stack,
        treelet: &Treelet,
        sp: usize,
        limit: f32,
    ) -> usize {
        // SAFETY: the caller vouches for the features; the stores lie in the stack (sp + 8 entries
        // fit: STACK's doc).
        unsafe {
            let Children { code, enter, exit } = children(shaft, stack, treelet, sp, limit);
            let empty = _mm256_cmpeq_epi32(code, _mm256_setzero_si256());
            let reached = _mm256_cmp_ps::<_CMP_LE_OQ>(enter, exit);
            let kept = _mm256_andnot_ps(_mm256_castsi256_ps(empty), reached);
            let mask = _mm256_movemask_ps(kept) as u8;
            let lanes = _mm_loadl_epi64(COMPRESS.0.as_ptr().add(mask as usize).cast());
            let lanes = _mm256_cvtepu8_epi32(lanes);
            let at = stack.code.as_mut_ptr().add(sp);
            _mm256_storeu_si256(at.cast(), _mm256_permutevar8x32_epi32(code, lanes));
            let at = stack.enter.as_mut_ptr().add(sp);
            _mm256_storeu_ps(at, _mm256_permutevar8x32_ps(enter, lanes));
            let at = stack.exit.as_mut_ptr().add(sp);
            _mm256_storeu_ps(at, _mm256_permutevar8x32_ps(exit, lanes));
            sp + mask.count_ones() as usize - 1
        }
    }

    unsafe fn walk<Q: BeamQuery>(
        beams: &mut Beams<'_, Q>,
        frame: &Frame,
        packets: Range<usize>,
    ) -> bool {
        // SAFETY: passed on to the caller.
        unsafe { walk_avx2(beams, frame, packets) }
    }

    unsafe fn judge(packet: &Packet, corners: &Corners, axis: [usize; 3]) -> Judgement {
        // SAFETY: passed on to the caller.
        unsafe { judge_avx2(packet, corners, axis) }
    }

    unsafe fn settle(
        packet: &Packet,
        corners: &mut Corners,
        exact: &Exact<'_>,
        axis: [usize; 3],
    ) -> Settled {
        // SAFETY: passed on to the caller.
        unsafe { settle_avx2(packet, corners, exact, axis) }
    }
}

impl BeamSimd for Avx512 {
    type Triangles = Eight512;
    type Rays = Sixteen;

    #[inline(always)]
    unsafe fn advance(
        shaft: &Shaft,
        stack: &mut Stack,
        treelet: &Treelet,
        sp: usize,
        limit: f32,
    ) -> usize {
        // SAFETY: as above.
        unsafe {
            let Children { code, enter, exit } = children(shaft, stack, treelet, sp, limit);
            let used = _mm256_test_epi32_mask(code, code);
            let mask = _mm256_mask_cmp_ps_mask::<_CMP_LE_OQ>(used, enter, exit);
            let at = stack.code.as_mut_ptr().add(sp);
            _mm256_storeu_si256(at.cast(), _mm256_maskz_compress_epi32(mask, code));
            let at = stack.enter.as_mut_ptr().add(sp);
            _mm256_storeu_ps(at, _mm256_maskz_compress_ps(mask, enter));
            let at = stack.exit.as_mut_ptr().add(sp);
            _mm256_storeu_ps(at, _mm256_maskz_compress_ps(mask, exit));
            sp + mask.count_ones() as usize - 1
        }
    }

    unsafe fn walk<Q: BeamQuery>(
        beams: &mut Beams<'_, Q>,
        frame: &Frame,
        packets: Range<usize>,
    ) -> bool {
        // SAFETY: passed on to the caller.
        unsafe { walk_avx512(beams, frame, packets) }
    }

    unsafe fn judge(packet: &Packet, corners: &Corners, axis: [usize; 3]) -> Judgement {
        // SAFETY: passed on to the caller.
        unsafe { judge_avx512(packet, corners, axis) }
    }

    unsafe fn settle(
        packet: &Packet,
        corners: &mut Corners,
        exact: &Exact<'_>,
        axis: [usize; 3],
    ) -> Settled {
        // SAFETY: passed on to the caller.
        unsafe { settle_avx512(packet, corners, exact, axis) }
    }
}

/// The parts that are functions of their own at each level.
macro_rules! compile {
    ($walk:ident, $judge:ident, $settle:ident, $level:ty, $features:literal) => {
        #[inline(never)]
        #[target_feature(enable = $features)]
        fn $walk<Q: BeamQuery>(
            beams: &mut Beams<'_, Q>,
            frame: &Frame,
            packets: Range<usize>,
        ) -> bool {
            // SAFETY: this function enables the level's features.
            unsafe { beams.walk::<$level>(frame, packets) }
        }

        #[inline(never)]
        #[target_feature(enable = $features)]
        fn $judge(packet: &Packet, corners: &Corners, axis: [usize; 3]) -> Judgement {
            // SAFETY: this function enables the level's features.
            unsafe { settle::judge::<$level>(packet, corners, axis) }
        }

        #[inline(never)]
        #[target_feature(enable = $features)]
        fn $settle(
            packet: &Packet,
            corners: &mut Corners,
            exact: &Exact<'_>,
            axis: [usize; 3],
        ) -> Settled {
            // SAFETY: this function enables the level's features.
            unsafe { settle::settle::<$level>(packet, corners, exact, axis) }
        }
    };
}
compile!(walk_avx2, judge_avx2, settle_avx2, Avx2, "avx2,fma,bmi1,bmi2,popcnt,lzcnt");
compile!(
    walk_avx512,
    judge_avx512,
    settle_avx512,
    Avx512,
    "avx2,fma,bmi1,bmi2,popcnt,lzcnt,avx512f,avx512vl,avx512bw,avx512dq"
);
