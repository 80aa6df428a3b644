//! The step: how far away the children of a treelet are, for each level.

#![allow(unsafe_code)]

use super::BeamSimd;
use crate::kernel::scalar::Scalar;
use crate::wide::Treelet;

/// Squared distances of the children of a treelet.
#[repr(C, align(32))]
pub struct Children {
    /// Along each axis.
    pub along: [[f32; 8]; 3],
    /// In all.
    pub distance2: [f32; 8],
}

impl Children {
    /// Nothing yet.
    pub const EMPTY: Children = Children { along: [[0.0; 8]; 3], distance2: [0.0; 8] };
}

/// A point made ready for a level.
#[repr(C, align(64))]
pub struct Place(pub [f64; 8]);

/// What the walk to the nearest triangle does, written for each level.
///
/// # Safety
/// The methods may only run on a machine with the level's features.
pub trait PointSimd: BeamSimd {
    /// Writes how far the children of a treelet are from a point, rounded to `f32`, if its cell is `cell`
    /// away along each axis; returns those that hold primitives and lie within `limit`.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn children(
        place: &Place,
        treelet: &Treelet,
        cell: &[f32; 3],
        limit: f32,
        children: &mut Children,
    ) -> u32;
}

impl PointSimd for Scalar {
    #[inline(always)]
    unsafe fn children(
        place: &Place,
        treelet: &Treelet,
        cell: &[f32; 3],
        limit: f32,
        children: &mut Children,
    ) -> u32 {
        let mut within = 0;
        for c in 0..8 {
            let (mut heap, mut along) = (0, *cell);
            for level in (0..3).rev() {
                let (axis, upper) = (treelet.axis(heap), c >> level & 1);
                let gap = (f64::from(treelet.plane[heap]) - place.0[axis]) as f32;
                let outside = if upper == 1 { gap > 0.0 } else { gap < 0.0 };
                if outside && gap * gap > along[axis] {
                    along[axis] = gap * gap;
                }
                heap = 2 * heap + 1 + upper;
            }
            let distance2 = along[0] + along[1] + along[2];
            for a in 0..3 {
                children.along[a][c] = along[a];
            }
            children.distance2[c] = distance2;
            within |= u32::from(distance2 <= limit && treelet.child[c] != 0) << c;
        }
        within
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{Children, Place, PointSimd};
    use crate::kernel::avx2::Avx2;
    use crate::kernel::avx512::Avx512;
    use crate::wide::{AXIS_SHIFTS, Treelet};
    use std::arch::x86_64::*;

    /// The planes of the children at each level; those of the upper side 8 more.
    #[repr(C, align(32))]
    struct Sides([[u32; 8]; 3]);

    static SIDES: Sides =
        Sides([[0, 0, 0, 0, 8, 8, 8, 8], [1, 1, 9, 9, 2, 2, 10, 10], [3, 11, 4, 12, 5, 13, 6, 14]]);

    impl PointSimd for Avx512 {
        #[inline(always)]
        unsafe fn children(
            place: &Place,
            treelet: &Treelet,
            cell: &[f32; 3],
            limit: f32,
            children: &mut Children,
        ) -> u32 {
            // SAFETY: the caller vouches for the features; a treelet is seven planes and a word of
            // axes, which is read as the eighth and not used, then eight children.
            unsafe {
                let planes = _mm256_load_ps(treelet.plane.as_ptr());
                let shifts = _mm256_loadu_si256(AXIS_SHIFTS.as_ptr().cast());
                let axes = _mm256_srlv_epi32(_mm256_set1_epi32(treelet.axes as i32), shifts);
                let axes = _mm256_and_si256(axes, _mm256_set1_epi32(3));
                let point = _mm512_load_pd(place.0.as_ptr());
                let at = _mm512_permutexvar_pd(_mm512_cvtepu32_epi64(axes), point);
                let gap = _mm512_cvtpd_ps(_mm512_sub_pd(_mm512_cvtps_pd(planes), at));
                let (zero, gap2) = (_mm256_setzero_ps(), _mm256_mul_ps(gap, gap));
                let is_above = _mm256_cmp_ps_mask::<_CMP_LT_OQ>(gap, zero);
                let [is_y, is_z] =
                    [(treelet.axes >> 14) as u8 & 127, (treelet.axes >> 21) as u8 & 127];
                let masks = [!(is_y | is_z), is_y, is_z];
                let sides = [
                    _mm256_load_si256(SIDES.0[0].as_ptr().cast()),
                    _mm256_load_si256(SIDES.0[1].as_ptr().cast()),
                    _mm256_load_si256(SIDES.0[2].as_ptr().cast()),
                ];
                let mut sum = zero;
                for a in 0..3 {
                    let below = _mm256_maskz_mov_ps(masks[a] & is_above, gap2);
                    let above = _mm256_maskz_mov_ps(masks[a] & !is_above, gap2);
                    let first = _mm256_permutex2var_ps(below, sides[0], above);
                    let second = _mm256_permutex2var_ps(below, sides[1], above);
                    let third = _mm256_permutex2var_ps(below, sides[2], above);
                    let outer = _mm256_max_ps(first, _mm256_set1_ps(cell[a]));
                    let along = _mm256_max_ps(outer, _mm256_max_ps(second, third));
                    _mm256_store_ps(children.along[a].as_mut_ptr(), along);
                    sum = _mm256_add_ps(sum, along);
                }
                _mm256_store_ps(children.distance2.as_mut_ptr(), sum);
                let near = _mm256_cmp_ps_mask::<_CMP_LE_OQ>(sum, _mm256_set1_ps(limit));
                let codes = _mm256_load_si256(treelet.child.as_ptr().cast());
                u32::from(near & _mm256_test_epi32_mask(codes, codes))
            }
        }
    }

    impl PointSimd for Avx2 {
        #[inline(always)]
        unsafe fn children(
            place: &Place,
            treelet: &Treelet,
            cell: &[f32; 3],
            limit: f32,
            children: &mut Children,
        ) -> u32 {
            // SAFETY: as for the other level.
            unsafe {
                let planes = _mm256_load_ps(treelet.plane.as_ptr());
                let shifts = _mm256_loadu_si256(AXIS_SHIFTS.as_ptr().cast());
                let axes = _mm256_srlv_epi32(_mm256_set1_epi32(treelet.axes as i32), shifts);
                let axes = _mm256_and_si256(axes, _mm256_set1_epi32(3));
                let point = _mm256_castpd_si256(_mm256_load_pd(place.0.as_ptr()));
                let low = gaps(_mm256_castps256_ps128(planes), _mm256_castsi256_si128(axes), point);
                let high = gaps(
                    _mm256_extractf128_ps::<1>(planes),
                    _mm256_extracti128_si256::<1>(axes),
                    point,
                );
                let gap = _mm256_set_m128(high, low);
                let (zero, gap2) = (_mm256_setzero_ps(), _mm256_mul_ps(gap, gap));
                let is_above = _mm256_cmp_ps::<_CMP_LT_OQ>(gap, zero);
                let sides = [
                    _mm256_load_si256(SIDES.0[0].as_ptr().cast()),
                    _mm256_load_si256(SIDES.0[1].as_ptr().cast()),
                    _mm256_load_si256(SIDES.0[2].as_ptr().cast()),
                ];
                let mut sum = zero;
                for a in 0..3 {
                    let axis = _mm256_cmpeq_epi32(axes, _mm256_set1_epi32(a as i32));
                    let gap2 = _mm256_and_ps(_mm256_castsi256_ps(axis), gap2);
                    let below = _mm256_and_ps(is_above, gap2);
                    let above = _mm256_andnot_ps(is_above, gap2);
                    let first = _mm256_blend_ps::<0b1111_0000>(
                        _mm256_permutevar8x32_ps(below, sides[0]),
                        _mm256_permutevar8x32_ps(above, sides[0]),
                    );
                    let second = _mm256_blend_ps::<0b1100_1100>(
                        _mm256_permutevar8x32_ps(below, sides[1]),
                        _mm256_permutevar8x32_ps(above, sides[1]),
                    );
                    let third = _mm256_blend_ps::<0b1010_1010>(
                        _mm256_permutevar8x32_ps(below, sides[2]),
                        _mm256_permutevar8x32_ps(above, sides[2]),
                    );
                    let outer = _mm256_max_ps(first, _mm256_set1_ps(cell[a]));
                    let along = _mm256_max_ps(outer, _mm256_max_ps(second, third));
                    _mm256_store_ps(children.along[a].as_mut_ptr(), along);
                    sum = _mm256_add_ps(sum, along);
                }
                _mm256_store_ps(children.distance2.as_mut_ptr(), sum);
                let near = _mm256_cmp_ps::<_CMP_LE_OQ>(sum, _mm256_set1_ps(limit));
                let codes = _mm256_load_si256(treelet.child.as_ptr().cast());
                let empty = _mm256_cmpeq_epi32(codes, _mm256_setzero_si256());
                _mm256_movemask_ps(_mm256_andnot_ps(_mm256_castsi256_ps(empty), near)) as u32
            }
        }
    }

    /// Gaps between four planes and a point, whose coordinates are pairs of words.
    #[inline(always)]
    unsafe fn gaps(planes: __m128, axes: __m128i, point: __m256i) -> __m128 {
        // SAFETY: the caller vouches for AVX2.
        unsafe {
            let twice = _mm256_slli_epi64::<1>(_mm256_cvtepu32_epi64(axes));
            let upper = _mm256_add_epi64(twice, _mm256_set1_epi64x(1));
            let words = _mm256_or_si256(twice, _mm256_slli_epi64::<32>(upper));
            let at = _mm256_castsi256_pd(_mm256_permutevar8x32_epi32(point, words));
            _mm256_cvtpd_ps(_mm256_sub_pd(_mm256_cvtps_pd(planes), at))
        }
    }
}
