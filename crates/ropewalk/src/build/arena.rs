//! The fragments and sorted events of all pending nodes, stacked, and their split in two.
//!
//! Nodes are built depth first, so the node at hand is always on top of the stack. A split leaves
//! the right child in the parent's place and puts the left child on top of it; nothing is
//! allocated once the buffers have grown.

use super::event::Event;
use super::fragment::Fragment;
use super::plane::{Plane, Side};
use crate::aabb::Aabb;
use crate::geometry::Geometry;
use crate::primitive::Primitive;
use rayon::prelude::*;

/// Fragments that one thread classifies and clips at a time; larger nodes are split in such pieces.
const PIECE: usize = 1 << 15;

/// How much of the arena belongs to one node.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct NodeSize {
    pub fragments: usize,
    pub events: [usize; 3],
}

/// The stack of pending nodes.
#[derive(Default)]
pub(crate) struct Arena {
    fragments: Vec<Fragment>,
    events: [Vec<Event>; 3],
    parallel: bool,
}

/// How straddling primitives are cut.
#[derive(Clone, Copy)]
pub(crate) struct Clipper<'a> {
    pub geometry: &'a Geometry,
    /// False: the boxes are cut, not the primitives.
    pub clipping: bool,
    /// See [`BuildSettings::margin`](crate::build::BuildSettings::margin).
    pub margin: f32,
}

impl Clipper<'_> {
    /// The part of a fragment inside a child cell, `None` if the primitive does not reach it.
    fn clip(&self, fragment: &Fragment, cell: &Aabb) -> Option<Fragment> {
        let bounds = if self.clipping {
            let shape = self.geometry.shape(fragment.prim());
            // The intersection holds a foreign primitive to its contract.
            match self.margin {
                0.0 => shape.clipped_bounds(cell)?.intersection(cell),
                margin => {
                    let near = cell.grown(margin);
                    let part = shape.clipped_bounds(&near)?.intersection(&near);
                    part.grown(margin).intersection(cell)
                }
            }
        } else {
            fragment.bounds().intersection(cell)
        };
        (!bounds.is_empty()).then(|| Fragment::new(fragment.prim(), &bounds))
    }

    /// Clips a fragment where it lies; true if nothing is left of it.
    fn clip_away(&self, fragment: &mut Fragment, cell: &Aabb) -> bool {
        *fragment = self.clip(fragment, cell).unwrap_or_else(Fragment::gone);
        fragment.is_gone()
    }
}

/// Buffers of a split, kept between nodes.
#[derive(Default)]
pub(crate) struct SplitBuffers {
    /// For each fragment of the parent: its number in the child and the child (see `Target`).
    targets: Vec<Target>,
    left_fragments: Vec<Fragment>,
    /// Where the two parts of straddlers lie, without events.
    straddlers: Vec<(u32, u32)>,
    left_events: Vec<Event>,
    /// Events of the parts of straddlers, per axis.
    new_left: [Vec<Event>; 3],
    new_right: [Vec<Event>; 3],
}

/// Where the events of a fragment go: the new number shifted by two, and the child in the low bits.
#[derive(Clone, Copy)]
struct Target(u32);

impl Target {
    /// A straddler: its events are made anew.
    const DROPPED: Target = Target(2);

    fn left(id: usize) -> Self {
        Target((id as u32) << 2)
    }
    fn right(id: usize) -> Self {
        Target((id as u32) << 2 | 1)
    }
    fn id(self) -> u32 {
        self.0 >> 2
    }
    fn is_left(self) -> bool {
        self.0 & 3 == 0
    }
    fn is_right(self) -> bool {
        self.0 & 3 == 1
    }
}

