//! SIMD levels: detected once, stored, dispatched per batch, forced in tests.

#![allow(unsafe_code)]

use super::slot::Slot;
use crate::wide::{Block, Treelet};

/// Instruction set of a kernel. All levels give bit-identical answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Level {
    /// Portable code, the definition of the others.
    Scalar,
    /// x86-64 with AVX2 and FMA.
    Avx2,
    /// x86-64 with AVX-512 F, VL, BW, DQ.
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
            Level::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
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

/// The two hot steps, written for each level.
///
/// # Safety
/// The methods may only run on a machine with the level's features.
pub trait Simd: Copy {
    /// Replaces the top of the slot's stack by the children that the ray's interval reaches,
    /// nearest on top, and returns the new stack pointer.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn step(slot: &mut Slot, treelet: &Treelet, sp: usize) -> usize;

    /// The lanes of a block whose triangle the ray may hit: none that it hits is missing.
    ///
    /// Rounding: see [`Slot::edge_slack`]. Lanes without a triangle (NaN) are never set.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn candidates(slot: &Slot, block: &Block) -> u32;

    /// Asks for a cache line.
    ///
    /// # Safety
    /// See the trait; the address need not be valid.
    unsafe fn prefetch(address: *const u8);
}
