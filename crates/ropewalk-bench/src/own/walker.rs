//! Walks with only the next segment of each particle known.

use super::wave::Wave;
use crate::answer::BenchHit;
use crate::harness::{Engine, Family};
use crate::workload::Question;
use ropewalk::Ray;
use ropewalk::kernel::{Arrival, Particle, WalkReport, prefetch};

/// The same tree as [`Wave`]; a segment is looked at only when the one before it is answered.
pub struct Walker(pub Wave);

/// A chain of segments, asked for one at a time.
struct Chain<'a> {
    segments: std::slice::Iter<'a, Ray>,
    answers: std::slice::IterMut<'a, BenchHit>,
}

impl Particle for Chain<'_> {
    #[inline(always)]
    fn next(&mut self, before: Option<Arrival>) -> Option<Ray> {
        if let Some(Arrival { t, prim_id }) = before
            && let Some(answer) = self.answers.next()
        {
            *answer = BenchHit { t, prim: prim_id };
        }
        self.segments.next().copied()
    }

    #[inline(always)]
    fn wait(&self) {
        // What comes later is not read, but its memory is asked for.
        for segment in self.segments.as_slice().iter().take(6).step_by(2) {
            prefetch(segment);
        }
        if let Some(answer) = self.answers.as_slice().first() {
            prefetch(answer);
        }
    }
}

impl Walker {
    /// The nearest hits of chains of segments, each of which begins where `chains` says.
    pub fn follow(&self, rays: &[Ray], chains: &[u32], out: &mut [BenchHit]) -> WalkReport {
        let (mut rest, mut hits) = (rays, out);
        let mut particles = Vec::with_capacity(chains.len());
        for (i, &from) in chains.iter().enumerate() {
            let end = chains.get(i + 1).map_or(rays.len(), |&to| to as usize);
            let (segments, behind) = rest.split_at(end - from as usize);
            let (answers, others) = hits.split_at_mut(segments.len());
            particles.push(Chain { segments: segments.iter(), answers: answers.iter_mut() });
            (rest, hits) = (behind, others);
        }
        self.0.caster().walk(&mut particles)
    }
}

impl Engine for Walker {
    fn name(&self) -> String {
        "ropewalk-walker".into()
    }

    fn family(&self) -> Family {
        Family::Own
    }

    fn level(&self) -> &str {
        self.0.level()
    }

    fn supports(&self, question: Question) -> bool {
        question == Question::Walk
    }

    fn walk(&self, rays: &[Ray], chains: &[u32], out: &mut [BenchHit]) {
        self.follow(rays, chains, out);
    }
}
