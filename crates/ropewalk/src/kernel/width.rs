//! How many rays are in flight on a core: as many as its first cache has room for.

#![allow(unsafe_code)]

use super::wave::WAVE;
use std::sync::OnceLock;

/// Rays in flight where the first data cache is of 32 KiB.
const NARROW: usize = 24;

/// Size of a first data cache in which all of [`WAVE`] pay, in bytes: measured at 48 KiB, where they save 3 % and more do not,
/// and at 32 KiB, where they cost as much on large trees.
const LARGE: usize = 40 << 10;

/// Rays in flight on a core of this machine, [`WAVE`] at most.
pub fn wave_width() -> usize {
    static WIDTH: OnceLock<usize> = OnceLock::new();
    *WIDTH.get_or_init(|| if first_cache() >= LARGE { WAVE } else { NARROW })
}

/// Bytes of the first data cache, 0 where the processor does not say.
#[cfg(target_arch = "x86_64")]
fn first_cache() -> usize {
    use std::arch::x86_64::{__cpuid, __cpuid_count};
    // Safe from some release of Rust on.
    #[allow(unused_unsafe)]
    // SAFETY: every x86-64 has the instruction; leaves are asked for only where there are as many.
    unsafe {
        // The same form by both makers: Intel's leaf, then AMD's.
        for (first, leaf) in [(0, 4), (0x8000_0000, 0x8000_001D)] {
            if __cpuid(first).eax < leaf {
                continue;
            }
            for i in 0..4 {
                let cache = __cpuid_count(leaf, i);
                let (kind, level) = (cache.eax & 31, cache.eax >> 5 & 7);
                // A data cache or one for everything, of the first level.
                if matches!(kind, 1 | 3) && level == 1 {
                    let field = |from: u32, bits: u32| (cache.ebx >> from & ((1 << bits) - 1)) + 1;
                    let lines = field(22, 10) * field(12, 10) * (cache.ecx + 1);
                    return (lines * field(0, 12)) as usize;
                }
            }
        }
    }
    0
}

#[cfg(not(target_arch = "x86_64"))]
fn first_cache() -> usize {
    0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the system says, where it says anything.
    #[test]
    fn the_first_cache_is_that_of_the_system() {
        let said = std::fs::read_to_string("/sys/devices/system/cpu/cpu0/cache/index0/size");
        let Some(kib) = said.ok().and_then(|text| text.trim().strip_suffix('K')?.parse().ok())
        else {
            return;
        };
        let kib: usize = kib;
        if cfg!(target_arch = "x86_64") {
            assert_eq!(first_cache(), kib << 10);
        }
    }

    #[test]
    fn the_width_is_one_of_two() {
        assert!([NARROW, WAVE].contains(&wave_width()));
    }
}
