//! The results of the experiment as data: what `--json` prints and the report draws.

use super::machine::Machine;
use super::published::Published;
use super::verdict::{Headline, Verdict};
use crate::output::{PerRay, Rays, Tree};
use ropewalk::method::{Method, Role};
use serde::Serialize;

/// The whole experiment.
#[derive(Clone, Debug, Serialize)]
pub struct Experiment {
    /// Version of the program.
    pub version: &'static str,
    /// Day of the run, UTC.
    pub date: String,
    /// The command that repeats it.
    pub command: String,
    /// Where times were measured.
    pub machine: Machine,
    /// `small`, `standard` or `large`.
    pub size: &'static str,
    /// How it was measured.
    pub protocol: Protocol,
    /// One entry a scene.
    pub scenes: Vec<SceneResult>,
    /// Means over the scenes.
    pub headline: Headline,
    /// What each ingredient brings.
    pub verdicts: Vec<Verdict>,
    /// Leaf size against depth; empty if not asked for.
    pub sensitivity: Vec<SensitivityCell>,
    /// Builds of growing size; empty if not asked for.
    pub scaling: Vec<ScalingPoint>,
}

/// How it was measured.
#[derive(Clone, Debug, Serialize)]
pub struct Protocol {
    /// Rays timed in each scene, at most.
    pub timed_rays: usize,
    /// Rounds in which every method is timed once; medians are reported.
    pub rounds: usize,
    /// Builds slower than this many seconds are timed once.
    pub slow_build_seconds: f64,
    /// Threads that count events; times are of one thread.
    pub counting_threads: usize,
}

/// One scene with all methods.
#[derive(Clone, Debug, Serialize)]
pub struct SceneResult {
    /// Name in the databases.
    pub name: String,
    /// Built-in scene.
    pub spec: String,
    /// Objects.
    pub objects: u64,
    /// Rays of the rendering.
    pub rays: Rays,
    /// Rays over which events were counted: all of them, or every `stride`-th.
    pub counted_rays: u64,
    /// One ray in so many was recorded.
    pub stride: u64,
    /// Rays over which times were taken.
    pub timed_rays: u64,
    /// Published octree and grid; only at standard size.
    pub published: Option<Outside>,
    /// One entry a method.
    pub methods: Vec<MethodResult>,
}

impl SceneResult {
    /// The results of the method called `name`.
    pub fn method(&self, name: &str) -> Option<&MethodResult> {
        self.methods.iter().find(|m| m.name == name)
    }
}

/// Published figures for the same scene.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Outside {
    /// Best octree.
    pub octree: Published,
    /// Best grid.
    pub grid: Published,
}

impl Outside {
    /// Who needs the fewest operations, where the best tree needs `best` and all steps along its
    /// rope trees are `rope_trees`.
    pub fn winner(&self, best: f64, rope_trees: f64) -> &'static str {
        let (octree, grid) = (self.octree.operations(), self.grid.operations());
        if rope_trees <= octree.min(grid).min(best) {
            "rope trees"
        } else if best <= octree.min(grid) {
            "best tree"
        } else if grid <= octree {
            "grid"
        } else {
            "octree"
        }
    }
}

/// One method on one scene.
#[derive(Clone, Debug, Serialize)]
pub struct MethodResult {
    /// Name on the command line.
    pub name: &'static str,
    /// What it is.
    pub title: &'static str,
    /// `baseline`, `reference`, `exact`, `ingredient` or `combined`.
    pub role: &'static str,
    /// True if links lead from leaf to leaf.
    pub roped: bool,
    /// The tree; all zero for the naive search.
    pub tree: Tree,
    /// Inner nodes and references, the paper's size.
    pub size: u64,
    /// Bytes a leaf, ropes included; `None` without a tree.
    pub bytes_per_leaf: Option<f64>,
    /// Counted events; rays that leave a surface start in its leaf where links are followed.
    pub per_ray: PerRay,
    /// The same where every ray starts at the root; only where links are followed.
    pub from_root: Option<PerRay>,
    /// Rays over which events were counted; fewer than the scene's where a method is very slow.
    pub counted_rays: u64,
    /// Rays over which times were taken; fewer than the scene's where a method is slow.
    pub timed_rays: u64,
    /// Intersection tests and traversal steps a ray, 1:1.
    pub operations: f64,
    /// Operations, rope crossings and steps in rope trees a ray.
    pub all_steps: f64,
    /// Medians in seconds; `trace` is for the timed rays, one thread.
    pub seconds: MethodSeconds,
    /// Median time of a ray in microseconds.
    pub microseconds_per_ray: f64,
    /// `(slowest - fastest) / median` of the timed rounds.
    pub trace_spread: f64,
    /// How many builds the median is over.
    pub timed_builds: usize,
    /// Expectation for a ray that hits the scene's box and ends nowhere.
    pub predicted: Option<Predicted>,
    /// How far the estimator of ray termination is off.
    pub estimator: Option<EstimatorError>,
    /// Against the paper's reference.
    pub ratio_to_macdonald_booth: Ratios,
    /// Against the exact sweep.
    pub ratio_to_exact: Ratios,
}

