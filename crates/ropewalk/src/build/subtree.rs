//! The recursion: from the root's fragments to nodes in depth-first order.

use super::arena::{Arena, Clipper, NodeSize, SplitBuffers};
use super::error::BuildError;
use super::fragment::Fragment;
use super::late_cutting;
use super::monitor::Monitor;
use super::plane::{CellAreas, Plane, Pricing};
use super::rays::RayStack;
use super::report::StopCounts;
use super::sample::RaySample;
use super::search::{NodeView, PlaneSearch, SearchBuffers};
use super::stopping::{StopReason, Stopping};
use crate::aabb::Aabb;
use crate::tree::Node;
use std::sync::atomic::{AtomicU64, Ordering};

/// Nodes with fewer fragments are not worth a task of their own.
const PARALLEL_GRAIN: usize = 4096;

/// Subtrees with a smaller share of the work do not report their progress.
const PROGRESS_GRAIN: f64 = 1.0 / 256.0;

/// Nodes with fewer fragments do not ask whether the build was cancelled.
const CANCEL_GRAIN: usize = 256;

/// Largest factor by which a node is thought likelier, or less likely, than by its area: a bound for the product
/// down a path, far from what rounding could disturb.
const MAX_CROWDING: f64 = 1e9;

/// What all workers share.
pub(super) struct Context<'a> {
    pub search: &'a dyn PlaneSearch,
    pub clipper: Clipper<'a>,
    pub sample: &'a RaySample,
    pub pricing: Pricing,
    pub stopping: Stopping,
    pub late_cutting: bool,
    pub parallel: bool,
    pub monitor: &'a dyn Monitor,
    /// Share of the work done, in units of 2^-32.
    pub done: AtomicU64,
}

impl Context<'_> {
    /// Builds the tree under `cell`; at most `budget` references.
    pub fn build(
        &self,
        fragments: Vec<Fragment>,
        cell: Aabb,
        budget: u64,
    ) -> Result<Output, BuildError> {
        let (arena, size) = Arena::new(fragments, self.search.uses_events(), self.parallel);
        let (stack, rays) = RayStack::new(self.sample, &cell, size.fragments);
        let mut worker = Worker::new(self, arena, stack);
        let (share, crowding) = (1.0, 1.0);
        worker.node(Task { cell, size, rays, crowding, depth: 0, failures: 0, budget, share })?;
        Ok(worker.out)
    }

    fn add_progress(&self, share: f64) {
        const UNIT: f64 = (1u64 << 32) as f64;
        let part = (share * UNIT) as u64;
        let done = self.done.fetch_add(part, Ordering::Relaxed) + part;
        self.monitor.progress((done as f64 / UNIT).min(1.0));
    }
}

/// Nodes and references of a subtree, with indices from 0.
#[derive(Default)]
pub(super) struct Output {
    pub nodes: Vec<Node>,
    pub refs: Vec<u32>,
    pub stops: StopCounts,
}

impl Output {
    /// Index of the next node, if a node can hold it.
    fn next_node(&self) -> Result<u32, BuildError> {
        check_index(self.nodes.len(), "nodes")
    }

    fn push_leaf(&mut self, prims: impl Iterator<Item = u32>) -> Result<(), BuildError> {
        let first = self.refs.len();
        self.refs.extend(prims);
        check_index(self.refs.len(), "references")?;
        self.next_node()?;
        self.nodes.push(Node::leaf(first as u32, (self.refs.len() - first) as u32));
        Ok(())
    }

    /// Appends a subtree that was built by itself.
    fn append(&mut self, other: Output) -> Result<(), BuildError> {
        let (node_base, ref_base) = (self.nodes.len(), self.refs.len());
        check_index(node_base + other.nodes.len(), "nodes")?;
        check_index(ref_base + other.refs.len(), "references")?;
        let moved = other.nodes.iter().map(|n| n.relocated(node_base as u32, ref_base as u32));
        self.nodes.extend(moved);
        self.refs.extend_from_slice(&other.refs);
        self.stops.add(&other.stops);
        Ok(())
    }
}

