//! One documented struct of settings, with presets.

use super::error::BuildError;
use super::sample::RaySample;
use crate::cost::{self, CostModel, LeafCost};
use crate::tree::MAX_DEPTH;

/// Which planes a builder looks at and which measure it minimises.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Measure {
    /// The middle of the cell, axes in turn x, y, z.
    SpatialMedian,
    /// The median of the primitives' centroids, axes in turn.
    ObjectMedian,
    /// MacDonald and Booth 1990 as published: nine sampled planes between the spatial and the
    /// object median on each axis, primitives sorted by their boxes without clipping.
    MacDonaldBooth1990,
    /// The same measure minimised exactly over all event planes.
    #[default]
    MacDonaldBooth,
    /// The paper's measure as printed, children paired by side.
    HavranPrinted,
    /// The paper's measure as printed, children paired crosswise.
    HavranPrintedCrossed,
    /// The paper's measure as it should be: the expectation with ray termination, `f*`.
    Termination,
}

impl Measure {
    /// True if the measure reads the probabilities of termination, and so has use for a
    /// [`TerminationEstimator`].
    pub fn uses_termination(self) -> bool {
        match self {
            Measure::SpatialMedian | Measure::ObjectMedian | Measure::MacDonaldBooth1990 => false,
            Measure::MacDonaldBooth => cost::MacDonaldBooth::USES_TERMINATION,
            Measure::HavranPrinted => cost::HavranPrinted::USES_TERMINATION,
            Measure::HavranPrintedCrossed => cost::HavranPrintedCrossed::USES_TERMINATION,
            Measure::Termination => cost::Termination::USES_TERMINATION,
        }
    }
}

impl Measure {
    /// All measures.
    pub const ALL: [Measure; 7] = [
        Measure::SpatialMedian,
        Measure::ObjectMedian,
        Measure::MacDonaldBooth1990,
        Measure::MacDonaldBooth,
        Measure::HavranPrinted,
        Measure::HavranPrintedCrossed,
        Measure::Termination,
    ];
}

/// How the probabilities `p_L`, `p_R` that a ray ends in a child are estimated.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum TerminationEstimator {
    /// `p = 1 - exp(-beta * 2 S / A_cell)` with the exact one-sided area S inside the child.
    SurfaceArea {
        /// Exponent; `None` calibrates it at the root with sampled lines.
        beta: Option<f64>,
    },
    /// `p = 1 - exp(-(area projected onto the cut) / a_c)` (after Moulin et al. 2015).
    Projection,
    /// The share of sampled uniform lines that end in the child; `SurfaceArea` below `stop_below`
    /// primitives.
    SampledLines {
        /// Lines sampled in each node, 64 to 256 sensible.
        lines: u32,
        /// Number of primitives under which lines no longer pay.
        stop_below: u32,
    },
}

impl Default for TerminationEstimator {
    fn default() -> Self {
        TerminationEstimator::SurfaceArea { beta: None }
    }
}

/// When a node becomes a leaf.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Termination {
    /// At `leaf_size` primitives or fewer, or at `max_depth`; any plane is taken until then.
    Fixed {
        /// Largest number of primitives of a leaf above the depth limit.
        leaf_size: u32,
        /// Depth at which every node is a leaf; `None` is `1.2 log2 N + 2`.
        max_depth: Option<u32>,
    },
    /// Havran and Bittner 2002: depth `1.2 log2 N + 2`; a split fails if
    /// `best cost / leaf cost > max_ratio`; `1 + 0.2 max_depth` failures are allowed on a path.
    Automatic {
        /// Ratio above which a split counts as a failure (0.75 in the thesis).
        max_ratio: f64,
    },
    /// Wald and Havran 2006: a leaf where no split is cheaper than the leaf.
    Cost {
        /// Depth limit; `None` is `1.2 log2 N + 8`.
        max_depth: Option<u32>,
    },
}

/// How a build for the wide tree trades its own time against the rays'.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Preset {
    /// Binned planes everywhere, boxes cut instead of primitives: for geometry that changes.
    Fast,
    /// Binned planes in large nodes, the exact sweep in small ones, primitives clipped.
    #[default]
    Balanced,
    /// The exact sweep everywhere.
    Best,
    /// As balanced, with a high price of memory: for scenes that would not fit otherwise.
    Compact,
}

