//! The methods of the paper by name: a way to build a tree and a way to walk it.
//!
//! Each ingredient can be switched on by itself. All methods of the comparison share the
//! termination that the paper's reference has (leaves of two, depth `1.2 log2 N + 2`) and one
//! budget of references, so that only the named ingredient differs.

use crate::accelerator::Walk;
use crate::build::{BuildSettings, Measure, Termination, TerminationEstimator};
use crate::cost::LeafCost;

/// Where a method stands in the comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Role {
    /// What came before the paper.
    Baseline,
    /// The paper's reference: its citations 2 (MacDonald and Booth) and 3 (Sung and Shirley).
    Reference,
    /// The reference's measure minimised exactly; every ingredient is added to it alone.
    Exact,
    /// The exact sweep and one ingredient.
    Ingredient,
    /// All ingredients together.
    Combined,
}

/// A way to build and a way to walk.
#[derive(Clone, Debug, PartialEq)]
pub struct Method {
    /// Name on the command line.
    pub name: &'static str,
    /// What it is, in a few words.
    pub title: &'static str,
    /// Place in the comparison.
    pub role: Role,
    /// How the tree is built; `None` where there is no tree.
    pub build: Option<BuildSettings>,
    /// How rays are walked.
    pub walk: Walk,
}

impl Method {
    /// The method that renders when none is named: the best tree, walked by TA-B.
    pub const DEFAULT: &'static str = "best";
    /// The tree of [`Method::DEFAULT`], walked along rope trees.
    pub const BEST_ROPE_TREES: &'static str = "best-rope-trees";
    /// The paper's reference.
    pub const REFERENCE: &'static str = "macdonald-booth-1990";
    /// The reference's measure by exact sweep.
    pub const EXACT: &'static str = "macdonald-booth";

    /// All methods, in the order of the report.
    pub fn all() -> Vec<Method> {
        let shared = BuildSettings {
            measure: Measure::MacDonaldBooth,
            estimator: TerminationEstimator::SurfaceArea { beta: None },
            leaf_cost: LeafCost::Linear,
            termination: Termination::Fixed { leaf_size: 2, max_depth: None },
            traversal_cost: 1.0,
            empty_factor: 1.0,
            late_cutting: false,
            clipping: false,
            ..BuildSettings::default()
        };
        let measure = |measure| BuildSettings { measure, ..shared.clone() };
        let estimator = |estimator| BuildSettings {
            measure: Measure::Termination,
            estimator,
            ..shared.clone()
        };
        let combined = BuildSettings {
            measure: Measure::Termination,
            empty_factor: 0.8,
            late_cutting: true,
            clipping: true,
            ..shared.clone()
        };
        // The lowest counted cost over the eight SPD scenes among the settings tried.
        let best = BuildSettings {
            estimator: TerminationEstimator::Projection,
            termination: Termination::Cost { max_depth: None },
            traversal_cost: 1.5,
            ..combined.clone()
        };
        use Role::*;
        use Walk::*;
        let mut methods = Vec::new();
        let mut add = |role, name, title, build, walk| {
            methods.push(Method { name, title, role, build, walk });
        };
        add(Baseline, "naive", "every primitive, every ray", None, BruteForce);
        add(
            Baseline,
            "spatial-median",
            "cut in the middle, axes in turn",
            Some(measure(Measure::SpatialMedian)),
            SungShirley,
        );
        add(
            Baseline,
            "object-median",
            "cut at the median object, axes in turn",
            Some(measure(Measure::ObjectMedian)),
            SungShirley,
        );
        add(
            Reference,
            Self::REFERENCE,
            "[2] + [3]: nine sampled planes, Sung-Shirley",
            Some(measure(Measure::MacDonaldBooth1990)),
            SungShirley,
        );
        add(
            Exact,
            Self::EXACT,
            "the same measure by exact sweep",
            Some(shared.clone()),
            SungShirley,
        );
        add(Ingredient, "ta-b", "TA-B traversal", Some(shared.clone()), TaB);
        add(
            Ingredient,
            "clipping",
            "perfect splits",
            Some(BuildSettings { clipping: true, ..shared.clone() }),
            SungShirley,
        );
        add(
            Ingredient,
            "havran-printed",
            "f'_M as printed",
            Some(measure(Measure::HavranPrinted)),
            SungShirley,
        );
        add(
            Ingredient,
            "havran-printed-crossed",
            "f'_M as printed, children crossed",
            Some(measure(Measure::HavranPrintedCrossed)),
            SungShirley,
        );
        add(
            Ingredient,
            "termination",
            "f*, p by surface area",
            Some(measure(Measure::Termination)),
            SungShirley,
        );
        add(
            Ingredient,
            "termination-projection",
            "f*, p by projection",
            Some(estimator(TerminationEstimator::Projection)),
            SungShirley,
        );
        add(
            Ingredient,
            "termination-lines",
            "f*, p by sampled lines",
            Some(estimator(TerminationEstimator::SampledLines { lines: 128, stop_below: 32 })),
            SungShirley,
        );
        add(
            Ingredient,
            "empty-early",
            "cuts with an empty side at 0.8 of their cost",
            Some(BuildSettings { empty_factor: 0.8, ..shared.clone() }),
            SungShirley,
        );
        add(
            Ingredient,
            "empty-late",
            "empty slabs cut off leaves (Figure 2)",
            Some(BuildSettings { late_cutting: true, ..shared.clone() }),
            SungShirley,
        );
        add(
            Ingredient,
            "cost-blocks",
            "f_C = ceil(N / 8)",
            Some(BuildSettings { leaf_cost: LeafCost::Blocks { width: 8 }, ..shared.clone() }),
            SungShirley,
        );
        add(
            Ingredient,
            "cost-log",
            "f_C = min(N, 2 + 2 log2 N)",
            Some(BuildSettings {
                leaf_cost: LeafCost::Logarithmic { a: 2.0, b: 2.0 },
                ..shared.clone()
            }),
            SungShirley,
        );
        add(
            Ingredient,
            "automatic",
            "termination by Havran and Bittner",
            Some(BuildSettings {
                termination: Termination::Automatic { max_ratio: 0.75 },
                ..shared.clone()
            }),
            SungShirley,
        );
        add(
            Ingredient,
            "cost-stop",
            "termination by cost",
            Some(BuildSettings {
                termination: Termination::Cost { max_depth: None },
                ..shared.clone()
            }),
            SungShirley,
        );
        add(Ingredient, "ropes", "one link a face", Some(shared.clone()), Ropes);
        add(Ingredient, "rope-trees", "a rope tree a face", Some(shared.clone()), RopeTrees);
        add(
            Combined,
            "combined",
            "f*, perfect splits, both cuttings, TA-B",
            Some(combined.clone()),
            TaB,
        );
        add(Combined, "combined-ropes", "the same tree, ropes", Some(combined.clone()), Ropes);
        add(
            Combined,
            "combined-rope-trees",
            "the same tree, rope trees",
            Some(combined),
            RopeTrees,
        );
        let title = "f* by projection, perfect splits, both cuttings, ended by cost";
        add(Combined, Self::DEFAULT, title, Some(best.clone()), TaB);
        add(Combined, Self::BEST_ROPE_TREES, "the same tree, rope trees", Some(best), RopeTrees);
        methods
    }

    /// The method called `name`.
    pub fn by_name(name: &str) -> Option<Method> {
        Self::all().into_iter().find(|m| m.name == name)
    }
}
