//! What points are asked about: triangles in `f32` or in `f64`, and the numbers in which they are looked for
//! and decided.

use crate::geometry::Geometry;
use crate::primitive::Primitive;
use crate::wide::WideTree;

/// Triangles that [`PointQueries`](super::PointQueries) and [`PointBruteForce`](super::PointBruteForce) answer
/// about: a [`Geometry`], or a [`DoubleGeometry`](crate::double::DoubleGeometry).
///
/// Answers are decided in *scaled* numbers, which differ from those that were given by a power of two alone,
/// and looked for in *placed* numbers, those of the tree; lengths are the same in both.
pub trait Triangles: Sync {
    /// The tree over them.
    type Tree: Sync;

    /// True if the tree's triangles are rounded, each vertex by less than
    /// [`ROUNDING`](super::ROUNDING) in all.
    const ROUNDED: bool;

    /// The wide tree in a tree.
    fn wide(tree: &Self::Tree) -> &WideTree;

    /// The number of primitives.
    fn count(&self) -> usize;

    /// A point in the numbers in which answers are decided.
    fn scaled(&self, point: [f64; 3]) -> [f64; 3];

    /// A scaled number as it would have been given.
    fn unscaled(&self, x: f64) -> f64;

    /// A point in the numbers of the tree.
    fn placed(&self, point: [f64; 3]) -> [f64; 3];

    /// A point of the tree as it would have been given.
    fn unplaced(&self, point: [f64; 3]) -> [f64; 3];

    /// The scaled corners of a triangle; `None` for what is none.
    fn corners(&self, prim_id: u32) -> Option<[[f64; 3]; 3]>;

    /// The placed corners of a triangle; `None` for what is none.
    fn placed_corners(&self, prim_id: u32) -> Option<[[f64; 3]; 3]>;

    /// True if a triangle has an area.
    fn has_area(&self, prim_id: u32) -> bool;

    /// The lower and upper corner of the scaled box of all primitives.
    fn extent(&self) -> [[f64; 3]; 2];
}

impl Triangles for Geometry {
    type Tree = WideTree;
    const ROUNDED: bool = false;

    fn wide(tree: &WideTree) -> &WideTree {
        tree
    }

    fn count(&self) -> usize {
        self.len()
    }

    #[inline(always)]
    fn scaled(&self, point: [f64; 3]) -> [f64; 3] {
        point
    }

    #[inline(always)]
    fn unscaled(&self, x: f64) -> f64 {
        x
    }

    #[inline(always)]
    fn placed(&self, point: [f64; 3]) -> [f64; 3] {
        point
    }

    #[inline(always)]
    fn unplaced(&self, point: [f64; 3]) -> [f64; 3] {
        point
    }

    #[inline(always)]
    fn corners(&self, prim_id: u32) -> Option<[[f64; 3]; 3]> {
        Some(self.triangle(prim_id)?.vertices.map(|v| v.map(f64::from)))
    }

    #[inline(always)]
    fn placed_corners(&self, prim_id: u32) -> Option<[[f64; 3]; 3]> {
        self.corners(prim_id)
    }

    fn has_area(&self, prim_id: u32) -> bool {
        self.triangle(prim_id).is_some_and(|triangle| !triangle.is_degenerate())
    }

    fn extent(&self) -> [[f64; 3]; 2] {
        let bounds = self.bounds();
        [bounds.min.map(f64::from), bounds.max.map(f64::from)]
    }
}
