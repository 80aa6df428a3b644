//! Primary, diffuse, shadow, ambient-occlusion and chord rays of a scene.

use crate::vector::{cross, dot, normalize, sub};
use crate::{BenchHit, Kind, Random, Surface, View, Workload, walk};
use ropewalk::Ray;
use std::cell::OnceCell;

/// How many rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sizes {
    /// Pixels along a side of the primary picture; a power of two.
    pub side: usize,
    /// Chords for all hits and first hits.
    pub chords: usize,
    /// Segments of a transport walk; a multiple of [`Sizes::SEGMENTS`].
    pub walk: usize,
}

impl Sizes {
    /// Those of a picture of `side` pixels: a chord for each 16 of them, a segment for each, at
    /// least a walker.
    pub const fn of_side(side: usize) -> Sizes {
        let pixels = side * side;
        let walkers = if pixels < Sizes::SEGMENTS { 1 } else { pixels / Sizes::SEGMENTS };
        Sizes { side, chords: pixels.div_ceil(16), walk: walkers * Sizes::SEGMENTS }
    }

    /// Segments of one walker.
    pub const SEGMENTS: usize = 64;
    /// The benchmark proper.
    pub const FULL: Sizes = Sizes { side: 1024, chords: 65_536, walk: 1 << 20 };
    /// For trying out.
    pub const QUICK: Sizes = Sizes { side: 256, chords: 8_192, walk: 1 << 16 };
}

/// Length of ambient-occlusion rays, in diagonals.
const AO_LENGTH: f64 = 0.05;
/// Shadow rays end before the light by this part of their length.
const SHADOW_END: f64 = 1e-4;
/// How far an origin is moved off its surface, in diagonals. Large enough that no engine, with
/// errors of some 10 ulp of the coordinates, hits that surface again from the wrong side.
const OFFSET: f64 = 1e-5;

/// Makes the workloads of a scene. The tracer answers the nearest hits that secondary rays and
/// walks start from.
pub struct Generator<'a> {
    ground: &'a dyn Surface,
    view: &'a View,
    sizes: Sizes,
    seed: u64,
    trace: &'a dyn Fn(&[Ray], &mut [BenchHit]),
    surface: OnceCell<Vec<SurfacePoint>>,
}

/// A primary hit: a point moved off the surface to the side of the eye, and the normal there.
#[derive(Clone, Copy)]
struct SurfacePoint {
    at: [f64; 3],
    normal: [f64; 3],
}

impl<'a> Generator<'a> {
    /// A generator for a scene.
    pub fn new(
        ground: &'a dyn Surface,
        view: &'a View,
        sizes: Sizes,
        trace: &'a dyn Fn(&[Ray], &mut [BenchHit]),
    ) -> Self {
        Generator { ground, view, sizes, seed: 0, trace, surface: OnceCell::new() }
    }

    /// Other random numbers than those of seed 0, which the benchmark has. Primary rays, shadow rays and the
    /// points that the others start from depend on the size of the picture alone.
    pub fn with_seed(self, seed: u64) -> Self {
        Generator { seed, ..self }
    }

    fn random(&self, stream: u64) -> Random {
        Random::new(stream ^ self.seed << 32)
    }

    /// The rays of a workload. [`Kind::Build`] has none; workloads that start on surfaces have
    /// none where the view sees nothing.
    pub fn workload(&self, kind: Kind) -> Workload {
        let mut chains = Vec::new();
        let rays = match kind {
            Kind::Primary => self.primary(),
            Kind::Diffuse => self.diffuse(),
            Kind::Shadow => self.shadow(),
            Kind::AmbientOcclusion => self.ambient_occlusion(),
            Kind::AllHits | Kind::FirstHits => self.chords(),
            Kind::Walk1 | Kind::Walk02 => {
                let mean = if kind == Kind::Walk1 { 0.01 } else { 0.002 };
                let walk =
                    walk::segments(self.ground, mean, self.sizes.walk, self.seed, self.trace);
                chains = walk.1;
                walk.0
            }
            Kind::Build => Vec::new(),
        };
        Workload { kind, rays, chains }
    }

    fn primary(&self) -> Vec<Ray> {
        let (view, side) = (self.view, self.sizes.side);
        let (eye, at) = (view.eye.map(f64::from), view.at.map(f64::from));
        let forward = normalize(sub(at, eye));
        let right = cross(forward, view.up.map(f64::from));
        let right = if dot(right, right) > 0.0 { right } else { cross(forward, [1.0, 0.0, 0.0]) };
        let right = normalize(right);
        let up = cross(right, forward);
        let half = (f64::from(view.fov_degrees).to_radians() / 2.0).tan();
        (0..(side * side) as u64)
            .map(|code| {
                let (x, y) = (compact_bits(code), compact_bits(code >> 1));
                let u = half * ((2 * x + 1) as f64 / side as f64 - 1.0);
                let v = half * (1.0 - (2 * y + 1) as f64 / side as f64);
                let dir = std::array::from_fn(|a| forward[a] + u * right[a] + v * up[a]);
                ray(eye, normalize(dir), f64::INFINITY)
            })
            .collect()
    }

