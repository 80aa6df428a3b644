//! Many rays, the batch kernels at every SIMD level against the `f64` walk of the binary tree, which
//! the tests of the core compare with brute force. Nothing is timed.
//!
//! The two trees are built by themselves (the default preset of the wide tree; the exact sweep with
//! late cutting for the walk), so that a primitive lost by a builder shows as well.

mod rays;

pub use rays::{Aim, Marksman};

use crate::answer::{BenchHit, HitLists};
use crate::harness::Engine;
use crate::own::{TaB, Wave};
use crate::scene::Mesh;
use crate::workload::Random;
use ropewalk::kernel::Level;
use ropewalk::{Hit, Ray};
use std::collections::BTreeMap;
use std::ops::AddAssign;

/// Rays of a chunk: one aim, one batch for each level.
pub const CHUNK: usize = 32_768;
/// Points inside of a closed mesh that rays start from.
const INSIDE_POINTS: usize = 64;
/// Directions that must agree that a point is inside.
const VOTES: usize = 5;

/// What came out of some rays; differences are counted once for each ray and level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Rays, each asked at all levels.
    pub rays: u64,
    /// Of these, hits.
    pub hits: u64,
    /// Rays that were asked for all hits too.
    pub all_hits_rays: u64,
    /// A hit where the walk misses, or a miss where it hits.
    pub hit_or_miss: u64,
    /// Another primitive that shares a vertex with the right one, within one `f32` of its `t`.
    pub neighbour: u64,
    /// Any other wrong primitive.
    pub other_primitive: u64,
    /// The right primitive, `t` one `f32` off: within the error of one more rounding.
    pub t_rounding: u64,
    /// The right primitive, `t` further off.
    pub t_outside: u64,
    /// Another answer of `occluded`.
    pub occluded: u64,
    /// Another list of all hits.
    pub all_hits: u64,
    /// Rays from inside of a closed mesh that the walk itself lets escape.
    pub lost: u64,
}

impl Tally {
    /// The columns of [`Tally::fields`].
    pub const COLUMNS: &str = "rays,hits,all_hits_rays,hit_or_miss,neighbour,other_primitive,\
        t_rounding,t_outside,occluded,all_hits,lost";

    /// All counts.
    pub fn fields(&self) -> [u64; 11] {
        [
            self.rays,
            self.hits,
            self.all_hits_rays,
            self.hit_or_miss,
            self.neighbour,
            self.other_primitive,
            self.t_rounding,
            self.t_outside,
            self.occluded,
            self.all_hits,
            self.lost,
        ]
    }

    /// Differences of any kind, rays lost by the walk included.
    pub fn differences(&self) -> u64 {
        self.fields()[3..].iter().sum()
    }
}

impl AddAssign for Tally {
    fn add_assign(&mut self, o: Tally) {
        self.rays += o.rays;
        self.hits += o.hits;
        self.all_hits_rays += o.all_hits_rays;
        self.hit_or_miss += o.hit_or_miss;
        self.neighbour += o.neighbour;
        self.other_primitive += o.other_primitive;
        self.t_rounding += o.t_rounding;
        self.t_outside += o.t_outside;
        self.occluded += o.occluded;
        self.all_hits += o.all_hits;
        self.lost += o.lost;
    }
}

/// Counts by aim.
pub type Tallies = BTreeMap<Aim, Tally>;

/// A mesh with both trees.
pub struct Campaign<'a> {
    mesh: &'a Mesh,
    walk: TaB,
    wave: Wave,
    closed: bool,
    inside: Vec<[f32; 3]>,
}

impl<'a> Campaign<'a> {
    /// Builds both trees with `threads` threads, and looks for points inside of a closed mesh.
    ///
    /// # Errors
    /// What the builders say.
    pub fn new(mesh: &'a Mesh, threads: usize) -> anyhow::Result<Self> {
        let (walk, wave) = (TaB::build(mesh, threads)?, Wave::build(mesh, threads)?);
        let closed = mesh.is_closed();
        let mut campaign = Campaign { mesh, walk, wave, closed, inside: Vec::new() };
        if closed {
            campaign.inside = campaign.points_inside();
        }
        Ok(campaign)
    }

