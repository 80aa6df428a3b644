//! Builders of the binary BSP tree.
//!
//! One recursion serves all strategies: the fragments of a node (the boxes of its primitives' parts
//! inside its cell) lie on a stack, a plane search picks a plane, the stack is split in two. What
//! differs is the [`Measure`]: which planes are looked at, and at what cost.

mod arena;
mod blockage;
mod choice;
mod error;
mod event;
mod fragment;
mod late_cutting;
pub(crate) mod memory;
mod monitor;
mod plane;
mod rays;
mod report;
mod sample;
mod search;
mod settings;
mod stopping;
mod subtree;

pub use blockage::EstimatorStats;
pub use choice::CostChoice;
pub use error::BuildError;
pub use memory::estimated_bytes;
pub use monitor::Monitor;
pub use report::{BuildReport, StopCounts};
pub use sample::RaySample;
pub use settings::{BuildSettings, Measure, Preset, Termination, TerminationEstimator};

use crate::aabb::Aabb;
use crate::cost;
use crate::geometry::Geometry;
use crate::primitive::Primitive;
use crate::tree::{BspTree, Node, TreeStats};
use arena::Clipper;
use blockage::{Blockage, estimator_stats};
use fragment::Fragment;
use plane::Pricing;
use rayon::prelude::*;
use search::{Binned, MacDonaldBooth1990, ObjectMedian, PlaneSearch, SpatialMedian, Sweep};
use std::sync::atomic::AtomicU64;
use std::time::Instant;
use stopping::Stopping;
use subtree::{Context, Output};

/// Builds a tree with the default settings.
///
/// # Errors
/// [`BuildError::TooLarge`] where the tree outgrows its 30-bit indices.
pub fn build_default(geometry: &Geometry) -> Result<(BspTree, BuildReport), BuildError> {
    build(geometry, &BuildSettings::default(), &())
}

/// Builds a tree over `geometry`; the same tree for any number of threads. An empty geometry makes
/// a single empty leaf.
///
/// The exact sweeps take O(N log N) time (Wald and Havran 2006), the medians and the 1990 measure
/// O(N log N) with a smaller and a similar constant.
///
/// # Errors
/// [`BuildError`] if a setting is out of range, the monitor cancels, the threads cannot be started
/// or the tree outgrows its 30-bit indices.
pub fn build(
    geometry: &Geometry,
    settings: &BuildSettings,
    monitor: &dyn Monitor,
) -> Result<(BspTree, BuildReport), BuildError> {
    let settings = settings.effective()?;
    in_pool(settings.threads, || build_here(geometry, &settings, monitor))?
}

/// Builds with effective settings on the threads of the caller's pool.
pub(crate) fn build_here(
    geometry: &Geometry,
    settings: &BuildSettings,
    monitor: &dyn Monitor,
) -> Result<(BspTree, BuildReport), BuildError> {
    let start = Instant::now();
    let blockage = blockage(geometry, settings, monitor)?;
    let output = build_output(geometry, settings, blockage.as_ref(), monitor)?;
    let root = root_cell(geometry, settings);
    let tree = BspTree::from_parts(root, output.nodes, output.refs);
    let seconds = start.elapsed().as_secs_f64();
    let stats = TreeStats::of(&tree);
    let report = BuildReport {
        primitives: geometry.len(),
        degenerate: geometry.degenerate_count(),
        duplication: stats.references as f64 / geometry.len().max(1) as f64,
        tree: stats,
        stops: output.stops,
        beta: blockage.as_ref().and_then(Blockage::beta),
        estimator: blockage.map(|b| estimator_stats(geometry, &tree, &b)),
        seconds,
        settings: settings.clone(),
    };
    Ok((tree, report))
}

/// The estimator of a measure that uses one, calibrated.
fn blockage<'a>(
    geometry: &'a Geometry,
    settings: &BuildSettings,
    monitor: &dyn Monitor,
) -> Result<Option<Blockage<'a>>, BuildError> {
    if !settings.measure.uses_termination() || geometry.is_empty() {
        return Ok(None);
    }
    let probe = if Blockage::needs_probe(settings.estimator) {
        Some(probe_tree(geometry, settings, monitor)?)
    } else {
        None
    };
    Ok(Some(Blockage::new(geometry, settings.estimator, probe)))
}

