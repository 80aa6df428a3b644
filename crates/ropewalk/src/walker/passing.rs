//! Particles that nothing stops.

use super::lists::Lists;
use super::{WalkerGeometry, end_or_not, fits};
use crate::kernel::{Crossings, PACKET, Supply, WAVE};
use crate::ray::Ray;

/// A segment that has been made.
#[derive(Clone, Copy, Default)]
struct Made<T> {
    particle: u32,
    /// Of the particle's list.
    segment: u32,
    /// The triangle that the particle stood at.
    passed: u32,
    from: [T; 3],
    to: [T; 3],
}

/// The segments of particles, one particle after the other.
pub struct Passing<'a, G: WalkerGeometry> {
    pub lists: Lists<'a, G>,
    /// The particle of the next segment.
    particle: usize,
    /// The next segment.
    next: usize,
    made: [Made<G::Float>; PACKET],
    /// Those in slots.
    under_way: [Made<G::Float>; WAVE],
}

impl<'a, G: WalkerGeometry> Passing<'a, G> {
    /// All of a task.
    pub fn new(lists: Lists<'a, G>) -> Self {
        for (walked, row) in lists.walked.iter_mut().zip(lists.offsets.windows(2)) {
            *walked = (row[1] - row[0]) as u32;
        }
        let (next, none) = (lists.offsets[0], Made::default());
        Passing { lists, particle: 0, next, made: [none; PACKET], under_way: [none; WAVE] }
    }
}

impl<'a, G: WalkerGeometry> Supply<Crossings<'a, G>> for Passing<'a, G> {
    #[inline(always)]
    fn make(&mut self, rays: &mut [Ray; PACKET]) -> usize {
        let Lists { geometry, offsets, directions, lengths, .. } = self.lists;
        let mut made = 0;
        while made < PACKET && self.particle < self.lists.positions.len() {
            let particle = self.particle;
            let (first, end) = (offsets[particle], offsets[particle + 1]);
            let mut from = self.lists.positions[particle];
            let mut passed = self.lists.stopped[particle];
            // Those that segments lead to have been looked at.
            let is_point = fits(geometry, from);
            let segments = directions[self.next..end].iter().zip(&lengths[self.next..end]);
            for (at, (&direction, &length)) in (self.next..end).zip(segments) {
                if made == PACKET {
                    break;
                }
                self.next = at + 1;
                let (to, valid) = end_or_not(geometry, from, direction, length);
                if !(valid & is_point) {
                    self.lists.invalid += 1;
                    continue;
                }
                if (to[0] == from[0]) & (to[1] == from[1]) & (to[2] == from[2]) {
                    continue;
                }
                let new = &mut self.made[made];
                (new.particle, new.segment) = (particle as u32, (at - first) as u32);
                new.passed = std::mem::replace(&mut passed, u32::MAX);
                // Number by number: copied as a whole they would be read back before they are written.
                for a in 0..3 {
                    (new.from[a], new.to[a]) = (from[a], to[a]);
                }
                rays[made] = geometry.search_ray(from, to);
                made += 1;
                from = to;
            }
            self.lists.positions[particle] = from;
            self.lists.stopped[particle] = passed;
            self.particle += usize::from(self.next >= end);
        }
        made
    }

    #[inline(always)]
    fn begin(&mut self, number: usize, k: usize, query: &mut Crossings<'a, G>) {
        let made = self.made[number % PACKET];
        query.set(k, made.from, made.to);
        self.under_way[k % WAVE] = made;
    }

    #[inline(always)]
    fn end(&mut self, k: usize, query: &mut Crossings<'a, G>) {
        let Made { particle, segment, passed, .. } = self.under_way[k % WAVE];
        self.lists.note((particle as usize, segment), passed, query.of(k), usize::MAX);
    }
}
