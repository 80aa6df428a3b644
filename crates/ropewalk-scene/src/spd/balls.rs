//! Balls, the "sphereflake": each sphere carries nine of a third of its radius, above a floor.

use super::emitter::{Emitter, Finish, SKY};
use super::transform::{Affine, Axis, Vec3, add, cross, normalized};
use crate::{Camera, SceneSink};
use std::f64::consts::PI;

/// Radius of a sphere over that of its parent.
const RATIO: f64 = 1.0 / 3.0;

/// Radius of the first sphere.
const ROOT_RADIUS: f64 = 0.5;

/// Cosine to the z axis from which on a direction counts as the axis itself: the rotation axis of
/// a nearly parallel direction is lost to rounding.
const ALONG_AXIS: f64 = 0.9999;

/// The floor and `1 + 9 + ... + 9^size` spheres.
pub(super) fn object_count(size: u32) -> u64 {
    (9u64.pow(size + 1) - 1) / 8 + 1
}

pub(super) fn generate<S: SceneSink>(size: u32, out: &mut Emitter<S>) -> Result<(), S::Error> {
    out.head(
        SKY,
        Camera {
            from: [2.1, 1.3, 1.7],
            at: [0.0; 3],
            up: [0.0, 0.0, 1.0],
            angle: 45.0,
            hither: 0.01,
            resolution: [512; 2],
        },
        &[[4.0, 3.0, 2.0], [1.0, -4.0, 4.0], [-3.0, 1.0, 5.0]],
    )?;
    out.finish(Finish::matte([1.0, 0.75, 0.33], 0.8).with_index(1.0))?;
    let (w, z) = (12.0, -ROOT_RADIUS);
    out.polygon(&[[w, w, z], [-w, w, z], [-w, -w, z], [w, -w, z]])?;
    out.finish(Finish::shiny([1.0, 0.9, 0.7], 0.5, 0.5, 37.0).with_index(1.0))?;
    flake(out, &child_directions(), size, [0.0; 3], ROOT_RADIUS, [0.0, 0.0, 1.0])
}

/// Where the nine children of a sphere with the outward direction +z sit: three trios, a third of
/// a turn apart.
fn child_directions() -> [Vec3; 9] {
    let d = 1.0 / 2.0f64.sqrt();
    let tilt = Affine::rotation_about(normalized([1.0, -1.0, 0.0]), (2.0 / 6.0f64.sqrt()).asin());
    let trio = [[d, d, 0.0], [d, 0.0, -d], [0.0, d, -d]].map(|v| tilt.vector(v));
    std::array::from_fn(|child| {
        let turn = Affine::rotation(Axis::Z, (child / 3) as f64 * 2.0 * PI / 3.0);
        turn.vector(trio[child % 3])
    })
}

/// A sphere and `depth` generations of children around `direction`.
fn flake<S: SceneSink>(
    out: &mut Emitter<S>,
    children: &[Vec3; 9],
    depth: u32,
    center: Vec3,
    radius: f64,
    direction: Vec3,
) -> Result<(), S::Error> {
    out.sphere(center, radius)?;
    if depth == 0 {
        return Ok(());
    }
    let turn = if direction[2] >= ALONG_AXIS {
        Affine::IDENTITY
    } else if direction[2] <= -ALONG_AXIS {
        Affine::rotation(Axis::Y, PI)
    } else {
        let axis = normalized(cross([0.0, 0.0, 1.0], direction));
        Affine::rotation_about(axis, direction[2].acos())
    };
    let reach = radius * (1.0 + RATIO);
    children.iter().try_for_each(|&child| {
        let at = add(turn.vector(child).map(|x| x * reach), center);
        let outward = std::array::from_fn(|i| (at[i] - center[i]) / reach);
        flake(out, children, depth - 1, at, radius * RATIO, outward)
    })
}
