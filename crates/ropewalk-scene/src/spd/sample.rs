//! Sample: three tessellated tori, a cone and a disc. It has one size.

use super::emitter::{Emitter, Finish};
use super::transform::{Affine, Vec3, cross, normalized};
use crate::{Camera, SceneSink};
use std::f64::consts::PI;

/// Radius of a torus, and of its tube.
const RING_RADIUS: f64 = 2.0;
const TUBE_RADIUS: f64 = 0.5;

/// Steps around a torus and around its tube.
const TORUS_STEPS: usize = 12;

/// Triangles of the disc.
const DISC_STEPS: usize = 16;

const DISC_RADIUS: f64 = 4.0;

/// Three tori, the cone, the disc.
pub(super) fn object_count() -> u64 {
    (3 * 2 * TORUS_STEPS * TORUS_STEPS + 1 + DISC_STEPS) as u64
}

pub(super) fn generate<S: SceneSink>(out: &mut Emitter<S>) -> Result<(), S::Error> {
    out.head(
        [0.8; 3],
        Camera {
            from: [0.0, 5.0, -5.0],
            at: [0.0; 3],
            up: [0.0, 1.0, 0.0],
            angle: 45.0,
            hither: 0.001,
            resolution: [512; 2],
        },
        &[[-10.0, 20.0, -20.0]],
    )?;
    let finish = |color| Finish::shiny(color, 0.7, 0.0, 10.0).with_index(1.0);
    out.finish(finish([0.0, 1.0, 1.0]))?;
    torus(out, [-1.0, 0.0, 0.0], [1.0, 1.0, -0.5])?;
    out.finish(finish([1.0, 1.0, 0.0]))?;
    torus(out, [0.0; 3], [0.0, 1.0, -0.5])?;
    out.finish(finish([1.0, 0.0, 1.0]))?;
    torus(out, [1.0, 0.0, 0.0], [-1.0, 1.0, -0.5])?;
    out.finish(finish([1.0, 0.0, 0.0]))?;
    out.cone(([0.0, -2.0, 0.0], 2.0), ([0.0, 2.0, 0.0], 0.1))?;
    out.finish(finish([1.0, 0.0, 0.0]))?;
    disc(out, [0.0, -2.0, 0.0], [0.0, 1.0, 0.0])
}

/// Angles of `N` equal steps around, as a running sum.
fn angles<const N: usize>() -> [(f64, f64); N] {
    let step = 2.0 * PI / N as f64;
    let mut angle = 0.0;
    std::array::from_fn(|_| {
        let pair = (angle, angle + step);
        angle += step;
        pair
    })
}

/// A torus about `axis` (of any length), as triangles with normals.
fn torus<S: SceneSink>(out: &mut Emitter<S>, center: Vec3, axis: Vec3) -> Result<(), S::Error> {
    let frame = Affine::frame(center, normalized(axis));
    for (u0, u1) in angles::<TORUS_STEPS>() {
        for (v0, v1) in angles::<TORUS_STEPS>() {
            let [a, b, c, d] =
                [(u0, v0), (u0, v1), (u1, v1), (u1, v0)].map(|(u, v)| torus_point(&frame, u, v));
            out.patch(&[c.0, b.0, a.0], &[c.1, b.1, a.1])?;
            out.patch(&[d.0, c.0, a.0], &[d.1, c.1, a.1])?;
        }
    }
    Ok(())
}

/// Point and normal at the angles `u` around the tube and `v` around the axis.
fn torus_point(frame: &Affine, u: f64, v: f64) -> (Vec3, Vec3) {
    let ((su, cu), (sv, cv)) = (u.sin_cos(), v.sin_cos());
    let reach = RING_RADIUS + TUBE_RADIUS * su;
    let along_u = [TUBE_RADIUS * cu * cv, TUBE_RADIUS * cu * sv, -TUBE_RADIUS * su];
    let along_v = [-reach * sv, reach * cv, 0.0];
    let normal = normalized(cross(along_u, along_v));
    (frame.point([reach * cv, reach * sv, TUBE_RADIUS * cu]), frame.vector(normal))
}

/// A disc as a fan of triangles.
fn disc<S: SceneSink>(out: &mut Emitter<S>, center: Vec3, axis: Vec3) -> Result<(), S::Error> {
    let frame = Affine::frame(center, axis);
    angles::<DISC_STEPS>().into_iter().try_for_each(|(u0, u1)| {
        let at = |radius: f64, u: f64| frame.point([radius * u.cos(), radius * u.sin(), 0.0]);
        out.polygon(&[at(DISC_RADIUS, u0), at(DISC_RADIUS, u1), at(0.0, u0)])
    })
}
