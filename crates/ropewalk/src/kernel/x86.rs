//! What the x86-64 levels share: both compute in 256-bit registers with FMA and differ in how they
//! mask and compress.
//!
//! Code for a level must be inlined into the function that enables its features, whatever the crate is
//! compiled for. `#[inline(always)]` sees to that for functions, but a closure is inlined only if the
//! compiler likes to, and where it does not, each instruction in it becomes a call. So vectors never
//! pass through closures here and in beam/, nor through `map`, `fold` or `from_fn`.

#![cfg(target_arch = "x86_64")]
#![allow(unsafe_code)]

use super::level::{DEPTH_SLACK, ROUNDED_DEPTH, ROUNDED_SIZE, Root, WEIGHT_SLACK};
use super::slot::{EDGE_SLACK, INTERVAL_SLACK, LARGE, Loaded, NEAR_ZERO, SMALL, Slot, TINY, later};
use super::vicinity::Cells;
use crate::ray::Ray;
use crate::wide::{AXIS_SHIFTS, Block, Flips, ORDER, Treelet, WIDTH};
use std::arch::x86_64::*;

/// Axis orders of the shear by its last axis, as indices into a vector; the last lane stays.
#[repr(C, align(16))]
struct ShearOrder([[u32; 4]; 3]);

static SHEAR_ORDER: ShearOrder = ShearOrder([[1, 2, 0, 3], [2, 0, 1, 3], [0, 1, 2, 3]]);

/// The largest lane, in all lanes.
#[inline(always)]
unsafe fn most(x: __m128) -> __m128 {
    // SAFETY: SSE is part of x86-64.
    unsafe {
        let x = _mm_max_ps(x, _mm_shuffle_ps::<0b01_00_11_10>(x, x));
        _mm_max_ps(x, _mm_shuffle_ps::<0b10_11_00_01>(x, x))
    }
}

/// [`Slot::load`] for rays without vanishing direction components and other oddities, which go there.
///
/// # Safety
/// The machine must have AVX2 and FMA, and the caller must enable them.
#[inline(always)]
pub unsafe fn load(slot: &mut Slot, ray: &Ray, index: u32, root: &Root) -> Loaded {
    // SAFETY: the caller vouches for the features; a ray is eight floats, origin first, then
    // direction and range, and the rows of the slot are four floats long.
    unsafe {
        let sign = _mm_set1_ps(-0.0);
        let origin = _mm_loadu_ps(ray.origin.as_ptr());
        let dir = _mm_loadu_ps(std::ptr::from_ref(ray).cast::<f32>().add(3));
        let size = _mm_andnot_ps(sign, dir);
        let inv = _mm_div_ps(_mm_set1_ps(1.0), dir);
        let large = _mm_set1_ps(LARGE);
        // False for NaN; an infinite inverse is a vanishing component.
        let ordinary = _mm_and_ps(
            _mm_cmple_ps(_mm_andnot_ps(sign, origin), large),
            _mm_and_ps(
                _mm_cmple_ps(size, large),
                _mm_cmplt_ps(_mm_andnot_ps(sign, inv), _mm_set1_ps(f32::INFINITY)),
            ),
        );
        let size = _mm_blend_ps::<8>(size, _mm_setzero_ps());
        let longest = most(size);
        let is_ordinary = root.is_ordinary
            & (_mm_movemask_ps(ordinary) & 7 == 7)
            & (_mm_cvtss_f32(longest) >= SMALL)
            & (ray.t_min <= ray.t_max);
        if !is_ordinary {
            return slot.load(ray, index, &root.bounds, root.code);
        }
        let axis = _mm_movemask_ps(_mm_cmpeq_ps(size, longest)).trailing_zeros() as usize & 3;

        let near = _mm_mul_ps(_mm_sub_ps(_mm_load_ps(root.min.as_ptr()), origin), inv);
        let far = _mm_mul_ps(_mm_sub_ps(_mm_load_ps(root.max.as_ptr()), origin), inv);
        let enter = _mm_blend_ps::<8>(_mm_min_ps(near, far), _mm_set1_ps(ray.t_min));
        let exit = _mm_blend_ps::<8>(_mm_max_ps(near, far), _mm_set1_ps(ray.t_max));
        let enter = _mm_cvtss_f32(most(enter));
        let exit = -_mm_cvtss_f32(most(_mm_xor_ps(exit, sign)));

        let start = _mm_blend_ps::<8>(_mm_andnot_ps(sign, origin), _mm_setzero_ps());
        let reach = _mm_cvtss_f32(_mm_max_ss(most(start), _mm_set_ss(root.reach)));

        let order = SHEAR_ORDER.0.get_unchecked(axis.min(2)).as_ptr();
        let order = _mm_load_si128(order.cast());
        let inv_z = _mm_permutevar_ps(inv, _mm_set1_epi32(axis as i32));
        let shear = _mm_mul_ps(_mm_permutevar_ps(dir, order), inv_z);
        _mm_store_ps(slot.origin.as_mut_ptr(), origin);
        _mm_store_ps(slot.inv.as_mut_ptr(), inv);
        _mm_store_ps(slot.shear_origin.as_mut_ptr(), _mm_permutevar_ps(origin, order));
        _mm_store_ps(slot.shear.as_mut_ptr(), _mm_blend_ps::<4>(shear, inv_z));
        _mm_store_si128(slot.k.as_mut_ptr().cast(), order);
        slot.edge_slack = EDGE_SLACK * _mm_cvtss_f32(longest);
        slot.half_scale = 0.5 * _mm_cvtss_f32(_mm_andnot_ps(sign, inv_z));
        slot.near_zero = NEAR_ZERO * reach * 2.0 * slot.half_scale;
        let (enter, exit) = (enter - slot.near_zero, exit + slot.near_zero);
        slot.may_lie_in_plane = false;
        slot.flips = Flips::new(_mm_movemask_ps(inv) as u32);
        slot.start(ray, index);
        slot.push_root(root.code, enter, exit);
        if enter <= later(exit) { Loaded::Ready } else { Loaded::Misses }
    }
}

