//! How much memory a build may take.

use super::error::BuildError;
use super::fragment::Fragment;
use super::settings::{BuildSettings, Measure};
use crate::ray::Ray;

/// Bytes a primitive while the largest node is split: its fragment of 32 bytes, where it goes, and a
/// copy of the part that goes left.
const PRIMITIVE: f64 = 56.0;

/// Bytes a reference at the end of a build for the wide tree: 55 of treelets and blocks on the benchmark's
/// scenes, the reference itself, and its share of the binary nodes.
const REFERENCE: f64 = 64.0;

/// Bytes that any build takes.
const BASE: f64 = 65_536.0;

/// Bytes a primitive of the sorted events of an exact sweep, with those of the child at hand.
const EVENTS: f64 = 96.0;

/// Bytes a primitive of the area functions that tell where rays end, along one axis of the root.
const RAMPS: f64 = 160.0;

/// What a build takes beyond [`estimated_bytes`] by its settings: events of a sweep, areas of an estimator,
/// rays of a sample. All pending nodes together keep a ray for each of their fragments, about.
fn by_settings(settings: &BuildSettings, primitives: usize) -> f64 {
    let sweeps = settings.measure != Measure::MacDonaldBooth || settings.binned_from == usize::MAX;
    let events = if sweeps { EVENTS } else { 0.0 };
    let ramps = if settings.measure.uses_termination() { RAMPS } else { 0.0 };
    let rays = settings.rays.len();
    let parts = if rays == 0 { 0 } else { 2 * rays.min(primitives) + primitives };
    let sample = rays * size_of::<Ray>() + parts * size_of::<Fragment>();
    primitives as f64 * (events + ramps) + sample as f64
}

/// What a build for the wide tree takes at its peak beyond the geometry, if it ends with so many references
/// a primitive. An estimate, meant to be above: builds of the benchmark's scenes stay below it.
pub fn estimated_bytes(primitives: usize, duplication: f64) -> u64 {
    (BASE + primitives as f64 * (PRIMITIVE + REFERENCE * duplication)) as u64
}

/// The largest duplication up to that of the settings with which a build is estimated to stay within a limit.
///
/// # Errors
/// [`BuildError::Memory`] if it would not even without any duplication.
pub(crate) fn duplication_within(
    limit: u64,
    primitives: usize,
    settings: &BuildSettings,
) -> Result<f64, BuildError> {
    let (max, more) = (settings.max_duplication, by_settings(settings, primitives));
    let least = estimated_bytes(primitives, 1.0) + more as u64;
    if least > limit {
        return Err(BuildError::Memory { needed: least, limit });
    }
    let rest = limit as f64 - BASE - primitives as f64 * PRIMITIVE - more;
    Ok((rest / (primitives.max(1) as f64 * REFERENCE)).clamp(1.0, max))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::{CostChoice, Preset, RaySample};

    #[test]
    fn limits_bound_the_duplication() {
        let settings = &BuildSettings::preset(Preset::Balanced);
        let needed = |d| estimated_bytes(1000, d);
        assert_eq!(duplication_within(u64::MAX, 1000, settings), Ok(16.0));
        assert_eq!(duplication_within(needed(1.0), 1000, settings), Ok(1.0));
        let found = duplication_within(needed(3.0), 1000, settings).unwrap();
        assert!((found - 3.0).abs() < 1e-3);
        let limit = needed(1.0) - 1;
        let refused = BuildError::Memory { needed: needed(1.0), limit };
        assert_eq!(duplication_within(limit, 1000, settings), Err(refused));
        assert_eq!(duplication_within(1 << 20, 0, settings), Ok(16.0));
    }

    #[test]
    fn rays_and_sweeps_need_more() {
        let rays = RaySample::new(&[Ray::new([0.0; 3], [1.0; 3]); 100]);
        let sampled = BuildSettings { rays, ..BuildSettings::preset(Preset::Balanced) };
        let limit = estimated_bytes(1000, 1.0);
        let needed = limit + 100 * 32 + (2 * 100 + 1000) * 32;
        let refused = |needed| Err(BuildError::Memory { needed, limit });
        assert_eq!(duplication_within(limit, 1000, &sampled), refused(needed));
        let best = BuildSettings::preset(Preset::Best);
        assert_eq!(duplication_within(limit, 1000, &best), refused(limit + 96_000));
        let ends = CostChoice::Termination.applied(best);
        assert_eq!(duplication_within(limit, 1000, &ends), refused(limit + 256_000));
    }
}
