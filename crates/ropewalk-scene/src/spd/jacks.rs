//! Jacks: three crossed cylinders with spheres at their ends, and a smaller copy in each octant.

use super::emitter::{Emitter, Finish};
use super::transform::{Affine, Axis, Vec3};
use crate::{Camera, SceneSink};
use std::f64::consts::PI;

/// Size of a jack in its cube, so that copies do not overlap.
const SHRINK: f64 = 0.75;

const CYLINDER_RADIUS: f64 = 0.1;
const SPHERE_RADIUS: f64 = 0.2;

/// Nine objects for each of `1 + 8 + ... + 8^(size - 1)` jacks.
pub(super) fn object_count(size: u32) -> u64 {
    9 * (8u64.pow(size) - 1) / 7
}

pub(super) fn generate<S: SceneSink>(size: u32, out: &mut Emitter<S>) -> Result<(), S::Error> {
    out.head(
        [0.2, 0.05, 0.2],
        Camera {
            from: [0.0, 0.0, -8.0],
            at: [0.0; 3],
            up: [0.0, 1.0, 0.0],
            angle: 25.0,
            hither: 0.001,
            resolution: [256; 2],
        },
        &[[-10.0, 3.0, -20.0]],
    )?;
    out.finish(Finish::shiny([0.737, 0.561, 0.561], 0.7, 0.7, 20.0).with_index(1.0))?;
    let frame = Affine::rotation(Axis::Y, -20.0 * PI / 180.0)
        .then(&Affine::rotation(Axis::X, -30.0 * PI / 180.0));
    divide(out, size, &frame)
}

/// A jack in `frame` and `depth - 1` generations of copies.
fn divide<S: SceneSink>(out: &mut Emitter<S>, depth: u32, frame: &Affine) -> Result<(), S::Error> {
    jack(out, &Affine::scaling(SHRINK).then(frame))?;
    if depth == 1 {
        return Ok(());
    }
    (0..8).try_for_each(|octant| {
        let half = |bit: u32| if octant >> bit & 1 == 1 { 0.5 } else { -0.5 };
        let offset = Affine::translation([half(2), half(1), half(0)]);
        divide(out, depth - 1, &Affine::scaling(0.5).then(&offset.then(frame)))
    })
}

/// Three cylinders along the axes of `frame` and six spheres at their ends.
fn jack<S: SceneSink>(out: &mut Emitter<S>, frame: &Affine) -> Result<(), S::Error> {
    let tip = |axis: usize, sign: f64| {
        let mut tip: Vec3 = [0.0; 3];
        tip[axis] = sign;
        frame.point(tip)
    };
    let scale = frame.scale();
    for axis in 0..3 {
        let radius = CYLINDER_RADIUS * scale;
        out.cone((tip(axis, -1.0), radius), (tip(axis, 1.0), radius))?;
    }
    for sign in [1.0, -1.0] {
        for axis in 0..3 {
            out.sphere(tip(axis, sign), SPHERE_RADIUS * scale)?;
        }
    }
    Ok(())
}
