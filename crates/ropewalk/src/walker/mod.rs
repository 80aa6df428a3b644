//! Particles that are moved segment by segment, with every triangle that they cross on the way.
//!
//! [`Walker`] holds many particles and moves each along a list of segments, many at once; [`crossings`]
//! defines what it reports. Which triangles a segment crosses is decided without rounding, by a rule
//! under which the segments of a particle join: nothing is crossed twice or not at all where one ends
//! and the next begins, also in a face, on an edge or in a vertex. docs/numerics.md has the rule. Positions are
//! `f32`, or `f64` among the triangles of a [`DoubleGeometry`](crate::double::DoubleGeometry).
//!
//! Particles that decide by themselves where to go next are moved by
//! [`BatchCaster::walk`](crate::kernel::BatchCaster::walk).

mod crossing;
mod lists;
mod passing;
mod precision;
mod stopping;

pub use crossing::Crossed;
pub(crate) use crossing::crossing;
pub use precision::{Float, WalkerGeometry};

use crate::geometry::Geometry;
use crate::kernel::{BatchCaster, Level, Masks, NoFilter, WalkReport};
use crate::point::{Cell, PointError, PointQueries};
use lists::{Lists, Part};
use rayon::prelude::*;

/// What a particle does at a triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Encounter {
    /// It passes through, and the crossing is noted.
    #[default]
    Pass,
    /// It stops there: the rest of its list is left out.
    Stop,
}

/// What particles met, in compressed rows: the events of particle `i` are `offsets[i]..offsets[i + 1]`, in
/// the order of its segments, in each by the share of the segment before the crossing, and at equal
/// shares by primitive.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Events<T = f32> {
    /// Row starts; one more than there are particles.
    pub offsets: Vec<usize>,
    /// The segment, counted from the first of the particle's list.
    pub segment: Vec<u32>,
    /// Where on the segment, in lengths of its direction.
    pub t: Vec<T>,
    /// The triangle.
    pub prim_id: Vec<u32>,
    /// True if the particle goes from the front to the back of the triangle: into a body whose fronts
    /// look outwards.
    pub entering: Vec<bool>,
    /// Segments that each particle began: all of its list, or fewer if it stopped.
    pub walked: Vec<u32>,
    /// Segments left out since they have no end: a number that is NaN, infinite or too large (see
    /// [`end_of`]), or a negative length.
    pub invalid: usize,
    /// How the segments went; which way they go changes no event.
    pub report: WalkReport,
}

/// Decides which crossings count: what it refuses is no event and stops no particle.
///
/// It may be asked from several threads: its answer must depend on its arguments alone.
pub trait CrossingFilter: Sync {
    /// True if the crossing counts for the particle with this index.
    fn accepts(&self, particle: usize, crossed: &Crossed) -> bool;

    /// True if a particle that was stopped at a triangle passes another one without an event too, since both are
    /// parts of one face.
    #[inline(always)]
    fn passes(&self, stopped_at: u32, prim_id: u32) -> bool {
        stopped_at == prim_id
    }
}

/// Every crossing counts.
impl CrossingFilter for NoFilter {
    #[inline(always)]
    fn accepts(&self, _particle: usize, _crossed: &Crossed) -> bool {
        true
    }
}

/// A crossing counts where the masks of triangle and particle (`ray`) have a bit in common.
impl CrossingFilter for Masks<'_> {
    fn accepts(&self, particle: usize, crossed: &Crossed) -> bool {
        self.match_up(particle, crossed.prim_id)
    }
}

impl<F: Fn(usize, &Crossed) -> bool + Sync> CrossingFilter for F {
    fn accepts(&self, particle: usize, crossed: &Crossed) -> bool {
        self(particle, crossed)
    }
}

/// Largest coordinate of a particle in `f32`.
pub const LARGEST: f32 = 1e30;

/// Particles that one task of a parallel batch moves.
const TASK: usize = 1024;

/// All crossings of the segment from `from` to `to` in order, found by going through all triangles: the
/// definition of what [`Walker`] reports.
pub fn crossings<G: WalkerGeometry>(
    geometry: &G,
    from: [G::Float; 3],
    to: [G::Float; 3],
) -> Vec<Crossed> {
    let (from, to) = (geometry.scaled(from.map(Into::into)), geometry.scaled(to.map(Into::into)));
    let of = |prim_id: u32| {
        if !geometry.has_area(prim_id) {
            return None;
        }
        let (share, entering) = crossing(from, to, &geometry.corners(prim_id)?)?;
        Some(Crossed { share, prim_id, entering })
    };
    let mut found: Vec<Crossed> = (0..geometry.count() as u32).filter_map(of).collect();
    found.sort_by(|a, b| a.share.total_cmp(&b.share).then(a.prim_id.cmp(&b.prim_id)));
    found
}

