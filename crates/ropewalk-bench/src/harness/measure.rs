//! Interleaved rounds.

use super::clock::Clock;
use super::engine::{Answers, Builder, Engine, Family};
use super::statistics::Spread;
use crate::workload::Workload;
use rayon::ThreadPool;
use rayon::prelude::*;

/// How much time may be spent.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    /// Rounds of each engine on each workload.
    pub rounds: usize,
    /// An engine that needs longer for a round gets a subset of the rays.
    pub seconds_per_round: f64,
    /// The same for peers other than Embree.
    pub peer_seconds: f64,
    /// Builds stop after so many seconds for an engine, but not before the third.
    pub build_seconds: f64,
}

impl Budget {
    /// The benchmark proper.
    pub const FULL: Budget =
        Budget { rounds: 7, seconds_per_round: 2.0, peer_seconds: 0.4, build_seconds: 30.0 };
    /// For trying out.
    pub const QUICK: Budget =
        Budget { rounds: 3, seconds_per_round: 0.3, peer_seconds: 0.1, build_seconds: 1.0 };
}

/// A measured rate in millions of rays (or triangles built) per second.
#[derive(Clone, Copy, Debug)]
pub struct Rate {
    /// By thread CPU time with one thread, by wall time with more.
    pub spread: Spread,
    /// Median by wall time.
    pub wall_median: f64,
}

/// Rays of a piece that one thread takes at a time; a multiple of a walker's segments.
const PIECE: usize = 16_384;
/// Blocks of rays that calibration times.
const CALIBRATION_BLOCKS: usize = 4;

/// The stride of the subset with which a round stays within the budget; 1 for all rays.
pub fn calibrate(engine: &dyn Engine, work: &Workload, budget: &Budget) -> usize {
    let blocks = work.rays.len().div_ceil(1024).max(1);
    let sample = work.subset((blocks / CALIBRATION_BLOCKS).max(1));
    let mut answers = Answers::for_workload(&sample);
    let clock = Clock::start();
    answers.fill(engine, &sample);
    let per_ray = clock.elapsed().0 / sample.rays.len().max(1) as f64;
    let seconds = match engine.family() {
        Family::Peer => budget.peer_seconds,
        _ => budget.seconds_per_round,
    };
    let strides = (per_ray * work.rays.len() as f64 / seconds).ceil() as usize;
    strides.clamp(1, blocks)
}

/// Rates of engines, each on its own rays, in `rounds` rounds. Each round asks all engines in
/// turn and begins with another one, so that a slow spell of the machine strikes all alike.
pub fn rates(
    engines: &[(&dyn Engine, &Workload)],
    rounds: usize,
    pool: Option<&ThreadPool>,
) -> Vec<Option<Rate>> {
    let mut prepared: Vec<Vec<(Workload, Answers)>> = engines
        .iter()
        .map(|(_, work)| {
            let pieces = if pool.is_some() { pieces(work) } else { vec![(*work).clone()] };
            pieces.into_iter().map(with_room).collect()
        })
        .collect();
    let mut samples = vec![(Vec::new(), Vec::new()); engines.len()];
    for round in 0..rounds {
        for k in 0..engines.len() {
            let at = (k + round) % engines.len();
            let (engine, work) = engines[at];
            let clock = Clock::start();
            match pool {
                None => prepared[at].iter_mut().for_each(|(w, a)| a.fill(engine, w)),
                Some(pool) => pool.install(|| {
                    prepared[at].par_iter_mut().for_each(|(w, a)| a.fill(engine, w));
                }),
            }
            let (cpu, wall) = clock.elapsed();
            let seconds = if pool.is_some() { wall } else { cpu };
            samples[at].0.push(work.rays.len() as f64 * 1e-6 / seconds);
            samples[at].1.push(work.rays.len() as f64 * 1e-6 / wall);
        }
    }
    samples.iter().map(|(own, wall)| rate(own, wall)).collect()
}

fn with_room(work: Workload) -> (Workload, Answers) {
    let answers = Answers::for_workload(&work);
    (work, answers)
}

fn rate(own: &[f64], wall: &[f64]) -> Option<Rate> {
    Some(Rate { spread: Spread::of(own)?, wall_median: Spread::of(wall)?.median })
}

