//! The same rays answered by any method: counted, timed, compared.

use rayon::prelude::*;
use ropewalk::traverse::{Counters, Counts, LeafId, NoCounts, RayCaster};
use ropewalk_render::{RayKind, RecordedRay};
use std::hint::black_box;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Rays that one task answers before it looks whether it should stop.
const CHUNK: usize = 4096;

/// What a ray was told: `(t, primitive)` of the first hit, or for a shadow ray whether it is blocked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Answer {
    /// The first hit.
    FirstHit(Option<(f32, u32)>),
    /// Anything in the way of a shadow ray.
    Blocked(bool),
}

impl Answer {
    fn of<A: RayCaster, C: Counters>(
        caster: &A,
        ray: &RecordedRay,
        start: Option<LeafId>,
        counters: &mut C,
    ) -> Self {
        if ray.kind == RayKind::Shadow {
            Answer::Blocked(caster.occluded_from(&ray.ray, start, counters))
        } else {
            let (hit, _) = caster.closest_hit_from(&ray.ray, start, counters);
            Answer::FirstHit(hit.map(|hit| (hit.t, hit.prim_id)))
        }
    }

    /// A number that differs, with near certainty, where the answer or the ray does.
    fn digest(self, ray: usize) -> u64 {
        let bits = match self {
            Answer::FirstHit(None) => 0,
            Answer::FirstHit(Some((t, prim))) => {
                (u64::from(t.to_bits()) << 32 | u64::from(prim)).wrapping_add(3)
            }
            Answer::Blocked(blocked) => 1 + u64::from(blocked),
        };
        // The finaliser of SplitMix64 (Steele, Lea, Flood 2014).
        let mut x = bits ^ (ray as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    }
}

impl std::fmt::Display for Answer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Answer::FirstHit(None) => f.write_str("no hit"),
            Answer::FirstHit(Some((t, prim))) => write!(f, "primitive {prim} at t = {t:e}"),
            Answer::Blocked(true) => f.write_str("blocked"),
            Answer::Blocked(false) => f.write_str("not blocked"),
        }
    }
}

/// Counted events of many rays, and a digest of all their answers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Events.
    pub counts: Counts,
    /// Equal where all answers are equal.
    pub digest: u64,
}

/// Rays with the leaves in which they start, as far as these are known.
#[derive(Clone, Copy)]
pub struct Replay<'a> {
    rays: &'a [RecordedRay],
    starts: &'a [Option<LeafId>],
}

impl<'a> Replay<'a> {
    /// All rays enter at the root.
    pub fn from_root(rays: &'a [RecordedRay]) -> Self {
        Replay { rays, starts: &[] }
    }

    /// Ray `i` starts in leaf `starts[i]`.
    pub fn from_leaves(rays: &'a [RecordedRay], starts: &'a [Option<LeafId>]) -> Self {
        Replay { rays, starts }
    }

    fn start(&self, ray: usize) -> Option<LeafId> {
        self.starts.get(ray).copied().flatten()
    }

    /// Answers all rays on the threads of the current pool; the sums do not depend on their number.
    /// `None` once `cancel` is set.
    pub fn tally<A: RayCaster>(&self, caster: &A, cancel: &AtomicBool) -> Option<Tally> {
        let chunk_tally = |(chunk, rays): (usize, &[RecordedRay])| {
            if cancel.load(Ordering::Relaxed) {
                return None;
            }
            let mut tally = Tally::default();
            for (i, ray) in rays.iter().enumerate() {
                let index = chunk * CHUNK + i;
                let answer = Answer::of(caster, ray, self.start(index), &mut tally.counts);
                tally.digest = tally.digest.wrapping_add(answer.digest(index));
            }
            Some(tally)
        };
        let tallies = self.rays.par_chunks(CHUNK).enumerate().map(chunk_tally);
        tallies.try_reduce(Tally::default, |a, b| {
            let mut counts = a.counts;
            counts += b.counts;
            Some(Tally { counts, digest: a.digest.wrapping_add(b.digest) })
        })
    }

