//! Particles that say themselves where they go next.

use super::batch::BatchCaster;
use super::lanes::{Before, Crowd, Lanes, WalkReport};
use super::query::{Closest, NoFilter};
use super::wave::WAVE;
use super::width::wave_width;
use crate::ray::Ray;
use rayon::prelude::*;

/// What became of a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// Parameter of the first hit; infinite if there is none.
    pub t: f32,
    /// Primitive of the first hit; `u32::MAX` if there is none.
    pub prim_id: u32,
}

impl Arrival {
    /// Nothing was hit.
    pub const MISS: Arrival = Arrival { t: f32::INFINITY, prim_id: u32::MAX };

    /// True if something was hit.
    pub fn is_hit(&self) -> bool {
        self.prim_id != u32::MAX
    }
}

/// Something that moves in straight segments, each of which depends on what became of the one before:
/// a photon, a neutron, a walk on a surface.
pub trait Particle: Send {
    /// The next segment, `None` at the end of the walk; `before` is what became of the last one, `None`
    /// at first. Not asked again after the end.
    fn next(&mut self, before: Option<Arrival>) -> Option<Ray>;

    /// The segment has been put under way, and other particles come first: a time to ask for memory that
    /// [`Particle::next`] will read, see [`prefetch`].
    #[inline(always)]
    fn wait(&self) {}
}

/// Asks for the cache line of a value, which will be read soon.
#[inline(always)]
pub fn prefetch<T>(value: &T) {
    #[cfg(target_arch = "x86_64")]
    super::x86::prefetch(std::ptr::from_ref(value).cast());
    #[cfg(not(target_arch = "x86_64"))]
    let _ = value;
}

/// Particles that one task of a parallel batch moves.
const TASK: usize = 256;

/// Particles in turn.
struct Particles<'a, P> {
    particles: &'a mut [P],
    /// The particle in each lane.
    of: [usize; WAVE],
    /// The first one not yet begun.
    next: usize,
}

impl<P: Particle> Crowd<Closest<'_>> for Particles<'_, P> {
    #[inline(always)]
    fn advance(&mut self, k: usize, query: &mut Closest<'_>, before: Before) -> Option<Ray> {
        let arrival = match before {
            Before::Nothing => None,
            Before::Missed => Some(Arrival::MISS),
            Before::Answered => {
                let (t, prim_id) = query.answer(k);
                Some(Arrival { t, prim_id })
            }
        };
        if arrival.is_some()
            && let Some(particle) = self.particles.get_mut(self.of[k])
            && let Some(ray) = particle.next(arrival)
        {
            return Some(ray);
        }
        loop {
            self.of[k] = self.next;
            let particle = self.particles.get_mut(self.next)?;
            self.next += 1;
            if let Some(ray) = particle.next(None) {
                return Some(ray);
            }
        }
    }

    #[inline(always)]
    fn wait(&mut self, k: usize) {
        if let Some(particle) = self.particles.get(self.of[k]) {
            particle.wait();
        }
    }
}

impl BatchCaster<'_, NoFilter> {
    /// Moves particles until each of them has come to its end, asking each for its next segment when
    /// the one before is answered; many are under way at once. What becomes of a segment is what
    /// [`BatchCaster::closest_hit`] says, so a particle sees the same whatever the level, the
    /// number of threads and the other particles.
    ///
    /// Segments are rays of finite range. Short ones are searched for from where their particle was
    /// (see [`Start::Entry`](super::Start)), unless that turns out not to pay.
    pub fn walk<P: Particle>(&self, particles: &mut [P]) -> WalkReport {
        if self.threads() == 1 || particles.len() <= TASK {
            return self.walk_here(particles);
        }
        let chunks = particles.par_chunks_mut(TASK);
        chunks.map(|part| self.walk_here(part)).reduce(WalkReport::default, |a, b| a + b)
    }

    fn walk_here<P: Particle>(&self, particles: &mut [P]) -> WalkReport {
        let (mut t, mut prim) = ([0.0; WAVE], [0; WAVE]);
        let width = particles.len().min(wave_width());
        let crowd = Particles { particles, of: [usize::MAX; WAVE], next: 0 };
        let mut lanes = Lanes::new(self.tree(), width, crowd);
        self.run_lanes(width, &mut Closest::new(&mut t, &mut prim), &mut lanes);
        lanes.into_parts().1
    }
}
