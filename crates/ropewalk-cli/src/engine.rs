//! From a scene's name and a method's name to something that answers rays.

use crate::interrupt;
use crate::output::usage;
use anyhow::Context;
use ropewalk::build::{self, BuildError, BuildReport, BuildSettings, Termination};
use ropewalk::method::Method;
use ropewalk::wide::WideTree;
use ropewalk::{Accelerator, Geometry};
use ropewalk_scene::{FacetPolicy, Loaded as Source, NffLimits, Scene};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// A scene with its primitives.
pub struct Loaded {
    pub scene: Scene,
    pub geometry: Arc<Geometry>,
    pub seconds: f64,
}

/// Reads a scene from a path or a built-in name.
pub fn load(spec: &str) -> anyhow::Result<Loaded> {
    load_as(spec, None)
}

/// The same with a facet policy; `None` is the rule of the databases.
pub fn load_as(spec: &str, policy: Option<FacetPolicy>) -> anyhow::Result<Loaded> {
    let start = Instant::now();
    let source = ropewalk_scene::load(spec, &NffLimits::default())?;
    let is_mesh = matches!(source, Source::Mesh(..));
    let scene = source.into_scene();
    // Which way the triangles of a mesh turn is not known.
    let rule = || if is_mesh { FacetPolicy::TwoSided } else { facet_policy(&scene) };
    let policy = policy.unwrap_or_else(rule);
    let geometry = scene.geometry(policy).with_context(|| spec.to_owned())?;
    Ok(Loaded { scene, geometry: Arc::new(geometry), seconds: start.elapsed().as_secs_f64() })
}

/// The SPD rule: opaque surfaces are one-sided, except in the teapot, built-in or in a file of that
/// name (`teapot`, `teapot_12`).
fn facet_policy(scene: &Scene) -> FacetPolicy {
    let stem = scene.name.split(['_', ':', '.']).find(|part| *part == "teapot");
    if stem.is_some() { FacetPolicy::TwoSided } else { FacetPolicy::OneSided }
}

/// The method called `name`, or a usage error that lists them all.
pub fn method(name: &str) -> anyhow::Result<Method> {
    Method::by_name(name).ok_or_else(|| {
        let names: Vec<_> = Method::all().iter().map(|m| m.name).collect();
        usage(format!("no method is called '{name}'; methods are: {}", names.join(", ")))
    })
}

/// A method made ready for rays.
pub struct Engine {
    pub accelerator: Accelerator,
    pub report: Option<BuildReport>,
    pub build_seconds: f64,
}

/// Builds a wide tree.
pub fn build_wide(
    geometry: &Geometry,
    settings: &BuildSettings,
) -> anyhow::Result<(WideTree, BuildReport)> {
    let bar = interrupt::bar(1000, "build");
    let watch = Watch { cancel: interrupt::flag(), bar: &bar };
    let built = WideTree::build(geometry, settings, &watch);
    bar.finish_and_clear();
    match built {
        Err(BuildError::Cancelled) => Err(interrupt::interrupted()),
        other => other.map_err(Into::into),
    }
}

/// Builds the tree, and the ropes if the method walks them.
pub fn build(geometry: &Arc<Geometry>, method: &Method, threads: usize) -> anyhow::Result<Engine> {
    let start = Instant::now();
    // Brute force needs no tree; an accelerator always holds one, so it gets a single leaf.
    let one_leaf = BuildSettings {
        termination: Termination::Fixed { leaf_size: 1, max_depth: Some(0) },
        late_cutting: false,
        ..BuildSettings::default()
    };
    let settings = method.build.as_ref().unwrap_or(&one_leaf);
    let settings = BuildSettings { threads, ..settings.clone() };
    let bar = interrupt::bar(1000, "build");
    let watch = Watch { cancel: interrupt::flag(), bar: &bar };
    let built = build::build(geometry, &settings, &watch);
    bar.finish_and_clear();
    let (tree, report) = match built {
        Err(BuildError::Cancelled) => return Err(interrupt::interrupted()),
        other => other?,
    };
    let accelerator = Accelerator::new(Arc::clone(geometry), Arc::new(tree), method.walk)?;
    let build_seconds = start.elapsed().as_secs_f64();
    let report = method.build.is_some().then_some(report);
    Ok(Engine { accelerator, report, build_seconds })
}

/// Shows the progress of reading or building and passes Ctrl-C on to it.
pub struct Watch<'a> {
    pub cancel: Arc<AtomicBool>,
    pub bar: &'a indicatif::ProgressBar,
}

impl build::Monitor for Watch<'_> {
    fn progress(&self, fraction: f64) {
        self.bar.set_position((fraction * 1000.0) as u64);
    }

    fn is_cancelled(&self) -> bool {
        self.cancel.load(Ordering::Relaxed)
    }
}