impl Preset {
    /// All presets.
    pub const ALL: [Preset; 4] = [Preset::Fast, Preset::Balanced, Preset::Best, Preset::Compact];

    /// The name used on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Preset::Fast => "fast",
            Preset::Balanced => "balanced",
            Preset::Best => "best",
            Preset::Compact => "compact",
        }
    }
}

/// The largest `binned_from` of a build with sample rays, which the exact sweep does not know: nodes with fewer
/// references try all positions.
const BINNED_WITH_RAYS: usize = 33;

/// Everything that steers a build.
#[derive(Clone, Debug, PartialEq)]
pub struct BuildSettings {
    /// Planes and measure.
    pub measure: Measure,
    /// Estimator of ray termination, for the measures that use it.
    pub estimator: TerminationEstimator,
    /// The cost of a set of primitives.
    pub leaf_cost: LeafCost,
    /// When to stop.
    pub termination: Termination,
    /// Cost of a traversal step in intersection tests.
    pub traversal_cost: f64,
    /// Factor on the cost of a plane with an empty side, `0 < f <= 1`; 1 is off.
    pub empty_factor: f64,
    /// Price of memory, in intersection tests of a ray through the scene: what it would cost to
    /// store all primitives in leaves once more. A cut must gain more than the copies that it makes
    /// cost, so that duplication goes where rays are likely. 0 is off.
    pub size_cost: f64,
    /// Largest price of one more unit of leaf cost to a ray that hits the node, in intersection tests.
    /// Without it, detail that is small in a large scene would not be worth its memory, although
    /// somebody may look at nothing else.
    pub max_size_price: f64,
    /// Cut empty slabs off a node that would become a leaf (the paper's Figure 2).
    pub late_cutting: bool,
    /// Clip primitives to the cell ("perfect splits"); otherwise their boxes are sorted.
    pub clipping: bool,
    /// Largest number of references in all leaves as a multiple of the number of primitives; the
    /// build stops splitting what would exceed it. Shared out over the children in proportion to
    /// their counts, so that the tree does not depend on the number of threads.
    pub max_duplication: f64,
    /// Nodes with at least so many references look for their plane in bins (Shevtsov, Soupikov and
    /// Kapustin 2007) instead of sweeping over all of them; `usize::MAX` is the exact sweep
    /// everywhere. Read by [`Measure::MacDonaldBooth`] alone.
    pub binned_from: usize,
    /// Rays like those that the tree will be asked for: cells that they meet more often than their surface area says
    /// weigh more. Without any the surface area alone decides. Read by [`Measure::MacDonaldBooth`] alone, whose nodes
    /// then all look for their planes in bins or, where they are small, among all positions.
    pub rays: RaySample,
    /// Width by which all primitives are thickened on every side, so that cells also refer to those that
    /// pass by them so closely: for geometry that has been rounded. 0 is off.
    pub margin: f32,
    /// Bytes that a build for the wide tree may take beyond its geometry. One that needs more by
    /// [`estimated_bytes`](super::estimated_bytes) without any duplication is refused before it begins; others get
    /// no more references than fit, and what the tree takes is checked again, exactly, before it is
    /// laid out. The tree depends on the limit, as on any setting. `None` is no limit.
    pub memory_limit: Option<u64>,
    /// Threads; 0 is one per core. The tree is the same for any number.
    pub threads: usize,
}

impl Default for BuildSettings {
    fn default() -> Self {
        BuildSettings {
            measure: Measure::MacDonaldBooth,
            estimator: TerminationEstimator::default(),
            leaf_cost: LeafCost::Linear,
            termination: Termination::Cost { max_depth: None },
            traversal_cost: 1.0,
            empty_factor: 0.8,
            size_cost: 0.0,
            max_size_price: 0.8,
            late_cutting: true,
            clipping: true,
            max_duplication: 32.0,
            binned_from: usize::MAX,
            rays: RaySample::default(),
            margin: 0.0,
            memory_limit: None,
            threads: 0,
        }
    }
}