/// Rows of eight rays: origins, directions, ends of their ranges.
///
/// # Safety
/// The machine must have AVX2, and the caller must enable it.
#[inline(always)]
pub unsafe fn rows(rays: [&Ray; WIDTH]) -> [__m256; 8] {
    // SAFETY: the caller vouches for the features; a ray is eight floats.
    unsafe {
        let mut x = [_mm256_setzero_ps(); 8];
        for i in 0..8 {
            x[i] = _mm256_loadu_ps(std::ptr::from_ref(rays[i]).cast());
        }
        let mut y = x;
        for i in 0..4 {
            y[2 * i] = _mm256_unpacklo_ps(x[2 * i], x[2 * i + 1]);
            y[2 * i + 1] = _mm256_unpackhi_ps(x[2 * i], x[2 * i + 1]);
        }
        for i in [0, 4] {
            x[i] = _mm256_shuffle_ps::<0b01_00_01_00>(y[i], y[i + 2]);
            x[i + 1] = _mm256_shuffle_ps::<0b11_10_11_10>(y[i], y[i + 2]);
            x[i + 2] = _mm256_shuffle_ps::<0b01_00_01_00>(y[i + 1], y[i + 3]);
            x[i + 3] = _mm256_shuffle_ps::<0b11_10_11_10>(y[i + 1], y[i + 3]);
        }
        for i in 0..4 {
            y[i] = _mm256_permute2f128_ps::<0x20>(x[i], x[i + 4]);
            y[i + 4] = _mm256_permute2f128_ps::<0x31>(x[i], x[i + 4]);
        }
        y
    }
}

