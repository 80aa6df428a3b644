//! Transport walks: particles with exponential steps that scatter isotropically.

use crate::generate::{offset, ray};
use crate::vector::{dot, sub};
use crate::{BenchHit, Random, Sizes, Surface};
use ropewalk::{Aabb, Ray};

/// A particle under way.
struct Walker {
    at: [f64; 3],
    /// Unit normal of the surface it stands on, on its side.
    surface: Option<[f64; 3]>,
    random: Random,
    /// True if the next segment does not continue the last one.
    fresh: bool,
}

/// `count` segments, all segments of a walker in turn, and where chains of segments begin.
///
/// A walker starts at a random point of the box. A segment that hits a surface ends there and the
/// walker scatters back into the half space it came from; a walker that leaves the box starts
/// anew, which begins a new chain. `mean` is the mean free path in diagonals.
pub(super) fn segments(
    ground: &dyn Surface,
    mean: f64,
    count: usize,
    seed: u64,
    trace: &dyn Fn(&[Ray], &mut [BenchHit]),
) -> (Vec<Ray>, Vec<u32>) {
    let bounds = ground.bounds();
    let (path, off) = (mean * bounds.diagonal(), offset(bounds.diagonal()));
    let walkers = count / Sizes::SEGMENTS;
    let mut crowd: Vec<Walker> = (0..walkers)
        .map(|i| {
            let mut random = Random::new((1_000_003 + i as u64) ^ seed << 32);
            Walker { at: anywhere(&bounds, &mut random), surface: None, random, fresh: true }
        })
        .collect();
    let mut rays = vec![Ray::new([0.0; 3], [1.0, 0.0, 0.0]); walkers * Sizes::SEGMENTS];
    let mut chains = Vec::new();
    let mut hits = vec![BenchHit::MISS; walkers];
    let mut step_rays: Vec<Ray> = Vec::with_capacity(walkers);
    for step in 0..Sizes::SEGMENTS {
        step_rays.clear();
        for (i, walker) in crowd.iter_mut().enumerate() {
            let index = i * Sizes::SEGMENTS + step;
            if walker.fresh {
                chains.push(index as u32);
                walker.fresh = false;
            }
            rays[index] = walker.next_segment(path);
            step_rays.push(rays[index]);
        }
        trace(&step_rays, &mut hits);
        for ((walker, segment), hit) in crowd.iter_mut().zip(&step_rays).zip(&hits) {
            walker.arrive(ground, &bounds, segment, hit, off);
        }
    }
    chains.sort_unstable();
    (rays, chains)
}

impl Walker {
    /// A segment from here in an isotropic direction, off the surface if it stands on one.
    fn next_segment(&mut self, path: f64) -> Ray {
        let mut dir = self.random.direction();
        if let Some(normal) = self.surface
            && dot(dir, normal) < 0.0
        {
            dir = dir.map(|x| -x);
        }
        ray(self.at, dir, self.random.exponential(path))
    }

    /// Moves to the end of the segment or to its hit.
    fn arrive(
        &mut self,
        ground: &dyn Surface,
        bounds: &Aabb,
        segment: &Ray,
        hit: &BenchHit,
        off: f64,
    ) {
        let t = if hit.is_hit() { hit.t } else { segment.t_max };
        self.at = segment.at(t);
        self.surface = hit.is_hit().then(|| ground.facing_normal(hit.prim, segment)).flatten();
        if let Some(normal) = self.surface {
            self.at = std::array::from_fn(|a| self.at[a] + off * normal[a]);
        }
        if !bounds.contains_point(self.at.map(|x| x as f32)) {
            self.at = anywhere(bounds, &mut self.random);
            self.surface = None;
            self.fresh = true;
        }
    }
}

fn anywhere(bounds: &Aabb, random: &mut Random) -> [f64; 3] {
    let size = sub(bounds.max.map(f64::from), bounds.min.map(f64::from));
    std::array::from_fn(|a| f64::from(bounds.min[a]) + size[a] * random.unit())
}
