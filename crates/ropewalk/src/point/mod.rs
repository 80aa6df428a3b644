//! Points: the nearest triangle, inside or outside, winding numbers, cells.
//!
//! [`PointQueries`] answers batches of points over the wide tree of the ray queries;
//! [`PointBruteForce`] is the definition of every answer. Points are `f64`, triangles `f32` or, of a
//! [`DoubleGeometry`](crate::double::DoubleGeometry), `f64`. docs/numerics.md has the rules and why a walk
//! finds what brute force finds.

mod brute_force;
pub(crate) mod cells;
pub(crate) mod expansion;
mod order;
mod queries;
pub(crate) mod side;
mod triangles;
mod winding;

pub use brute_force::PointBruteForce;
pub use cells::Cell;
pub use queries::{ClosestPoints, PointError, PointQueries};
pub use side::Side;
pub(crate) use side::{Crossing, crossing, flushed};
pub use triangles::Triangles;
pub use winding::WindingMoments;
pub(crate) use winding::{Moments, NOTHING, half_angle, half_solid_angle, tangent};

/// Largest coordinate of a point; beyond it products overflow.
pub const LARGEST: f64 = 1e100;

/// True if a point has an answer: all coordinates are numbers up to [`LARGEST`].
#[inline(always)]
pub fn is_near(point: &[f64; 3]) -> bool {
    point[0].abs() <= LARGEST && point[1].abs() <= LARGEST && point[2].abs() <= LARGEST
}

/// How far rounding for a tree's triangles may move one or a point, in the numbers of that tree: half a step of
/// `f32` along each axis, and some of `f64`, up to 1 in size; more than twice over.
pub const ROUNDING: f64 = 1.0 / (1u64 << 22) as f64;

/// The point of a primitive that is nearest to a point, in its order among others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosestPoint {
    /// Distance, not squared.
    pub distance: f64,
    /// The primitive; of those equally near the lowest.
    pub prim_id: u32,
    /// The point of it.
    pub point: [f64; 3],
    /// Weights of its vertices 1 and 2 at that point.
    pub uv: [f64; 2],
}
