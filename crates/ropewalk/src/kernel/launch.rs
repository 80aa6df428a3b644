//! Kernels at the level in use.

#![allow(unsafe_code)]

use super::beam::{self, BatchReport, BeamQuery, beams};
use super::events::Events;
use super::leaf::Leaves;
use super::level::{Level, Root};
use super::query::BatchQuery;
use super::scalar::Scalar;
use super::single::single;
use super::slot::Slot;
use super::source::Source;
use super::wave::wave;
use crate::geometry::Geometry;
use crate::ray::Ray;
use crate::wide::WideTree;

/// The rays of `source` in the wave.
pub fn run_wave<Q: BatchQuery, S: Source<Q>, E: Events, const SHAPES: bool>(
    level: Level,
    (tree, geometry): (&WideTree, &Geometry),
    slots: &mut [Slot],
    query: &mut Q,
    source: &mut S,
    events: &mut E,
) {
    match level {
        // SAFETY: portable code.
        Level::Scalar => unsafe {
            wave::<Scalar, Q, S, E, SHAPES>(tree, geometry, slots, query, source, events);
        },
        // SAFETY: callers have only levels that this machine has.
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 => unsafe {
            wave_avx2::<Q, S, E, SHAPES>(tree, geometry, slots, query, source, events);
        },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 => unsafe {
            wave_avx512::<Q, S, E, SHAPES>(tree, geometry, slots, query, source, events);
        },
        #[cfg(not(target_arch = "x86_64"))]
        _ => unreachable!("only available levels can be chosen"),
    }
}

/// One ray by itself; see [`single`].
pub fn run_single<Q: BatchQuery, E: Events, const SHAPES: bool>(
    level: Level,
    leaves: &Leaves<'_>,
    root: &Root,
    slot: &mut Slot,
    query: &mut Q,
    events: &mut E,
) -> bool {
    match level {
        // SAFETY: portable code.
        Level::Scalar => unsafe {
            single::<Scalar, Q, E, SHAPES>(leaves, root, slot, query, events)
        },
        // SAFETY: callers have only levels that this machine has.
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 => unsafe { single_avx2::<Q, E, SHAPES>(leaves, root, slot, query, events) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 => unsafe {
            single_avx512::<Q, E, SHAPES>(leaves, root, slot, query, events)
        },
        #[cfg(not(target_arch = "x86_64"))]
        _ => unreachable!("only available levels can be chosen"),
    }
}

/// The coherent rays in beams; the others are left.
pub fn run_beams<Q: BeamQuery>(
    level: Level,
    tree: &WideTree,
    rays: &[Ray],
    query: &mut Q,
    room: &mut beam::Room,
    left: &mut Vec<u32>,
) -> BatchReport {
    match level {
        // SAFETY: portable code.
        Level::Scalar => unsafe { beams::<Scalar, Q>(tree, rays, query, room, left) },
        // SAFETY: callers have only levels that this machine has.
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 => unsafe { beams_avx2(tree, rays, query, room, left) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 => unsafe { beams_avx512(tree, rays, query, room, left) },
        #[cfg(not(target_arch = "x86_64"))]
        _ => unreachable!("only available levels can be chosen"),
    }
}

macro_rules! instantiate {
    ($wave:ident, $beams:ident, $single:ident, $level:ty, $features:literal) => {
        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = $features)]
        fn $wave<Q: BatchQuery, S: Source<Q>, E: Events, const SHAPES: bool>(
            tree: &WideTree,
            geometry: &Geometry,
            slots: &mut [Slot],
            query: &mut Q,
            source: &mut S,
            events: &mut E,
        ) {
            // SAFETY: this function enables the level's features.
            unsafe { wave::<$level, Q, S, E, SHAPES>(tree, geometry, slots, query, source, events) }
        }

        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = $features)]
        fn $beams<Q: BeamQuery>(
            tree: &WideTree,
            rays: &[Ray],
            query: &mut Q,
            room: &mut beam::Room,
            left: &mut Vec<u32>,
        ) -> BatchReport {
            // SAFETY: this function enables the level's features.
            unsafe { beams::<$level, Q>(tree, rays, query, room, left) }
        }

        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = $features)]
        fn $single<Q: BatchQuery, E: Events, const SHAPES: bool>(
            leaves: &Leaves<'_>,
            root: &Root,
            slot: &mut Slot,
            query: &mut Q,
            events: &mut E,
        ) -> bool {
            // SAFETY: this function enables the level's features; the caller's root is the tree's.
            unsafe { single::<$level, Q, E, SHAPES>(leaves, root, slot, query, events) }
        }
    };
}
instantiate!(
    wave_avx2,
    beams_avx2,
    single_avx2,
    super::avx2::Avx2,
    "avx2,fma,bmi1,bmi2,popcnt,lzcnt"
);
instantiate!(
    wave_avx512,
    beams_avx512,
    single_avx512,
    super::avx512::Avx512,
    "avx2,fma,bmi1,bmi2,popcnt,lzcnt,avx512f,avx512vl,avx512bw,avx512dq"
);
