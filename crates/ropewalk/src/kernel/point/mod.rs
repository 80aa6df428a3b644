//! Walks of points over the wide tree: to the nearest triangle, and up a column.
//!
//! ```text
//! nearest   depth first; of the children of a treelet those that hold primitives and are near enough go on
//!           the stack with their distances along the axes, the nearest on top
//! column    all cells that the ray from the point along +z touches, plane by plane
//! winding   down to cells that are far enough for their moments, and to all triangles near by
//! ```
//! In a leaf, eight triangles at a time are looked at by their boxes first. What is found is defined without a tree in `triangle` and
//! [`crate::point`]; brute force uses the same. Where the tree's triangles are rounded they are candidates, and those of the
//! geometry decide.

#![allow(unsafe_code)]

mod column;
mod nearest;
mod step;
pub mod triangle;
mod winding;

pub use nearest::Found;
pub use winding::Winding;

use super::beam::BeamSimd;
use super::events::Events;
use super::level::Level;
use super::scalar::Scalar;
use crate::point::{Side, Triangles, WindingMoments};
use crate::tree::MAX_DEPTH;
use crate::wide::{LEVELS, WideTree};

/// Entries that a walk may put on its stack: one a plane on the path.
const STACK: usize = MAX_DEPTH.next_multiple_of(LEVELS) + 1;

/// The nearest triangle of each point, at a level that this machine has.
pub fn nearest<E: Events, G: Triangles>(
    level: Level,
    scene: (&WideTree, &G),
    points: &[[f64; 3]],
    found: &mut [Found],
    events: &mut E,
) {
    match level {
        // SAFETY: portable code.
        Level::Scalar => unsafe { nearest::nearest::<Scalar, E, G>(scene, points, found, events) },
        // SAFETY: the caller gives only levels that this machine has.
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 => unsafe { nearest_avx2(scene, points, found, events) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 => unsafe { nearest_avx512(scene, points, found, events) },
        #[cfg(not(target_arch = "x86_64"))]
        _ => unreachable!("only available levels can be chosen"),
    }
}

/// On which side of the surface each point is, at a level that this machine has.
pub fn sides<E: Events, G: Triangles>(
    level: Level,
    scene: (&WideTree, &G),
    points: &[[f64; 3]],
    sides: &mut [Side],
    events: &mut E,
) {
    match level {
        // SAFETY: portable code.
        Level::Scalar => unsafe { column::sides::<Scalar, E, G>(scene, points, sides, events) },
        // SAFETY: the caller gives only levels that this machine has.
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 => unsafe { sides_avx2(scene, points, sides, events) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 => unsafe { sides_avx512(scene, points, sides, events) },
        #[cfg(not(target_arch = "x86_64"))]
        _ => unreachable!("only available levels can be chosen"),
    }
}

/// The winding number of each point by moments, at a level that this machine has.
pub fn winding<G: Triangles>(
    level: Level,
    scene: (&WideTree, &G),
    moments: &WindingMoments,
    points: &[[f64; 3]],
    accuracy: f64,
    found: &mut [Winding],
) {
    match level {
        // SAFETY: the caller gives only levels that this machine has.
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 => unsafe { winding_avx2(scene, moments, points, accuracy, found) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 => unsafe { winding_avx512(scene, moments, points, accuracy, found) },
        _ => winding::winding(scene, moments, points, accuracy, found),
    }
}

macro_rules! instantiate {
    ($nearest:ident, $sides:ident, $winding:ident, $level:ty, $features:literal) => {
        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = $features)]
        fn $winding<G: Triangles>(
            scene: (&WideTree, &G),
            moments: &WindingMoments,
            points: &[[f64; 3]],
            accuracy: f64,
            found: &mut [Winding],
        ) {
            winding::winding(scene, moments, points, accuracy, found);
        }

        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = $features)]
        fn $nearest<E: Events, G: Triangles>(
            scene: (&WideTree, &G),
            points: &[[f64; 3]],
            found: &mut [Found],
            events: &mut E,
        ) {
            // SAFETY: this function enables the level's features.
            unsafe { nearest::nearest::<$level, E, G>(scene, points, found, events) }
        }

        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = $features)]
        fn $sides<E: Events, G: Triangles>(
            scene: (&WideTree, &G),
            points: &[[f64; 3]],
            sides: &mut [Side],
            events: &mut E,
        ) {
            // SAFETY: this function enables the level's features.
            unsafe { column::sides::<$level, E, G>(scene, points, sides, events) }
        }
    };
}
instantiate!(
    nearest_avx2,
    sides_avx2,
    winding_avx2,
    super::avx2::Avx2,
    "avx2,fma,bmi1,bmi2,popcnt,lzcnt"
);
instantiate!(
    nearest_avx512,
    sides_avx512,
    winding_avx512,
    super::avx512::Avx512,
    "avx2,fma,bmi1,bmi2,popcnt,lzcnt,avx512f,avx512vl,avx512bw,avx512dq"
);
