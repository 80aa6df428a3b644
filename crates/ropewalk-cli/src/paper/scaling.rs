//! Builds of growing size: the exact sweep with perfect splits, one thread.

use super::candidate::Candidate;
use super::model::ScalingPoint;
use super::replay::Replay;
use crate::{engine, interrupt};
use anyhow::Context;
use ropewalk::method::Method;
use ropewalk_render::{RenderSettings, record_rays};
use std::sync::atomic::AtomicBool;

/// The method that is built.
const METHOD: &str = "clipping";
/// Scenes and size factors, from about 10^4 to 10^6 objects.
const SERIES: [(&str, &[u32]); 2] = [("tetra", &[7, 8, 9, 10]), ("balls", &[4, 5, 6])];
/// Rays over which events are counted, at most.
const RAYS: usize = 100_000;

/// How many scenes are built.
pub const POINTS: u64 = (SERIES[0].1.len() + SERIES[1].1.len()) as u64;

/// Builds every size once; `step` is called after each.
///
/// # Errors
/// The scene's and the builder's, and the interruption.
pub fn run(cancel: &AtomicBool, step: impl Fn()) -> anyhow::Result<Vec<ScalingPoint>> {
    let method = Method::by_name(METHOD).context("the method is missing")?;
    let mut points = Vec::new();
    for (scene, factors) in SERIES {
        for factor in factors {
            points.push(point(scene, *factor, &method, cancel)?);
            step();
        }
    }
    Ok(points)
}

fn point(
    name: &'static str,
    factor: u32,
    method: &Method,
    cancel: &AtomicBool,
) -> anyhow::Result<ScalingPoint> {
    let loaded = engine::load(&format!("spd:{name}:{factor}"))?;
    let candidate = Candidate::build(&loaded.geometry, method, 1, cancel)?;
    let settings = RenderSettings::spd();
    let caster = &candidate.accelerator;
    let set = record_rays(&loaded.scene, &loaded.geometry, caster, &settings, RAYS)?;
    let counts = Replay::from_root(&set.rays)
        .tally(caster, cancel)
        .ok_or_else(interrupt::interrupted)?
        .counts;
    let objects = loaded.geometry.len();
    let n = objects as f64;
    let tree = caster.tree();
    Ok(ScalingPoint {
        scene: name,
        objects: objects as u64,
        build_seconds: candidate.seconds,
        nanoseconds_per_n_log_n: 1e9 * candidate.seconds / (n * n.log2()).max(1.0),
        operations: (counts.intersection_tests + counts.traversal_steps) as f64
            / set.rays.len().max(1) as f64,
        size: candidate.report.map_or(0, |r| (r.tree.inner_nodes + tree.reference_count()) as u64),
    })
}