impl Arena {
    /// The arena of a root: `fragments` and, if wanted, their events, sorted here once and for all.
    pub fn new(fragments: Vec<Fragment>, with_events: bool, parallel: bool) -> (Self, NodeSize) {
        let events: [Vec<Event>; 3] = std::array::from_fn(|axis| {
            let mut events = Vec::new();
            if with_events {
                events.reserve_exact(2 * fragments.len());
                for (id, f) in fragments.iter().enumerate() {
                    f.push_events(id as u32, axis, &mut events);
                }
            }
            if parallel {
                events.par_sort_unstable();
            } else {
                events.sort_unstable();
            }
            events
        });
        let size = NodeSize {
            fragments: fragments.len(),
            events: std::array::from_fn(|axis| events[axis].len()),
        };
        (Arena { fragments, events, parallel }, size)
    }

    /// The fragments of the node on top.
    pub fn fragments(&self, size: &NodeSize) -> &[Fragment] {
        &self.fragments[self.fragments.len() - size.fragments..]
    }

    /// The sorted events of the node on top.
    pub fn events(&self, size: &NodeSize) -> [&[Event]; 3] {
        std::array::from_fn(|axis| {
            &self.events[axis][self.events[axis].len() - size.events[axis]..]
        })
    }

    /// Drops the node on top.
    pub fn pop(&mut self, size: &NodeSize) {
        self.fragments.truncate(self.fragments.len() - size.fragments);
        for (axis, events) in self.events.iter_mut().enumerate() {
            events.truncate(events.len() - size.events[axis]);
        }
    }

    /// Moves the node under the top one (of size `top`) into an arena of its own.
    pub fn take_below(&mut self, top: &NodeSize, below: &NodeSize) -> Arena {
        fn take<T>(stack: &mut Vec<T>, top: usize, below: usize) -> Vec<T> {
            let start = stack.len() - top - below;
            stack.drain(start..start + below).collect()
        }
        Arena {
            fragments: take(&mut self.fragments, top.fragments, below.fragments),
            events: std::array::from_fn(|axis| {
                take(&mut self.events[axis], top.events[axis], below.events[axis])
            }),
            parallel: self.parallel,
        }
    }

    /// Replaces the node on top by its two children, the left one on top, and returns their sizes.
    /// The order of fragments and of events is kept.
    pub fn split(
        &mut self,
        size: &NodeSize,
        plane: &Plane,
        cells: &(Aabb, Aabb),
        clipper: Clipper<'_>,
        buffers: &mut SplitBuffers,
    ) -> (NodeSize, NodeSize) {
        let with_events = size.events != [0; 3];
        let (left, right) = if with_events {
            self.split_fragments(size.fragments, plane, cells, clipper, buffers)
        } else {
            self.split_alone(size.fragments, plane, cells, clipper, buffers)
        };
        let mut sizes = (
            NodeSize { fragments: left, events: [0; 3] },
            NodeSize { fragments: right, events: [0; 3] },
        );
        if with_events {
            for axis in 0..3 {
                let (l, r) = self.split_events(size.events[axis], axis, buffers);
                sizes.0.events[axis] = l;
                sizes.1.events[axis] = r;
            }
        }
        sizes
    }

    /// Classifies and clips the fragments on top; fills `buffers.targets` and the new events.
    fn split_fragments(
        &mut self,
        count: usize,
        plane: &Plane,
        cells: &(Aabb, Aabb),
        clipper: Clipper<'_>,
        buffers: &mut SplitBuffers,
    ) -> (usize, usize) {
        let base = self.fragments.len() - count;
        let own = &mut self.fragments[base..];
        let SplitBuffers { targets, left_fragments: left, new_left, new_right, .. } = buffers;
        targets.clear();
        left.clear();
        new_left.iter_mut().chain(new_right.iter_mut()).for_each(Vec::clear);
        let mut rights = 0;
        for i in 0..count {
            let f = own[i];
            targets.push(match plane.side_of(&f) {
                Side::Left => {
                    left.push(f);
                    Target::left(left.len() - 1)
                }
                Side::Right => {
                    own[rights] = f; // rights <= i: read already
                    rights += 1;
                    Target::right(rights - 1)
                }
                Side::Both => {
                    if let Some(part) = clipper.clip(&f, &cells.0) {
                        let id = left.len() as u32;
                        (0..3).for_each(|a| part.push_events(id, a, &mut new_left[a]));
                        left.push(part);
                    }
                    if let Some(part) = clipper.clip(&f, &cells.1) {
                        let id = rights as u32;
                        (0..3).for_each(|a| part.push_events(id, a, &mut new_right[a]));
                        own[rights] = part;
                        rights += 1;
                    }
                    Target::DROPPED
                }
            });
        }
        self.fragments.truncate(base + rights);
        self.fragments.extend_from_slice(left);
        (left.len(), rights)
    }

