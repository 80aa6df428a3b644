//! What the harness asks of an engine.

use crate::answer::{BenchHit, HitLists};
use crate::workload::{Question, Workload};
use ropewalk::Ray;

/// Who an entry point belongs to, for the ratios.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Embree as it comes; the ratios are against the best of these.
    Embree,
    /// Embree with its robust flag.
    EmbreeRobust,
    /// Another peer.
    Peer,
    /// Ropewalk.
    Own,
}

/// One way to ask an engine. An engine with several entry points is several of these over the
/// same tree.
///
/// A method is called only for questions that [`Engine::supports`] affirms; the defaults of the
/// others are never reached.
pub trait Engine: Sync {
    /// Name in the record, such as `embree-16`.
    fn name(&self) -> String;

    /// Whose it is.
    fn family(&self) -> Family;

    /// The SIMD level it runs at, as far as known.
    fn level(&self) -> &str {
        ""
    }

    /// Whether it answers this question.
    fn supports(&self, question: Question) -> bool;

    /// The nearest hit of each ray.
    fn closest(&self, _rays: &[Ray], _out: &mut [BenchHit]) {
        unreachable!("{} does not answer closest hits", self.name())
    }

    /// Whether each ray hits anything.
    fn occluded(&self, _rays: &[Ray], _out: &mut [bool]) {
        unreachable!("{} does not answer occlusion", self.name())
    }

    /// The hits of each ray in order, none twice; at most `limit` of each. Written over what `out` holds.
    fn hits(&self, _rays: &[Ray], _limit: usize, _out: &mut HitLists) {
        unreachable!("{} does not answer all hits", self.name())
    }

    /// The nearest hit of segments; `chains` says where segments begin that continue each other.
    fn walk(&self, rays: &[Ray], _chains: &[u32], out: &mut [BenchHit]) {
        self.closest(rays, out);
    }
}

/// A way to build, timed by the workload `build`.
pub trait Builder {
    /// Name in the record.
    fn name(&self) -> String;

    /// Whose it is.
    fn family(&self) -> Family;

    /// False if it builds with one thread only.
    fn is_parallel(&self) -> bool {
        true
    }

    /// Builds once with `threads` threads, drops the result, and says how large it was.
    ///
    /// # Errors
    /// What the engine says, or that it cannot build with so many threads.
    fn build(&self, threads: usize) -> anyhow::Result<Built>;
}

/// What a build was.
#[derive(Clone, Copy, Debug)]
pub struct Built {
    /// Thread CPU seconds with one thread, else wall seconds; the copy of the input left out.
    pub seconds: f64,
    /// Wall seconds.
    pub wall_seconds: f64,
    /// Bytes of the tree with its own copy of the triangles, where it is known.
    pub bytes: Option<usize>,
}

/// The answers of an engine to a workload.
#[derive(Clone, Debug, PartialEq)]
pub enum Answers {
    /// Nearest hits.
    Closest(Vec<BenchHit>),
    /// Occlusion.
    Occluded(Vec<bool>),
    /// Hits in order.
    Hits(HitLists),
}

impl Answers {
    /// Room for the answers to a workload.
    pub fn for_workload(work: &Workload) -> Answers {
        match work.kind.question() {
            Question::Closest | Question::Walk | Question::Build => {
                Answers::Closest(vec![BenchHit::MISS; work.rays.len()])
            }
            Question::Occluded => Answers::Occluded(vec![false; work.rays.len()]),
            Question::AllHits | Question::FirstHits(_) => Answers::Hits(HitLists::new()),
        }
    }

    /// Lets an engine answer a workload in the calling thread.
    pub fn fill(&mut self, engine: &dyn Engine, work: &Workload) {
        match (self, work.kind.question()) {
            (Answers::Closest(out), Question::Closest) => engine.closest(&work.rays, out),
            (Answers::Closest(out), _) => engine.walk(&work.rays, &work.chains, out),
            (Answers::Occluded(out), _) => engine.occluded(&work.rays, out),
            (Answers::Hits(out), Question::FirstHits(k)) => engine.hits(&work.rays, k, out),
            (Answers::Hits(out), _) => engine.hits(&work.rays, usize::MAX, out),
        }
    }

    /// The answer for one ray.
    pub fn of(&self, ray: usize) -> Answer {
        match self {
            Answers::Closest(hits) => Answer::Closest(hits[ray]),
            Answers::Occluded(flags) => Answer::Occluded(flags[ray]),
            Answers::Hits(lists) => Answer::Hits(lists.of(ray)),
        }
    }
}

/// The answer for one ray.
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// Nearest hit.
    Closest(BenchHit),
    /// Occlusion.
    Occluded(bool),
    /// Hits in order.
    Hits(Vec<BenchHit>),
}