/// Of eight rays those of which [`load`] would say that they miss, number by number, except the odd ones.
///
/// # Safety
/// As for [`load`].
#[inline(always)]
pub unsafe fn miss_box(rays: &[Ray], index: &[u32; WIDTH], root: &Root) -> u32 {
    if !root.is_ordinary {
        return 0;
    }
    // SAFETY: passed on to the caller.
    unsafe {
        let rows = rows(index.map(|i| &rays[i as usize]));
        let sign = _mm256_set1_ps(-0.0);
        let (mut enter, mut exit) = (rows[6], rows[7]);
        let mut reach = _mm256_set1_ps(root.reach);
        let (mut longest, mut least) = (_mm256_setzero_ps(), _mm256_set1_ps(f32::INFINITY));
        // A vanishing component has an infinite inverse, which the sum shows, as any NaN and infinity.
        let mut sum = _mm256_setzero_ps();
        for a in 0..3 {
            let (o, d) = (rows[a], rows[3 + a]);
            let inv = _mm256_div_ps(_mm256_set1_ps(1.0), d);
            let near = _mm256_mul_ps(_mm256_sub_ps(_mm256_set1_ps(root.min[a]), o), inv);
            let far = _mm256_mul_ps(_mm256_sub_ps(_mm256_set1_ps(root.max[a]), o), inv);
            enter = _mm256_max_ps(enter, _mm256_min_ps(near, far));
            exit = _mm256_min_ps(exit, _mm256_max_ps(near, far));
            reach = _mm256_max_ps(reach, _mm256_andnot_ps(sign, o));
            let (size, inv_size) = (_mm256_andnot_ps(sign, d), _mm256_andnot_ps(sign, inv));
            longest = _mm256_max_ps(longest, size);
            least = _mm256_min_ps(least, inv_size);
            sum = _mm256_add_ps(_mm256_add_ps(sum, size), inv_size);
        }
        let large = _mm256_set1_ps(LARGE);
        let ordinary = _mm256_and_ps(
            _mm256_and_ps(
                _mm256_cmp_ps::<_CMP_LE_OQ>(reach, large),
                _mm256_cmp_ps::<_CMP_LE_OQ>(longest, large),
            ),
            _mm256_and_ps(
                _mm256_cmp_ps::<_CMP_GE_OQ>(longest, _mm256_set1_ps(SMALL)),
                _mm256_cmp_ps::<_CMP_LT_OQ>(sum, _mm256_set1_ps(f32::INFINITY)),
            ),
        );
        let near_zero = _mm256_mul_ps(_mm256_mul_ps(_mm256_set1_ps(NEAR_ZERO), reach), least);
        let (enter, exit) = (_mm256_sub_ps(enter, near_zero), _mm256_add_ps(exit, near_zero));
        let slack = _mm256_mul_ps(_mm256_andnot_ps(sign, exit), _mm256_set1_ps(INTERVAL_SLACK));
        let misses = _mm256_cmp_ps::<_CMP_GT_OQ>(enter, _mm256_add_ps(exit, slack));
        _mm256_movemask_ps(_mm256_and_ps(misses, ordinary)) as u32
    }
}

/// The eight children of a treelet from far to near, and the ray's interval in each.
pub struct Children {
    /// Codes; 0 where a cell is empty.
    pub code: __m256i,
    /// Where the ray enters.
    pub enter: __m256,
    /// Where it leaves.
    pub exit: __m256,
    /// The same, widened: the cell is reached if `enter <= widened`.
    pub widened: __m256,
}

/// What each level does in its own manner.
///
/// # Safety
/// The methods may only run on a machine with the level's features.
pub trait Manner {
    /// The larger of both in the lanes whose bits are set; NaN in `t` leaves the bound.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn max<const LANES: i32>(bound: __m256, t: __m256) -> __m256;

    /// The smaller of both, likewise.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn min<const LANES: i32>(bound: __m256, t: __m256) -> __m256;

    /// The larger absolute value.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn larger_size(a: __m256, b: __m256) -> __m256;
}

/// The step without its last part: masking and compressing.
///
/// # Safety
/// The machine must have AVX2 and FMA, and the caller must enable them; `sp` must be on the stack.
#[inline(always)]
pub unsafe fn children<M: Manner>(slot: &Slot, treelet: &Treelet, sp: usize) -> Children {
    debug_assert!(sp < super::slot::STACK);
    // SAFETY: the caller vouches for the features; all loads lie in the aligned treelet, the table
    // (index below 128) and the slot.
    unsafe {
        let origin = _mm256_broadcast_ps(&*slot.origin.as_ptr().cast::<__m128>());
        let inv = _mm256_broadcast_ps(&*slot.inv.as_ptr().cast::<__m128>());
        let planes = _mm256_load_ps(treelet.plane.as_ptr());
        let shifts = _mm256_loadu_si256(AXIS_SHIFTS.as_ptr().cast());
        let axes = _mm256_srlv_epi32(_mm256_set1_epi32(treelet.axes as i32), shifts);
        let inv = _mm256_permutevar_ps(inv, axes);
        let origin = _mm256_permutevar_ps(origin, axes);
        let t = _mm256_mul_ps(_mm256_sub_ps(planes, origin), inv);

        let row = ORDER.0.as_ptr().cast::<u8>().add(treelet.order_offset(slot.flips));
        let packed = _mm256_cvtepu16_epi32(_mm_load_si128(row.cast()));
        let t0 = _mm256_broadcastss_ps(_mm256_castps256_ps128(t));
        let t1 = _mm256_permutevar8x32_ps(t, _mm256_srli_epi32::<3>(packed));
        let t2 = _mm256_permutevar8x32_ps(t, _mm256_srli_epi32::<6>(packed));
        let children = _mm256_load_si256(treelet.child.as_ptr().cast());
        let children = _mm256_permutevar8x32_epi32(children, packed);

        // A plane at NaN bounds neither side.
        let enter = _mm256_set1_ps(*slot.enter.get_unchecked(sp));
        let exit = _mm256_set1_ps(*slot.exit.get_unchecked(sp));
        let enter = M::max::<0x0F>(enter, t0);
        let exit = M::min::<0xF0>(exit, t0);
        let enter = M::max::<0x33>(enter, t1);
        let exit = M::min::<0xCC>(exit, t1);
        let enter = M::max::<0x55>(enter, t2);
        let exit = M::min::<0xAA>(exit, t2);

        let widened = _mm256_add_ps(exit, _mm256_set1_ps(slot.slack));
        Children { code: children, enter, exit, widened }
    }
}

