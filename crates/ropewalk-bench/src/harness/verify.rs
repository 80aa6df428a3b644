//! Answers are compared before anything is timed. Where engines disagree the oracle decides; a few
//! rays on which all agree are audited as well.

use super::engine::{Answer, Answers, Family};
use super::oracle::{Candidate, Oracle};
use crate::answer::BenchHit;
use crate::workload::{Question, Random, Workload};

/// Relative difference of `t` below which two hits are not worth the oracle's time: 16 roundings
/// in `f32`. Larger differences are not errors yet; the oracle knows each triangle's own bound.
const AGREE: f32 = 16.0 / 16_777_216.0;
/// Disputed rays that go to the oracle, at most; counts are scaled up beyond that.
const MAX_ARBITRATED: usize = 192;
/// Triangle tests the oracle may spend on a workload.
const MAX_TESTS: usize = 200_000_000;
/// Rays without dispute that are audited.
const AUDITED: usize = 8;
/// More wrong answers than this make a row an error. Engines in `f32` decide otherwise than `f64`
/// on 1e-5 to 1e-4 of the rays, mostly within the bound of an edge, which counts as a mismatch and
/// not as wrong. Peers that are not watertight, or whose triangle test is ill-conditioned on
/// slivers, do worse; their share is recorded, and only a share that points to a broken wrapper is
/// an error.
pub fn max_wrong_per_million(family: Family) -> f64 {
    if family == Family::Own { 10.0 } else { 50_000.0 }
}

/// How well an engine answered.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Verdict {
    /// Answers that are not what `f64` arithmetic gives, per million rays.
    pub mismatches_per_million: f64,
    /// Those of them outside the error bound of `f32`, per million rays.
    pub wrong_per_million: f64,
}

/// The answers of one engine to every `stride`-th block of a workload.
pub struct Testimony<'a> {
    /// Its answers, one for each ray of the subset.
    pub answers: &'a Answers,
    /// See [`Workload::subset`].
    pub stride: usize,
}

impl Testimony<'_> {
    /// The answer to a ray of the whole workload, if it is in the subset.
    fn on(&self, ray: usize) -> Option<Answer> {
        Workload::in_subset(ray, self.stride).map(|k| self.answers.of(k))
    }
}

/// A verdict for each engine.
pub fn verify(oracle: &Oracle, faces: usize, work: &Workload, all: &[Testimony]) -> Vec<Verdict> {
    let disputed: Vec<usize> = (0..work.rays.len())
        .filter(|&ray| {
            let mut given = all.iter().filter_map(|e| e.on(ray));
            let Some(first) = given.next() else { return false };
            !given.all(|other| agree(&first, &other))
        })
        .collect();

    let affordable = (MAX_TESTS / faces.max(1)).clamp(8, MAX_ARBITRATED);
    let mut random = Random::new(11);
    let mut sample = disputed.clone();
    random.shuffle(&mut sample);
    sample.truncate(affordable);
    let scale = disputed.len() as f64 / sample.len().max(1) as f64;
    let audits = if work.rays.is_empty() { 0 } else { AUDITED };
    let audited: Vec<usize> = (0..audits).map(|_| random.below(work.rays.len())).collect();

    let mut counts = vec![(0.0, 0.0, 0usize); all.len()];
    for (engine, count) in all.iter().zip(&mut counts) {
        count.2 = (0..work.rays.len())
            .filter(|&r| Workload::in_subset(r, engine.stride).is_some())
            .count();
    }
    let weighted = sample.iter().map(|&r| (r, scale));
    // An audited ray stands for itself alone; a wrong one shows that all engines err together.
    let audits = audited.iter().filter(|r| !disputed.contains(r)).map(|&r| (r, 1.0));
    for (ray, weight) in weighted.chain(audits) {
        let candidates = oracle.candidates(&work.rays[ray]);
        for (engine, count) in all.iter().zip(&mut counts) {
            let Some(given) = engine.on(ray) else { continue };
            count.0 += weight * f64::from(!is_exact(&given, work.kind.question(), &candidates));
            count.1 += weight * f64::from(!is_right(&given, work.kind.question(), &candidates));
        }
    }
    let per_million = |count: f64, rays: usize| count * 1e6 / rays.max(1) as f64;
    counts
        .into_iter()
        .map(|(mismatches, wrong, rays)| Verdict {
            mismatches_per_million: per_million(mismatches, rays),
            wrong_per_million: per_million(wrong, rays),
        })
        .collect()
}

