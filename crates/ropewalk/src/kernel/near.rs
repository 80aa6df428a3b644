//! Which primitives of a block that are no triangles a ray comes near to; the others are not tested.
//!
//! Written once for all levels; docs/numerics.md derives the bounds.

#![allow(unsafe_code)]

use super::beam::Vector;
use super::slot::{Slot, TINY};
use crate::ray::Ray;
use crate::wide::Block;

/// Room for 32 roundings, as a share of the distance between origin and primitive.
const SLACK: f32 = 32.0 * f32::EPSILON / 2.0;

/// By how much the square of [`SLACK`]'s part counts more where a square of a sum is bounded by squares.
const SQUARE: f32 = 128.0;

/// The lanes whose [`Bound`](crate::wide::Bound) the ray of a slot meets between `t_min` and its limit, and
/// perhaps a few more.
///
/// # Safety
/// The machine must have the features of `V`, and the caller must enable them.
#[inline(always)]
pub unsafe fn near<V: Vector>(slot: &Slot, ray: &Ray, block: &Block) -> u32 {
    // SAFETY: passed on to the caller.
    unsafe {
        let [dx, dy, dz] = ray.dir;
        let inv = 1.0 / (dx * dx + dy * dy + dz * dz).sqrt();
        let [x, y, z] = [V::splat(dx * inv), V::splat(dy * inv), V::splat(dz * inv)];
        let [[_, p, q], [r, radius, a], [b, c, thick]] = &block.vertex;
        let (p, q, r) = (V::load(p), V::load(q), V::load(r));
        let p = p - V::splat(ray.origin[0]);
        let q = q - V::splat(ray.origin[1]);
        let r = r - V::splat(ray.origin[2]);
        let far = p.abs() + q.abs() + r.abs();

        // The point of the ray nearest to the middle, as seen from there.
        let along = x.mul_add(p, y.mul_add(q, z * r));
        let (p, q, r) = (along.neg_mul_add(x, p), along.neg_mul_add(y, q), along.neg_mul_add(z, r));
        let reach = V::splat(SLACK).mul_add(far, V::load(radius));
        let square = p.mul_add(p, q.mul_add(q, r * r));
        let close = square.le(reach.mul_add(reach, V::splat(TINY)));

        let (middle, half) = (along * V::splat(inv), reach.mul_add(V::splat(inv), V::splat(TINY)));
        let (t_min, limit) = (V::splat(slot.t_min), V::splat(slot.limit));
        let within = (middle - half).le(limit) & t_min.le(middle + half);

        // The distance between ray and axis, times the sine of the angle between them.
        let (a, b, c) = (V::load(a), V::load(b), V::load(c));
        let (u, v, w) = (z.neg_mul_add(b, y * c), x.neg_mul_add(c, z * a), y.neg_mul_add(a, x * b));
        let apart = u.mul_add(p, v.mul_add(q, w * r));
        let sine = u.mul_add(u, v.mul_add(v, w * w));
        let thick = V::load(thick);
        let off = V::splat(SLACK) * (far + thick);
        let most = off.mul_add(off * V::splat(SQUARE), V::splat(TINY));
        let beside = (apart * apart).le((thick * thick).mul_add(sine, most));
        close & within & beside
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::aabb::Aabb;
    use crate::kernel::beam::PortableLanes;
    use crate::kernel::random::Random;
    use crate::kernel::slot::Loaded;
    use crate::primitive::{Cone, Primitive, Shape, Sides, Sphere};
    use crate::ray::PreparedRay;
    use crate::wide::{Bound, WIDTH};

    /// Spheres and cones of all sizes, far from the origin and near, and rays that graze them from far and near: no
    /// hit is dropped, though most misses are.
    #[test]
    fn no_hit_is_dropped() {
        let mut random = Random(5);
        let (mut hits, mut kept, mut dropped) = (0, 0, 0);
        for round in 0..30_000 {
            let size = [1e-12, 1e-6, 1.0, 1e6][round % 4];
            let offset = [0.0, 1.0, 1e4][round % 3] * size;
            let mut point = |size: f32| -> [f32; 3] {
                std::array::from_fn(|_| offset + size * random.signed())
            };
            let (center, apex) = (point(size), point(size));
            let (from, to) = (point([2.0, 30.0, 1e4][round / 12 % 3] * size), point(size));
            let shape: Shape = if round % 2 == 0 {
                Sphere { center, radius: size * random.signed().abs() }.into()
            } else {
                let radius = [0.3, 1e-3, 1e-6][round / 36 % 3] * size;
                let (base_radius, apex_radius) =
                    (radius * random.signed().abs(), radius * random.signed().abs());
                Cone { base: center, apex, base_radius, apex_radius }.into()
            };
            // At a point of the box, so that many rays graze what is in it.
            let bounds = shape.bounds();
            let aim: [f32; 3] = std::array::from_fn(|a| match round / 108 % 2 {
                0 => to[a],
                _ => center[a] + (apex[a] - center[a]) * random.signed().abs(),
            });
            let dir: [f32; 3] = std::array::from_fn(|a| aim[a] - from[a]);
            let line = Ray::new(from, dir).with_range(f32::NEG_INFINITY, f32::INFINITY);
            let Some(prepared) = PreparedRay::new(&line) else { continue };
            let found = shape.intersect(&prepared, Sides::Both);
            let mut block = Block::EMPTY;
            block.set_bound(round % WIDTH, &Bound::of(&shape));
            let all = Aabb::new(bounds.min.map(|x| x - size), bounds.max.map(|x| x + size));
            let t = found.map_or(0.5, |found| found.t);
            let ranges =
                [(f32::NEG_INFINITY, f32::INFINITY), (t, t), (t, t.next_up()), (t.next_down(), t)];
            for (t_min, t_max) in ranges {
                let ray = line.with_range(t_min, t_max);
                let mut slot = Slot::new();
                if slot.load(&ray, 0, &all, 1) != Loaded::Ready {
                    slot.start(&ray, 0);
                }
                // SAFETY: portable code.
                let lanes = unsafe { near::<PortableLanes<WIDTH>>(&slot, &ray, &block) };
                assert_eq!(lanes & !(1 << (round % WIDTH)), 0, "lanes of nothing");
                if found.is_some() {
                    assert_ne!(lanes, 0, "{ray:?}, hit at {t}");
                    hits += 1;
                } else {
                    kept += usize::from(lanes != 0);
                    dropped += usize::from(lanes == 0);
                }
            }
        }
        assert!(hits > 10_000 && dropped > 2 * kept, "{hits} {kept} {dropped}");
    }
}
