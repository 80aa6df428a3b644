//! Triangles and rays in `f64`: searched in `f32`, decided in `f64`.
//!
//! A [`DoubleGeometry`] keeps its coordinates and holds a copy for the search, moved to the middle of the
//! scene, scaled by a power of two to reach from -1 to 1, and rounded to `f32`. A [`DoubleTree`] over the
//! copy refers to each triangle from all cells that come near it, rays are rounded the same way, and the
//! wave lets by whatever might be hit but for the rounding; [`DoubleGeometry::intersect`], in `f64` from
//! the coordinates as they were given, decides. So answers are those of [`DoubleBruteForce`], bit for bit,
//! however far from the origin a scene lies (docs/numerics.md).

mod brute_force;
mod geometry;
mod narrow;
mod point;
mod ray;
mod rows;

pub use crate::kernel::{DoubleAllHits, DoubleBatchHit, DoubleCaster, DoubleFilter};
pub use brute_force::DoubleBruteForce;
pub use geometry::{DoubleGeometry, DoubleGeometryError, DoubleTree};
pub(crate) use narrow::{Narrowed, Place};
pub use ray::{DoubleHit, DoubleRay};
pub(crate) use rows::Rows;