fn check_index(index: usize, what: &'static str) -> Result<u32, BuildError> {
    let max = Node::MAX_INDEX;
    u32::try_from(index).ok().filter(|&i| i <= max).ok_or(BuildError::TooLarge { what, max })
}

/// A node to be built; its fragments are on top of the worker's arena, its rays on top of the stack.
struct Task {
    cell: Aabb,
    size: NodeSize,
    rays: usize,
    /// See [`NodeView::crowding`].
    crowding: f64,
    depth: usize,
    /// Failed splits on the path.
    failures: u32,
    /// Largest number of references of the subtree, at least the number of fragments.
    budget: u64,
    /// Share of the whole work; 0 once an ancestor reports for all of its subtree.
    share: f64,
}

/// Builds one subtree in one thread.
struct Worker<'a> {
    context: &'a Context<'a>,
    arena: Arena,
    rays: RayStack,
    out: Output,
    split_buffers: SplitBuffers,
    search_buffers: SearchBuffers,
}

impl<'a> Worker<'a> {
    fn new(context: &'a Context<'a>, arena: Arena, rays: RayStack) -> Self {
        Worker {
            context,
            arena,
            rays,
            out: Output::default(),
            split_buffers: SplitBuffers::default(),
            search_buffers: SearchBuffers::default(),
        }
    }

    fn node(&mut self, mut task: Task) -> Result<(), BuildError> {
        if task.size.fragments >= CANCEL_GRAIN && self.context.monitor.is_cancelled() {
            return Err(BuildError::Cancelled);
        }
        let reports = task.share > 0.0 && task.share < PROGRESS_GRAIN;
        let share = task.share;
        if reports {
            task.share = 0.0;
        }
        let is_leaf = match self.decide(&mut task) {
            Ok(plane) => {
                self.inner(task, &plane)?;
                false
            }
            Err(reason) => {
                self.out.stops.count(reason);
                self.leaf(&task)?;
                true
            }
        };
        if reports || is_leaf && share > 0.0 {
            self.context.add_progress(share);
        }
        Ok(())
    }

    /// The plane to cut with, or why the node is a leaf.
    fn decide(&mut self, task: &mut Task) -> Result<Plane, StopReason> {
        let Context { search, pricing, stopping, .. } = self.context;
        let count = task.size.fragments;
        if let Some(reason) = stopping.before_search(count, task.depth, pricing) {
            return Err(reason);
        }
        let view = NodeView {
            cell: task.cell,
            depth: task.depth,
            fragments: self.arena.fragments(&task.size),
            events: self.arena.events(&task.size),
            rays: self.rays.top(task.rays),
            crowding: task.crowding,
        };
        let plane =
            search.best_plane(&view, &mut self.search_buffers).ok_or(StopReason::NoPlane)?;
        if let Some(reason) = stopping.after_search(&plane, count, &mut task.failures, pricing) {
            return Err(reason);
        }
        if (plane.left + plane.right) as u64 > task.budget {
            return Err(StopReason::Budget);
        }
        Ok(plane)
    }

