//! One scene: record its rays, build every method, compare, count, time.

use super::candidate::Candidate;
use super::model::*;
use super::published;
use super::replay::{Answer, Replay, Tally};
use super::scenes::{SceneChoice, Size};
use super::statistics::{evenly, median, relative_spread};
use crate::engine::{self, Loaded};
use crate::interrupt;
use crate::output::{PerRay, Rays, Tree};
use anyhow::{Context, bail};
use indicatif::ProgressBar;
use ropewalk::method::Method;
use ropewalk::traverse::{Counts, LeafId};
use ropewalk::{Geometry, Walk};
use ropewalk_render::{RayKind, RaySet, RecordedRay, RenderSettings, record_rays};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Rounds in which every method is built and timed once.
pub const ROUNDS: usize = 5;
/// Builds slower than this many seconds are not repeated.
pub const SLOW_BUILD: f64 = 2.0;
/// Most rays that are kept of a rendering (about 320 MB); beyond it every second, fourth, ... is.
const MAX_RECORDED: usize = 8 << 20;
/// Rays over which the cost of a method is looked at beforehand.
const PROBE_RAYS: usize = 500;
/// Operations of a timed round up to which a method is given all timed rays: a hundred a ray of
/// 100,000.
const TIMED_OPERATIONS: f64 = 1e7;
/// Operations over all rays up to which a method's events are counted over all of them.
const COUNTED_OPERATIONS: f64 = 3e8;
/// A slower method is given every so many rays, so that it spends this share of the operations.
const SLOW_SHARE: f64 = 0.2;

/// What all scenes share.
pub struct Setup<'a> {
    /// Rays to time.
    pub timed_rays: usize,
    /// Size of the scenes.
    pub size: Size,
    /// Ctrl-C.
    pub cancel: &'a AtomicBool,
    /// Advances by [`steps`] a scene.
    pub bar: &'a ProgressBar,
}

impl Setup<'_> {
    /// Advances the bar; an error once Ctrl-C was pressed.
    fn step(&self) -> anyhow::Result<()> {
        self.bar.inc(1);
        if self.cancel.load(Ordering::Relaxed) { Err(interrupt::interrupted()) } else { Ok(()) }
    }
}

/// How often [`run`] advances the bar.
pub fn steps() -> u64 {
    (Method::all().len() * (2 + ROUNDS)) as u64
}

/// A method on its way through the experiment.
struct Entrant {
    method: Method,
    candidate: Candidate,
    /// Operations a ray, as far as a first look tells.
    probed: f64,
    timed: Vec<RecordedRay>,
    starts: Vec<Option<LeafId>>,
    counted_rays: usize,
    counts: Counts,
    counts_from_root: Option<Counts>,
    build_seconds: Vec<f64>,
    trace_seconds: Vec<f64>,
}

impl Entrant {
    fn is_naive(&self) -> bool {
        self.method.walk == Walk::BruteForce
    }

    fn is_roped(&self) -> bool {
        matches!(self.method.walk, Walk::Ropes | Walk::RopeTrees)
    }

    /// `rays`, or fewer of them at even distances where they would take more `operations`.
    fn afford(&self, rays: &[RecordedRay], operations: f64) -> Vec<RecordedRay> {
        let all = self.probed * rays.len() as f64;
        let share = if all <= operations { 1.0 } else { SLOW_SHARE * operations / all };
        evenly(rays, (share * rays.len() as f64).ceil() as usize)
    }

    /// The leaves from which links are followed: that of the surface which a ray leaves. A renderer
    /// knows it from the hit before, so looking it up is neither timed nor counted.
    fn start_leaves(&self, rays: &[RecordedRay]) -> Vec<Option<LeafId>> {
        if !self.is_roped() {
            return Vec::new();
        }
        let locate = |ray: &RecordedRay| match ray.kind {
            RayKind::Primary => None,
            _ => self.candidate.accelerator.locate(ray.ray.origin),
        };
        rays.iter().map(locate).collect()
    }

    /// The timed rays.
    fn replay(&self) -> Replay<'_> {
        Replay::from_leaves(&self.timed, &self.starts)
    }
}

/// A scene with its rays, for the parts of the experiment that follow.
pub struct Recorded {
    /// Primitives.
    pub geometry: Arc<Geometry>,
    /// Rays of the rendering.
    pub rays: RaySet,
}

