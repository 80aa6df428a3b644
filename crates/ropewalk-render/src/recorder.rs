//! The rays of a render as data.

use crate::error::RenderError;
use crate::observer::Observer;
use crate::ray_counts::{RayCounts, RayKind};
use crate::renderer::Frame;
use crate::settings::RenderSettings;
use ropewalk::traverse::{NoCounts, RayCaster};
use ropewalk::{Geometry, Ray};
use ropewalk_scene::Scene;

/// A ray and why it was shot. Shadow rays end at their light (`t_max` is 1) and ask whether
/// anything is hit; all others ask for the first hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecordedRay {
    /// The ray with its range.
    pub ray: Ray,
    /// Its kind.
    pub kind: RayKind,
}

/// Rays of a render in the order in which one thread shoots them: row by row, and each eye ray
/// followed by its tree.
#[derive(Clone, Debug, PartialEq)]
pub struct RaySet {
    /// The recorded rays.
    pub rays: Vec<RecordedRay>,
    /// Every `stride`-th ray was recorded, from the first on; a power of two, 1 if all were.
    pub stride: u64,
    /// All rays of the render, recorded or not.
    pub counts: RayCounts,
}

/// Collects the rays of a render, at most `max` of them (at least 1 is kept).
///
/// Where there are more, every second, fourth, ... ray is kept, evenly over the picture and over
/// the kinds, so that between `max / 2` and `max` rays remain. Runs in the calling thread; memory
/// is bounded by `max`. The settings' thread count and counters have no effect.
///
/// # Errors
/// As [`render`](crate::render).
pub fn record_rays<A: RayCaster>(
    scene: &Scene,
    geometry: &Geometry,
    caster: &A,
    settings: &RenderSettings,
    max: usize,
) -> Result<RaySet, RenderError> {
    let frame = Frame::new(scene, geometry, caster, settings)?;
    let mut recorder = Recorder::new(max);
    let [w, h] = frame.cells();
    for y in 0..h {
        for x in 0..w {
            frame.trace_cell(x, y, &mut recorder, |_, _| {});
        }
    }
    Ok(recorder.set)
}

struct Recorder {
    set: RaySet,
    max: usize,
    seen: u64,
    counters: NoCounts,
}

impl Recorder {
    fn new(max: usize) -> Self {
        let set = RaySet { rays: Vec::new(), stride: 1, counts: RayCounts::default() };
        Recorder { set, max: max.max(1), seen: 0, counters: NoCounts }
    }

    /// Keeps every second of the kept rays.
    fn thin(&mut self) {
        let mut index = 0;
        self.set.rays.retain(|_| {
            index += 1;
            index % 2 == 1
        });
        self.set.stride *= 2;
    }
}

impl Observer for Recorder {
    type Counters = NoCounts;

    fn cast(&mut self, kind: RayKind, ray: &Ray) -> &mut NoCounts {
        if self.seen.is_multiple_of(self.set.stride) {
            if self.set.rays.len() == self.max {
                self.thin();
            }
            if self.seen.is_multiple_of(self.set.stride) {
                self.set.rays.push(RecordedRay { ray: *ray, kind });
            }
        }
        self.seen += 1;
        &mut self.counters
    }

    fn answered(&mut self, kind: RayKind, hit: bool) {
        self.set.counts.record(kind, hit);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_every_stride_th_ray() {
        for (shot, max) in [(0u32, 4), (4, 4), (5, 4), (1000, 7), (1000, 1), (3, 0)] {
            let mut recorder = Recorder::new(max);
            for i in 0..shot {
                recorder.cast(RayKind::Primary, &Ray::new([i as f32; 3], [1.0; 3]));
            }
            let set = recorder.set;
            assert!(set.rays.len() <= max.max(1));
            assert!(shot == 0 || 2 * set.rays.len() >= max.min(shot as usize));
            for (k, r) in set.rays.iter().enumerate() {
                assert_eq!(r.ray.origin[0], (k as u64 * set.stride) as f32);
            }
        }
    }
}