    /// The view in shades of grey, row by row: the cosine between ray and surface, 0 for a miss.
    pub fn picture(&self) -> Vec<u8> {
        let (rays, side) = (self.primary(), self.sizes.side as u64);
        let mut hits = vec![BenchHit::MISS; rays.len()];
        (self.trace)(&rays, &mut hits);
        let mut grey = vec![0; rays.len()];
        for (code, (ray, hit)) in (0..).zip(rays.iter().zip(&hits)).filter(|(_, r)| r.1.is_hit()) {
            let at = (compact_bits(code >> 1) * side + compact_bits(code)) as usize;
            let normal = self.ground.facing_normal(hit.prim, ray);
            let cosine = normal.map_or(0.0, |n| -dot(n, ray.dir.map(f64::from)));
            grey[at] = 55 + (200.0 * cosine) as u8;
        }
        grey
    }

    fn surface(&self) -> &[SurfacePoint] {
        self.surface.get_or_init(|| {
            let rays = self.primary();
            let mut hits = vec![BenchHit::MISS; rays.len()];
            (self.trace)(&rays, &mut hits);
            let offset = offset(self.ground.bounds().diagonal());
            rays.iter()
                .zip(&hits)
                .filter(|(_, hit)| hit.is_hit())
                .filter_map(|(ray, hit)| {
                    let normal = self.ground.facing_normal(hit.prim, ray)?;
                    let on = ray.at(hit.t);
                    let at = std::array::from_fn(|a| on[a] + offset * normal[a]);
                    Some(SurfacePoint { at, normal })
                })
                .collect()
        })
    }

    fn diffuse(&self) -> Vec<Ray> {
        let (points, mut random) = (self.surface(), self.random(2));
        if points.is_empty() {
            return Vec::new();
        }
        let mut rays: Vec<Ray> = (0..self.sizes.side * self.sizes.side)
            .map(|i| {
                let p = points[i % points.len()];
                ray(p.at, cosine_weighted(p.normal, &mut random), f64::INFINITY)
            })
            .collect();
        random.shuffle(&mut rays);
        rays
    }

    fn shadow(&self) -> Vec<Ray> {
        let light = self.view.light.map(f64::from);
        let to_light = |p: &SurfacePoint| {
            let way = sub(light, p.at);
            let length = dot(way, way).sqrt();
            ray(p.at, normalize(way), length * (1.0 - SHADOW_END))
        };
        self.surface().iter().map(to_light).collect()
    }

    fn ambient_occlusion(&self) -> Vec<Ray> {
        let (length, mut random) = (AO_LENGTH * self.ground.bounds().diagonal(), self.random(4));
        let cast = |p: &SurfacePoint| ray(p.at, cosine_weighted(p.normal, &mut random), length);
        self.surface().iter().map(cast).collect()
    }

    fn chords(&self) -> Vec<Ray> {
        let (bounds, mut random) = (self.ground.bounds(), self.random(5));
        let radius = bounds.diagonal() / 2.0;
        let center: [f64; 3] =
            std::array::from_fn(|a| (f64::from(bounds.min[a]) + f64::from(bounds.max[a])) / 2.0);
        let mut on_sphere = || -> [f64; 3] {
            let d = random.direction();
            std::array::from_fn(|a| center[a] + radius * d[a])
        };
        (0..self.sizes.chords)
            .map(|_| {
                let (from, to) = (on_sphere(), on_sphere());
                ray(from, normalize(sub(to, from)), f64::INFINITY)
            })
            .collect()
    }
}

/// How far an origin on a surface is moved off it in a scene of this diagonal.
pub(super) fn offset(diagonal: f64) -> f64 {
    OFFSET * diagonal
}

/// A ray over `0 ..= t_max`, rounded to `f32`.
pub(super) fn ray(origin: [f64; 3], dir: [f64; 3], t_max: f64) -> Ray {
    Ray::new(origin.map(|x| x as f32), dir.map(|x| x as f32)).with_range(0.0, t_max as f32)
}