fn agree(a: &Answer, b: &Answer) -> bool {
    match (a, b) {
        (Answer::Closest(a), Answer::Closest(b)) => same_place(a, b),
        (Answer::Occluded(a), Answer::Occluded(b)) => a == b,
        (Answer::Hits(a), Answer::Hits(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| same_place(a, b))
        }
        _ => false,
    }
}

/// Both miss, or both hit at the same `t`; the primitive may then differ.
fn same_place(a: &BenchHit, b: &BenchHit) -> bool {
    a.is_hit() == b.is_hit()
        && (!a.is_hit() || (a.t - b.t).abs() <= AGREE * a.t.abs().max(b.t.abs()))
}

/// Whether an answer is what `f64` gives, up to the rounding of `t`.
fn is_exact(given: &Answer, question: Question, candidates: &[Candidate]) -> bool {
    let hits = || candidates.iter().filter(|c| c.exact);
    let near = |hit: &BenchHit, c: &Candidate| (f64::from(hit.t) - c.t).abs() <= c.t_error;
    match given {
        Answer::Closest(hit) => match hits().next() {
            None => !hit.is_hit(),
            Some(first) => hit.is_hit() && near(hit, first),
        },
        Answer::Occluded(flag) => *flag == hits().next().is_some(),
        Answer::Hits(list) => {
            let wanted = hits().count().min(limit(question));
            list.len() == wanted && list.iter().zip(hits()).all(|(hit, c)| near(hit, c))
        }
    }
}

/// Whether an answer is possible within the error bound.
fn is_right(given: &Answer, question: Question, candidates: &[Candidate]) -> bool {
    let certain = || candidates.iter().filter(|c| c.certain);
    let found = |hit: &BenchHit| {
        candidates
            .iter()
            .find(|c| c.prim == hit.prim)
            .filter(|c| (f64::from(hit.t) - c.t).abs() <= c.t_error)
    };
    match given {
        Answer::Closest(hit) if !hit.is_hit() => certain().next().is_none(),
        Answer::Closest(hit) => {
            found(hit).is_some_and(|c| !certain().any(|n| n.t + n.t_error < c.t - c.t_error))
        }
        Answer::Occluded(true) => !candidates.is_empty(),
        Answer::Occluded(false) => certain().next().is_none(),
        Answer::Hits(list) => {
            let mut ids: Vec<u32> = list.iter().map(|h| h.prim).collect();
            ids.sort_unstable();
            let unique = ids.windows(2).all(|w| w[0] != w[1]);
            let ordered = list.windows(2).all(|w| w[0].t <= w[1].t);
            // A full list may end before a hit; a shorter one may not leave any out.
            let full = list.len() == limit(question);
            let end =
                if full { list.last().map_or(0.0, |h| f64::from(h.t)) } else { f64::INFINITY };
            let complete = certain()
                .filter(|c| c.t + c.t_error < end)
                .all(|c| ids.binary_search(&c.prim).is_ok());
            unique && ordered && complete && list.iter().all(|h| found(h).is_some())
        }
    }
}

