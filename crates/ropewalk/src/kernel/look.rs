//! The first look at a block: which of its triangles a ray may hit, without saying where.
//!
//! Written once for all levels. It keeps the bounds of
//! [`Simd::test`](super::level::Simd::test), which is asked about what is left: see [`Slot::edge_slack`] for those
//! of the edge functions, and [`WEIGHT_SLACK`] for those of the parameters. Rays that start on a surface pass through the triangle
//! there just behind their start; that these are dropped here saves most of the tests in full.

#![allow(unsafe_code)]

use super::beam::Vector;
use super::level::{DEPTH_SLACK, ROUNDED_DEPTH, ROUNDED_SIZE, WEIGHT_SLACK};
use super::slot::{Slot, TINY};
use crate::wide::Block;

/// Triangles side by side.
pub trait Triangles<V: Vector>: Copy {
    /// The coordinates of a vertex along an axis.
    ///
    /// # Safety
    /// The machine must have the features of `V`, and the caller must enable them; `axis` must be below 3.
    unsafe fn row(self, vertex: usize, axis: usize) -> V;
}

impl<V: Vector> Triangles<V> for &Block {
    #[inline(always)]
    unsafe fn row(self, vertex: usize, axis: usize) -> V {
        // SAFETY: passed on to the caller; a row has as many numbers as a vector for one block.
        unsafe { V::load(self.vertex[vertex].get_unchecked(axis)) }
    }
}

impl<V: Vector> Triangles<V> for [&Block; 2] {
    #[inline(always)]
    unsafe fn row(self, vertex: usize, axis: usize) -> V {
        let [low, high] = self;
        // SAFETY: passed on to the caller; a row has half as many numbers as a vector for two blocks.
        unsafe {
            V::load_two(
                low.vertex[vertex].get_unchecked(axis),
                high.vertex[vertex].get_unchecked(axis),
            )
        }
    }
}

/// A vertex in the ray's frame: two coordinates across, and its parameter.
#[inline(always)]
unsafe fn sheared<V: Vector, T: Triangles<V>>(slot: &Slot, triangles: T, vertex: usize) -> [V; 3] {
    // SAFETY: passed on to the caller; axes are below 3.
    unsafe {
        let [kx, ky, kz] = [slot.k[0] as usize, slot.k[1] as usize, slot.k[2] as usize];
        let z = triangles.row(vertex, kz) - V::splat(slot.shear_origin[2]);
        let x = triangles.row(vertex, kx) - V::splat(slot.shear_origin[0]);
        let y = triangles.row(vertex, ky) - V::splat(slot.shear_origin[1]);
        let x = V::splat(slot.shear[0]).neg_mul_add(z, x);
        let y = V::splat(slot.shear[1]).neg_mul_add(z, y);
        [x, y, V::splat(slot.shear[2]) * z]
    }
}

/// The edge function of two vertices.
#[inline(always)]
fn edge<V: Vector>(p: [V; 3], q: [V; 3]) -> V {
    p[1].neg_mul_add(q[0], p[0] * q[1])
}