    /// True if the mesh has no rim.
    pub fn is_closed(&self) -> bool {
        self.closed
    }

    /// The aims that the mesh has rays for.
    pub fn aims(&self) -> impl Iterator<Item = Aim> {
        Aim::ALL.into_iter().filter(|&aim| aim != Aim::Inside || !self.inside.is_empty())
    }

    /// Points from which lines in all of some directions cross the surface an odd number of times.
    fn points_inside(&self) -> Vec<[f32; 3]> {
        let (bounds, mut random) = (self.mesh.bounds(), Random::new(7));
        let mut found = Vec::new();
        for _ in 0..64 * INSIDE_POINTS {
            let point = std::array::from_fn(|a| {
                (f64::from(bounds.min[a]) + bounds.extent(a) * random.unit()) as f32
            });
            let ray = |random: &mut Random| Ray::new(point, random.direction().map(|x| x as f32));
            let rays: Vec<Ray> = (0..VOTES).map(|_| ray(&mut random)).collect();
            let mut lists = HitLists::new();
            self.walk.hits(&rays, usize::MAX, &mut lists);
            // A line through an edge hits two triangles in one place, which would count twice.
            let mut places: Vec<_> = (0..VOTES).map(|i| lists.of(i)).collect();
            places.iter_mut().for_each(|hits| hits.dedup_by_key(|h| h.t));
            if places.iter().all(|hits| hits.len() % 2 == 1) {
                found.push(point);
            }
            if found.len() == INSIDE_POINTS {
                break;
            }
        }
        found
    }

    /// Casts a chunk of [`CHUNK`] rays, the same ones for the same number and seed; asks for all hits
    /// too if wanted.
    pub fn chunk(&self, aim: Aim, number: u64, seed: u64, all_hits: bool) -> Tally {
        let (mesh, bounds) = (self.mesh, self.mesh.bounds());
        let marksman = Marksman { mesh, bounds, inside: &self.inside };
        let rays = marksman.rays(aim, CHUNK, seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ number);
        let mut expected = vec![BenchHit::MISS; rays.len()];
        self.walk.closest(&rays, &mut expected);
        let mut tally = Tally { rays: rays.len() as u64, ..Tally::default() };
        tally.hits = expected.iter().filter(|h| h.is_hit()).count() as u64;
        if aim == Aim::Inside {
            tally.lost = tally.rays - tally.hits;
        }
        let every = all_hits.then(|| self.every_hit(&rays));
        for level in Level::ALL {
            let Some(caster) = self.wave.caster().with_level(level) else { continue };
            let hits = caster.closest_hit(&rays);
            for ((&t, &prim), right) in hits.t.iter().zip(&hits.prim_id).zip(&expected) {
                self.compare(&mut tally, BenchHit { t, prim }, *right);
            }
            let wrong = |(&flag, hit): (&bool, &BenchHit)| flag != hit.is_hit();
            let flags = caster.occluded(&rays);
            tally.occluded += flags.iter().zip(&expected).filter(|&x| wrong(x)).count() as u64;
            let Some(lists) = &every else { continue };
            let all = caster.all_hits(&rays);
            for (right, range) in lists.iter().zip(all.offsets.windows(2)) {
                let range = range[0]..range[1];
                let own = all.t[range.clone()].iter().zip(&all.prim_id[range]);
                let own = own.map(|(&t, &prim)| (t.to_bits(), prim));
                tally.all_hits += u64::from(!own.eq(right.iter().copied()));
            }
        }
        tally.all_hits_rays = every.map_or(0, |lists| lists.len() as u64);
        tally
    }