/// The end of a segment; `None` if it has none: a length that is negative or NaN, or a coordinate at either end that
/// is NaN or beyond [`WalkerGeometry::LARGEST`] once it is scaled.
///
/// It is computed in `f64` as `from + direction * length` with a rounding for each operation, and in a scene in
/// `f32` rounded to `f32` then (the product is exact there).
#[inline(always)]
pub fn end_of<G: WalkerGeometry>(
    geometry: &G,
    from: [G::Float; 3],
    direction: [G::Float; 3],
    length: G::Float,
) -> Option<[G::Float; 3]> {
    let (to, valid) = end_or_not(geometry, from, direction, length);
    (valid & fits(geometry, from)).then_some(to)
}

/// The same, and whether it is one, if the segment begins at a point that [`fits`]: as a pair, which stays in registers.
#[inline(always)]
fn end_or_not<G: WalkerGeometry>(
    geometry: &G,
    from: [G::Float; 3],
    direction: [G::Float; 3],
    length: G::Float,
) -> ([G::Float; 3], bool) {
    let end = |a: usize| G::Float::rounded(from[a].into() + direction[a].into() * length.into());
    let to = [end(0), end(1), end(2)];
    (to, (length.into() >= 0.0) & fits(geometry, to))
}

/// True if a point is one, and not too far away.
#[inline(always)]
fn fits<G: WalkerGeometry>(geometry: &G, point: [G::Float; 3]) -> bool {
    let [x, y, z] = geometry.scaled(point.map(Into::into));
    (x.abs() <= G::LARGEST) & (y.abs() <= G::LARGEST) & (z.abs() <= G::LARGEST)
}

/// Particles in a scene of triangles.
///
/// Positions are `f32`, or `f64` over a [`DoubleGeometry`](crate::double::DoubleGeometry). A segment leads from where its particle is to [`end_of`] its direction and
/// length; what it crosses is what [`crossings`] says about these two points, whatever the level, the
/// number of threads and the other particles. On which sides a triangle can be hit does not matter, and
/// triangles without area are never met.
///
/// A particle that is stopped stands where the segment crosses the triangle, rounded, and its next segment
/// passes this triangle without a further event, to either side.
pub struct Walker<'a, F = NoFilter, G: WalkerGeometry = Geometry> {
    caster: BatchCaster<'a>,
    filter: F,
    tree: &'a G::Tree,
    geometry: &'a G,
    positions: Vec<[G::Float; 3]>,
    /// The triangle at which each particle was stopped, which its next segment passes; `u32::MAX` for
    /// none.
    stopped: Vec<u32>,
}

impl<'a, G: WalkerGeometry> Walker<'a, NoFilter, G> {
    /// Particles at these positions, moved at the best level of this machine on all threads of the
    /// current rayon pool. `tree` must have been built over `geometry`.
    ///
    /// # Errors
    /// [`PointError::NotTriangles`] if a leaf of the tree holds anything but triangles.
    pub fn new(
        tree: &'a G::Tree,
        geometry: &'a G,
        positions: Vec<[G::Float; 3]>,
    ) -> Result<Self, PointError> {
        let wide = G::wide(tree);
        if wide.has_shapes() {
            return Err(PointError::NotTriangles);
        }
        let stopped = vec![u32::MAX; positions.len()];
        let caster = BatchCaster::new(wide, geometry.of_kernels());
        Ok(Walker { caster, filter: NoFilter, tree, geometry, positions, stopped })
    }
}

