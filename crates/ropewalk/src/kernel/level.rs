//! SIMD levels: detected once, stored, dispatched per batch, forced in tests.

#![allow(unsafe_code)]

use super::beam::Doubles;
use super::entry::Locate;
use super::list::{List, Lists};
use super::order::order;
#[cfg(doc)]
use super::order::room;
use super::slot::{LARGE, Loaded, Slot};
use super::vicinity::Cells;
use crate::aabb::Aabb;
use crate::ray::Ray;
use crate::wide::{Block, Treelet, WIDTH};

/// Instruction set of a kernel. All levels give bit-identical answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Level {
    /// Portable code, the definition of the others.
    Scalar,
    /// x86-64 with AVX2, FMA and the bit instructions that came with them.
    Avx2,
    /// The same with AVX-512 F, VL, BW, DQ.
    Avx512,
}

impl Level {
    /// All levels, the slowest first.
    pub const ALL: [Level; 3] = [Level::Scalar, Level::Avx2, Level::Avx512];

    /// True if this machine can run the level.
    pub fn is_available(self) -> bool {
        match self {
            Level::Scalar => true,
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => {
                is_x86_feature_detected!("avx2")
                    && is_x86_feature_detected!("fma")
                    && is_x86_feature_detected!("bmi1")
                    && is_x86_feature_detected!("bmi2")
                    && is_x86_feature_detected!("popcnt")
                    && is_x86_feature_detected!("lzcnt")
            }
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => {
                Level::Avx2.is_available()
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512vl")
                    && is_x86_feature_detected!("avx512bw")
                    && is_x86_feature_detected!("avx512dq")
            }
            #[cfg(not(target_arch = "x86_64"))]
            _ => false,
        }
    }

    /// The best level of this machine.
    pub fn best() -> Level {
        Level::ALL.into_iter().rev().find(|l| l.is_available()).unwrap_or(Level::Scalar)
    }

    /// The name used in tables.
    pub fn name(self) -> &'static str {
        match self {
            Level::Scalar => "scalar",
            Level::Avx2 => "avx2",
            Level::Avx512 => "avx512",
        }
    }
}

/// Where every ray of a batch begins.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug)]
pub struct Root {
    /// Lower corner of the scene's box; the fourth lane is padding.
    pub min: [f32; 4],
    /// Upper corner.
    pub max: [f32; 4],
    /// The same box.
    pub bounds: Aabb,
    /// Code of the root cell.
    pub code: u32,
    /// Largest coordinate of the box.
    pub reach: f32,
    /// True if the box lies within [`LARGE`](super::slot::LARGE).
    pub is_ordinary: bool,
}

impl Root {
    /// The root of a tree.
    pub fn new(bounds: &Aabb, code: u32) -> Root {
        let pad = |[x, y, z]: [f32; 3]| [x, y, z, 0.0];
        let reach = bounds.min.iter().chain(&bounds.max).fold(0.0f32, |m, x| m.max(x.abs()));
        let is_ordinary = reach <= LARGE;
        Root {
            min: pad(bounds.min),
            max: pad(bounds.max),
            bounds: *bounds,
            code,
            reach,
            is_ordinary,
        }
    }
}

/// The lanes of a block that a ray may hit.
#[derive(Clone, Copy, Debug, Default)]
pub struct Found {
    /// Lanes that it hits for sure, at a parameter in [`Range`], all of which lies between the
    /// ray's `t_min` and limit.
    pub clear: u32,
    /// Lanes that must be decided exactly.
    pub open: u32,
}

/// Bounds of the parameter in each clear lane of a block; without meaning in others.
#[repr(C, align(32))]
#[derive(Clone, Copy, Debug, Default)]
pub struct Range {
    /// Lower bounds.
    pub low: [f32; WIDTH],
    /// Upper bounds.
    pub high: [f32; WIDTH],
}

/// What [`Simd::nearest`] finds.
#[derive(Clone, Copy, Debug)]
pub struct Nearest {
    /// The lane.
    pub lane: usize,
    /// Its upper bound.
    pub high: f32,
    /// Lanes that may be as near.
    pub rivals: u32,
}

/// Relative error of a parameter interpolated between the depths of a triangle's vertices, added to
/// what the edge functions' errors contribute: three roundings in a depth, eight in the
/// interpolation, and one more where the exact parameter is rounded.
pub const DEPTH_SLACK: f32 = 16.0 * f32::EPSILON / 2.0;

/// Error of an interpolated parameter in shares of the depth range times `slack / |det|`.
///
/// The weights `w` of the vertices are off by at most `slack` each. Depths taken from the middle of
/// their range are at most half of it, and so is the parameter: `sum(dw z) - t sum(dw)` is at most
/// `3 / 2 + 3 / 2` ranges times `slack`, and `det`, computed, divides it. 4 leaves room for roundings.
pub const WEIGHT_SLACK: f32 = 4.0;

