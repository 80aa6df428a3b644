//! How to build: presets, cost models, samples of rays, limits of memory, and who watches.

use crate::error::{self, Failure};
use crate::figures::Build;
use crate::rays::Rays;
use pyo3::prelude::*;
use ropewalk::build::{BuildSettings, CostChoice, Monitor, Preset, RaySample};
use ropewalk::{Shape, Sides};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Watches a build for Python.
pub struct Watch<'a> {
    /// Set when the build is to stop.
    pub stop: &'a AtomicBool,
    /// The largest share done so far, as the bits of an `f64`, which are ordered as the numbers are.
    pub done: &'a AtomicU64,
}

impl Monitor for Watch<'_> {
    fn progress(&self, fraction: f64) {
        self.done.fetch_max(fraction.max(0.0).to_bits(), Ordering::Relaxed);
    }

    fn is_cancelled(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

/// How to build.
pub struct Plan {
    /// The preset.
    pub preset: Preset,
    cost_model: CostChoice,
    rays: RaySample,
}

impl Plan {
    /// From the names of a preset and of a cost model.
    pub fn new((preset, cost_model): &(String, String)) -> PyResult<Plan> {
        let known = Preset::ALL.into_iter().find(|known| known.name() == preset);
        let preset = known.ok_or_else(|| {
            let names = Preset::ALL.map(Preset::name).join(", ");
            let message = format!("preset is '{preset}'; expected one of {names}");
            error::argument("preset", None, message)
        })?;
        let cost_model = CostChoice::by_name(cost_model).ok_or_else(|| {
            let names = CostChoice::ALL.map(CostChoice::name).join(", ");
            let message = format!("cost_model is '{cost_model}'; expected one of {names}");
            error::argument("cost_model", None, message)
        })?;
        Ok(Plan { preset, cost_model, rays: RaySample::default() })
    }

    /// With a sample of rays.
    pub fn with_rays(self, rays: RaySample) -> Plan {
        Plan { rays, ..self }
    }

    /// The settings; work with 0 threads runs in the current pool, which is the one that `watch` chose.
    pub fn settings(&self, threads: usize) -> BuildSettings {
        self.cost_model.applied(BuildSettings {
            threads: usize::from(threads == 1),
            rays: self.rays.clone(),
            ..BuildSettings::preset(self.preset)
        })
    }
}

/// The names of a preset and of a build's cost model, that of the presets where it is not known.
pub fn plan_of(preset: Preset, report: &Build) -> (&'static str, &'static str) {
    (preset.name(), report.cost_model.unwrap_or_default().name())
}

/// The sample that some rays are.
pub fn sample(py: Python<'_>, rays: Option<&Rays>) -> PyResult<RaySample> {
    let Some(rays) = rays else { return Ok(RaySample::default()) };
    let arrays = rays.borrow(py)?;
    let view = arrays.view()?;
    Ok(py.detach(|| {
        let mut rays = Vec::with_capacity(view.count);
        view.interleave(0..view.count, &mut rays);
        RaySample::new(&rays)
    }))
}

/// What a limit leaves for a build beyond the geometry itself.
pub fn left_for_build(
    limit: Option<u64>,
    kept: u64,
    primitives: usize,
) -> Result<Option<u64>, Failure> {
    let Some(limit) = limit else { return Ok(None) };
    let geometry = kept + (primitives * (size_of::<Shape>() + size_of::<Sides>())) as u64;
    let needed = geometry + ropewalk::build::estimated_bytes(primitives, 1.0);
    if needed > limit { Err(Failure::Memory { needed, limit }) } else { Ok(Some(limit - geometry)) }
}