impl<'a, F: CrossingFilter, G: WalkerGeometry> Walker<'a, F, G> {
    /// The same with a filter that decides which crossings count: a closure of the particle's index and the
    /// crossing, or [`Masks`].
    pub fn with_filter<H: CrossingFilter>(self, filter: H) -> Walker<'a, H, G> {
        let Walker { caster, tree, geometry, positions, stopped, .. } = self;
        Walker { caster, filter, tree, geometry, positions, stopped }
    }

    /// The same with another level, or `None` if this machine lacks it.
    pub fn with_level(self, level: Level) -> Option<Self> {
        Some(Walker { caster: self.caster.with_level(level)?, ..self })
    }

    /// The same on the calling thread only (`1`) or on the current rayon pool (`0`).
    pub fn with_threads(self, threads: usize) -> Self {
        Walker { caster: self.caster.with_threads(threads), ..self }
    }

    /// Where the particles are.
    pub fn positions(&self) -> &[[G::Float; 3]] {
        &self.positions
    }

    /// The triangle at which each particle was stopped by its last segment; `u32::MAX` for none.
    pub fn stopped_at(&self) -> &[u32] {
        &self.stopped
    }

    /// The same with particles that were stopped before, as [`Walker::stopped_at`] said: where a walk goes
    /// on.
    ///
    /// # Panics
    /// If there are not as many as particles.
    pub fn with_stopped(self, stopped: Vec<u32>) -> Self {
        assert!(stopped.len() == self.positions.len(), "one entry a particle");
        Walker { stopped, ..self }
    }

    /// Puts particles elsewhere, as many as there were; none of them is stopped there.
    ///
    /// # Panics
    /// If there are more or fewer.
    pub fn set_positions(&mut self, positions: &[[G::Float; 3]]) {
        self.positions.copy_from_slice(positions);
        self.stopped.fill(u32::MAX);
    }

    /// The leaves in which the particles are; `None` outside of the tree's box.
    pub fn cells(&self) -> Vec<Option<Cell>> {
        let Ok(queries) = PointQueries::new(self.tree, self.geometry) else {
            return vec![None; self.positions.len()];
        };
        let points: Vec<[f64; 3]> = self.positions.iter().map(|p| p.map(Into::into)).collect();
        queries.with_threads(self.caster.threads()).locate(&points)
    }

    /// Moves each particle along one segment: a direction, which need not be normalised, and a length in
    /// lengths of the direction.
    ///
    /// # Panics
    /// If there are more or fewer directions or lengths than particles.
    pub fn advance(
        &mut self,
        directions: &[[G::Float; 3]],
        lengths: &[G::Float],
        encounter: Encounter,
    ) -> Events<G::Float> {
        let offsets: Vec<usize> = (0..=self.positions.len()).collect();
        self.run(&offsets, directions, lengths, encounter)
    }

    /// Moves particle `i` along the segments `offsets[i]..offsets[i + 1]`, one after the other, each from
    /// where the one before ended.
    ///
    /// # Panics
    /// If there is not one offset more than particles, if they descend or lead beyond the segments, or if
    /// there are not as many directions as lengths.
    pub fn run(
        &mut self,
        offsets: &[usize],
        directions: &[[G::Float; 3]],
        lengths: &[G::Float],
        encounter: Encounter,
    ) -> Events<G::Float> {
        let n = self.positions.len();
        assert!(offsets.len() == n + 1 && offsets.is_sorted(), "one row a particle");
        assert!(directions.len() == lengths.len(), "one length a direction");
        assert!(offsets[n] <= lengths.len(), "rows lie within the segments");
        let mut walked = vec![0u32; n];
        let serial = self.caster.threads() == 1 || n <= TASK;
        let task = if serial { n.max(1) } else { TASK };
        let (caster, geometry, filter) =
            (self.caster, self.geometry, &self.filter as &dyn CrossingFilter);
        let parts = self.positions.chunks_mut(task).zip(self.stopped.chunks_mut(task));
        let parts = parts.zip(walked.chunks_mut(task)).enumerate();
        let tasks: Vec<Lists<'_, G>> = parts
            .map(|(i, ((positions, stopped), walked))| {
                let rows = &offsets[i * task..=i * task + positions.len()];
                let state = (positions, stopped, walked);
                let segments = (directions, lengths);
                Lists::new(geometry, rows, segments, state, encounter, (filter, i * task))
            })
            .collect();
        let run = |lists: Lists<'_, G>| G::walk(&caster, lists);
        let parts: Vec<Part<G::Float>> = if serial {
            tasks.into_iter().map(run).collect()
        } else {
            tasks.into_par_iter().map(run).collect()
        };
        gather(&parts, task, walked)
    }
}

/// The rows of all tasks.
fn gather<T: Float>(parts: &[Part<T>], task: usize, walked: Vec<u32>) -> Events<T> {
    let total = parts.iter().map(|((records, _), _)| records.len()).sum();
    let mut events = Events {
        offsets: vec![0; walked.len() + 1],
        segment: vec![0; total],
        t: vec![T::default(); total],
        prim_id: vec![0; total],
        entering: vec![false; total],
        walked,
        invalid: parts.iter().map(|((_, invalid), _)| invalid).sum(),
        report: parts.iter().fold(WalkReport::default(), |sum, (_, report)| sum + *report),
    };
    let all = || {
        parts.iter().enumerate().flat_map(move |(i, ((records, _), _))| {
            records.iter().map(move |record| (i * task + record.particle as usize, record))
        })
    };
    for (particle, _) in all() {
        events.offsets[particle + 1] += 1;
    }
    for i in 1..events.offsets.len() {
        events.offsets[i] += events.offsets[i - 1];
    }
    // Records come as segments are answered, those of a segment together: a particle's are almost in order.
    let mut next = events.offsets.clone();
    for (particle, record) in all() {
        let (first, mut at) = (events.offsets[particle], next[particle]);
        next[particle] += 1;
        while at > first && events.segment[at - 1] > record.segment {
            events.segment[at] = events.segment[at - 1];
            events.t[at] = events.t[at - 1];
            events.prim_id[at] = events.prim_id[at - 1];
            events.entering[at] = events.entering[at - 1];
            at -= 1;
        }
        events.segment[at] = record.segment;
        events.t[at] = record.t;
        events.prim_id[at] = record.hit.prim_id;
        events.entering[at] = record.hit.entering;
    }
    events
}
