//! Shells: a sea shell of overlapping spheres, many of them tiny (Pickover 1989).

use super::emitter::{Emitter, Finish, SKY};
use crate::{Camera, SceneSink};
use std::f64::consts::PI;

/// How fast the spiral widens, per radian.
const GROWTH: f64 = 0.15;

/// Height over radius: the shell points down.
const SLOPE: f64 = -2.0;

/// Turns of the spiral.
const TURNS: f64 = 9.0;

/// Steps of the spiral.
fn steps(size: u32) -> i64 {
    180 << size
}

/// A sphere a step and one at the end.
pub(super) fn object_count(size: u32) -> u64 {
    steps(size).unsigned_abs() + 1
}

pub(super) fn generate<S: SceneSink>(size: u32, out: &mut Emitter<S>) -> Result<(), S::Error> {
    out.head(
        SKY,
        Camera {
            from: [-6.0, -60.0, 35.0],
            at: [0.0, 8.0, -15.0],
            up: [0.0, 0.0, 1.0],
            angle: 45.0,
            hither: 0.5,
            resolution: [512; 2],
        },
        &[[-100.0, -100.0, 100.0]],
    )?;
    out.finish(Finish::shiny([1.0, 0.8, 0.4], 0.8, 0.2, 10.0).with_index(1.0))?;
    let steps = steps(size);
    (-steps * 2 / 3..=steps / 3).try_for_each(|i| {
        let angle = TURNS * 2.0 * PI * i as f64 / steps as f64;
        let radius = (GROWTH * angle).exp();
        out.sphere([radius * angle.sin(), radius * angle.cos(), SLOPE * radius], radius)
    })
}
