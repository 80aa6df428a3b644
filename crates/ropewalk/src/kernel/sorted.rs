//! Incoherent rays moved next to their neighbours, so that those in flight meet the same cells.
//!
//! ```text
//! count    the rays of each cell of a grid over the scene, by the signs of their directions
//! move     each ray to where those of its kind lie together (a counting sort)
//! walk     the moved rays in the wave
//! answer   each ray where it stood
//! ```
//! Rays are moved, not fetched through a sorted index: the wave reads them in their order, which the
//! hardware foresees. After Pharr et al., "Rendering Complex Scenes with Memory-Coherent Ray Tracing"
//! (1997). Answers do not depend on it.

use crate::aabb::Aabb;
use crate::ray::Ray;

/// When incoherent rays are sorted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Sorting {
    /// Where the tree is larger than the caches, many rays are left to the wave, and those that follow
    /// each other start in different places.
    #[default]
    Automatic,
    /// Always, where beams may take rays out as well.
    Always,
    /// Never.
    Never,
}

/// Most rays that are sorted together: some 50 bytes each are kept by each thread for it.
pub const GROUP: usize = 1 << 20;

/// Fewest rays that are worth it.
const FEWEST: usize = 1 << 15;

/// Smallest tree that is worth it, in bytes.
pub const SMALLEST: usize = 32 << 20;

/// Pairs of rays that are looked at, and how many of these may start in one cell.
const SAMPLE: usize = 256;
const TOGETHER: usize = SAMPLE / 4;

/// Cells of the grid along an axis: two to this power.
const BITS: u32 = 4;
const CELLS: usize = 1 << BITS;

/// Kinds of rays.
const KINDS: usize = 8 << (3 * BITS);

/// The bits of a number, three apart.
static SPREAD: [u32; CELLS] = {
    let mut spread = [0; CELLS];
    let mut i = 0;
    while i < CELLS * BITS as usize {
        let (x, bit) = (i / BITS as usize, i % BITS as usize);
        spread[x] |= ((x >> bit & 1) << (3 * bit)) as u32;
        i += 1;
    }
    spread
};

/// A grid over the scene.
struct Grid {
    min: [f32; 3],
    scale: [f32; 3],
}

impl Grid {
    fn new(bounds: &Aabb) -> Self {
        let mut scale = [0.0; 3];
        for (a, scale) in scale.iter_mut().enumerate() {
            let size = bounds.max[a] - bounds.min[a];
            *scale = if size > 0.0 { CELLS as f32 / size } else { 0.0 };
        }
        Grid { min: bounds.min, scale }
    }

    /// The kind of a ray: the cell of its origin along a Morton curve, then its signs. Origins outside
    /// count as in the outermost cells, NaN as in the first.
    #[inline(always)]
    fn kind(&self, ray: &Ray) -> u32 {
        let (mut cell, mut signs) = (0, 0);
        for a in 0..3 {
            let x = ((ray.origin[a] - self.min[a]) * self.scale[a]) as usize;
            cell |= SPREAD[x.min(CELLS - 1)] << a;
            signs |= u32::from(ray.dir[a] < 0.0) << a;
        }
        cell << 3 | signs
    }
}

/// The room that sorting needs, kept by each thread.
#[derive(Default)]
pub struct Sorter {
    kinds: Vec<u32>,
    /// Where the next ray of each kind goes.
    next: Vec<u32>,
    /// The rays in their new order.
    pub rays: Vec<Ray>,
    /// Where they stood.
    pub stood: Vec<u32>,
}

impl Sorter {
    /// True if sorting the rays with these indices is expected to pay.
    pub fn pays(bounds: &Aabb, tree_bytes: usize, rays: &[Ray], order: &[u32]) -> bool {
        if order.len() < FEWEST || tree_bytes < SMALLEST {
            return false;
        }
        let grid = Grid::new(bounds);
        let cell = |i: u32| grid.kind(&rays[i as usize]) >> 3;
        let pairs = order.windows(2).step_by((order.len() - 1) / SAMPLE).take(SAMPLE);
        pairs.filter(|pair| cell(pair[0]) == cell(pair[1])).count() < TOGETHER
    }

    /// Moves the rays with these indices.
    pub fn sort(&mut self, bounds: &Aabb, rays: &[Ray], order: &[u32]) {
        let grid = Grid::new(bounds);
        self.next.clear();
        self.next.resize(KINDS, 0);
        self.kinds.clear();
        for &i in order {
            let kind = grid.kind(&rays[i as usize]);
            self.kinds.push(kind);
            self.next[kind as usize] += 1;
        }
        let mut sum = 0;
        for next in &mut self.next {
            (*next, sum) = (sum, sum + *next);
        }
        self.rays.resize(order.len(), Ray::new([0.0; 3], [0.0; 3]));
        self.stood.resize(order.len(), 0);
        for (&i, &kind) in order.iter().zip(&self.kinds) {
            let to = self.next[kind as usize] as usize;
            self.next[kind as usize] += 1;
            self.rays[to] = rays[i as usize];
            self.stood[to] = i;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn some_rays(n: usize) -> Vec<Ray> {
        let number = |i: usize| (i * 7919 % 1009) as f32 / 1009.0;
        let ray = |i: usize| {
            let origin = [number(i), number(3 * i + 1), number(7 * i + 2)];
            Ray::new(origin, [number(i + 5) - 0.5, number(2 * i) - 0.5, number(5 * i) - 0.5])
        };
        (0..n).map(ray).collect()
    }

    #[test]
    fn every_ray_is_moved_once() {
        let mut rays = some_rays(5000);
        rays[17].origin = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
        rays[18].origin = [-1e30, 1e30, 0.5];
        let order: Vec<u32> = (0..5000).filter(|i| i % 3 != 0).chain([17]).collect();
        let bounds = Aabb { min: [0.0; 3], max: [1.0, 1.0, 0.0] };
        let mut sorter = Sorter::default();
        for _ in 0..2 {
            sorter.sort(&bounds, &rays, &order);
            let (mut stood, mut wanted) = (sorter.stood.clone(), order.clone());
            stood.sort_unstable();
            wanted.sort_unstable();
            assert_eq!(stood, wanted);
            let bits = |ray: &Ray| ray.origin.map(f32::to_bits);
            for (ray, &i) in sorter.rays.iter().zip(&sorter.stood) {
                assert_eq!(bits(ray), bits(&rays[i as usize]));
            }
            let grid = Grid::new(&bounds);
            assert!(sorter.rays.is_sorted_by_key(|ray| grid.kind(ray)));
        }
    }

    #[test]
    fn sorted_rays_stay_where_they_are() {
        let rays = some_rays(1 << 16);
        let order: Vec<u32> = (0..1 << 16).collect();
        let bounds = Aabb { min: [0.0; 3], max: [1.0; 3] };
        assert!(Sorter::pays(&bounds, SMALLEST, &rays, &order));
        assert!(!Sorter::pays(&bounds, SMALLEST - 1, &rays, &order));
        assert!(!Sorter::pays(&bounds, SMALLEST, &rays, &order[..FEWEST - 1]));
        let mut sorter = Sorter::default();
        sorter.sort(&bounds, &rays, &order);
        assert!(!Sorter::pays(&bounds, SMALLEST, &sorter.rays, &order));
    }
}
