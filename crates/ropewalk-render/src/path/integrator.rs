//! Paths in waves: all rays of a bounce go through the batch engine at once, in the order of their pixels.
//!
//! ```text
//! start    a ray from the lens for each sample of each pixel, pixels along a Morton curve
//! repeat   closest hits of all rays, in one batch
//!          emission that a ray met, weighed against sampling the light
//!          one light for each surface: a shadow ray, and what it brings if it is free
//!          one direction for each surface: the next ray, or the path ends by chance
//!          whether shadow rays are blocked, in one batch
//! ```
//! Next-event estimation with multiple importance sampling, power heuristic (E. Veach, "Robust Monte Carlo Methods
//! for Light Transport Simulation", 1997).

use super::bsdf::{Bsdf, Lobes, luminance};
use super::camera::LensView;
use super::film::{Cell, WalkCost};
use super::light::Chooser;
use super::light_tree::Place;
use super::sampler::{Purpose, Sampler, hash, unit_float};
use super::settings::{LightChoice, Strategy};
use super::sight::Sight;
use super::world::{Surface, World};
use crate::offset::lifted_origin;
use glam::Vec3;
use ropewalk::kernel::BatchCaster;
use ropewalk::{Hit, Ray};
use std::time::{Duration, Instant};

/// Bounces before a path may end by chance.
const SURE_BOUNCES: u32 = 3;

/// Largest chance that a path goes on after that.
const MOST_SURVIVAL: f32 = 0.95;

/// Rays that were cast, and the time they took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PathCounts {
    /// Rays from the lens.
    pub camera: u64,
    /// Of these, those that hit something.
    pub camera_hits: u64,
    /// Rays from surface to surface.
    pub bounce: u64,
    /// Of these, those that hit something.
    pub bounce_hits: u64,
    /// Rays to lights.
    pub shadow: u64,
    /// Of these, those that are blocked.
    pub shadow_hits: u64,
    /// Seconds that threads spent in the batch engine, added up.
    pub seconds_traversal: f64,
    /// Seconds that threads spent on paths in all, added up.
    pub seconds: f64,
}

impl PathCounts {
    /// All rays.
    pub fn rays(&self) -> u64 {
        self.camera + self.bounce + self.shadow
    }

    /// The share of time that is spent in traversal, 0 to 1.
    pub fn traversal_share(&self) -> f64 {
        if self.seconds > 0.0 { self.seconds_traversal / self.seconds } else { 0.0 }
    }
}

impl std::ops::AddAssign<&PathCounts> for PathCounts {
    fn add_assign(&mut self, other: &PathCounts) {
        self.camera += other.camera;
        self.camera_hits += other.camera_hits;
        self.bounce += other.bounce;
        self.bounce_hits += other.bounce_hits;
        self.shadow += other.shadow;
        self.shadow_hits += other.shadow_hits;
        self.seconds_traversal += other.seconds_traversal;
        self.seconds += other.seconds;
    }
}

/// Follows paths through a world.
pub(crate) struct Integrator<'a> {
    pub world: &'a World,
    pub caster: BatchCaster<'a>,
    /// What is seen of the sky from where; for the choice of lights by place.
    pub sight: Option<Sight>,
    pub light_choice: LightChoice,
    pub view: LensView,
    /// Pixels a row, which number the pixels.
    pub width: u32,
    pub seed: u32,
    pub max_depth: u32,
    pub strategy: Strategy,
    /// Largest luminance that a path brings after its first bounce.
    pub clamp: f32,
}

/// A path between two bounces. Its ray lies beside it.
#[derive(Clone, Copy)]
struct Path {
    /// Cell of the tile.
    cell: u32,
    sampler: Sampler,
    /// What radiance is multiplied with on its way to the eye.
    throughput: Vec3,
    /// Density by which the ray was chosen; infinite if no light could have been sampled in its place.
    density: f32,
    /// Where the ray was chosen.
    place: Place,
    /// What the throughput holds because radiance changes with the index of refraction.
    compression: f32,
    /// Whether it is the first sample of its pixel in this pass.
    is_first: bool,
}

/// A shadow ray's light, if it arrives.
struct Pending {
    cell: u32,
    radiance: Vec3,
    sampler: Sampler,
}

/// The state of a wave; its memory is used again by the next.
#[derive(Default)]
pub(crate) struct Wave {
    paths: Vec<Path>,
    rays: Vec<Ray>,
    t: Vec<f32>,
    face: Vec<u32>,
    pending: Vec<Pending>,
    shadow_rays: Vec<Ray>,
    blocked: Vec<bool>,
}

/// A part of the picture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tile {
    pub x: u32,
    pub y: u32,
    pub width: u32,
    pub height: u32,
}

impl Tile {
    pub fn cells(&self) -> usize {
        self.width as usize * self.height as usize
    }
}