/// Wall-clock seconds.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct MethodSeconds {
    /// Making the scene.
    pub read: f64,
    /// Building the tree and its ropes.
    pub build: f64,
    /// Answering the timed rays.
    pub trace: f64,
}

/// The surface-area expectation of a tree's figures.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Predicted {
    /// Inner nodes visited.
    pub traversal_steps: f64,
    /// Leaves visited.
    pub leaf_visits: f64,
    /// Empty leaves visited.
    pub empty_leaf_visits: f64,
    /// Intersection tests.
    pub intersection_tests: f64,
}

/// Estimated termination probabilities against sampled lines.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct EstimatorError {
    /// Exponent of the surface-area estimator, calibrated at the root; `None` where none is used.
    pub beta: Option<f64>,
    /// Mean of estimate minus truth.
    pub bias: f64,
    /// Mean of the absolute difference.
    pub mean_absolute: f64,
    /// Mean of the sampled truth.
    pub mean_truth: f64,
    /// Probabilities compared.
    pub samples: u64,
}

/// One method's figures divided by another's; `None` where the other has none.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Ratios {
    /// Intersection tests and traversal steps.
    pub operations: Option<f64>,
    /// Operations, rope crossings and steps in rope trees.
    pub all_steps: Option<f64>,
    /// Time of a ray.
    pub time: Option<f64>,
    /// Inner nodes and references.
    pub size: Option<f64>,
}

impl Ratios {
    /// `of / to`, figure by figure.
    pub fn new(of: &MethodResult, to: &MethodResult) -> Self {
        let over = |a: f64, b: f64| (a > 0.0 && b > 0.0).then(|| a / b);
        Ratios {
            operations: over(of.operations, to.operations),
            all_steps: over(of.all_steps, to.all_steps),
            time: over(of.microseconds_per_ray, to.microseconds_per_ray),
            size: over(of.size as f64, to.size as f64),
        }
    }
}

/// One setting of the termination, three methods.
#[derive(Clone, Debug, Serialize)]
pub struct SensitivityCell {
    /// Scene.
    pub scene: String,
    /// Largest leaf above the depth limit.
    pub leaf_size: u32,
    /// `auto` (1.2 log2 N + 2) or the limit.
    pub max_depth: String,
    /// Operations a ray of the reference.
    pub reference: f64,
    /// Of the exact sweep.
    pub exact: f64,
    /// Of the combination.
    pub combined: f64,
}

impl SensitivityCell {
    /// The exact sweep's operations over the reference's at the same setting.
    pub fn exact_ratio(&self) -> f64 {
        self.exact / self.reference
    }

    /// The combination's operations over the reference's at the same setting.
    pub fn combined_ratio(&self) -> f64 {
        self.combined / self.reference
    }
}

/// One build of the scaling series, one thread.
#[derive(Clone, Debug, Serialize)]
pub struct ScalingPoint {
    /// Scene.
    pub scene: &'static str,
    /// Objects, N.
    pub objects: u64,
    /// Seconds.
    pub build_seconds: f64,
    /// `seconds / (N log2 N)` in nanoseconds.
    pub nanoseconds_per_n_log_n: f64,
    /// Operations a ray.
    pub operations: f64,
    /// Inner nodes and references.
    pub size: u64,
}

/// Operations, rope crossings and steps in rope trees.
pub fn all_steps(per_ray: &PerRay) -> f64 {
    per_ray.operations() + per_ray.rope_crossings + per_ray.rope_tree_steps
}

/// A role's name in reports.
pub fn role_name(role: Role) -> &'static str {
    match role {
        Role::Baseline => "baseline",
        Role::Reference => "reference",
        Role::Exact => "exact",
        Role::Ingredient => "ingredient",
        Role::Combined => "combined",
    }
}

/// Holds every method against the reference and the exact sweep of the same scene.
pub fn fill_ratios(methods: &mut [MethodResult]) {
    let find = |name| methods.iter().find(|m| m.name == name).cloned();
    let (reference, exact) = (find(Method::REFERENCE), find(Method::EXACT));
    for method in methods {
        let against = |other: &Option<MethodResult>| {
            other.as_ref().map(|o| Ratios::new(method, o)).unwrap_or_default()
        };
        let (to_reference, to_exact) = (against(&reference), against(&exact));
        method.ratio_to_macdonald_booth = to_reference;
        method.ratio_to_exact = to_exact;
    }
}