/// The same for eight cells by their sides, from the only entry of the stack.
///
/// # Safety
/// As for [`children`].
#[inline(always)]
pub unsafe fn cells(slot: &Slot, cells: &Cells) -> Children {
    // SAFETY: the caller vouches for the features; all loads are of whole aligned rows.
    unsafe {
        let mut enter = _mm256_set1_ps(slot.enter[1]);
        let mut exit = _mm256_set1_ps(slot.exit[1]);
        for (a, side) in cells.side.iter().enumerate() {
            let near = (slot.inv[a].to_bits() >> 31) as usize;
            let origin = _mm256_set1_ps(slot.origin[a]);
            let inv = _mm256_set1_ps(slot.inv[a]);
            let first = _mm256_load_ps(side.get_unchecked(near).as_ptr());
            let last = _mm256_load_ps(side.get_unchecked(1 - near).as_ptr());
            // The second operand is returned where the first is NaN.
            enter = _mm256_max_ps(_mm256_mul_ps(_mm256_sub_ps(first, origin), inv), enter);
            exit = _mm256_min_ps(_mm256_mul_ps(_mm256_sub_ps(last, origin), inv), exit);
        }
        let widened = _mm256_add_ps(exit, _mm256_set1_ps(slot.slack));
        let code = _mm256_load_si256(cells.code.as_ptr().cast());
        Children { code, enter, exit, widened }
    }
}

/// The eight triangles of a block in the ray's frame.
pub struct Lanes {
    /// Edge functions.
    pub edge: [__m256; 3],
    /// Parameters of the vertices.
    pub depth: [__m256; 3],
    /// Smallest edge function.
    pub low: __m256,
    /// Largest edge function.
    pub high: __m256,
    /// Error bound of the edge functions; the triangle is missed if `low < -slack` and
    /// `high > slack`.
    pub slack: __m256,
    /// The negated bound.
    pub minus_slack: __m256,
    /// Parameter of the nearest vertex.
    pub near: __m256,
    /// Parameter of the farthest vertex.
    pub far: __m256,
    /// Error bound of the parameters.
    pub blur: __m256,
}

// SAFETY: both types are eight floats, and any bits are valid in either.
pub const SIGN: __m256 = unsafe { std::mem::transmute::<[f32; 8], __m256>([-0.0; 8]) };

/// Coordinates along the `a`-th axis of the ray's frame, relative to its origin.
#[inline(always)]
unsafe fn offset(slot: &Slot, vertex: &[[f32; WIDTH]; 3], a: usize) -> __m256 {
    // SAFETY: passed on to the caller; axes are below 3 and rows are aligned.
    unsafe {
        let row = vertex.get_unchecked(*slot.k.get_unchecked(a) as usize);
        _mm256_sub_ps(_mm256_load_ps(row.as_ptr()), _mm256_set1_ps(slot.shear_origin[a]))
    }
}

/// A vertex of eight triangles in the ray's frame: two coordinates across, and its parameter.
#[inline(always)]
unsafe fn sheared(slot: &Slot, vertex: &[[f32; WIDTH]; 3]) -> [__m256; 3] {
    // SAFETY: passed on to the caller.
    unsafe {
        let [sx, sy, sz] = slot.shear;
        let z = offset(slot, vertex, 2);
        let x = _mm256_fnmadd_ps(_mm256_set1_ps(sx), z, offset(slot, vertex, 0));
        let y = _mm256_fnmadd_ps(_mm256_set1_ps(sy), z, offset(slot, vertex, 1));
        [x, y, _mm256_mul_ps(_mm256_set1_ps(sz), z)]
    }
}