/// The workload cut into pieces of [`PIECE`] rays, chains included.
fn pieces(work: &Workload) -> Vec<Workload> {
    let cut = |(i, rays): (usize, &[ropewalk::Ray])| {
        let (from, to) = ((i * PIECE) as u32, (i * PIECE + rays.len()) as u32);
        let mut chains: Vec<u32> = Vec::new();
        if !work.chains.is_empty() {
            chains.push(0);
            let inside = work.chains.iter().filter(|&&c| from < c && c < to);
            chains.extend(inside.map(|c| c - from));
        }
        Workload { kind: work.kind, rays: rays.to_vec(), chains }
    };
    work.rays.chunks(PIECE).enumerate().map(cut).collect()
}

/// What the builds of one builder gave: rate in triangles, and bytes; or why there are none.
pub type BuildResult = anyhow::Result<(Rate, Option<usize>)>;

/// Rates of builders in interleaved rounds, in millions of triangles per second.
pub fn build_rates(
    builders: &[Box<dyn Builder + '_>],
    triangles: usize,
    threads: usize,
    budget: &Budget,
) -> Vec<BuildResult> {
    let mega = triangles as f64 * 1e-6;
    let mut runs: Vec<anyhow::Result<Vec<_>>> = builders.iter().map(|_| Ok(Vec::new())).collect();
    for round in 0..budget.rounds {
        for (builder, run) in builders.iter().zip(&mut runs) {
            let Ok(done) = run else { continue };
            let spent: f64 = done.iter().map(|b: &super::Built| b.wall_seconds).sum();
            if round >= 3 && spent > budget.build_seconds {
                continue;
            }
            match builder.build(threads) {
                Ok(built) => done.push(built),
                Err(error) => *run = Err(error),
            }
        }
    }
    let finish = |run: anyhow::Result<Vec<super::Built>>| {
        let run = run?;
        let own: Vec<f64> = run.iter().map(|b| mega / b.seconds).collect();
        let wall: Vec<f64> = run.iter().map(|b| mega / b.wall_seconds).collect();
        let rate = rate(&own, &wall).ok_or_else(|| anyhow::anyhow!("no rounds"))?;
        Ok((rate, run[0].bytes))
    };
    runs.into_iter().map(finish).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::answer::BenchHit;
    use crate::workload::{Kind, Question};
    use ropewalk::Ray;
    use std::sync::Mutex;
    use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

    /// Notes who was called when, and takes a while for each ray.
    struct Noting<'a>(char, usize, &'a Mutex<String>, AtomicUsize);

    impl Engine for Noting<'_> {
        fn name(&self) -> String {
            self.0.into()
        }
        fn family(&self) -> Family {
            Family::Own
        }
        fn supports(&self, _: Question) -> bool {
            true
        }
        fn closest(&self, rays: &[Ray], _: &mut [BenchHit]) {
            self.2.lock().unwrap().push(self.0);
            self.3.fetch_add(rays.len(), Relaxed);
            for i in 0..rays.len() * self.1 {
                std::hint::black_box(i);
            }
        }
    }

    fn work(rays: usize) -> Workload {
        let rays = vec![Ray::new([0.0; 3], [1.0, 0.0, 0.0]); rays];
        Workload { kind: Kind::Primary, rays, chains: Vec::new() }
    }

    #[test]
    fn rounds_are_interleaved_and_begin_in_turn() {
        let log = Mutex::new(String::new());
        let [a, b] = ['a', 'b'].map(|c| Noting(c, 1, &log, AtomicUsize::new(0)));
        let work = work(100);
        let rates = rates(&[(&a, &work), (&b, &work)], 3, None);
        assert_eq!(*log.lock().unwrap(), "abbaab");
        assert!(rates.iter().all(|r| r.unwrap().spread.median > 0.0));
    }

    #[test]
    fn pieces_cover_all_rays_once() {
        let log = Mutex::new(String::new());
        let a = Noting('a', 0, &log, AtomicUsize::new(0));
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
        rates(&[(&a, &work(50_000))], 1, Some(&pool));
        assert_eq!(a.3.load(Relaxed), 50_000);
    }

    #[test]
    fn slow_engines_get_a_subset() {
        let log = Mutex::new(String::new());
        let slow = Noting('s', 100_000, &log, AtomicUsize::new(0));
        let fast = Noting('f', 0, &log, AtomicUsize::new(0));
        let (work, budget) = (work(40 * 1024), Budget { seconds_per_round: 0.1, ..Budget::QUICK });
        assert_eq!(calibrate(&fast, &work, &budget), 1);
        assert!(calibrate(&slow, &work, &budget) > 1);
    }
}