    /// All hits of each ray in the walk's arithmetic, `t` as bits; -0 is 0.
    fn every_hit(&self, rays: &[Ray]) -> Vec<Vec<(u32, u32)>> {
        let mut lists = HitLists::new();
        self.walk.hits(rays, usize::MAX, &mut lists);
        let row = |ray: usize| {
            let mut hits = lists.of(ray);
            hits.iter_mut().for_each(|h| h.t += 0.0);
            hits.sort_unstable_by(BenchHit::order);
            let hit = |h: &BenchHit| Hit { t: h.t, prim_id: h.prim, u: 0.0, v: 0.0 };
            let mut hits: Vec<Hit> = hits.iter().map(hit).collect();
            self.wave.geometry().leave_out(&rays[ray], &mut hits);
            hits.iter().map(|h| (h.t.to_bits(), h.prim_id)).collect()
        };
        (0..rays.len()).map(row).collect()
    }

    fn compare(&self, tally: &mut Tally, own: BenchHit, right: BenchHit) {
        if own.is_hit() != right.is_hit() {
            tally.hit_or_miss += 1;
        } else if own.prim != right.prim {
            let [a, b] = [own, right].map(|hit| self.mesh.triangle(hit.prim));
            let touch = a.iter().any(|v| b.contains(v)) && is_near(own.t, right.t);
            *if touch { &mut tally.neighbour } else { &mut tally.other_primitive } += 1;
        } else if own.t != right.t {
            let near = is_near(own.t, right.t);
            *if near { &mut tally.t_rounding } else { &mut tally.t_outside } += 1;
        }
    }
}

/// True if at most one `f32` apart.
fn is_near(a: f32, b: f32) -> bool {
    a == b || a.next_up() == b || b.next_up() == a
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenes::{bumpy_sphere, soup_mesh};

    #[test]
    fn a_closed_mesh_has_an_inside_and_no_ray_differs() {
        for (mesh, aims) in [(bumpy_sphere(2000), 9), (soup_mesh(500), 8)] {
            let campaign = Campaign::new(&mesh, 1).unwrap();
            assert_eq!(campaign.aims().count(), aims);
            for (number, aim) in campaign.aims().enumerate() {
                let tally = campaign.chunk(aim, number as u64, 1, true);
                assert_eq!(tally, campaign.chunk(aim, number as u64, 1, true), "reproducible");
                assert_eq!((tally.rays, tally.all_hits_rays), (CHUNK as u64, CHUNK as u64));
                assert!(tally.hits > 100, "{aim:?} {tally:?}");
                assert_eq!(tally.differences(), 0, "{aim:?} {tally:?}");
            }
        }
    }

    #[test]
    fn differences_are_told_apart() {
        let mesh = bumpy_sphere(12);
        let campaign = Campaign::new(&mesh, 1).unwrap();
        let mut tally = Tally::default();
        let hit = |t: f32, prim| BenchHit { t, prim };
        let apart = (1..mesh.faces.len() as u32)
            .find(|&f| mesh.triangle(f).iter().all(|v| !mesh.triangle(0).contains(v)))
            .unwrap();
        campaign.compare(&mut tally, hit(1.0, 0), hit(1.0, 0));
        assert_eq!(tally.differences(), 0);
        campaign.compare(&mut tally, hit(1.0, 0), BenchHit::MISS);
        campaign.compare(&mut tally, hit(1.0, 0), hit(1.0, 1));
        campaign.compare(&mut tally, hit(1.0, 0), hit(1.5, 1));
        campaign.compare(&mut tally, hit(1.0, 0), hit(1.0, apart));
        campaign.compare(&mut tally, hit(1.0f32.next_up(), 0), hit(1.0, 0));
        campaign.compare(&mut tally, hit(1.1, 0), hit(1.0, 0));
        let expected = Tally {
            hit_or_miss: 1,
            neighbour: 1,
            other_primitive: 2,
            t_rounding: 1,
            t_outside: 1,
            ..Tally::default()
        };
        assert_eq!(tally, expected);
    }
}
