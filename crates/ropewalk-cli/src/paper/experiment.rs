//! One scene: record its rays, build every method, compare, count, time.

use super::candidate::Candidate;
use super::model::*;
use super::published;
use super::replay::{self, Tally};
use super::scenes::{SceneChoice, Size};
use super::statistics::{evenly, median, relative_spread};
use crate::engine::{self, Loaded};
use crate::interrupt;
use crate::output::{PerRay, Rays, Tree};
use anyhow::{Context, bail};
use indicatif::ProgressBar;
use ropewalk::method::Method;
use ropewalk::traverse::Counts;
use ropewalk::{Geometry, Walk};
use ropewalk_render::{RaySet, RecordedRay, RenderSettings, record_rays};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Rounds in which every method is built and timed once.
pub const ROUNDS: usize = 5;
/// Builds slower than this many seconds are not repeated.
pub const SLOW_BUILD: f64 = 2.0;
/// Most rays that are kept of a rendering (about 320 MB); beyond it every second, fourth, ... is.
const MAX_RECORDED: usize = 8 << 20;
/// Intersection tests that the naive search may spend in a round.
const NAIVE_TESTS: usize = 20_000_000;

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
    counts: Counts,
    build_seconds: Vec<f64>,
    trace_seconds: Vec<f64>,
}

impl Entrant {
    fn is_naive(&self) -> bool {
        self.method.walk == Walk::BruteForce
    }
}

/// Rays that are timed: the naive search affords fewer.
struct Sample {
    all: Vec<RecordedRay>,
    naive: Vec<RecordedRay>,
}

impl Sample {
    fn of(&self, entrant: &Entrant) -> &[RecordedRay] {
        if entrant.is_naive() { &self.naive } else { &self.all }
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
    let sample = {
        let all = evenly(&set.rays, setup.timed_rays);
        let naive = replay::affordable(&all, loaded.geometry.len(), NAIVE_TESTS);
        Sample { all, naive }
    };
    compare(&entrants, &sample).with_context(|| choice.spec())?;
    count_all(&mut entrants, &set.rays, setup).with_context(|| choice.spec())?;
    for _ in 0..ROUNDS {
        round(&mut entrants, &loaded.geometry, &sample, setup)?;
    }
    let counted = set.rays.len() as u64;
    let mut methods: Vec<_> =
        entrants.iter().map(|e| result(e, &loaded, counted, sample.of(e).len())).collect();
    fill_ratios(&mut methods);
    let standard = setup.size == Size::Standard;
    let result = SceneResult {
        name: choice.name.to_owned(),
        spec: choice.spec(),
        objects: loaded.geometry.len() as u64,
        rays: Rays::from(&set.counts),
        counted_rays: counted,
        stride: set.stride,
        timed_rays: sample.all.len() as u64,
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
        let trace_seconds = Vec::new();
        Ok(Entrant { method, candidate, counts: Counts::default(), build_seconds, trace_seconds })
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

/// Holds every method's answers against those of the first one that has a tree.
fn compare(entrants: &[Entrant], sample: &Sample) -> anyhow::Result<()> {
    let first = entrants.iter().find(|e| !e.is_naive()).context("no method has a tree")?;
    let expect = |rays: &[RecordedRay]| replay::answers(&first.candidate.accelerator, rays);
    let (expected, expected_naive) = (expect(&sample.all), expect(&sample.naive));
    for entrant in entrants {
        let rays = sample.of(entrant);
        let expected = if entrant.is_naive() { &expected_naive } else { &expected };
        let found = replay::answers(&entrant.candidate.accelerator, rays);
        let different = found.iter().zip(expected).position(|(f, e)| f != e);
        if let Some(i) = different {
            bail!(
                "methods {} and {} disagree: {} against {} for {:?}",
                entrant.method.name,
                first.method.name,
                found[i],
                expected[i],
                rays[i].ray
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
    for entrant in entrants {
        if !entrant.is_naive() {
            let tally = replay::tally(&entrant.candidate.accelerator, rays, setup.cancel);
            let Tally { counts, digest } = tally.ok_or_else(interrupt::interrupted)?;
            let (name, expected) = *first.get_or_insert((entrant.method.name, digest));
            if digest != expected {
                bail!("methods {} and {name} disagree on some of all rays", entrant.method.name);
            }
            entrant.counts = counts;
        }
        setup.step()?;
    }
    Ok(())
}

/// Every method builds and traces once, so that whatever slows the machine down meets them all.
fn round(
    entrants: &mut [Entrant],
    geometry: &Arc<Geometry>,
    sample: &Sample,
    setup: &Setup<'_>,
) -> anyhow::Result<()> {
    for entrant in entrants {
        if entrant.candidate.seconds <= SLOW_BUILD {
            let rebuilt = Candidate::build(geometry, &entrant.method, 1, setup.cancel)?;
            entrant.build_seconds.push(rebuilt.seconds);
        }
        let rays = sample.of(entrant);
        entrant.trace_seconds.push(replay::seconds(&entrant.candidate.accelerator, rays));
        setup.step()?;
    }
    Ok(())
}

fn result(entrant: &Entrant, loaded: &Loaded, counted: u64, timed: usize) -> MethodResult {
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
        roped: matches!(method.walk, Walk::Ropes | Walk::RopeTrees),
        size: tree.size(),
        bytes_per_leaf: report.map(|r| bytes as f64 / r.tree.leaves.max(1) as f64),
        tree,
        operations,
        all_steps: operations + per_ray.rope_crossings + per_ray.rope_tree_steps,
        per_ray,
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
