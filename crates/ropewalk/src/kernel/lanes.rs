//! Particles in lanes: one in each slot of a wave, of which only the next segment is known.
//!
//! ```text
//! a slot is free: its particle takes one segment after the other
//!     nothing is near one     the particle goes on at once
//!     else                    the segment is walked from its entry, and others come in turn
//! until the particle has no more; then the next one takes its place
//! ```
//! Each lane keeps the path to where its particle is, so that particles do not lead each other away.

#![allow(unsafe_code)]

use super::entry::Path;
use super::events::Events;
use super::level::Simd;
use super::query::BatchQuery;
use super::source::Source;
use super::wave::WAVE;
use crate::ray::Ray;
use crate::wide::WideTree;

/// What is known about the last segment of a lane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Before {
    /// There was none.
    Nothing,
    /// It hits nothing.
    Missed,
    /// The query has its answer.
    Answered,
}

/// The particles of a batch.
pub trait Crowd<Q: BatchQuery> {
    /// The next segment in a lane, whose particle may be another than before; `None` once there are no
    /// more particles.
    fn advance(&mut self, k: usize, query: &mut Q, before: Before) -> Option<Ray>;

    /// The segment in a lane has been put under way, and others come first.
    #[inline(always)]
    fn wait(&mut self, _k: usize) {}
}

/// How the segments of a batch went.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WalkReport {
    /// Segments.
    pub segments: u64,
    /// Of these, segments whose entries were searched for; the others started at the root.
    pub searched: u64,
    /// Of these, segments near which there is nothing: no step, no test.
    pub clear: u64,
}

impl std::ops::Add for WalkReport {
    type Output = WalkReport;

    fn add(self, other: WalkReport) -> WalkReport {
        WalkReport {
            segments: self.segments + other.segments,
            searched: self.searched + other.searched,
            clear: self.clear + other.clear,
        }
    }
}

/// So many segments are searched for before it is asked whether that pays.
const TRIED: u32 = 256;

/// If it does not, so many start at the root before it is tried again.
const ROOTED: u32 = 4096;

/// The share of [`TRIED`] that the search must answer, as for batches of rays.
const WORTHWHILE: f64 = 0.4;

/// Whether entries are searched for, as far as that has paid.
pub struct Trial {
    /// True if there is anything to search.
    possible: bool,
    searching: bool,
    /// Segments since it was last decided whether to search.
    tried: u32,
    /// Of these, segments that the search answered.
    cleared: u32,
    report: WalkReport,
}

impl Trial {
    /// They are searched for at first, where that is possible.
    pub fn new(possible: bool) -> Trial {
        let report = WalkReport::default();
        Trial { possible, searching: possible, tried: 0, cleared: 0, report }
    }

    /// True if the next segments are searched for.
    #[inline(always)]
    pub fn searching(&self) -> bool {
        self.searching
    }

    /// How the segments went.
    pub fn report(&self) -> WalkReport {
        self.report
    }

    /// Takes note of some segments, of which the search answered `clear`.
    #[inline(always)]
    pub fn note(&mut self, tried: u32, clear: u32) {
        self.report.segments += u64::from(tried);
        self.report.searched += u64::from(if self.searching { tried } else { 0 });
        self.report.clear += u64::from(clear);
        self.tried += tried;
        self.cleared += clear;
        if self.tried >= if self.searching { TRIED } else { ROOTED } {
            self.decide();
        }
    }

    /// Decides whether the next segments are searched for.
    #[cold]
    fn decide(&mut self) {
        let pays = f64::from(self.cleared) >= WORTHWHILE * f64::from(self.tried);
        self.searching = self.possible && (!self.searching || pays);
        (self.tried, self.cleared) = (0, 0);
    }
}

/// The particles of a crowd, one in each slot.
pub struct Lanes<C> {
    crowd: C,
    rays: [Ray; WAVE],
    before: [Before; WAVE],
    /// The way to each lane's particle; none where the tree is a leaf.
    paths: Vec<Path>,
    trial: Trial,
}

impl<C> Lanes<C> {
    /// Lanes for a wave of `width` slots, over a tree.
    pub fn new(tree: &WideTree, width: usize, crowd: C) -> Self {
        let path = || Path::new(tree);
        let paths: Vec<Path> = (0..width.min(WAVE)).map_while(|_| path()).collect();
        Lanes {
            crowd,
            rays: [Ray::new([0.0; 3], [1.0, 0.0, 0.0]); WAVE],
            before: [Before::Nothing; WAVE],
            trial: Trial::new(!paths.is_empty()),
            paths,
        }
    }

    /// The crowd, and how its segments went.
    pub fn into_parts(self) -> (C, WalkReport) {
        (self.crowd, self.trial.report())
    }
}

impl<Q: BatchQuery, C: Crowd<Q>> Source<Q> for Lanes<C> {
    const WAITS: bool = true;

    #[inline(always)]
    fn rays(&self) -> &[Ray] {
        &self.rays
    }

    #[inline(always)]
    unsafe fn next<L: Simd, E: Events>(
        &mut self,
        k: usize,
        tree: &WideTree,
        query: &mut Q,
        events: &mut E,
    ) -> Option<(usize, u32)> {
        let mut before = self.before[k];
        let (mut tried, mut clear) = (0, 0);
        let next = loop {
            let Some(ray) = self.crowd.advance(k, query, before) else { break None };
            tried += 1;
            // SAFETY: passed on to the caller.
            unsafe { L::put(&mut self.rays[k], &ray) };
            let mut code = tree.root();
            if self.trial.searching() {
                // SAFETY: passed on to the caller; the path is that of the tree.
                match unsafe { self.paths[k].enter::<L, E>(tree, &self.rays[k], events) } {
                    Some(entry) => code = entry,
                    None => {
                        clear += 1;
                        before = Before::Missed;
                        continue;
                    }
                }
            }
            self.before[k] = Before::Answered;
            self.crowd.wait(k);
            break Some((k, code));
        };
        self.trial.note(tried, clear);
        next
    }
}
