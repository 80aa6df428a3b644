//! Particles with lists of segments, as the lanes of a wave take them.

use super::{Crossed, CrossingFilter, Crossings, Encounter, end_of};
use crate::kernel::{Before, Crowd, WAVE};
use crate::ray::Ray;

/// A crossing of a particle.
#[derive(Clone, Copy, Debug)]
pub struct Record {
    /// The particle, counted from the first of the task.
    pub particle: u32,
    /// The segment of its list.
    pub segment: u32,
    /// Where on it, in lengths of its direction.
    pub t: f32,
    /// What it crosses.
    pub hit: Crossed,
}

/// The particles of a task.
pub struct Lists<'a, F> {
    /// Where the segments of each particle begin, and where the last ones end.
    offsets: &'a [usize],
    directions: &'a [[f32; 3]],
    lengths: &'a [f32],
    positions: &'a mut [[f32; 3]],
    stopped: &'a mut [u32],
    /// Segments that each particle has behind it.
    walked: &'a mut [u32],
    encounter: Encounter,
    /// Decides which crossings count.
    filter: &'a F,
    /// The index of the first particle among all, as the filter knows them.
    first: usize,
    /// The particle of each lane.
    of: [usize; WAVE],
    /// Where its segment ends.
    to: [[f32; 3]; WAVE],
    /// The first particle not yet begun.
    next: usize,
    records: Vec<Record>,
    invalid: usize,
}

/// Positions, the triangles at which particles were stopped, and segments walked.
type State<'a> = (&'a mut [[f32; 3]], &'a mut [u32], &'a mut [u32]);

/// The ray of a segment begins earlier and ends later by this share of it. The filters bound their
/// errors for a ray of exact direction; this one's is rounded, which moves parameters by less.
const BEYOND: f32 = 1.0 / (1u32 << 16) as f32;

impl<'a, F: CrossingFilter> Lists<'a, F> {
    /// Particles with their rows of segments, the first of which is number `first` of all.
    pub fn new(
        offsets: &'a [usize],
        (directions, lengths): (&'a [[f32; 3]], &'a [f32]),
        (positions, stopped, walked): State<'a>,
        encounter: Encounter,
        (filter, first): (&'a F, usize),
    ) -> Self {
        Lists {
            offsets,
            directions,
            lengths,
            positions,
            stopped,
            walked,
            encounter,
            filter,
            first,
            of: [usize::MAX; WAVE],
            to: [[0.0; 3]; WAVE],
            next: 0,
            records: Vec::new(),
            invalid: 0,
        }
    }

    /// Number of particles.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// All crossings, those of each particle in order, and the number of segments without an end.
    pub fn into_records(self) -> (Vec<Record>, usize) {
        (self.records, self.invalid)
    }

    /// Takes note of what the segment of a lane crosses; true if it stops its particle.
    #[inline(always)]
    fn arrive(&mut self, k: usize, crossed: &[Crossed]) -> bool {
        let particle = self.of[k];
        let (from, to) = (self.positions[particle], self.to[k]);
        let segment = self.walked[particle];
        let passed = std::mem::replace(&mut self.stopped[particle], u32::MAX);
        self.walked[particle] += 1;
        self.positions[particle] = to;
        let (filter, index) = (self.filter, self.first + particle);
        let counts =
            |hit: &&Crossed| !filter.passes(passed, hit.prim_id) && filter.accepts(index, hit);
        for hit in crossed.iter().filter(counts) {
            let length = self.lengths[self.offsets[particle] + segment as usize];
            let t = (hit.share * f64::from(length)) as f32;
            self.records.push(Record { particle: particle as u32, segment, t, hit: *hit });
            if self.encounter == Encounter::Stop {
                let at = |a: usize| {
                    let (from, to) = (f64::from(from[a]), f64::from(to[a]));
                    (from + hit.share * (to - from)) as f32
                };
                self.positions[particle] = std::array::from_fn(at);
                self.stopped[particle] = hit.prim_id;
                return true;
            }
        }
        false
    }

    /// The next segment of the particle of a lane.
    #[inline(always)]
    fn segment(&mut self, k: usize, query: &mut Crossings) -> Option<Ray> {
        let particle = self.of[k];
        let from = self.positions[particle];
        loop {
            let at = self.offsets[particle] + self.walked[particle] as usize;
            if at >= self.offsets[particle + 1] {
                return None;
            }
            let Some(to) = end_of(from, self.directions[at], self.lengths[at]) else {
                self.invalid += 1;
                self.walked[particle] += 1;
                continue;
            };
            if to == from {
                self.walked[particle] += 1;
                continue;
            }
            query.set(k, from, to);
            self.to[k] = to;
            let dir = [to[0] - from[0], to[1] - from[1], to[2] - from[2]];
            return Some(Ray::new(from, dir).with_range(-BEYOND, 1.0 + BEYOND));
        }
    }
}

impl<F: CrossingFilter> Crowd<Crossings> for Lists<'_, F> {
    #[inline(always)]
    fn advance(&mut self, k: usize, query: &mut Crossings, before: Before) -> Option<Ray> {
        let goes_on = match before {
            Before::Nothing => false,
            Before::Missed => !self.arrive(k, &[]),
            Before::Answered => !self.arrive(k, query.of(k)),
        };
        if goes_on && let Some(ray) = self.segment(k, query) {
            return Some(ray);
        }
        while self.next < self.positions.len() {
            self.of[k] = self.next;
            self.next += 1;
            if let Some(ray) = self.segment(k, query) {
                return Some(ray);
            }
        }
        None
    }
}
