//! Random rays and random coordinates: in exponent space, and on an integer grid where exact ties
//! happen.

use ropewalk::{Aabb, Ray};

/// A small seeded generator (SplitMix64, Steele, Lea, Flood 2014): the same numbers everywhere.
#[derive(Clone, Debug)]
pub struct Draw(u64);

impl Draw {
    /// A generator; equal seeds give equal sequences.
    pub fn new(seed: u64) -> Self {
        Draw(seed)
    }

    /// 64 uniform bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// A number below `n`, which must not be 0.
    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    /// True with probability `p`.
    pub fn chance(&mut self, p: f64) -> bool {
        self.uniform(0.0, 1.0) < p
    }

    /// Uniform in `low .. high`.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.bits() >> 11) as f64 / (1u64 << 53) as f64)
    }

    /// Either sign, magnitude uniform in the exponent over `2^low .. 2^high`.
    pub fn exponent(&mut self, low: f64, high: f64) -> f64 {
        let magnitude = self.uniform(low, high).exp2();
        if self.chance(0.5) { magnitude } else { -magnitude }
    }

    /// A point uniform in a box; the origin for an empty one.
    pub fn point_in(&mut self, b: &Aabb) -> [f32; 3] {
        if b.is_empty() {
            return [0.0; 3];
        }
        std::array::from_fn(|a| {
            let x = self.uniform(f64::from(b.min[a]), f64::from(b.max[a])) as f32;
            x.clamp(b.min[a], b.max[a])
        })
    }

    /// A point with integer coordinates in `-n ..= n`.
    pub fn grid_point(&mut self, n: i32) -> [f32; 3] {
        std::array::from_fn(|_| (self.below(2 * n as usize + 1) as i32 - n) as f32)
    }

    /// A uniform direction.
    pub fn direction(&mut self) -> [f32; 3] {
        loop {
            let d: [f64; 3] = std::array::from_fn(|_| self.uniform(-1.0, 1.0));
            let len = d.iter().map(|x| x * x).sum::<f64>();
            if 1e-4 < len && len <= 1.0 {
                return d.map(|x| (x / len.sqrt()) as f32);
            }
        }
    }
}

/// A generic ray at a scene: from in and around its box (three box sizes away at most) towards a
/// point of the box, or in a uniform direction; length of the direction in exponent space.
pub fn generic_ray(draw: &mut Draw, scene: &Aabb) -> Ray {
    let size = if scene.is_empty() { 1.0 } else { scene.diagonal() };
    let reach = size * draw.uniform(0.0, 3.0);
    let inside = draw.point_in(scene);
    let out = draw.direction();
    let origin: [f32; 3] = std::array::from_fn(|a| inside[a] + out[a] * reach as f32);
    let target = draw.point_in(scene);
    let to: [f32; 3] = std::array::from_fn(|a| target[a] - origin[a]);
    let aimed = draw.chance(0.75) && to != [0.0; 3];
    let dir = if aimed { to } else { draw.direction() };
    let scale = draw.uniform(-6.0, 6.0).exp2() as f32;
    let dir = dir.map(|d| d * scale);
    Ray::new(origin, if dir == [0.0; 3] { [1.0, 0.0, 0.0] } else { dir })
}

/// A ray with an integer origin and direction: parallel to axes, diagonal through edges and
/// corners, or generic, with ties everywhere. `n` bounds the origin's coordinates.
pub fn grid_ray(draw: &mut Draw, n: i32) -> Ray {
    let origin = draw.grid_point(n);
    loop {
        let dir = match draw.below(3) {
            0 => {
                let mut dir = [0.0; 3];
                dir[draw.below(3)] = if draw.chance(0.5) { 1.0 } else { -1.0 };
                dir
            }
            1 => draw.grid_point(1),
            _ => draw.grid_point(4),
        };
        if dir != [0.0; 3] {
            return Ray::new(origin, dir);
        }
    }
}

/// A ray drawn from the coordinates of the scene itself: origin and target take each coordinate
/// from a list of values (split positions, vertices), so that rays run in planes, along edges and
/// through corners.
pub fn aligned_ray(draw: &mut Draw, values: &[Vec<f32>; 3]) -> Ray {
    let mut pick = |a: usize| values[a].get(draw.below(values[a].len().max(1))).copied();
    let origin: [f32; 3] = std::array::from_fn(|a| pick(a).unwrap_or(0.0));
    let target: [f32; 3] = std::array::from_fn(|a| pick(a).unwrap_or(1.0));
    let mut dir: [f32; 3] = std::array::from_fn(|a| target[a] - origin[a]);
    if draw.chance(0.5) {
        dir[draw.below(3)] = 0.0;
    }
    if draw.chance(0.3) {
        let keep = draw.below(3);
        dir = std::array::from_fn(|a| if a == keep { dir[a] } else { 0.0 });
    }
    if dir == [0.0; 3] {
        dir[draw.below(3)] = 1.0;
    }
    Ray::new(origin, dir)
}

/// Rays that hit nothing by definition: NaN, infinite, zero direction, disordered range.
pub fn invalid_rays() -> Vec<Ray> {
    let good = Ray::new([0.5; 3], [0.0, 0.0, 1.0]);
    let mut rays = vec![
        Ray { dir: [0.0; 3], ..good },
        Ray { dir: [-0.0, 0.0, -0.0], ..good },
        good.with_range(1.0, 0.5),
        good.with_range(f32::NAN, 1.0),
        good.with_range(0.0, f32::NAN),
    ];
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for axis in 0..3 {
            let (mut origin, mut dir) = (good, good);
            origin.origin[axis] = bad;
            dir.dir[axis] = bad;
            rays.extend([origin, dir]);
        }
    }
    rays
}
