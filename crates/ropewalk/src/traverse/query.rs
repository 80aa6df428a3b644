//! What a walk looks for.

use crate::ray::Hit;

/// A question asked along a ray. A walk offers hits in any order and asks after each leaf whether
/// it may stop.
pub trait Query: Default {
    /// What the query returns.
    type Answer;
    /// Takes note of a hit.
    fn offer(&mut self, hit: Hit);
    /// True once nothing at a parameter greater than `t` can change the answer.
    fn done_at(&self, t: f64) -> bool;
    /// The answer.
    fn answer(self) -> Self::Answer;
}

/// The first hit: smallest `t`, and at equal `t` the lowest primitive.
#[derive(Clone, Copy, Debug, Default)]
pub struct ClosestHit {
    best: Option<Hit>,
}

impl Query for ClosestHit {
    type Answer = Option<Hit>;

    #[inline]
    fn offer(&mut self, hit: Hit) {
        if self.best.is_none_or(|best| hit.is_before(&best)) {
            self.best = Some(hit);
        }
    }

    #[inline]
    fn done_at(&self, t: f64) -> bool {
        self.best.is_some_and(|best| f64::from(best.t) < t)
    }

    fn answer(self) -> Option<Hit> {
        self.best
    }
}

/// Whether anything is hit at all.
#[derive(Clone, Copy, Debug, Default)]
pub struct Occluded {
    found: bool,
}

impl Query for Occluded {
    type Answer = bool;

    #[inline]
    fn offer(&mut self, _hit: Hit) {
        self.found = true;
    }

    #[inline]
    fn done_at(&self, _t: f64) -> bool {
        self.found
    }

    fn answer(self) -> bool {
        self.found
    }
}
