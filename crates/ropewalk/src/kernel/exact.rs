//! What the filters leave open: decided in `f64`, as the reference walks do.

use crate::primitive::Triangle;
use crate::ray::{Hit, Ray, Shear};
use crate::wide::{ID_MASK, Lines, WIDTH};

/// A triangle where it lies: the line of its block times eight plus its lane.
pub type At = u32;

/// The place of a lane of the block at `line`.
#[inline(always)]
pub fn place(line: usize, lane: usize) -> At {
    (line * WIDTH + lane) as u32
}

/// The triangles and rays of a batch, for exact tests.
#[derive(Clone, Copy)]
pub struct Exact<'a> {
    /// The tree's memory.
    pub lines: &'a Lines,
    /// All rays.
    pub rays: &'a [Ray],
}

impl Exact<'_> {
    /// The hit of a ray on a triangle, if it lies in the ray's range.
    ///
    /// The block has just been tested, so it is at hand where the geometry's own copy would not be.
    #[inline(always)]
    pub fn hit(&self, ray: u32, at: At) -> Option<Hit> {
        let (block, lane) = (self.lines.block(at as usize / WIDTH), at as usize % WIDTH);
        let ray = &self.rays[ray as usize];
        let corner = |i: usize, axis: usize| block.vertex[i][axis][lane];
        let met = Triangle::meet(corner, &Shear::new(ray), block.sides(lane))?;
        let t = met.t as f32;
        let accepted = t.is_finite() && ray.t_min <= t && t <= ray.t_max;
        accepted.then_some(Hit { t, prim_id: block.id[lane] & ID_MASK, u: met.u, v: met.v })
    }
}