/// A direction about `normal` with density proportional to the cosine: a point of the unit sphere
/// moved by the normal (Shirley).
fn cosine_weighted(normal: [f64; 3], random: &mut Random) -> [f64; 3] {
    let on_sphere = random.direction();
    let sum: [f64; 3] = std::array::from_fn(|a| normal[a] + on_sphere[a]);
    // The point opposite to the normal gives no direction.
    if dot(sum, sum) > 1e-12 { normalize(sum) } else { normal }
}

/// Gathers the even bits of a Morton code.
fn compact_bits(code: u64) -> u64 {
    (0..32).fold(0, |out, bit| out | ((code >> (2 * bit)) & 1) << bit)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::triangle_normal;
    use ropewalk::Geometry;
    use ropewalk::traverse::{BruteForce, NoCounts, RayCaster};

    /// Two walls and a floor, seen from between them.
    fn corner() -> (Geometry, View) {
        let vertices =
            [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 4.0], [4.0, 4.0, 0.0]];
        let faces = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 4, 2]];
        let view = View {
            eye: [3.0, 2.5, 3.5],
            at: [0.0; 3],
            up: [0.0, 1.0, 0.0],
            fov_degrees: 60.0,
            light: [1.0, 3.0, 1.5],
        };
        (Geometry::from_triangles(&vertices, &faces).unwrap(), view)
    }

    #[test]
    fn the_same_seed_gives_the_same_rays_and_all_are_sound() {
        let (geometry, view) = corner();
        let oracle = BruteForce { geometry: &geometry };
        let trace = |rays: &[Ray], out: &mut [BenchHit]| {
            for (ray, hit) in rays.iter().zip(out) {
                let found = oracle.closest_hit(ray, &mut NoCounts);
                *hit = found.map_or(BenchHit::MISS, |h| BenchHit { t: h.t, prim: h.prim_id });
            }
        };
        let sizes = Sizes { side: 32, chords: 100, walk: 4 * Sizes::SEGMENTS };
        let make = |kind| Generator::new(&geometry, &view, sizes, &trace).workload(kind);
        for kind in Kind::ALL {
            let work = make(kind);
            assert_eq!(work, make(kind), "{}", kind.name());
            assert_eq!(work.rays.is_empty(), kind == Kind::Build);
            for ray in &work.rays {
                assert!(ray.is_valid() && ray.t_min == 0.0);
                let length: f32 = ray.dir.iter().map(|x| x * x).sum();
                assert!((length - 1.0).abs() < 1e-6);
            }
        }
        assert_eq!(make(Kind::Diffuse).rays.len(), 1024);
        assert_ne!(make(Kind::Diffuse).rays, make(Kind::AmbientOcclusion).rays);
        assert!(make(Kind::AmbientOcclusion).rays.iter().all(|r| r.t_max < 0.5));
        assert!(make(Kind::Walk1).chains.len() >= 4);
    }

    #[test]
    fn sizes_follow_the_picture() {
        assert_eq!(Sizes::of_side(1024), Sizes::FULL);
        assert_eq!(Sizes::of_side(1), Sizes { side: 1, chords: 1, walk: Sizes::SEGMENTS });
    }

    #[test]
    fn normals_of_primitives_and_of_corners_agree() {
        let (geometry, view) = corner();
        let corners = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
        for dir in [[-0.5, -0.4, -1.0], [0.1, 0.2, 1.0]] {
            let eye = std::array::from_fn(|a| [1.0, 1.0, 0.0][a] - dir[a]);
            let ray = Ray::new(eye, dir);
            let (own, expected) = (geometry.facing_normal(0, &ray), triangle_normal(corners, &ray));
            let (own, expected) = (own.unwrap(), expected.unwrap());
            assert!(dot(own, dir.map(f64::from)) < 0.0);
            assert!(sub(own, expected).iter().all(|x| x.abs() < 1e-12), "{own:?} {expected:?}");
        }
        assert_eq!(geometry.facing_normal(0, &Ray::new(view.eye, [1.0, 0.0, 0.0])), None);
    }

    #[test]
    fn sixteen_primary_rays_in_turn_are_a_block_of_pixels() {
        let block: Vec<_> = (16..32).map(|c| (compact_bits(c), compact_bits(c >> 1))).collect();
        assert!(block.iter().all(|&(x, y)| (4..8).contains(&x) && y < 4));
    }

    #[test]
    fn cosine_weighted_directions_have_the_mean_of_the_lambertian() {
        let (normal, mut random) = ([0.0, 0.6, 0.8], Random::new(3));
        let mean: f64 =
            (0..50_000).map(|_| dot(cosine_weighted(normal, &mut random), normal)).sum::<f64>();
        // The mean cosine is 2/3.
        assert!((mean / 50_000.0 - 2.0 / 3.0).abs() < 0.01);
    }
}
