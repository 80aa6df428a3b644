//! Particles with lists of segments.

use super::passing::Passing;
use super::stopping::Stopping;
use super::{Crossed, CrossingFilter, Encounter, Float, WalkerGeometry};
use crate::kernel::{BatchCaster, Crossings, Known, Lanes, WalkReport, wave_width};

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
    pub geometry: &'a G,
    /// Where the segments of each particle begin, and where the last ones end.
    pub offsets: &'a [usize],
    pub directions: &'a [[G::Float; 3]],
    pub lengths: &'a [G::Float],
    pub positions: &'a mut [[G::Float; 3]],
    pub stopped: &'a mut [u32],
    /// Segments that each particle has behind it.
    pub walked: &'a mut [u32],
    encounter: Encounter,
    /// Decides which crossings count.
    filter: &'a dyn CrossingFilter,
    /// The index of the first particle among all, as the filter knows them.
    first: usize,
    records: Vec<Record<G::Float>>,
    /// Segments without an end.
    pub invalid: usize,
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
            records: Vec::new(),
            invalid: 0,
        }
    }

    /// Takes note of the first of the crossings of a segment that count, up to `most` of them; returns the last one. A
    /// particle that stood at a face that it passes does not cross it.
    #[inline(always)]
    pub fn note(
        &mut self,
        (particle, segment): (usize, u32),
        passed: u32,
        crossed: &[Crossed],
        most: usize,
    ) -> Option<Crossed> {
        let (filter, index) = (self.filter, self.first + particle);
        let counts =
            |hit: &&Crossed| !filter.passes(passed, hit.prim_id) && filter.accepts(index, hit);
        let mut last = None;
        for hit in crossed.iter().filter(counts).take(most) {
            let length = self.lengths[self.offsets[particle] + segment as usize];
            let t = Float::rounded(hit.share * length.into());
            self.records.push(Record { particle: particle as u32, segment, t, hit: *hit });
            last = Some(*hit);
        }
        last
    }
}

/// The crossings of all particles of a task, those of each segment in order, and the number of segments without an end;
/// how the segments went.
pub type Part<T> = ((Vec<Record<T>>, usize), WalkReport);

/// Moves the particles of a task.
pub fn walk<G: WalkerGeometry>(caster: &BatchCaster<'_>, lists: Lists<'_, G>) -> Part<G::Float> {
    let (tree, mut query) = (caster.tree(), Crossings::new(lists.geometry));
    let (lists, report) = match lists.encounter {
        Encounter::Pass => {
            let segments = lists.offsets[lists.positions.len()] - lists.offsets[0];
            let width = segments.min(wave_width());
            let mut known = Known::new(tree, Passing::new(lists));
            caster.run_lanes(width, &mut query, &mut known);
            let (passing, report) = known.into_parts();
            (passing.lists, report)
        }
        Encounter::Stop => {
            let width = lists.positions.len().min(wave_width());
            let mut lanes = Lanes::new(tree, width, Stopping::new(lists));
            caster.run_lanes(width, &mut query, &mut lanes);
            let (stopping, report) = lanes.into_parts();
            (stopping.lists, report)
        }
    };
    ((lists.records, lists.invalid), report)
}