    /// Sends the fragments on top, which have no events, to the children. Large nodes are split in
    /// pieces, in parallel if wanted; the order is that of one piece.
    fn split_alone(
        &mut self,
        count: usize,
        plane: &Plane,
        cells: &(Aabb, Aabb),
        clipper: Clipper<'_>,
        buffers: &mut SplitBuffers,
    ) -> (usize, usize) {
        let base = self.fragments.len() - count;
        let split = |piece: &mut [Fragment], buffers: &mut SplitBuffers| {
            split_piece(piece, plane, cells, clipper, buffers)
        };
        if count <= PIECE {
            let (l, r) = split(&mut self.fragments[base..], buffers);
            self.fragments.truncate(base + r);
            self.fragments.extend_from_slice(&buffers.left_fragments[..l]);
            return (l, r);
        }
        let own = &mut self.fragments[base..];
        let split = |piece: &mut [Fragment]| {
            let mut buffers = SplitBuffers::default();
            let (l, r) = split(piece, &mut buffers);
            buffers.left_fragments.truncate(l);
            (buffers.left_fragments, r)
        };
        let parts: Vec<(Vec<Fragment>, usize)> = if self.parallel {
            own.par_chunks_mut(PIECE).map(split).collect()
        } else {
            own.chunks_mut(PIECE).map(split).collect()
        };
        let mut end = base;
        for (i, &(_, r)) in parts.iter().enumerate() {
            let start = base + i * PIECE;
            self.fragments.copy_within(start..start + r, end);
            end += r;
        }
        self.fragments.truncate(end);
        for (lefts, _) in &parts {
            self.fragments.extend_from_slice(lefts);
        }
        (self.fragments.len() - end, end - base)
    }

    /// Sends the sorted events on top to the children and merges in those of the straddlers.
    fn split_events(
        &mut self,
        count: usize,
        axis: usize,
        buffers: &mut SplitBuffers,
    ) -> (usize, usize) {
        let stack = &mut self.events[axis];
        let base = stack.len() - count;
        if buffers.left_events.len() < count {
            buffers.left_events.resize(count, Event::default());
        }
        let (own, lefts) = (&mut stack[base..], &mut buffers.left_events[..count]);
        // Both writes are unconditional and only the counters depend on the side: a branch here
        // would be taken at random.
        let (mut l, mut r) = (0, 0);
        for i in 0..count {
            let event = own[i];
            let target = buffers.targets[event.fragment() as usize];
            let renumbered = event.renumbered(target.id());
            lefts[l] = renumbered; // l <= i < count
            own[r] = renumbered; // r <= i: read already
            l += usize::from(target.is_left());
            r += usize::from(target.is_right());
        }
        let (new_left, new_right) = (&mut buffers.new_left[axis], &mut buffers.new_right[axis]);
        new_left.sort_unstable();
        new_right.sort_unstable();
        stack.truncate(base + r);
        merge_into_top(stack, base, new_right);
        let right = stack.len() - base;
        append_merged(stack, &lefts[..l], new_left);
        (stack.len() - base - right, right)
    }
}

