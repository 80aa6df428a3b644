//! Tree: a binary tree of cones and spheres (Aono and Kunii 1984) on a field.

use super::emitter::{Emitter, Finish, SKY};
use super::transform::{Affine, Axis};
use crate::{Camera, SceneSink};
use std::f64::consts::PI;

/// How a branch stands on its parent.
struct Branch {
    /// Angle to the parent, in degrees.
    bend: f64,
    /// Angle about the parent, in degrees.
    divergence: f64,
    /// Length over that of the parent.
    contraction: f64,
}

const BRANCHES: [Branch; 2] = [
    Branch { bend: 40.0, divergence: 90.0, contraction: 0.65 },
    Branch { bend: 25.0, divergence: 140.0 + 90.0, contraction: 0.70 },
];

/// Diameter at the end of a branch over that at its foot.
const TAPER: f64 = 0.67;

/// Radius at the foot of the trunk, which has length 1.
const TRUNK_RADIUS: f64 = 0.15;

/// The field and a cone and a sphere for each of `2^(size + 1) - 1` branches.
pub(super) fn object_count(size: u32) -> u64 {
    2 * (2u64.pow(size + 1) - 1) + 1
}

pub(super) fn generate<S: SceneSink>(size: u32, out: &mut Emitter<S>) -> Result<(), S::Error> {
    out.head(
        SKY,
        Camera {
            from: [4.5, 0.4, 2.0],
            at: [0.0, 0.0, 1.5],
            up: [0.0, 0.0, 1.0],
            angle: 45.0,
            hither: 1.0,
            resolution: [512; 2],
        },
        &[
            [-5.0, 5.0, 50.0],
            [30.0, -30.0, 30.0],
            [-40.0, -30.0, 20.0],
            [10.0, 30.0, 40.0],
            [-30.0, 40.0, 10.0],
            [50.0, 25.0, 20.0],
            [-10.0, -60.0, 30.0],
        ],
    )?;
    out.finish(Finish::matte([0.2, 0.7, 0.2], 1.0))?;
    out.polygon(&[[50.0, 50.0, 0.0], [-50.0, 50.0, 0.0], [-50.0, -50.0, 0.0], [50.0, -50.0, 0.0]])?;
    out.finish(Finish::matte([0.55, 0.4, 0.2], 1.0))?;
    let joints = BRANCHES.map(|branch| {
        Affine::rotation(Axis::X, branch.bend * PI / 180.0)
            .then(&Affine::rotation(Axis::Z, branch.divergence * PI / 180.0))
            .then(&Affine::scaling(branch.contraction))
            .then(&Affine::translation([0.0, 0.0, 1.0]))
    });
    grow(out, &joints, size, &Affine::IDENTITY, 1.0)
}

/// A branch from the origin to the tip of the z axis of `frame`, and `depth` generations on it.
fn grow<S: SceneSink>(
    out: &mut Emitter<S>,
    joints: &[Affine; 2],
    depth: u32,
    frame: &Affine,
    thickness: f64,
) -> Result<(), S::Error> {
    let (base, apex) = (frame.point([0.0; 3]), frame.point([0.0, 0.0, 1.0]));
    let base_radius = thickness * TRUNK_RADIUS;
    let apex_radius = base_radius * TAPER;
    out.cone((base, base_radius), (apex, apex_radius))?;
    out.sphere(apex, apex_radius)?;
    if depth == 0 {
        return Ok(());
    }
    joints
        .iter()
        .try_for_each(|joint| grow(out, joints, depth - 1, &joint.then(frame), thickness * TAPER))
}
