//! The rays of a sample in the nodes of a build (Bittner and Havran 2009, RDH: Ray Distribution Heuristics).
//!
//! The probability that a ray which meets a node meets a child is a mixture of two estimates: the
//! child's share of the surface area, and its share of the node's sample rays. With `n` rays the latter has the
//! weight `n / (n + PRIOR)`, as if the surface area had been seen as `PRIOR` rays before: no child is ever thought
//! free because few rays were sampled. Nodes with fewer than [`FEWEST`] rays go by the area alone.
//!
//! A part of a ray in a cell is kept as its box, as parts of primitives are: on each axis it tells on which sides of a
//! plane the ray is.

use super::fragment::Fragment;
use super::plane::{CellAreas, Plane};
use super::sample::RaySample;
use crate::aabb::Aabb;

/// How many rays the surface area is worth.
pub(super) const PRIOR: f64 = 32.0;

/// Nodes with fewer rays go by the surface area, and so does all below them.
pub(super) const FEWEST: usize = 16;

/// Rays that a node keeps for each fragment, at most, and in any case: they then cost a build no more than some
/// multiple of its own time and memory, however many rays there are and wherever they go.
const PER_FRAGMENT: usize = 1;
const IN_ANY_CASE: usize = 64;

/// Rays that a node of so many fragments keeps.
fn most(fragments: usize) -> usize {
    IN_ANY_CASE.max(PER_FRAGMENT * fragments)
}

/// The sample rays of one node.
#[derive(Clone, Copy)]
pub(crate) struct NodeRays<'a> {
    /// Parts inside the cell, named by the rays; at least [`FEWEST`].
    pub parts: &'a [Fragment],
}

impl NodeRays<'_> {
    /// The weights of the area's share and of one ray in the mixture.
    pub fn weights(&self) -> (f64, f64) {
        let total = self.parts.len() as f64 + PRIOR;
        (PRIOR / total, 1.0 / total)
    }

    /// The areas of the parts below and above a plane, as they would be if their shares of the cell's area were
    /// the probabilities.
    pub fn areas(&self, areas: &CellAreas, axis: usize, position: f32) -> (f64, f64) {
        let (of_area, of_ray) = self.weights();
        let (below, above) = areas.parts(position);
        let (mut left, mut right) = (0u32, 0u32);
        for part in self.parts {
            let (lo, hi) = (part.min(axis), part.max(axis));
            left += u32::from(lo < position);
            right += u32::from(is_above(lo, hi, position));
        }
        let mixed = |area: f64, rays: u32| of_area * area + of_ray * f64::from(rays) * areas.area;
        (mixed(below, left), mixed(above, right))
    }
}

/// Whether a part reaches above a plane; one that lies in it does.
#[inline(always)]
pub(crate) fn is_above(lo: f32, hi: f32, position: f32) -> bool {
    (hi > position) | (lo >= position)
}

/// The rays of all pending nodes, stacked as their fragments are.
#[derive(Default)]
pub(super) struct RayStack {
    parts: Vec<Fragment>,
    lefts: Vec<Fragment>,
}

impl RayStack {
    /// The rays that meet a root of so many fragments, and how many they are.
    pub fn new(sample: &RaySample, cell: &Aabb, fragments: usize) -> (Self, usize) {
        // Nothing has a cell that holds nothing.
        let rays = if fragments > 0 { 0..sample.len() as u32 } else { 0..0 };
        let parts = rays.filter_map(|ray| sample.part(ray, cell)).take(most(fragments));
        let mut stack = RayStack { parts: parts.collect(), lefts: Vec::new() };
        if stack.parts.len() < FEWEST {
            stack.parts.clear();
        }
        let count = stack.parts.len();
        (stack, count)
    }

    /// The rays of the node on top, if it has any.
    pub fn top(&self, count: usize) -> Option<NodeRays<'_>> {
        (count > 0).then(|| NodeRays { parts: &self.parts[self.parts.len() - count..] })
    }

    /// Drops the node on top.
    pub fn pop(&mut self, count: usize) {
        self.parts.truncate(self.parts.len() - count);
    }

    /// Moves the node under the top one into a stack of its own.
    pub fn take_below(&mut self, top: usize, below: usize) -> RayStack {
        let start = self.parts.len() - top - below;
        RayStack { parts: self.parts.drain(start..start + below).collect(), lefts: Vec::new() }
    }

    /// Replaces the node on top by its children of so many fragments, the lower one on top; how many rays they
    /// keep.
    pub fn split(
        &mut self,
        count: usize,
        plane: &Plane,
        cells: &(Aabb, Aabb),
        sample: &RaySample,
        (left, right): (usize, usize),
    ) -> (usize, usize) {
        if count == 0 {
            return (0, 0);
        }
        let base = self.parts.len() - count;
        let (axis, position) = (plane.axis, plane.position);
        self.lefts.clear();
        let mut rights = base;
        for i in base..base + count {
            let part = self.parts[i];
            let (lo, hi) = (part.min(axis), part.max(axis));
            let (below, above) = (lo < position, is_above(lo, hi, position));
            let inside =
                |cell| if below && above { sample.part(part.prim(), cell) } else { Some(part) };
            if below && self.lefts.len() < most(left) {
                self.lefts.extend(inside(&cells.0));
            }
            if above
                && rights - base < most(right)
                && let Some(part) = inside(&cells.1)
            {
                self.parts[rights] = part; // rights <= i: read already
                rights += 1;
            }
        }
        let enough = |rays: usize| if rays < FEWEST { 0 } else { rays };
        let (left, right) = (enough(self.lefts.len()), enough(rights - base));
        self.parts.truncate(base + right);
        self.parts.extend_from_slice(&self.lefts[..left]);
        (left, right)
    }
}
