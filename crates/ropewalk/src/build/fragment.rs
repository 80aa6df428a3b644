//! The part of a primitive inside a cell, as a box.

use super::event::{Event, EventKind};
use crate::aabb::Aabb;

/// The box of one primitive's part inside the cell of a node.
///
/// Invariant: the box is not empty, lies in the cell, and holds no negative zero, so that equal
/// coordinates have equal bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Fragment {
    pub prim: u32,
    pub min: [f32; 3],
    pub max: [f32; 3],
}

impl Fragment {
    pub fn new(prim: u32, bounds: &Aabb) -> Self {
        // Adding +0 turns -0 into +0 and leaves everything else alone.
        Fragment { prim, min: bounds.min.map(|x| x + 0.0), max: bounds.max.map(|x| x + 0.0) }
    }

    pub fn bounds(&self) -> Aabb {
        Aabb::new(self.min, self.max)
    }

    /// Appends the events of this fragment, known as `id` in its node.
    pub fn push_events(&self, id: u32, axis: usize, out: &mut Vec<Event>) {
        let (lo, hi) = (self.min[axis], self.max[axis]);
        if lo == hi {
            out.push(Event::new(lo, EventKind::Planar, id));
        } else {
            out.push(Event::new(lo, EventKind::Start, id));
            out.push(Event::new(hi, EventKind::End, id));
        }
    }
}