/// Splits the fragments of `own`: those of the upper child come to its front, those of the lower one
/// to `buffers.left_fragments`; their numbers, lower child first.
fn split_piece(
    own: &mut [Fragment],
    plane: &Plane,
    cells: &(Aabb, Aabb),
    clipper: Clipper<'_>,
    buffers: &mut SplitBuffers,
) -> (usize, usize) {
    let count = own.len();
    let SplitBuffers { left_fragments, straddlers, .. } = buffers;
    if left_fragments.len() < count {
        left_fragments.resize(count, Fragment::default());
        straddlers.resize(count, (0, 0));
    }
    let (lefts, straddlers) = (&mut left_fragments[..count], &mut straddlers[..count]);
    let (axis, position) = (plane.axis, plane.position);
    // Both writes are unconditional and only the counters depend on the side: a branch here would be
    // taken at random.
    let (mut l, mut r, mut both) = (0, 0, 0);
    for i in 0..count {
        let f = own[i];
        let (lo, hi) = (f.min(axis), f.max(axis));
        // What reaches neither below nor above lies in the plane.
        let (below, above) = (lo < position, hi > position);
        let goes_left = below | (!above & plane.planar_left);
        let goes_right = above | (!below & !plane.planar_left);
        lefts[l] = f; // l <= i < count
        own[r] = f; // r <= i: read already
        straddlers[both] = (l as u32, r as u32);
        l += usize::from(goes_left);
        r += usize::from(goes_right);
        both += usize::from(goes_left & goes_right);
    }
    let (mut gone_left, mut gone_right) = (0, 0);
    for &(at_left, at_right) in &straddlers[..both] {
        let (left, right) = (&mut lefts[at_left as usize], &mut own[at_right as usize]);
        gone_left += usize::from(clipper.clip_away(left, &cells.0));
        gone_right += usize::from(clipper.clip_away(right, &cells.1));
    }
    if gone_left > 0 {
        sweep_out(&mut lefts[..l]);
    }
    if gone_right > 0 {
        sweep_out(&mut own[..r]);
    }
    (l - gone_left, r - gone_right)
}

/// Moves the fragments of which something is left to the front.
#[cold]
fn sweep_out(fragments: &mut [Fragment]) {
    let mut kept = 0;
    for i in 0..fragments.len() {
        let f = fragments[i];
        fragments[kept] = f;
        kept += usize::from(!f.is_gone());
    }
}

/// Merges sorted `new` into the sorted `stack[base..]`, from the back, in place.
fn merge_into_top(stack: &mut Vec<Event>, base: usize, new: &[Event]) {
    let (mut old_end, mut new_end) = (stack.len(), new.len());
    stack.resize(old_end + new_end, Event::default());
    let mut end = stack.len();
    while new_end > 0 {
        end -= 1;
        if old_end > base && stack[old_end - 1] > new[new_end - 1] {
            old_end -= 1;
            stack[end] = stack[old_end];
        } else {
            new_end -= 1;
            stack[end] = new[new_end];
        }
    }
}

/// Appends the merge of two sorted lists.
fn append_merged(stack: &mut Vec<Event>, old: &[Event], new: &[Event]) {
    let mut rest = old;
    for &event in new {
        let before = rest.iter().take_while(|&&o| o < event).count();
        stack.extend_from_slice(&rest[..before]);
        stack.push(event);
        rest = &rest[before..];
    }
    stack.extend_from_slice(rest);
}

#[cfg(test)]
mod tests {
    use super::super::event::EventKind;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn merges_equal_sorting(
            below in prop::collection::vec(0u32..50, 0..5),
            mut old in prop::collection::vec(0u32..50, 0..40),
            mut new in prop::collection::vec(0u32..50, 0..40),
        ) {
            let event = |id: u32| Event::new((id / 3) as f32, EventKind::Start, id);
            old.sort_unstable();
            new.sort_unstable();
            let events = |ids: &[u32]| ids.iter().map(|&i| event(i)).collect::<Vec<_>>();
            let mut expected = events(&[&old[..], &new[..]].concat());
            expected.sort_unstable();
            let expected = [events(&below), expected].concat();

            let mut stack = events(&[&below[..], &old[..]].concat());
            merge_into_top(&mut stack, below.len(), &events(&new));
            prop_assert_eq!(&stack, &expected);
            let mut stack = events(&below);
            append_merged(&mut stack, &events(&old), &events(&new));
            prop_assert_eq!(&stack, &expected);
        }
    }
}
