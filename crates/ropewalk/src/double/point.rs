//! Triangles in `f64` as points ask about them.

use super::{DoubleGeometry, DoubleTree};
use crate::point::Triangles;
use crate::wide::WideTree;

/// Scaled coordinates nearer to zero than this count as zero, so that no product of three underflows: the scene
/// reaches over more than 1/2 there.
const TINY: f64 = f64::from_bits((1023 - 250) << 52);

impl DoubleGeometry {
    /// A vertex by its scaled coordinates.
    #[inline(always)]
    fn scaled_vertices(&self, prim_id: u32) -> Option<[[f64; 3]; 3]> {
        let [a, b, c] = self.triangle(prim_id)?;
        Some([self.scaled(a), self.scaled(b), self.scaled(c)])
    }
}

impl Triangles for DoubleGeometry {
    type Tree = DoubleTree;
    const ROUNDED: bool = true;

    fn wide(tree: &DoubleTree) -> &WideTree {
        tree.wide()
    }

    fn count(&self) -> usize {
        self.len()
    }

    #[inline(always)]
    fn scaled(&self, point: [f64; 3]) -> [f64; 3] {
        let scale = self.frame().scale();
        point.map(|x| {
            let x = x * scale;
            if x.abs() < TINY { 0.0 } else { x }
        })
    }

    #[inline(always)]
    fn unscaled(&self, x: f64) -> f64 {
        x * self.frame().unit()
    }

    #[inline(always)]
    fn placed(&self, point: [f64; 3]) -> [f64; 3] {
        self.frame().scaled(point)
    }

    fn unplaced(&self, point: [f64; 3]) -> [f64; 3] {
        self.frame().unscaled(point)
    }

    #[inline(always)]
    fn corners(&self, prim_id: u32) -> Option<[[f64; 3]; 3]> {
        self.scaled_vertices(prim_id)
    }

    fn placed_corners(&self, prim_id: u32) -> Option<[[f64; 3]; 3]> {
        Some(self.triangle(prim_id)?.map(|p| self.frame().scaled(p)))
    }

    fn has_area(&self, prim_id: u32) -> bool {
        !self.is_degenerate(prim_id)
    }

    fn extent(&self) -> [[f64; 3]; 2] {
        let (low, high) = self.bounds().unwrap_or(([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]));
        [self.scaled(low), self.scaled(high)]
    }
}
