//! A sample of the rays that a tree is built for.

use super::fragment::Fragment;
use crate::aabb::Aabb;
use crate::ray::Ray;
use std::fmt;
use std::sync::Arc;

/// Where the order of a sample begins, arbitrary and fixed.
const SEED: u64 = 0x7261_7973_616d_706c;

/// Rays like those that a tree will be asked for, with which a build may weigh its cells
/// ([`BuildSettings::rays`](super::BuildSettings::rays)). Copies share the rays.
///
/// A ray counts from `t_min` to `t_max` and nowhere else; to have it end at its hit, give that as `t_max`. On the mean
/// of the benchmark's scenes that gains nothing (docs/lab/building.md). Of a
/// larger sample [`RaySample::MAX`] rays are kept, drawn at random in an order that is always the same; those
/// that can hit nothing ([`Ray::is_valid`]) are left out and counted.
#[derive(Clone, Default, PartialEq)]
pub struct RaySample {
    rays: Arc<[Ray]>,
    left_out: usize,
}

impl fmt::Debug for RaySample {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("RaySample")
            .field("rays", &self.rays.len())
            .field("left_out", &self.left_out)
            .finish()
    }
}

impl RaySample {
    /// Rays that are kept at most.
    pub const MAX: usize = 1 << 16;

    /// The sample of some rays.
    pub fn new(rays: &[Ray]) -> Self {
        Self::of(rays.len(), rays.iter().copied())
    }

    /// The sample of those of `given` rays that can hit something for all that is known.
    pub(crate) fn of(given: usize, rays: impl Iterator<Item = Ray> + Clone) -> Self {
        let valid = rays.filter(Ray::is_valid);
        let count = valid.clone().count();
        let mut kept: Vec<Ray> = Vec::with_capacity(count.min(Self::MAX));
        // Drawn one after another, each with the chance of those still wanted among those still there.
        let (mut wanted, mut left, mut random) = (count.min(Self::MAX) as u64, count as u64, SEED);
        for ray in valid {
            if wanted == 0 {
                break;
            }
            if below(&mut random, left) < wanted {
                kept.push(ray);
                wanted -= 1;
            }
            left -= 1;
        }
        // Shuffled, so that the first rays of any node are a fair sample of all of its rays.
        for i in (1..kept.len()).rev() {
            kept.swap(i, below(&mut random, i as u64 + 1) as usize);
        }
        RaySample { rays: kept.into(), left_out: given - count }
    }

    /// Number of rays that are kept.
    pub fn len(&self) -> usize {
        self.rays.len()
    }

    /// True if no ray is kept: a build is then as it is without a sample.
    pub fn is_empty(&self) -> bool {
        self.rays.is_empty()
    }

    /// How many of the rays given can hit nothing.
    pub fn left_out(&self) -> usize {
        self.left_out
    }

    /// The part of a ray inside a cell; `None` if it does not reach it.
    pub(super) fn part(&self, ray: u32, cell: &Aabb) -> Option<Fragment> {
        let Ray { origin, dir, t_min, t_max } = self.rays[ray as usize];
        let (mut from, mut to) = (f64::from(t_min), f64::from(t_max));
        for a in 0..3 {
            let (o, d) = (f64::from(origin[a]), f64::from(dir[a]));
            let (lo, hi) = (f64::from(cell.min[a]), f64::from(cell.max[a]));
            if d == 0.0 {
                if o < lo || o > hi {
                    return None;
                }
                continue;
            }
            let (t_lo, t_hi) = ((lo - o) / d, (hi - o) / d);
            from = from.max(t_lo.min(t_hi));
            to = to.min(t_lo.max(t_hi));
        }
        if from > to {
            return None;
        }
        let (mut min, mut max) = ([0.0; 3], [0.0; 3]);
        for a in 0..3 {
            let at = |t: f64| {
                // Without a direction on the axis t does not matter, even where it is infinite.
                let step = if dir[a] == 0.0 { 0.0 } else { t * f64::from(dir[a]) };
                ((f64::from(origin[a]) + step) as f32).clamp(cell.min[a], cell.max[a])
            };
            let (x, y) = (at(from), at(to));
            (min[a], max[a]) = (x.min(y), x.max(y));
        }
        Some(Fragment::new(ray, &Aabb::new(min, max)))
    }
}

/// A number below `n`, which is positive (splitmix64, Steele et al. 2014).
fn below(state: &mut u64, n: u64) -> u64 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((u128::from(z ^ (z >> 31)) * u128::from(n)) >> 64) as u64
}
