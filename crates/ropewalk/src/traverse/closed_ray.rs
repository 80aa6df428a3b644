//! A ray against one tree under the closed rule: every cell that the ray touches is visited.
//!
//! docs/numerics.md derives the slack and proves that a walk under this rule finds exactly the
//! hits that brute force finds.

use crate::aabb::Aabb;
use crate::geometry::Geometry;
use crate::ray::{PreparedRay, Ray};
use crate::traverse::{Counters, Query};

/// Slack of the closed rule as a fraction of the largest coordinate in play: `4096` units of the
/// last place of an `f64`. A cell counts as touched if the ray comes within
/// `SLACK * max(|origin|, |bounds|)` of it on every axis. docs/numerics.md derives it: half of it
/// covers the backward error of the primitive kernels, the other half the rounding of the walk.
pub const SLACK: f64 = 4096.0 * f64::EPSILON;

/// A prepared ray, the slack for one tree, and the part of the ray that lies in the tree's box.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ClosedRay {
    /// The ray itself.
    pub ray: PreparedRay,
    /// Slack in units of length.
    pub slack: f64,
    /// Slack in units of `t` against a plane of each axis: `slack * |inv|`, and 0 where `dir` is
    /// zero, for such planes are never crossed.
    pub t_slack: [f64; 3],
    /// Where the walk begins: no accepted hit lies before it.
    pub from: f64,
    /// Where the walk ends: no accepted hit lies after it.
    pub to: f64,
}

impl ClosedRay {
    /// Makes `ray` ready for a tree over `bounds`; `None` if it can hit nothing there.
    pub fn new(ray: &Ray, bounds: &Aabb) -> Option<Self> {
        let prepared = PreparedRay::new(ray)?;
        if bounds.is_empty() {
            return None;
        }
        let corners = bounds.min.iter().chain(&bounds.max).map(|&x| f64::from(x));
        let scale =
            prepared.origin.into_iter().chain(corners).fold(0.0, |m: f64, x| m.max(x.abs()));
        let slack = SLACK * scale;
        // A hit is accepted by its rounded t, so the exact t may lie half a step outside.
        let from = f64::from(ray.t_min.next_down());
        let to = f64::from(ray.t_max.next_up());
        let t_slack = prepared.inv.map(|inv| if inv.is_finite() { slack * inv.abs() } else { 0.0 });
        let mut closed = ClosedRay { ray: prepared, slack, t_slack, from, to };
        for axis in 0..3 {
            let [low, high] = [bounds.min[axis], bounds.max[axis]].map(f64::from);
            if closed.is_parallel(axis) {
                let o = closed.ray.origin[axis];
                if o < low - slack || o > high + slack {
                    return None;
                }
                continue;
            }
            let (near, far) = if closed.goes_up(axis) { (low, high) } else { (high, low) };
            closed.from = closed.from.max(closed.t_at(axis, near) - closed.t_slack[axis]);
            closed.to = closed.to.min(closed.t_at(axis, far) + closed.t_slack[axis]);
        }
        (closed.from <= closed.to).then_some(closed)
    }

    /// True if the direction has no component along `axis`.
    #[inline]
    pub fn is_parallel(&self, axis: usize) -> bool {
        self.ray.dir[axis] == 0.0
    }

    /// True if the coordinate on `axis` grows along the ray.
    #[inline]
    pub fn goes_up(&self, axis: usize) -> bool {
        self.ray.dir[axis] > 0.0
    }

    /// Where the ray crosses the plane `axis = position`; not for parallel axes.
    #[inline]
    pub fn t_at(&self, axis: usize, position: f64) -> f64 {
        (position - self.ray.origin[axis]) * self.ray.inv[axis]
    }

    /// The point at `t`.
    #[inline]
    pub fn point(&self, t: f64) -> [f64; 3] {
        std::array::from_fn(|a| self.ray.origin[a] + t * self.ray.dir[a])
    }

    /// True once no hit at an exact parameter of `t` or more can change the answer. Hits are
    /// compared by `t` rounded to `f32` and rounding is monotone, so comparing with the rounded
    /// bound is exact, ties included.
    #[inline]
    pub fn settled<Q: Query>(query: &Q, t: f64) -> bool {
        query.done_at(f64::from(t as f32))
    }

    /// Tests the primitives of a leaf; true if the query wants no further hit at all.
    #[inline]
    pub fn test_leaf<Q: Query, C: Counters>(
        &self,
        geometry: &Geometry,
        refs: &[u32],
        query: &mut Q,
        counters: &mut C,
    ) -> bool {
        counters.leaf_visit(refs.is_empty());
        for &prim_id in refs {
            counters.intersection_test();
            if let Some(hit) = geometry.intersect(prim_id, &self.ray) {
                query.offer(hit);
                if query.done_at(f64::NEG_INFINITY) {
                    return true;
                }
            }
        }
        false
    }
}