impl BuildSettings {
    /// The settings for a tree that is compiled to a [`WideTree`](crate::wide::WideTree): leaves
    /// cost their blocks of eight, and a step of three levels costs about as much as a block.
    pub fn preset(preset: Preset) -> Self {
        let (binned_from, clipping, size_cost, max_size_price) = match preset {
            Preset::Fast => (0, false, 0.75, 0.8),
            Preset::Balanced => (33, true, 0.75, 0.8),
            Preset::Best => (usize::MAX, true, 0.25, 0.8),
            Preset::Compact => (33, true, 6.0, 2.0),
        };
        BuildSettings {
            leaf_cost: LeafCost::Blocks { width: 8 },
            traversal_cost: 0.3,
            size_cost,
            max_size_price,
            late_cutting: false,
            clipping,
            binned_from,
            max_duplication: 16.0,
            ..BuildSettings::default()
        }
    }

    /// The settings in effect, checked: the 1990 measure never clips, and sample rays are looked at in bins.
    ///
    /// # Errors
    /// [`BuildError::Setting`] that names the first field out of range.
    pub fn effective(&self) -> Result<BuildSettings, BuildError> {
        let check = |ok: bool, field, found: String, expected| {
            if ok { Ok(()) } else { Err(BuildError::Setting { field, found, expected }) }
        };
        let number = |ok: bool, field, found: f64, expected| {
            check(ok && found.is_finite(), field, found.to_string(), expected)
        };
        let c = self.traversal_cost;
        number(c >= 0.0, "traversal_cost", c, "a finite number, at least 0")?;
        let f = self.empty_factor;
        number(f > 0.0 && f <= 1.0, "empty_factor", f, "above 0 and at most 1")?;
        let s = self.size_cost;
        number(s >= 0.0, "size_cost", s, "a finite number, at least 0")?;
        let p = self.max_size_price;
        number(p >= 0.0, "max_size_price", p, "a finite number, at least 0")?;
        let d = self.max_duplication;
        number(d >= 1.0, "max_duplication", d, "a finite number, at least 1")?;
        let m = f64::from(self.margin);
        number(m >= 0.0, "margin", m, "a finite number, at least 0")?;
        match self.leaf_cost {
            LeafCost::Linear => {}
            LeafCost::Blocks { width } => {
                check(width >= 1, "leaf_cost.width", width.to_string(), "at least 1")?;
            }
            LeafCost::Logarithmic { a, b } => {
                number(a >= 0.0, "leaf_cost.a", a, "a finite number, at least 0")?;
                number(b >= 0.0, "leaf_cost.b", b, "a finite number, at least 0")?;
            }
        }
        match self.termination {
            Termination::Fixed { leaf_size: n, max_depth } => {
                check(n >= 1, "termination.leaf_size", n.to_string(), "at least 1")?;
                Self::check_depth(max_depth)?;
            }
            Termination::Automatic { max_ratio: r } => {
                number(r > 0.0, "termination.max_ratio", r, "a finite number above 0")?;
            }
            Termination::Cost { max_depth } => Self::check_depth(max_depth)?,
        }
        match self.estimator {
            TerminationEstimator::SurfaceArea { beta: Some(b) } => {
                number(b > 0.0, "estimator.beta", b, "a finite number above 0")?;
            }
            TerminationEstimator::SampledLines { lines, .. } => {
                check(lines >= 1, "estimator.lines", lines.to_string(), "at least 1")?;
            }
            _ => {}
        }
        let clipping = self.clipping && self.measure != Measure::MacDonaldBooth1990;
        let mut binned_from = self.binned_from;
        if !self.rays.is_empty() {
            let found = format!("a sample of {} with {:?}", self.rays.len(), self.measure);
            let expected = "no rays but with the surface area, Measure::MacDonaldBooth";
            check(self.measure == Measure::MacDonaldBooth, "rays", found, expected)?;
            binned_from = binned_from.min(BINNED_WITH_RAYS);
        }
        Ok(BuildSettings { clipping, binned_from, ..self.clone() })
    }

    fn check_depth(max_depth: Option<u32>) -> Result<(), BuildError> {
        match max_depth {
            Some(d) if d as usize > MAX_DEPTH => Err(BuildError::Setting {
                field: "termination.max_depth",
                found: d.to_string(),
                expected: "at most tree::MAX_DEPTH (96)",
            }),
            _ => Ok(()),
        }
    }
}
