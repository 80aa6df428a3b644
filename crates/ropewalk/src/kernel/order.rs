//! Incoherent rays in an order that visits the same parts of a large tree together.
//!
//! A wave hides much of the latency of memory, but on trees beyond the caches a batch of shuffled
//! rays still moves every line it touches from memory. Sorted by origin and octant of direction in
//! groups, such rays find most of their lines in the cache; a radix sort costs little against that.

use crate::aabb::Aabb;
use crate::ray::Ray;

/// Rays that are put in order together: their keys stay in the cache.
pub const GROUP: usize = 1 << 16;

/// Bits of the key for each axis of the origin; three more hold the octant.
const ORIGIN_BITS: u32 = 6;

/// Bits of a pass of the sort; two passes cover the key.
const PASS_BITS: u32 = 11;

const _: () = assert!(3 * ORIGIN_BITS + 3 <= 2 * PASS_BITS);

/// Bits of a Morton code three places apart.
static SPREAD: [u32; 1 << ORIGIN_BITS] = {
    let mut table = [0; 1 << ORIGIN_BITS];
    let mut i = 0;
    while i < table.len() {
        let mut bit = 0;
        while bit < ORIGIN_BITS {
            table[i] |= ((i as u32 >> bit) & 1) << (3 * bit);
            bit += 1;
        }
        i += 1;
    }
    table
};

/// The memory that sorting takes.
#[derive(Default)]
pub struct Sorter {
    /// Keys above, indices of rays below.
    keyed: Vec<u64>,
    other: Vec<u64>,
}

impl Sorter {
    /// Puts the rays that `order` lists, at most [`GROUP`], in an order in which neighbours start
    /// near each other and go a like way; `bounds` is the scene's box. Nothing is done where their
    /// origins follow each other closely as they are.
    pub fn sort(&mut self, order: &mut [u32], rays: &[Ray], bounds: &Aabb) {
        let scale: [f32; 3] = std::array::from_fn(|a| {
            let extent = bounds.max[a] - bounds.min[a];
            if extent > 0.0 { (1 << ORIGIN_BITS) as f32 / extent } else { 0.0 }
        });
        let key = |ray: &Ray| {
            let mut key = 0;
            for a in 0..3 {
                // `as` saturates, and NaN becomes 0.
                let cell = ((ray.origin[a] - bounds.min[a]) * scale[a]) as u32;
                key |= SPREAD[cell.min((1 << ORIGIN_BITS) - 1) as usize] << a;
            }
            let octant: u32 = (0..3).map(|a| (ray.dir[a].to_bits() >> 31) << a).sum();
            key << 3 | octant
        };
        self.keyed.clear();
        let keyed = |&i: &u32| u64::from(key(&rays[i as usize])) << 32 | u64::from(i);
        self.keyed.extend(order.iter().map(keyed));
        let cell = |entry: u64| entry >> (32 + 3 + 3);
        let together = self.keyed.windows(2).filter(|w| cell(w[0]) == cell(w[1])).count();
        if 2 * together >= order.len() {
            return;
        }
        self.other.resize(self.keyed.len(), 0);
        pass(&self.keyed, &mut self.other, 32);
        pass(&self.other, &mut self.keyed, 32 + PASS_BITS);
        for (place, &entry) in order.iter_mut().zip(&self.keyed) {
            *place = entry as u32;
        }
    }
}

/// A stable counting sort by the `PASS_BITS` bits from `shift` on.
fn pass(from: &[u64], to: &mut [u64], shift: u32) {
    let digit = |entry: u64| (entry >> shift) as usize & ((1 << PASS_BITS) - 1);
    let mut start = [0u32; 1 << PASS_BITS];
    for &entry in from {
        start[digit(entry)] += 1;
    }
    let mut sum = 0;
    for count in &mut start {
        (*count, sum) = (sum, sum + *count);
    }
    for &entry in from {
        let at = &mut start[digit(entry)];
        to[*at as usize] = entry;
        *at += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rays(count: u32) -> Vec<Ray> {
        let mut state = 1u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1u32 << 24) as f32
        };
        let mut point = || [next(), next(), next()];
        (0..count).map(|_| Ray::new(point(), point().map(|x| x - 0.5))).collect()
    }

    const UNIT: Aabb = Aabb { min: [0.0; 3], max: [1.0; 3] };

    #[test]
    fn every_ray_comes_once_and_neighbours_are_near() {
        let mut rays = rays(20_000);
        rays[7] = Ray::new([f32::NAN, 1e30, -1e30], [f32::INFINITY, 0.0, 1.0]);
        let mut found: Vec<u32> = (0..20_000).collect();
        Sorter::default().sort(&mut found, &rays, &UNIT);
        let mut sorted = found.clone();
        sorted.sort_unstable();
        assert!(sorted.into_iter().eq(0..20_000));
        let near = |w: &&[u32]| {
            let [a, b] = [w[0], w[1]].map(|i| rays[i as usize].origin);
            (0..3).all(|k| (a[k] - b[k]).abs() < 0.2)
        };
        assert!(found.windows(2).filter(near).count() > 19_000);
        let again = found.clone();
        Sorter::default().sort(&mut found, &rays, &UNIT);
        assert_eq!(found, again, "in order already");
    }

    #[test]
    fn flat_and_empty_boxes_do_no_harm() {
        let rays = rays(100);
        for bounds in [Aabb::EMPTY, Aabb { min: [0.0; 3], max: [1.0, 0.0, 1.0] }] {
            let mut order: Vec<u32> = (0..100).collect();
            Sorter::default().sort(&mut order, &rays, &bounds);
            order.sort_unstable();
            assert!(order.into_iter().eq(0..100));
        }
    }
}