/// Runs the experiment on one scene.
///
/// # Errors
/// The scene's and the builder's; a sentence if two methods answer a ray differently; the
/// interruption.
pub fn run(choice: &SceneChoice, setup: &Setup<'_>) -> anyhow::Result<(SceneResult, Recorded)> {
    let loaded = engine::load(&choice.spec())?;
    let mut entrants = build_all(&loaded.geometry, setup)?;
    let set = record(&loaded, &entrants, setup.timed_rays)?;
    choose_rays(&mut entrants, &set.rays, setup)?;
    compare(&entrants).with_context(|| choice.spec())?;
    count_all(&mut entrants, &set.rays, setup).with_context(|| choice.spec())?;
    for _ in 0..ROUNDS {
        round(&mut entrants, &loaded.geometry, setup)?;
    }
    let mut methods: Vec<_> = entrants.iter().map(|e| result(e, &loaded)).collect();
    fill_ratios(&mut methods);
    let standard = setup.size == Size::Standard;
    let result = SceneResult {
        name: choice.name.to_owned(),
        spec: choice.spec(),
        objects: loaded.geometry.len() as u64,
        rays: Rays::from(&set.counts),
        counted_rays: set.rays.len() as u64,
        stride: set.stride,
        timed_rays: set.rays.len().min(setup.timed_rays) as u64,
        published: published::efficiency(choice.name)
            .filter(|_| standard)
            .map(|e| Outside { octree: e.octree, grid: e.grid }),
        methods,
    };
    Ok((result, Recorded { geometry: loaded.geometry, rays: set }))
}

fn build_all(geometry: &Arc<Geometry>, setup: &Setup<'_>) -> anyhow::Result<Vec<Entrant>> {
    let enter = |method: Method| {
        let candidate = Candidate::build(geometry, &method, 1, setup.cancel)
            .with_context(|| format!("method {}", method.name))?;
        setup.step()?;
        let slow = candidate.seconds > SLOW_BUILD;
        let build_seconds = if slow { vec![candidate.seconds] } else { Vec::new() };
        Ok(Entrant {
            method,
            candidate,
            probed: 0.0,
            timed: Vec::new(),
            starts: Vec::new(),
            counted_rays: 0,
            counts: Counts::default(),
            counts_from_root: None,
            build_seconds,
            trace_seconds: Vec::new(),
        })
    };
    Method::all().into_iter().map(enter).collect()
}

/// The rays of a rendering by the rules of the databases, shot through the best tree.
fn record(loaded: &Loaded, entrants: &[Entrant], timed: usize) -> anyhow::Result<RaySet> {
    let best = entrants.iter().find(|e| e.method.name == Method::DEFAULT);
    let best = best.context("the best method is missing")?;
    let Loaded { scene, geometry, .. } = loaded;
    let most = MAX_RECORDED.max(timed);
    Ok(record_rays(scene, geometry, &best.candidate.accelerator, &RenderSettings::spd(), most)?)
}

/// Looks at each method's cost and gives it the rays that it is timed on: all the same, but for
/// methods that are so slow that they are given every so many of them.
fn choose_rays(
    entrants: &mut [Entrant],
    rays: &[RecordedRay],
    setup: &Setup<'_>,
) -> anyhow::Result<()> {
    let timed = evenly(rays, setup.timed_rays);
    let probe = evenly(rays, PROBE_RAYS);
    for entrant in entrants {
        let caster = &entrant.candidate.accelerator;
        let tally = Replay::from_root(&probe).tally(caster, setup.cancel);
        let counts = tally.ok_or_else(interrupt::interrupted)?.counts;
        let operations = counts.intersection_tests + counts.traversal_steps;
        entrant.probed = operations as f64 / probe.len().max(1) as f64;
        entrant.timed = entrant.afford(&timed, TIMED_OPERATIONS);
        entrant.starts = entrant.start_leaves(&entrant.timed);
    }
    Ok(())
}

/// Holds every method's answers to the timed rays against those of the first that has a tree and
/// is timed on all of them.
fn compare(entrants: &[Entrant]) -> anyhow::Result<()> {
    let most = entrants.iter().map(|e| e.timed.len()).max().unwrap_or(0);
    let judge = entrants.iter().find(|e| !e.is_naive() && e.timed.len() == most);
    let judge = judge.context("no method has a tree")?;
    let answer =
        |rays: &[RecordedRay]| Replay::from_root(rays).answers(&judge.candidate.accelerator);
    let all: Vec<Answer> = answer(&judge.timed);
    for entrant in entrants {
        let own;
        let expected = if entrant.timed.len() == most {
            &all
        } else {
            own = answer(&entrant.timed);
            &own
        };
        let found = entrant.replay().answers(&entrant.candidate.accelerator);
        let different = found.iter().zip(expected).position(|(f, e)| f != e);
        if let Some(i) = different {
            bail!(
                "methods {} and {} disagree: {} against {} for {:?}",
                entrant.method.name,
                judge.method.name,
                found[i],
                expected[i],
                entrant.timed[i].ray
            );
        }
    }
    Ok(())
}

