//! Particles that stop at what they meet.

use super::lists::Lists;
use super::{Crossed, Float, WalkerGeometry, end_or_not, fits};
use crate::kernel::{Before, Crossings, Crowd, WAVE};
use crate::ray::Ray;

/// The particles of a task in the lanes of a wave.
pub struct Stopping<'a, G: WalkerGeometry> {
    pub lists: Lists<'a, G>,
    /// The particle of each lane.
    of: [usize; WAVE],
    /// Where its segment ends.
    to: [[G::Float; 3]; WAVE],
    /// The first particle not yet begun.
    next: usize,
}

impl<'a, G: WalkerGeometry> Stopping<'a, G> {
    /// All of a task.
    pub fn new(lists: Lists<'a, G>) -> Self {
        let to = [[G::Float::default(); 3]; WAVE];
        Stopping { lists, of: [usize::MAX; WAVE], to, next: 0 }
    }

    /// Takes note of what the segment of a lane crosses; true if it stops its particle.
    #[inline(always)]
    fn arrive(&mut self, k: usize, crossed: &[Crossed]) -> bool {
        let (lists, particle) = (&mut self.lists, self.of[k]);
        let (from, to) = (lists.positions[particle], self.to[k]);
        let segment = lists.walked[particle];
        let passed = std::mem::replace(&mut lists.stopped[particle], u32::MAX);
        lists.walked[particle] += 1;
        lists.positions[particle] = to;
        let Some(hit) = lists.note((particle, segment), passed, crossed, 1) else { return false };
        let at = |a: usize| {
            let (from, to): (f64, f64) = (from[a].into(), to[a].into());
            Float::rounded(from + hit.share * (to - from))
        };
        lists.positions[particle] = std::array::from_fn(at);
        lists.stopped[particle] = hit.prim_id;
        true
    }

    /// The next segment of the particle of a lane.
    #[inline(always)]
    fn segment(&mut self, k: usize, query: &mut Crossings<'_, G>) -> Option<Ray> {
        let (lists, particle) = (&mut self.lists, self.of[k]);
        let from = lists.positions[particle];
        loop {
            let at = lists.offsets[particle] + lists.walked[particle] as usize;
            if at >= lists.offsets[particle + 1] {
                return None;
            }
            let (direction, length) = (lists.directions[at], lists.lengths[at]);
            let (to, valid) = end_or_not(lists.geometry, from, direction, length);
            let valid = valid & fits(lists.geometry, from);
            if !valid {
                lists.invalid += 1;
                lists.walked[particle] += 1;
                continue;
            }
            if to == from {
                lists.walked[particle] += 1;
                continue;
            }
            query.set(k, from, to);
            self.to[k] = to;
            return Some(lists.geometry.search_ray(from, to));
        }
    }
}

impl<'a, G: WalkerGeometry> Crowd<Crossings<'a, G>> for Stopping<'a, G> {
    #[inline(always)]
    fn advance(&mut self, k: usize, query: &mut Crossings<'a, G>, before: Before) -> Option<Ray> {
        let goes_on = match before {
            Before::Nothing => false,
            Before::Missed => !self.arrive(k, &[]),
            Before::Answered => !self.arrive(k, query.of(k)),
        };
        if goes_on && let Some(ray) = self.segment(k, query) {
            return Some(ray);
        }
        while self.next < self.lists.positions.len() {
            self.of[k] = self.next;
            self.next += 1;
            if let Some(ray) = self.segment(k, query) {
                return Some(ray);
            }
        }
        None
    }
}
