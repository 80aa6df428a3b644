//! What is noted of each ray while a picture is traced.

use crate::ray_counts::{RayCounts, RayKind};
use ropewalk::Ray;
use ropewalk::traverse::{Counters, Counts, NoCounts};

/// Sees each ray before it is cast, lends the counters for its walk, and hears the answer.
pub(crate) trait Observer {
    type Counters: Counters;
    fn cast(&mut self, kind: RayKind, ray: &Ray) -> &mut Self::Counters;
    fn answered(&mut self, kind: RayKind, hit: bool);
}

/// Counters that can be read as [`Counts`] afterwards.
pub(crate) trait Readable: Counters + Default + Copy {
    fn counts(&self) -> Counts;
}

impl Readable for Counts {
    fn counts(&self) -> Counts {
        *self
    }
}

impl Readable for NoCounts {
    fn counts(&self) -> Counts {
        Counts::default()
    }
}

/// Counts rays and, by kind, the events of their walks.
#[derive(Default)]
pub(crate) struct Tally<C> {
    pub rays: RayCounts,
    pub by_kind: [C; 4],
}

impl<C: Readable> Tally<C> {
    /// Events of all rays so far.
    pub fn total(&self) -> Counts {
        self.by_kind.iter().fold(Counts::default(), |mut sum, c| {
            sum += c.counts();
            sum
        })
    }
}

impl<C: Readable> Observer for Tally<C> {
    type Counters = C;

    #[inline]
    fn cast(&mut self, kind: RayKind, _ray: &Ray) -> &mut C {
        &mut self.by_kind[kind.index()]
    }

    #[inline]
    fn answered(&mut self, kind: RayKind, hit: bool) {
        self.rays.record(kind, hit);
    }
}