/// The lanes that the ray of a slot may hit between `t_min` and its limit, and perhaps a few more; of two blocks those of
/// the first come first.
///
/// `WHOLE` says that triangles are to be dropped, too, that the ray passes through for sure, but behind `t_min`
/// or beyond the limit: a sixth more work, which pays where many are. `ROUNDED`: see
/// [`Simd::test`](super::level::Simd::test).
///
/// # Safety
/// The machine must have the features of `V`, and the caller must enable them; a slot's axes are below 3, and `V` has as
/// many lanes as there are triangles.
#[inline(always)]
pub unsafe fn look<V: Vector, T: Triangles<V>, const ROUNDED: bool, const WHOLE: bool>(
    slot: &Slot,
    triangles: T,
) -> u32 {
    // SAFETY: passed on to the caller.
    unsafe {
        let a = sheared::<V, T>(slot, triangles, 0);
        let b = sheared::<V, T>(slot, triangles, 1);
        let c = sheared::<V, T>(slot, triangles, 2);
        let (u, v, w) = (edge(c, b), edge(a, c), edge(b, a));
        let (low, high) = (u.min(v).min(w), u.max(v).max(w));
        let (near, far) = (a[2].min(b[2]).min(c[2]), a[2].max(b[2]).max(c[2]));
        let mut reach = near.larger_size(far);
        let across = a[0].larger_size(b[0]).larger_size(c[0]);
        let mut sum = across + a[1].larger_size(b[1]).larger_size(c[1]);
        if ROUNDED {
            reach = reach + V::splat(ROUNDED_DEPTH);
            sum = sum + V::splat(ROUNDED_SIZE);
        }
        let blur = reach * V::splat(DEPTH_SLACK);
        let scale = sum.mul_add(V::splat(slot.half_scale), reach);
        let slack = (sum * V::splat(slot.edge_slack)).mul_add(scale, V::splat(TINY));

        // The sign of a sum of two numbers is never rounded away.
        let zero = V::splat(0.0);
        let outside = (low + slack).lt(zero) & slack.lt(high);
        let (t_min, limit) = (V::splat(slot.t_min), V::splat(slot.limit));
        let within = (near - blur).le(limit) & t_min.le(far + blur);
        if !WHOLE {
            return within & !outside;
        }
        // `t` is `sum / det`, off by `blur + (far - near) slack WEIGHT_SLACK / |det|` at most.
        let det = u + v + w;
        let sum = u.mul_add(a[2], v.mul_add(b[2], w * c[2])).flip(det);
        let det = det.abs();
        let share = slack * V::splat(WEIGHT_SLACK);
        let margin = (far - near).mul_add(share, blur * det);
        let beyond = margin.lt(limit.neg_mul_add(det, sum));
        let behind = (t_min.neg_mul_add(det, sum) + margin).lt(zero);
        let inside = slack.lt(low) | (high + slack).lt(zero);
        within & !outside & !(inside & (beyond | behind))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::aabb::Aabb;
    use crate::geometry::Geometry;
    use crate::kernel::beam::PortableLanes;
    use crate::kernel::random::Random;
    use crate::kernel::slot::Loaded;
    use crate::ray::{PreparedRay, Ray};
    use crate::wide::WIDTH;

    /// The looks of all levels that need no features of the machine: what they share is the arithmetic.
    fn looks(slot: &Slot, block: &Block) -> [u32; 4] {
        type L = PortableLanes<WIDTH>;
        // SAFETY: portable code; `load` sets axes below 3.
        unsafe {
            [
                look::<L, &Block, false, true>(slot, block),
                look::<L, &Block, false, false>(slot, block),
                look::<L, &Block, true, true>(slot, block),
                look::<L, &Block, true, false>(slot, block),
            ]
        }
    }

    /// Rays that start on triangles, end on them, pass through edges and vertices, or graze them, with ranges
    /// that begin or end at the hit or one rounding beside it: no hit may be dropped.
    #[test]
    fn no_hit_is_dropped() {
        let mut random = Random(11);
        let (mut hits, mut dropped) = (0, 0);
        for round in 0..4000 {
            let size = [1e-6, 1e-3, 1.0, 1e4][round % 4];
            let offset = [0.0, 1.0, 100.0][round % 3] * size;
            let mut point =
                || -> [f32; 3] { std::array::from_fn(|_| offset + size * random.signed()) };
            let mut triangles: [[[f32; 3]; 3]; WIDTH] =
                std::array::from_fn(|_| [point(), point(), point()]);
            // A sliver, and one without area.
            triangles[6][2] = std::array::from_fn(|a| {
                0.3 * triangles[6][0][a] + 0.7 * triangles[6][1][a] + 1e-5 * size
            });
            triangles[7][2] = triangles[7][0];
            let mut block = Block::EMPTY;
            for (lane, triangle) in triangles.iter().enumerate() {
                for (vertex, corner) in triangle.iter().enumerate() {
                    (0..3).for_each(|a| block.vertex[vertex][a][lane] = corner[a]);
                }
                block.id[lane] = lane as u32;
            }
            let vertices: Vec<[f32; 3]> = triangles.iter().flatten().copied().collect();
            let faces: Vec<[u32; 3]> =
                (0..WIDTH as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
            let geometry = Geometry::from_triangles(&vertices, &faces).unwrap();
            for _ in 0..16 {
                let aim = random.below(WIDTH as u64);
                let mut weights = [random.share(), random.share()];
                if random.below(3) == 0 {
                    weights[random.below(2)] = 0.0;
                }
                if weights[0] + weights[1] > 1.0 {
                    weights = weights.map(|w| 1.0 - w);
                }
                let [a, b, c] = triangles[aim];
                let on: [f32; 3] = std::array::from_fn(|i| {
                    a[i] + weights[0] * (b[i] - a[i]) + weights[1] * (c[i] - a[i])
                });
                let dir: [f32; 3] = std::array::from_fn(|_| random.signed());
                let back = if random.below(2) == 0 { 0.0 } else { size };
                let origin: [f32; 3] = std::array::from_fn(|i| on[i] - back * dir[i]);
                let ray = Ray { t_min: -4.0 * size, ..Ray::new(origin, dir) };
                let Some(found) = geometry.intersect(aim as u32, &PreparedRay::new(&ray).unwrap())
                else {
                    continue;
                };
                let (below, above) = (found.t.next_down(), found.t.next_up());
                let ranges = [
                    (0.0f32.min(found.t), f32::INFINITY),
                    (found.t, f32::INFINITY),
                    (below, above),
                    (ray.t_min, found.t),
                    (above, f32::INFINITY),
                    (ray.t_min, below),
                    (found.t + size, f32::INFINITY),
                ];
                for (t_min, t_max) in ranges {
                    let ray = Ray { t_min, t_max, ..ray };
                    let everything = Aabb { min: [-1e9; 3], max: [1e9; 3] };
                    let mut slot = Slot::new();
                    if slot.load(&ray, 0, &everything, 16) != Loaded::Ready {
                        continue;
                    }
                    let prepared = PreparedRay::new(&ray).unwrap();
                    let hit = (0..WIDTH)
                        .filter(|&lane| geometry.intersect(lane as u32, &prepared).is_some())
                        .fold(0, |mask, lane| mask | 1 << lane);
                    for met in looks(&slot, &block) {
                        assert_eq!(hit & !met, 0, "{ray:?} {:?}", triangles[aim]);
                    }
                    let [whole, crude, ..] = looks(&slot, &block);
                    assert_eq!(whole & !crude, 0, "a closer look lets nothing more through");
                    hits += hit.count_ones();
                    dropped += (crude & !whole).count_ones();
                }
            }
        }
        assert!(hits > 100_000, "{hits} hits");
        assert!(dropped > 10_000, "the closer look drops {dropped} only");
    }
}