/// The edge function of two vertices.
#[inline(always)]
unsafe fn edge(p: [__m256; 3], q: [__m256; 3]) -> __m256 {
    // SAFETY: passed on to the caller.
    unsafe { _mm256_fmsub_ps(p[0], q[1], _mm256_mul_ps(p[1], q[0])) }
}

/// The largest absolute value of three numbers, lane by lane.
#[inline(always)]
unsafe fn size<M: Manner>(p: __m256, q: __m256, r: __m256) -> __m256 {
    // SAFETY: passed on to the caller.
    unsafe { M::larger_size(M::larger_size(p, q), r) }
}

/// The test without its comparisons.
///
/// # Safety
/// As for [`children`].
#[inline(always)]
pub unsafe fn lanes<M: Manner, const ROUNDED: bool>(slot: &Slot, block: &Block) -> Lanes {
    // SAFETY: the caller vouches for the features.
    unsafe {
        let a = sheared(slot, &block.vertex[0]);
        let b = sheared(slot, &block.vertex[1]);
        let c = sheared(slot, &block.vertex[2]);
        let (u, v, w) = (edge(c, b), edge(a, c), edge(b, a));
        let low = _mm256_min_ps(_mm256_min_ps(u, v), w);
        let high = _mm256_max_ps(_mm256_max_ps(u, v), w);

        let near = _mm256_min_ps(_mm256_min_ps(a[2], b[2]), c[2]);
        let far = _mm256_max_ps(_mm256_max_ps(a[2], b[2]), c[2]);
        let mut reach = M::larger_size(near, far);
        if ROUNDED {
            reach = _mm256_add_ps(reach, _mm256_set1_ps(ROUNDED_DEPTH));
        }
        let blur = _mm256_mul_ps(reach, _mm256_set1_ps(DEPTH_SLACK));
        let mut sum = _mm256_add_ps(size::<M>(a[0], b[0], c[0]), size::<M>(a[1], b[1], c[1]));
        if ROUNDED {
            sum = _mm256_add_ps(sum, _mm256_set1_ps(ROUNDED_SIZE));
        }
        let scale = _mm256_fmadd_ps(sum, _mm256_set1_ps(slot.half_scale), reach);
        let slack = _mm256_mul_ps(sum, _mm256_set1_ps(slot.edge_slack));
        let slack = _mm256_fmadd_ps(slack, scale, _mm256_set1_ps(TINY));
        let minus_slack = _mm256_xor_ps(slack, SIGN);
        let (edge, depth) = ([u, v, w], [a[2], b[2], c[2]]);
        Lanes { edge, depth, low, high, slack, minus_slack, near, far, blur }
    }
}

/// Bounds of the parameters at which the ray meets the triangles.
///
/// # Safety
/// As for [`children`].
#[inline(always)]
pub unsafe fn parameters(lanes: &Lanes) -> (__m256, __m256) {
    // SAFETY: the caller vouches for the features.
    unsafe {
        let [u, v, w] = lanes.edge;
        let [a, b, c] = lanes.depth;
        let det = _mm256_add_ps(_mm256_add_ps(u, v), w);
        let sum = _mm256_fmadd_ps(u, a, _mm256_fmadd_ps(v, b, _mm256_mul_ps(w, c)));
        let inv = _mm256_div_ps(_mm256_set1_ps(1.0), det);
        let t = _mm256_mul_ps(sum, inv);
        let range = _mm256_sub_ps(lanes.far, lanes.near);
        let share = _mm256_mul_ps(lanes.slack, _mm256_andnot_ps(SIGN, inv));
        let share = _mm256_mul_ps(share, _mm256_set1_ps(WEIGHT_SLACK));
        let blur = _mm256_fmadd_ps(range, share, lanes.blur);
        (_mm256_sub_ps(t, blur), _mm256_add_ps(t, blur))
    }
}

/// The smallest lane, in all lanes.
///
/// # Safety
/// As for [`children`].
#[inline(always)]
pub unsafe fn least(x: __m256) -> __m256 {
    // SAFETY: the caller vouches for the features.
    unsafe {
        let x = _mm256_min_ps(x, _mm256_permute2f128_ps::<1>(x, x));
        let x = _mm256_min_ps(x, _mm256_permute_ps::<0b01_00_11_10>(x));
        _mm256_min_ps(x, _mm256_permute_ps::<0b10_11_00_01>(x))
    }
}

/// Asks for the cache line of any address at all.
#[inline(always)]
pub fn prefetch(address: *const u8) {
    // SAFETY: a prefetch reads nothing; SSE is part of x86-64.
    unsafe { _mm_prefetch::<_MM_HINT_T0>(address.cast()) }
}