fn limit(question: Question) -> usize {
    if let Question::FirstHits(k) = question { k } else { usize::MAX }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::answer::HitLists;
    use crate::scene::Mesh;
    use crate::workload::Kind;
    use ropewalk::Ray;

    /// Three parallel squares, each of two triangles, seen along -z.
    fn squares() -> Mesh {
        let (mut vertices, mut faces) = (Vec::new(), Vec::new());
        for z in [0.0f32, -1.0, -2.0] {
            let base = vertices.len() as u32;
            vertices.extend([[0.0, 0.0, z], [1.0, 0.0, z], [1.0, 1.0, z], [0.0, 1.0, z]]);
            faces.extend([[base, base + 1, base + 2], [base, base + 2, base + 3]]);
        }
        Mesh { name: "squares".into(), vertices, faces }
    }

    fn down(count: usize) -> Vec<Ray> {
        let mut random = Random::new(3);
        let mut at = || 1.4 * random.unit() as f32 - 0.2;
        (0..count).map(|_| Ray::new([at(), at(), 1.0], [0.0, 0.0, -1.0])).collect()
    }

    fn right(oracle: &Oracle, work: &Workload) -> Answers {
        let lists = work.rays.iter().map(|r| oracle.exact(r));
        match work.kind.question() {
            Question::Occluded => Answers::Occluded(lists.map(|l| !l.is_empty()).collect()),
            Question::AllHits | Question::FirstHits(_) => {
                let mut out = HitLists::new();
                lists.for_each(|l| out.push(&l[..l.len().min(limit(work.kind.question()))]));
                Answers::Hits(out)
            }
            _ => Answers::Closest(
                lists.map(|l| l.first().copied().unwrap_or(BenchHit::MISS)).collect(),
            ),
        }
    }

    #[test]
    fn right_answers_pass_and_a_planted_wrong_one_is_found_in_every_workload() {
        let mesh = squares();
        let oracle = Oracle::new(&mesh);
        for kind in [Kind::Primary, Kind::Shadow, Kind::AllHits, Kind::FirstHits, Kind::Walk1] {
            let work = Workload { kind, rays: down(500), chains: vec![0] };
            let good = right(&oracle, &work);
            let victim = (0..500).find(|&r| !oracle.exact(&work.rays[r]).is_empty()).unwrap();
            let mut bad = good.clone();
            match &mut bad {
                Answers::Closest(hits) => hits[victim].t += 1.0,
                Answers::Occluded(flags) => flags[victim] = !flags[victim],
                Answers::Hits(lists) => {
                    lists.prim[lists.offsets[victim]] ^= 1;
                    lists.t[lists.offsets[victim]] += 0.1;
                }
            }
            let testimony = |answers| Testimony { answers, stride: 1 };
            let verdicts =
                verify(&oracle, 6, &work, &[testimony(&good), testimony(&bad), testimony(&good)]);
            assert_eq!(verdicts[0], Verdict::default(), "{}", kind.name());
            assert_eq!(verdicts[2], Verdict::default(), "{}", kind.name());
            assert_eq!(verdicts[1].wrong_per_million, 2000.0, "{}", kind.name());
            assert_eq!(verdicts[1].mismatches_per_million, 2000.0, "{}", kind.name());
        }
    }

    #[test]
    fn an_error_that_all_share_is_found_by_the_audit() {
        let mesh = squares();
        let oracle = Oracle::new(&mesh);
        let work = Workload { kind: Kind::Primary, rays: down(50), chains: Vec::new() };
        let blind = Answers::Closest(vec![BenchHit::MISS; 50]);
        let both =
            [Testimony { answers: &blind, stride: 1 }, Testimony { answers: &blind, stride: 1 }];
        let verdicts = verify(&oracle, 6, &work, &both);
        assert!(verdicts.iter().all(|v| v.wrong_per_million > 0.0));
    }

    #[test]
    fn a_repeated_primitive_and_a_hit_left_out_are_wrong() {
        let mesh = squares();
        let ray = Ray::new([0.7, 0.2, 1.0], [0.0, 0.0, -1.0]);
        let candidates = Oracle::new(&mesh).candidates(&ray);
        let list = Oracle::new(&mesh).exact(&ray);
        let ok = |l: &[BenchHit], q| is_right(&Answer::Hits(l.to_vec()), q, &candidates);
        assert!(list.len() == 3 && ok(&list, Question::AllHits));
        assert!(!ok(&[list[0], list[0], list[1], list[2]], Question::AllHits));
        assert!(!ok(&[list[0], list[2]], Question::AllHits));
        assert!(!ok(&[list[1], list[0], list[2]], Question::AllHits));
        assert!(ok(&list[..2], Question::FirstHits(2)));
        assert!(!ok(&[list[0], list[2]], Question::FirstHits(2)));
    }
}