    fn inner(&mut self, task: Task, plane: &Plane) -> Result<(), BuildError> {
        let index = self.out.next_node()? as usize;
        self.out.nodes.push(Node::inner(plane.axis, plane.position, 0));
        let cells = task.cell.split(plane.axis, plane.position);
        let (left_size, right_size) = self.arena.split(
            &task.size,
            plane,
            &cells,
            self.context.clipper,
            &mut self.split_buffers,
        );
        let crowding = self.crowding(&task, plane);
        let sizes = (left_size.fragments, right_size.fragments);
        let rays = self.rays.split(task.rays, plane, &cells, self.context.sample, sizes);
        let [mut left, mut right] = task.children(cells, left_size, right_size);
        (left.rays, right.rays) = rays;
        (left.crowding, right.crowding) = crowding;
        if self.context.parallel && task.size.fragments >= PARALLEL_GRAIN {
            let arena = self.arena.take_below(&left_size, &right_size);
            let stack = self.rays.take_below(rays.0, rays.1);
            let mut other = Worker::new(self.context, arena, stack);
            let (a, b) = rayon::join(|| self.node(left), || other.node(right));
            a.and(b)?;
            let right_index = self.out.next_node()?;
            self.out.nodes[index] = Node::inner(plane.axis, plane.position, right_index);
            self.out.append(other.out)
        } else {
            self.node(left)?;
            let right_index = self.out.next_node()?;
            self.out.nodes[index] = Node::inner(plane.axis, plane.position, right_index);
            self.node(right)
        }
    }

    /// The crowding of both children of the node on top.
    fn crowding(&self, task: &Task, plane: &Plane) -> (f64, f64) {
        let of_node = task.crowding;
        let (Some(rays), Some(areas)) =
            (self.rays.top(task.rays), CellAreas::new(&task.cell, plane.axis))
        else {
            return (of_node, of_node);
        };
        let (left, right) = areas.parts(plane.position);
        let (mixed_left, mixed_right) = rays.areas(&areas, plane.axis, plane.position);
        // A part without area is met by no ray at all, so that any number will do.
        let of = |mixed: f64, area: f64| {
            let crowding = if area > 0.0 { of_node * mixed / area } else { of_node };
            crowding.clamp(MAX_CROWDING.recip(), MAX_CROWDING)
        };
        (of(mixed_left, left), of(mixed_right, right))
    }

    /// Emits the node on top as a leaf, with empty slabs cut off if that is wanted and pays.
    fn leaf(&mut self, task: &Task) -> Result<(), BuildError> {
        let fragments = self.arena.fragments(&task.size);
        let slabs = if self.context.late_cutting && !fragments.is_empty() {
            late_cutting::slabs(fragments, task.cell, task.depth, &self.context.pricing)
        } else {
            Vec::new()
        };
        let mut pending = Vec::new();
        for slab in &slabs {
            let index = self.out.next_node()?;
            if slab.keep_left {
                pending.push((index, slab)); // the empty leaf follows the kept one
                self.out.nodes.push(Node::inner(slab.axis, slab.position, 0));
            } else {
                self.out.nodes.push(Node::inner(slab.axis, slab.position, index + 2));
                self.out.push_leaf(std::iter::empty())?;
            }
        }
        self.out.push_leaf(fragments.iter().map(|f| f.prim()))?;
        for (index, slab) in pending.into_iter().rev() {
            let right = self.out.next_node()?;
            self.out.nodes[index as usize] = Node::inner(slab.axis, slab.position, right);
            self.out.push_leaf(std::iter::empty())?;
        }
        self.out.stops.late_cuts += slabs.len() as u64;
        self.arena.pop(&task.size);
        self.rays.pop(task.rays);
        Ok(())
    }
}

impl Task {
    /// The tasks of the children. References left in the budget and the share of the work are
    /// divided in proportion to the children's counts, rounded down on the left: the result does
    /// not depend on what is built elsewhere.
    fn children(&self, cells: (Aabb, Aabb), left: NodeSize, right: NodeSize) -> [Task; 2] {
        let (l, r) = (left.fragments as u64, right.fragments as u64);
        let total = (l + r).max(1);
        let left_budget = (u128::from(self.budget) * u128::from(l) / u128::from(total)) as u64;
        let left_share = self.share * l as f64 / total as f64;
        let child = |cell, size, budget, share| Task {
            cell,
            size,
            rays: 0,
            crowding: self.crowding,
            depth: self.depth + 1,
            failures: self.failures,
            budget,
            share,
        };
        [
            child(cells.0, left, left_budget, left_share),
            child(cells.1, right, self.budget - left_budget, self.share - left_share),
        ]
    }
}
