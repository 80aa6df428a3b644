//! Particles with lists of segments, as the lanes of a wave take them.

use super::{Crossed, CrossingFilter, Encounter, Float, WalkerGeometry, end_of};
use crate::kernel::{BatchCaster, Before, Crossings, Crowd, Lanes, WAVE, WalkReport, wave_width};
use crate::ray::Ray;

/// A crossing of a particle.
#[derive(Clone, Copy, Debug)]
pub struct Record<T> {
    /// The particle, counted from the first of the task.
    pub particle: u32,
    /// The segment of its list.
    pub segment: u32,
    /// Where on it, in lengths of its direction.
    pub t: T,
    /// What it crosses.
    pub hit: Crossed,
}

/// The particles of a task.
pub struct Lists<'a, G: WalkerGeometry> {
    geometry: &'a G,
    /// Where the segments of each particle begin, and where the last ones end.
    offsets: &'a [usize],
    directions: &'a [[G::Float; 3]],
    lengths: &'a [G::Float],
    positions: &'a mut [[G::Float; 3]],
    stopped: &'a mut [u32],
    /// Segments that each particle has behind it.
    walked: &'a mut [u32],
    encounter: Encounter,
    /// Decides which crossings count.
    filter: &'a dyn CrossingFilter,
    /// The index of the first particle among all, as the filter knows them.
    first: usize,
    /// The particle of each lane.
    of: [usize; WAVE],
    /// Where its segment ends.
    to: [[G::Float; 3]; WAVE],
    /// The first particle not yet begun.
    next: usize,
    records: Vec<Record<G::Float>>,
    invalid: usize,
}

/// Positions, the triangles at which particles were stopped, and segments walked.
type State<'a, T> = (&'a mut [[T; 3]], &'a mut [u32], &'a mut [u32]);

/// Directions and lengths of segments.
type Segments<'a, T> = (&'a [[T; 3]], &'a [T]);

impl<'a, G: WalkerGeometry> Lists<'a, G> {
    /// Particles with their rows of segments, the first of which is number `first` of all.
    pub fn new(
        geometry: &'a G,
        offsets: &'a [usize],
        (directions, lengths): Segments<'a, G::Float>,
        (positions, stopped, walked): State<'a, G::Float>,
        encounter: Encounter,
        (filter, first): (&'a dyn CrossingFilter, usize),
    ) -> Self {
        Lists {
            geometry,
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
            to: [[G::Float::default(); 3]; WAVE],
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
    pub fn into_records(self) -> (Vec<Record<G::Float>>, usize) {
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
            let t = Float::rounded(hit.share * length.into());
            self.records.push(Record { particle: particle as u32, segment, t, hit: *hit });
            if self.encounter == Encounter::Stop {
                let at = |a: usize| {
                    let (from, to): (f64, f64) = (from[a].into(), to[a].into());
                    Float::rounded(from + hit.share * (to - from))
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
    fn segment(&mut self, k: usize, query: &mut Crossings<'_, G>) -> Option<Ray> {
        let particle = self.of[k];
        let from = self.positions[particle];
        loop {
            let at = self.offsets[particle] + self.walked[particle] as usize;
            if at >= self.offsets[particle + 1] {
                return None;
            }
            let end = end_of(self.geometry, from, self.directions[at], self.lengths[at]);
            let Some(to) = end else {
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
            return Some(self.geometry.search_ray(from, to));
        }
    }
}

impl<'a, G: WalkerGeometry> Crowd<Crossings<'a, G>> for Lists<'a, G> {
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

/// What the particles of a task met, segments without an end, and how the segments went.
pub type Part<T> = ((Vec<Record<T>>, usize), WalkReport);

/// Moves the particles of a task.
pub fn walk<G: WalkerGeometry>(caster: &BatchCaster<'_>, lists: Lists<'_, G>) -> Part<G::Float> {
    let (width, mut query) = (lists.len().min(wave_width()), Crossings::new(lists.geometry));
    let mut lanes = Lanes::new(caster.tree(), width, lists);
    caster.run_lanes(width, &mut query, &mut lanes);
    let (lists, report) = lanes.into_parts();
    (lists.into_records(), report)
}
