//! Rays whose numbers would overflow or underflow in the filters: a plain walk in `f64`.

use super::exact::{Exact, place};
use super::query::BatchQuery;
use super::slot::Slot;
use crate::geometry::Geometry;
use crate::ray::{PreparedRay, Ray};
use crate::wide::{ID_MASK, LEAF, Treelet, WIDTH, WideTree, code_line};

/// Relative slack of a parameter computed in `f64`: a difference, a quotient, a little more.
const SLACK: f64 = 16.0 * f64::EPSILON;

/// The interval in which a ray is in a cell.
type Interval = (f64, f64);

/// Puts every hit of the ray of slot `k` to `query`, in no order.
pub fn walk<Q: BatchQuery>(
    tree: &WideTree,
    geometry: &Geometry,
    exact: &Exact<'_>,
    (k, slot): (usize, &mut Slot),
    query: &mut Q,
) {
    let ray = &exact.rays[slot.ray as usize];
    let Some(prepared) = PreparedRay::new(ray) else { return };
    let mut whole = (f64::from(ray.t_min), f64::from(ray.t_max));
    for axis in 0..3 {
        whole = part(ray, axis, tree.bounds().min[axis], true, whole);
        whole = part(ray, axis, tree.bounds().max[axis], false, whole);
    }
    let mut stack = vec![(tree.root(), whole)];
    while let Some((code, interval)) = stack.pop() {
        if code == 0 || is_empty(interval) {
            continue;
        }
        if code & LEAF == 0 {
            push_children(&mut stack, tree.lines().treelet(code_line(code)), ray, interval);
            continue;
        }
        for line in tree.block_lines(code) {
            let block = tree.lines().block(line);
            for lane in 0..WIDTH {
                let shape = block.shape_lanes() >> lane & 1 == 1;
                let hit = if shape {
                    geometry.intersect(block.id[lane] & ID_MASK, &prepared)
                } else if block.vertex[0][0][lane].is_nan() {
                    None
                } else {
                    exact.hit(slot.ray, place(line, lane))
                };
                if let Some(hit) = hit {
                    query.take(k, slot, &hit, exact);
                    if Q::ANY {
                        return;
                    }
                }
            }
        }
    }
}

fn push_children(
    stack: &mut Vec<(u32, Interval)>,
    treelet: &Treelet,
    ray: &Ray,
    interval: Interval,
) {
    for child in 0..8 {
        let (mut heap, mut inside) = (0, interval);
        for level in 0..3 {
            let upper = child >> (2 - level) & 1;
            let (axis, plane) = (treelet.axis(heap), treelet.plane[heap]);
            inside = part(ray, axis, plane, upper == 1, inside);
            heap = 2 * heap + 1 + upper;
        }
        stack.push((treelet.child[child], inside));
    }
}

/// The part of an interval in which the ray is on one side of a plane, the plane included.
fn part(ray: &Ray, axis: usize, plane: f32, upper: bool, (enter, exit): Interval) -> Interval {
    let (offset, d) = (f64::from(plane) - f64::from(ray.origin[axis]), f64::from(ray.dir[axis]));
    if d == 0.0 {
        let inside = if upper { offset <= 0.0 } else { offset >= 0.0 };
        return if inside { (enter, exit) } else { (f64::INFINITY, f64::NEG_INFINITY) };
    }
    let t = offset / d;
    if upper == (d > 0.0) { (enter.max(t), exit) } else { (enter, exit.min(t)) }
}

fn is_empty((enter, exit): Interval) -> bool {
    enter - enter.abs() * SLACK > exit + exit.abs() * SLACK
}