/// A tree that is quick to build and good enough to answer sampled lines.
fn probe_tree(
    geometry: &Geometry,
    settings: &BuildSettings,
    monitor: &dyn Monitor,
) -> Result<BspTree, BuildError> {
    /// Cancels, but keeps the progress of the probe to itself.
    struct Quiet<'a>(&'a dyn Monitor);
    impl Monitor for Quiet<'_> {
        fn is_cancelled(&self) -> bool {
            self.0.is_cancelled()
        }
    }
    let quick = BuildSettings {
        measure: Measure::ObjectMedian,
        termination: Termination::Fixed { leaf_size: 8, max_depth: None },
        clipping: false,
        late_cutting: false,
        max_duplication: 4.0,
        threads: settings.threads,
        ..BuildSettings::default()
    };
    let output = build_output(geometry, &quick, None, &Quiet(monitor))?;
    Ok(BspTree::from_parts(geometry.bounds(), output.nodes, output.refs))
}

/// Runs `work` in a pool of its own, in the global pool (0) or without one (1).
pub(crate) fn in_pool<T: Send>(
    threads: usize,
    work: impl FnOnce() -> T + Send,
) -> Result<T, BuildError> {
    if threads <= 1 {
        return Ok(work());
    }
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|e| BuildError::Threads { threads, reason: e.to_string() })?;
    Ok(pool.install(work))
}

/// The cell of the root.
fn root_cell(geometry: &Geometry, settings: &BuildSettings) -> Aabb {
    geometry.bounds().grown(settings.margin)
}

fn build_output(
    geometry: &Geometry,
    settings: &BuildSettings,
    blockage: Option<&Blockage<'_>>,
    monitor: &dyn Monitor,
) -> Result<Output, BuildError> {
    let pricing = Pricing {
        leaf_cost: settings.leaf_cost,
        traversal_cost: settings.traversal_cost,
        empty_factor: settings.empty_factor,
        size_unit: settings.size_cost * geometry.bounds().area()
            / settings.leaf_cost.cost(geometry.len()).max(1.0),
        max_size_price: settings.max_size_price,
    };
    let search = plane_search(settings, pricing, blockage);
    let thick = |prim| geometry.shape(prim).bounds().grown(settings.margin);
    let fragment = |prim| Fragment::new(prim, &thick(prim));
    let prims = 0..geometry.len() as u32;
    let fragments: Vec<Fragment> = if settings.threads == 1 {
        prims.map(fragment).collect()
    } else {
        prims.into_par_iter().map(fragment).collect()
    };
    let references = (settings.max_duplication * fragments.len() as f64) as u64;
    let context = Context {
        search: search.as_ref(),
        clipper: Clipper { geometry, clipping: settings.clipping, margin: settings.margin },
        sample: &settings.rays,
        pricing,
        stopping: Stopping::new(settings.termination, fragments.len()),
        late_cutting: settings.late_cutting,
        parallel: settings.threads != 1,
        monitor,
        done: AtomicU64::new(0),
    };
    context.build(
        fragments,
        root_cell(geometry, settings),
        references.min(u64::from(Node::MAX_INDEX)),
    )
}

fn plane_search<'a>(
    settings: &BuildSettings,
    pricing: Pricing,
    blockage: Option<&'a Blockage<'a>>,
) -> Box<dyn PlaneSearch + 'a> {
    match settings.measure {
        Measure::SpatialMedian => Box::new(SpatialMedian { pricing }),
        Measure::ObjectMedian => Box::new(ObjectMedian { pricing }),
        Measure::MacDonaldBooth1990 => Box::new(MacDonaldBooth1990 { pricing }),
        Measure::MacDonaldBooth => {
            let exact = Sweep { model: cost::MacDonaldBooth, pricing, blockage: None };
            match settings.binned_from {
                usize::MAX => Box::new(exact),
                from => Box::new(Binned { exact, from, parallel: settings.threads != 1 }),
            }
        }
        Measure::HavranPrinted => Box::new(Sweep { model: cost::HavranPrinted, pricing, blockage }),
        Measure::HavranPrintedCrossed => {
            Box::new(Sweep { model: cost::HavranPrintedCrossed, pricing, blockage })
        }
        Measure::Termination => Box::new(Sweep { model: cost::Termination, pricing, blockage }),
    }
}