/// Added to the largest parameter of a triangle where ray and triangle are [rounded](crate::double):
/// with sheared coordinates off by `9 u` each, `u = 2^-24`, an edge function is off by another
/// `18 u S + 162 u^2`, and a parameter by `5 u`; what is added to the bounds is `20 u (S + 16 u)` at
/// least, since the largest direction component is 1 at least, and `20 u`. More would cost exact tests
/// of the triangles that rays start from.
pub const ROUNDED_DEPTH: f32 = 1.25;

/// Added to the size of a triangle for the same reason.
pub const ROUNDED_SIZE: f32 = 16.0 * f32::EPSILON / 2.0;

/// The two hot steps, written for each level.
///
/// # Safety
/// The methods may only run on a machine with the level's features.
pub trait Simd: Locate {
    /// Some lanes in `f64`, or one.
    type Doubles: Doubles;

    /// [`Slot::load`], which it may call.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn load(slot: &mut Slot, ray: &Ray, index: u32, root: &Root) -> Loaded;

    /// Of eight rays those of which [`Simd::load`] would say that they miss, or some of them; `index` says which rays.
    ///
    /// # Safety
    /// See the trait.
    #[inline(always)]
    unsafe fn miss_box(_rays: &[Ray], _index: &[u32; WIDTH], _root: &Root) -> u32 {
        0
    }

    /// Replaces the top of the slot's stack by the children that the ray's interval reaches,
    /// nearest on top, and returns the new stack pointer.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn step(slot: &mut Slot, treelet: &Treelet, sp: usize) -> usize;

    /// Replaces the only entry of the slot's stack by those of some cells that the ray's interval reaches, in any
    /// order, and returns the new stack pointer.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn enter(slot: &mut Slot, cells: &Cells) -> usize;

    /// [`Lists::add`].
    ///
    /// # Safety
    /// See the trait.
    #[inline(always)]
    unsafe fn add(lists: &mut Lists, moved: &List, n: usize) {
        lists.add(moved, n);
    }

    /// The lanes that [`Simd::test`] may find clear or open, and perhaps a few more; see
    /// [`look`](super::look::look).
    ///
    /// # Safety
    /// See the trait.
    unsafe fn meets<const ROUNDED: bool, const WHOLE: bool>(slot: &Slot, block: &Block) -> u32;

    /// True if two blocks are looked at side by side in less time than one after the other.
    const TWO: bool = false;

    /// [`Simd::meets`] for two blocks, the lanes of the second in bits 15..8.
    ///
    /// # Safety
    /// See the trait.
    #[inline(always)]
    unsafe fn meets_two<const ROUNDED: bool, const WHOLE: bool>(
        slot: &Slot,
        [first, second]: [&Block; 2],
    ) -> u32 {
        // SAFETY: passed on to the caller.
        unsafe {
            let lanes = Self::meets::<ROUNDED, WHOLE>(slot, first);
            lanes | Self::meets::<ROUNDED, WHOLE>(slot, second) << WIDTH
        }
    }

    /// Tests the triangles of a block against the slot's ray, `t_min` and `limit`.
    ///
    /// `f32` with error bounds: a lane that is neither clear nor open is not hit, or hit beyond the
    /// limit. Rounding: see [`Slot::edge_slack`]. Lanes without a triangle (NaN) are never set.
    ///
    /// `ROUNDED` says that ray and triangles have been rounded from `f64` as
    /// [`double`](crate::double) does; the bounds then hold for what they were before.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn test<const ROUNDED: bool>(slot: &Slot, block: &Block, range: &mut Range) -> Found;

    /// The lanes of a block of other primitives that the ray may hit, and perhaps a few more; see
    /// [`near`](super::near::near).
    ///
    /// # Safety
    /// See the trait.
    unsafe fn near(slot: &Slot, ray: &Ray, block: &Block) -> u32;

    /// The clear lane with the smallest upper bound, that bound, and the other clear lanes whose
    /// lower bound does not lie above it. Lane 0 and infinity without clear lanes.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn nearest(clear: u32, range: &Range) -> Nearest;

    /// The lanes of a block whose primitive is not `prim_id`.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn others(block: &Block, prim_id: u32) -> u32;

    /// Writes some lanes of a row one after another to the beginning of `kept`, and anything behind
    /// them.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn keep(lanes: u32, row: &[u32; WIDTH], kept: &mut [u32; WIDTH]);

    /// Sorts the keys of hits and writes parameters and primitives to the beginning of `t` and
    /// `prim`, repeated ones once; returns how many these are. The order of `keys` is lost.
    ///
    /// # Panics
    /// If `t` or `prim` is shorter than [`room`]`(keys.len())`: anything may be written there.
    ///
    /// # Safety
    /// See the trait.
    #[inline(always)]
    unsafe fn order(keys: &mut [u64], t: &mut [f32], prim: &mut [u32]) -> usize {
        order(keys, t, prim)
    }

    /// Asks for a cache line.
    ///
    /// # Safety
    /// See the trait; the address need not be valid.
    unsafe fn prefetch(address: *const u8);
}