/// Counts events over all rays. The digests compare the answers to all of them on the way.
fn count_all(
    entrants: &mut [Entrant],
    rays: &[RecordedRay],
    setup: &Setup<'_>,
) -> anyhow::Result<()> {
    let mut first: Option<(&'static str, u64)> = None;
    for entrant in entrants.iter_mut() {
        let counted = entrant.afford(rays, COUNTED_OPERATIONS);
        let caster = &entrant.candidate.accelerator;
        let count = |replay: Replay<'_>| {
            replay.tally(caster, setup.cancel).ok_or_else(interrupt::interrupted)
        };
        if !entrant.is_naive() {
            let starts = entrant.start_leaves(&counted);
            let Tally { counts, digest } = count(Replay::from_leaves(&counted, &starts))?;
            if entrant.is_roped() {
                entrant.counts_from_root = Some(count(Replay::from_root(&counted))?.counts);
            }
            if counted.len() == rays.len() {
                let (name, expected) = *first.get_or_insert((entrant.method.name, digest));
                if digest != expected {
                    bail!(
                        "methods {} and {name} disagree on some of all rays",
                        entrant.method.name
                    );
                }
            }
            entrant.counts = counts;
        }
        entrant.counted_rays = counted.len();
        setup.step()?;
    }
    Ok(())
}

/// Every method builds and traces once, so that whatever slows the machine down meets them all.
fn round(
    entrants: &mut [Entrant],
    geometry: &Arc<Geometry>,
    setup: &Setup<'_>,
) -> anyhow::Result<()> {
    for entrant in entrants {
        if entrant.candidate.seconds <= SLOW_BUILD {
            let rebuilt = Candidate::build(geometry, &entrant.method, 1, setup.cancel)?;
            entrant.build_seconds.push(rebuilt.seconds);
        }
        let seconds = entrant.replay().seconds(&entrant.candidate.accelerator);
        entrant.trace_seconds.push(seconds);
        setup.step()?;
    }
    Ok(())
}

fn result(entrant: &Entrant, loaded: &Loaded) -> MethodResult {
    let counted = entrant.counted_rays as u64;
    let timed = entrant.timed.len();
    let Entrant { method, candidate, .. } = entrant;
    let build = median(&entrant.build_seconds);
    let trace = median(&entrant.trace_seconds);
    let report = candidate.report.as_ref();
    let bytes = candidate.accelerator.bytes() as u64;
    let mut tree = report.map(|r| Tree::new(r, bytes)).unwrap_or_default();
    tree.build_seconds = build;
    let per_ray = if entrant.is_naive() {
        let intersection_tests = loaded.geometry.len() as f64; // by definition
        PerRay { intersection_tests, ..PerRay::default() }
    } else {
        PerRay::new(&entrant.counts, counted)
    };
    let operations = per_ray.operations();
    MethodResult {
        name: method.name,
        title: method.title,
        role: role_name(method.role),
        roped: entrant.is_roped(),
        size: tree.size(),
        bytes_per_leaf: report.map(|r| bytes as f64 / r.tree.leaves.max(1) as f64),
        tree,
        operations,
        all_steps: all_steps(&per_ray),
        per_ray,
        from_root: entrant.counts_from_root.as_ref().map(|c| PerRay::new(c, counted)),
        counted_rays: counted,
        timed_rays: timed as u64,
        seconds: MethodSeconds { read: loaded.seconds, build, trace },
        microseconds_per_ray: 1e6 * trace / timed.max(1) as f64,
        trace_spread: relative_spread(&entrant.trace_seconds),
        timed_builds: entrant.build_seconds.len(),
        predicted: report.map(|r| Predicted {
            traversal_steps: r.tree.predicted_inner_visits,
            leaf_visits: r.tree.predicted_leaf_visits,
            empty_leaf_visits: r.tree.predicted_empty_leaf_visits,
            intersection_tests: r.tree.predicted_intersection_tests,
        }),
        estimator: report.and_then(|r| {
            let stats = r.estimator.as_ref()?;
            Some(EstimatorError {
                beta: r.beta,
                bias: stats.mean_estimate - stats.mean_truth,
                mean_absolute: stats.mean_abs_error,
                mean_truth: stats.mean_truth,
                samples: stats.count as u64,
            })
        }),
        ratio_to_macdonald_booth: Ratios::default(),
        ratio_to_exact: Ratios::default(),
    }
}