impl Integrator<'_> {
    /// Follows samples `first..first + count` of all pixels of a tile.
    pub fn trace(
        &self,
        tile: &Tile,
        first: u32,
        count: u32,
        wave: &mut Wave,
    ) -> (Vec<Cell>, PathCounts) {
        let start = Instant::now();
        let mut cells = vec![Cell::EMPTY; tile.cells()];
        let mut counts = PathCounts::default();
        self.start(tile, first, count, wave);
        for depth in 1..=self.max_depth {
            if wave.rays.is_empty() {
                break;
            }
            let traversal = self.closest_hits(depth, wave);
            let hits = wave.face.iter().filter(|&&f| f != u32::MAX).count() as u64;
            if depth == 1 {
                (counts.camera, counts.camera_hits) = (wave.rays.len() as u64, hits);
            } else {
                counts.bounce += wave.rays.len() as u64;
                counts.bounce_hits += hits;
            }
            self.scatter(depth, wave, &mut cells);
            let shadow = self.add_unblocked(depth, wave, &mut cells);
            counts.shadow += wave.pending.len() as u64;
            counts.shadow_hits += wave.blocked.iter().filter(|&&b| b).count() as u64;
            counts.seconds_traversal += (traversal + shadow).as_secs_f64();
        }
        counts.seconds = start.elapsed().as_secs_f64();
        (cells, counts)
    }

    /// The rays from the lens.
    fn start(&self, tile: &Tile, first: u32, count: u32, wave: &mut Wave) {
        wave.paths.clear();
        wave.rays.clear();
        let side = tile.width.max(tile.height).next_power_of_two();
        for code in 0..side * side {
            let [x, y] = morton(code);
            if x >= tile.width || y >= tile.height {
                continue;
            }
            let (column, row) = (tile.x + x, tile.y + y);
            for sample in first..first + count {
                let sampler = Sampler::new(self.seed, row * self.width + column, sample);
                let [u, v, a, b] = sampler.four(0, Purpose::Camera);
                let place = [f64::from(column) + f64::from(u), f64::from(row) + f64::from(v)];
                wave.rays.push(self.view.ray(place[0], place[1], [a, b]));
                wave.paths.push(Path {
                    cell: y * tile.width + x,
                    sampler,
                    throughput: Vec3::ONE,
                    density: f32::INFINITY,
                    place: Place { point: Vec3::ZERO, normal: Vec3::ZERO },
                    compression: 1.0,
                    is_first: sample == first,
                });
            }
        }
    }

    /// What the walk of the ray through the middle of a pixel and of the lens costs, alone, not in a wave.
    pub fn walk_cost(&self, column: u32, row: u32) -> WalkCost {
        let ray = self.view.ray(f64::from(column) + 0.5, f64::from(row) + 0.5, [0.0; 2]);
        let events = if self.world.has_cutouts() {
            let key = Sampler::new(self.seed, row * self.width + column, 0).key() ^ hash(2);
            let filter = |_: usize, hit: &Hit| {
                self.world.is_there(hit, || unit_float(hash(key ^ hash(hit.prim_id))))
            };
            self.caster.with_filter(filter).closest_hit_one_events(&ray)
        } else {
            self.caster.closest_hit_one_events(&ray)
        };
        let whole = |n: u64| u32::try_from(n).unwrap_or(u32::MAX);
        WalkCost { steps: whole(events.steps), blocks: whole(events.blocks) }
    }

    fn closest_hits(&self, depth: u32, wave: &mut Wave) -> Duration {
        let Wave { paths, rays, t, face, .. } = wave;
        t.resize(rays.len(), 0.0);
        face.resize(rays.len(), 0);
        let start = Instant::now();
        if self.world.has_cutouts() {
            let filter = |ray: usize, hit: &Hit| {
                let key = paths[ray].sampler.key() ^ hash(2 * depth);
                self.world.is_there(hit, || unit_float(hash(key ^ hash(hit.prim_id))))
            };
            self.caster.with_filter(filter).closest_hit_into(rays, t, face);
        } else {
            self.caster.closest_hit_into(rays, t, face);
        }
        start.elapsed()
    }

    /// Adds what rays met, and replaces them by the next ones and by shadow rays.
    fn scatter(&self, depth: u32, wave: &mut Wave, cells: &mut [Cell]) {
        wave.pending.clear();
        wave.shadow_rays.clear();
        let mut kept = 0;
        for i in 0..wave.rays.len() {
            let (mut path, ray) = (wave.paths[i], wave.rays[i]);
            let cell = &mut cells[path.cell as usize];
            if wave.face[i] == u32::MAX {
                let radiance = self.beyond_surfaces(&path, Vec3::from_array(ray.dir));
                self.add(cell, depth, radiance);
                continue;
            }
            let surface = self.world.surface(&ray, wave.t[i], wave.face[i]);
            let radiance = self.emission(&path, &surface, &ray);
            self.add(cell, depth, radiance);
            let bsdf = self.world.bsdf(&surface);
            if depth == 1 {
                cell.albedo += bsdf.base;
                cell.normal += surface.shading;
                cell.depth = cell.depth.min((surface.travelled / self.world.scale()) as f32);
                if path.is_first {
                    cell.face = surface.face;
                }
            }
            if depth == self.max_depth {
                continue;
            }
            let wo = surface.frame.local(-Vec3::from_array(ray.dir)).normalize();
            let lobes = bsdf.lobes(wo);
            let chance = path.sampler.four(depth, Purpose::Light);
            // Only glass gets light from behind.
            let normal = if bsdf.glass > 0.0 { Vec3::ZERO } else { surface.shading };
            path.place = Place { point: surface.position.as_vec3(), normal };
            if let Some((ray, radiance)) =
                self.direct_light(&path, &surface, (&bsdf, &lobes), wo, (depth, chance))
            {
                wave.shadow_rays.push(ray);
                let sampler = path.sampler;
                wave.pending.push(Pending { cell: path.cell, radiance, sampler });
            }
            let [a, b, c, _] = path.sampler.four(depth, Purpose::Bsdf);
            let Some(scattered) = bsdf.sample(&lobes, wo, [a, b, c]) else { continue };
            let direction = surface.frame.world(scattered.wi);
            // A smooth normal must not let light through a surface or keep it from being reflected by one.
            if (direction.dot(surface.geometric) > 0.0) != (scattered.wi.z > 0.0) {
                continue;
            }
            path.throughput *= scattered.weight;
            path.compression *= scattered.compression;
            path.density = scattered.density;
            if depth >= SURE_BOUNCES {
                // Light that is dim only because it is inside of glass counts in full.
                let bright = path.throughput.max_element() / path.compression;
                let survival = bright.min(MOST_SURVIVAL);
                if chance[3] >= survival {
                    continue;
                }
                path.throughput /= survival;
            }
            wave.rays[kept] = leaving_ray(&surface, direction);
            wave.paths[kept] = path;
            kept += 1;
        }
        wave.rays.truncate(kept);
        wave.paths.truncate(kept);
    }

    /// Light from where no surface is.
    fn beyond_surfaces(&self, path: &Path, direction: Vec3) -> Vec3 {
        let lights = self.world.lights();
        let mut sum = Vec3::ZERO;
        let (sky, by_sky) = self.world.sky(direction);
        if sky != Vec3::ZERO {
            let density =
                |place: &Place| lights.environment_density(&self.chooser(), place, by_sky);
            sum += sky * self.weight_of_bsdf(path, density);
        }
        if let Some(sun) = self.world.sun() {
            let radiance = sun.radiance(direction);
            if radiance != Vec3::ZERO {
                let density = |place: &Place| lights.sun_density(&self.chooser(), place, sun);
                sum += radiance * self.weight_of_bsdf(path, density);
            }
        }
        path.throughput * sum
    }

    /// Light that the surface itself emits.
    fn emission(&self, path: &Path, surface: &Surface<'_>, ray: &Ray) -> Vec3 {
        let radiance = self.world.emitted(surface);
        if radiance == Vec3::ZERO {
            return radiance;
        }
        let cosine = Vec3::from_array(ray.dir).normalize().dot(surface.geometric).abs();
        let distance2 = (surface.travelled * surface.travelled) as f32;
        let density = |place: &Place| {
            let lights = self.world.lights();
            let by_area = lights.face_density(&self.chooser(), place, surface.face, surface.area);
            by_area * distance2 / cosine.max(1e-9)
        };
        path.throughput * radiance * self.weight_of_bsdf(path, density)
    }

    /// A shadow ray, and what it brings if nothing is in its way.
    fn direct_light(
        &self,
        path: &Path,
        surface: &Surface<'_>,
        (bsdf, lobes): (&Bsdf<'_>, &Lobes),
        wo: Vec3,
        (depth, u): (u32, [f32; 4]),
    ) -> Option<(Ray, Vec3)> {
        if !bsdf.spreads() {
            return None;
        }
        // More digits than a sample has: there may be many lights.
        let digits = unit_float(hash(path.sampler.key() ^ hash(!depth)));
        let choice = f64::from(u[0]) + f64::from(digits) * f64::from(f32::EPSILON / 2.0);
        let lights = self.world.lights();
        let (chooser, place) = (self.chooser(), [u[1], u[2]]);
        let arriving = lights.sample(&chooser, surface.position, &path.place, choice, place)?;
        if self.strategy == Strategy::Bsdf && !arriving.is_single {
            return None;
        }
        let wi = surface.frame.local(arriving.direction).normalize();
        if (arriving.direction.dot(surface.geometric) > 0.0) != (wi.z > 0.0) {
            return None;
        }
        let (value, density) = bsdf.evaluate(lobes, wo, wi);
        let weight = match self.strategy {
            _ if arriving.is_single => 1.0,
            Strategy::Lights => 1.0,
            _ => power_heuristic(arriving.density, density),
        };
        let radiance = path.throughput * value * arriving.radiance * (weight / arriving.density);
        if radiance == Vec3::ZERO || !radiance.is_finite() {
            return None;
        }
        let ray = match arriving.from {
            None => leaving_ray(surface, arriving.direction),
            Some(from) => {
                let origin = leaving_origin(surface, arriving.direction);
                let way = std::array::from_fn(|a| from[a] - origin[a]);
                Ray::new(origin, way).with_range(0.0, 1.0)
            }
        };
        Some((ray, radiance))
    }

    /// The weight of light that was met by scattering, where sampling the light would have had a density.
    fn weight_of_bsdf(&self, path: &Path, of_light: impl FnOnce(&Place) -> f32) -> f32 {
        match self.strategy {
            _ if path.density.is_infinite() => 1.0,
            Strategy::Bsdf => 1.0,
            Strategy::Lights => 0.0,
            Strategy::Both => power_heuristic(path.density, of_light(&path.place)),
        }
    }

    fn chooser(&self) -> Chooser<'_> {
        let choice = self.light_choice;
        Chooser { world: self.world, sight: self.sight.as_ref(), choice }
    }

    /// Casts the shadow rays and adds the light of those that are free.
    fn add_unblocked(&self, depth: u32, wave: &mut Wave, cells: &mut [Cell]) -> Duration {
        let Wave { pending, shadow_rays: rays, blocked, .. } = wave;
        blocked.clear();
        blocked.resize(rays.len(), false);
        let start = Instant::now();
        if self.world.has_cutouts() {
            let filter = |ray: usize, hit: &Hit| {
                let key = pending[ray].sampler.key() ^ hash(2 * depth + 1);
                self.world.is_there(hit, || unit_float(hash(key ^ hash(hit.prim_id))))
            };
            self.caster.with_filter(filter).occluded_into(rays, blocked);
        } else {
            self.caster.occluded_into(rays, blocked);
        }
        let time = start.elapsed();
        for (light, _) in pending.iter().zip(blocked).filter(|(_, blocked)| !**blocked) {
            self.add(&mut cells[light.cell as usize], depth + 1, light.radiance);
        }
        time
    }

    /// Adds light that arrives after so many edges of a path.
    fn add(&self, cell: &mut Cell, edges: u32, radiance: Vec3) {
        let bright = luminance(radiance);
        let scale = if edges > 2 && bright > self.clamp { self.clamp / bright } else { 1.0 };
        if radiance.is_finite() {
            cell.radiance += radiance * scale;
        }
    }
}