    /// All answers, in the order of the rays.
    pub fn answers<A: RayCaster>(&self, caster: &A) -> Vec<Answer> {
        let rays = self.rays.par_iter().enumerate();
        rays.map(|(i, ray)| Answer::of(caster, ray, self.start(i), &mut NoCounts)).collect()
    }

    /// Seconds that one thread takes to answer all rays.
    pub fn seconds<A: RayCaster>(&self, caster: &A) -> f64 {
        let begin = Instant::now();
        for (i, ray) in self.rays.iter().enumerate() {
            black_box(Answer::of(caster, ray, self.start(i), &mut NoCounts));
        }
        begin.elapsed().as_secs_f64()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ropewalk::{Hit, Ray};

    /// Hits where the origin's x is positive, with one test a ray.
    struct HalfSpace;

    impl RayCaster for HalfSpace {
        fn closest_hit<C: Counters>(&self, ray: &Ray, counters: &mut C) -> Option<Hit> {
            counters.intersection_test();
            (ray.origin[0] > 0.0).then_some(Hit { t: ray.origin[0], prim_id: 7, u: 0.0, v: 0.0 })
        }

        fn occluded<C: Counters>(&self, ray: &Ray, counters: &mut C) -> bool {
            counters.intersection_test();
            ray.origin[0] > 0.0
        }
    }

    fn rays(count: usize) -> Vec<RecordedRay> {
        let ray = |i| RecordedRay {
            ray: Ray::new([(i % 3) as f32, 0.0, 0.0], [1.0, 0.0, 0.0]),
            kind: RayKind::ALL[i % 4],
        };
        (0..count).map(ray).collect()
    }

    #[test]
    fn tallies_do_not_depend_on_the_number_of_threads() {
        let rays = rays(3 * CHUNK + 17);
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| Replay::from_root(&rays).tally(&HalfSpace, &AtomicBool::new(false)))
                .unwrap()
        };
        assert_eq!(run(1).counts.intersection_tests, rays.len() as u64);
        assert_eq!(run(1), run(3));
        assert_eq!(Replay::from_root(&rays).tally(&HalfSpace, &AtomicBool::new(true)), None);
    }

    #[test]
    fn a_digest_tells_answers_and_rays_apart() {
        let all = [
            Answer::FirstHit(None),
            Answer::FirstHit(Some((0.0, 0))),
            Answer::FirstHit(Some((0.0, 1))),
            Answer::FirstHit(Some((-0.0, 1))),
            Answer::FirstHit(Some((f32::from_bits(1), 1))),
            Answer::Blocked(false),
            Answer::Blocked(true),
        ];
        let mut digests: Vec<_> =
            (0..100).flat_map(|ray| all.iter().map(move |a| a.digest(ray))).collect();
        digests.sort_unstable();
        digests.dedup();
        assert_eq!(digests.len(), 100 * all.len());
    }

    /// Answers with the leaf in which the ray is said to start.
    struct TellsStart;

    impl RayCaster for TellsStart {
        fn closest_hit<C: Counters>(&self, _: &Ray, _: &mut C) -> Option<Hit> {
            None
        }

        fn occluded<C: Counters>(&self, _: &Ray, _: &mut C) -> bool {
            false
        }

        fn closest_hit_from<C: Counters>(
            &self,
            _: &Ray,
            start: Option<LeafId>,
            _: &mut C,
        ) -> (Option<Hit>, Option<LeafId>) {
            (start.map(|leaf| Hit { t: 1.0, prim_id: leaf.0, u: 0.0, v: 0.0 }), None)
        }
    }

    #[test]
    fn every_ray_gets_its_own_start() {
        let rays = rays(3);
        let starts = [None, Some(LeafId(4)), Some(LeafId(5))];
        let first = |prim| Answer::FirstHit(Some((1.0, prim)));
        let none = Answer::FirstHit(None);
        let replay = Replay::from_leaves(&rays, &starts);
        assert_eq!(replay.answers(&TellsStart), [none, first(4), first(5)]);
        assert_eq!(Replay::from_root(&rays).answers(&TellsStart), [none; 3]);
        assert!(replay.seconds(&TellsStart) >= 0.0);
    }
}
