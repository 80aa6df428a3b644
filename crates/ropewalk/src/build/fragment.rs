//! The part of a primitive inside a cell, as a box.

use super::event::{Event, EventKind};
use crate::aabb::Aabb;
use crate::geometry::Geometry;
use glam::Vec4;

/// The box of one primitive's part inside the cell of a node, in 32 bytes.
///
/// ```text
/// lanes 0..3  lower corner      lane 3  bits of the primitive's id
/// lanes 4..7  upper corner      lane 7  0
/// ```
/// Ids have 30 bits, which read as numbers of 0 to 2: arithmetic on all lanes harms nothing.
///
/// Invariant: the box is not empty, lies in the cell, and holds no negative zero, so that equal
/// coordinates have equal bits.
#[repr(C, align(32))]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Fragment {
    pub lanes: [f32; 8],
}

impl Fragment {
    /// Stands for the primitive in a fragment of which nothing is left.
    const GONE: u32 = Geometry::MAX_PRIMITIVES as u32;

    pub fn new(prim: u32, bounds: &Aabb) -> Self {
        // Adding +0 turns -0 into +0 and leaves everything else alone.
        let ([x0, y0, z0], [x1, y1, z1]) =
            (bounds.min.map(|x| x + 0.0), bounds.max.map(|x| x + 0.0));
        Fragment { lanes: [x0, y0, z0, f32::from_bits(prim), x1, y1, z1, 0.0] }
    }

    /// A fragment of which nothing is left.
    pub fn gone() -> Self {
        Fragment::new(Self::GONE, &Aabb::new([0.0; 3], [0.0; 3]))
    }

    pub fn is_gone(&self) -> bool {
        self.prim() == Self::GONE
    }

    #[inline(always)]
    pub fn prim(&self) -> u32 {
        self.lanes[3].to_bits()
    }

    /// The lower corner, and a number that stands for the primitive.
    #[inline(always)]
    pub fn lower(&self) -> Vec4 {
        Vec4::from_slice(&self.lanes[..4])
    }

    /// The upper corner, and 0.
    #[inline(always)]
    pub fn upper(&self) -> Vec4 {
        Vec4::from_slice(&self.lanes[4..])
    }

    #[inline(always)]
    pub fn min(&self, axis: usize) -> f32 {
        self.lanes[axis]
    }

    #[inline(always)]
    pub fn max(&self, axis: usize) -> f32 {
        self.lanes[4 + axis]
    }

    pub fn bounds(&self) -> Aabb {
        let [x0, y0, z0, _, x1, y1, z1, _] = self.lanes;
        Aabb::new([x0, y0, z0], [x1, y1, z1])
    }

    /// Appends the events of this fragment, known as `id` in its node.
    pub fn push_events(&self, id: u32, axis: usize, out: &mut Vec<Event>) {
        let (lo, hi) = (self.min(axis), self.max(axis));
        if lo == hi {
            out.push(Event::new(lo, EventKind::Planar, id));
        } else {
            out.push(Event::new(lo, EventKind::Start, id));
            out.push(Event::new(hi, EventKind::End, id));
        }
    }
}