/// The weight of a strategy with density `p` beside one with density `q`.
fn power_heuristic(p: f32, q: f32) -> f32 {
    let ratio = q / p;
    1.0 / (1.0 + ratio * ratio)
}

fn leaving_origin(surface: &Surface<'_>, direction: Vec3) -> [f32; 3] {
    let side = if direction.dot(surface.geometric) < 0.0 { -1.0 } else { 1.0 };
    let normal = (side * surface.geometric).as_dvec3().to_array();
    lifted_origin(surface.position.to_array(), normal, surface.travelled)
}

fn leaving_ray(surface: &Surface<'_>, direction: Vec3) -> Ray {
    Ray::new(leaving_origin(surface, direction), direction.to_array())
}

/// Column and row of a place on the Morton curve.
fn morton(code: u32) -> [u32; 2] {
    let even = |mut x: u32| {
        x &= 0x5555_5555;
        for (shift, mask) in
            [(1, 0x3333_3333), (2, 0x0f0f_0f0f), (4, 0x00ff_00ff), (8, 0x0000_ffff)]
        {
            x = (x | x >> shift) & mask;
        }
        x
    };
    [even(code), even(code >> 1)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_meets_every_cell_once() {
        let mut seen = [[false; 8]; 8];
        for code in 0..64 {
            let [x, y] = morton(code);
            assert!(!std::mem::replace(&mut seen[y as usize][x as usize], true));
        }
        assert_eq!(morton(0b1101), [0b11, 0b10]);
    }

    #[test]
    fn the_weights_of_two_strategies_add_up_to_one() {
        for (p, q) in [(1.0, 1.0), (0.3, 7.0), (1e20, 1e-20), (1.0, 0.0)] {
            assert!((power_heuristic(p, q) + power_heuristic(q, p) - 1.0).abs() < 1e-6 || q == 0.0);
        }
        assert_eq!(power_heuristic(1.0, 0.0), 1.0);
    }
}
