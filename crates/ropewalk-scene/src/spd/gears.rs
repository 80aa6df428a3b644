//! Gears: a cube of meshing gears, each with two concave faces of 144 vertices.

use super::emitter::{Emitter, Finish, SKY};
use super::transform::Vec3;
use crate::{Camera, SceneSink};
use std::f64::consts::PI;

/// Teeth of a gear.
const TEETH: usize = 36;

/// Vertices of a gear's face.
const FACE: usize = 4 * TEETH;

/// Share of the radius that the teeth take.
const TOOTH_HEIGHT: f64 = 1.0 - 0.9;

/// The teeth end a little before the full radius, so that meshing gears do not touch.
const OUTER_RATIO: f64 = 0.995;

/// Largest thickness of a gear.
const MAX_THICKNESS: f64 = 0.1;

/// Where a tooth's four corners lie, in pitches from its middle: two outside, two at its foot.
const CORNERS: [f64; 4] = [-0.19, 0.19, 0.3, 0.7];

/// The ground and, for each gear, two faces and the rectangles between them.
pub(super) fn object_count(size: u32) -> u64 {
    u64::from(size).pow(3) * (2 + FACE as u64) + 1
}

pub(super) fn generate<S: SceneSink>(size: u32, out: &mut Emitter<S>) -> Result<(), S::Error> {
    out.head(
        SKY,
        Camera {
            from: [-1.1, -2.1, 2.6],
            at: [0.0; 3],
            up: [0.0, 0.0, 1.0],
            angle: 45.0,
            hither: 1.0,
            resolution: [512; 2],
        },
        &[
            [2.0, 4.0, 4.0],
            [-2.0, 4.0, 3.0],
            [2.0, -2.5, 2.5],
            [-1.0, -4.0, 2.0],
            [-1.111, -2.121, 2.626],
        ],
    )?;
    out.finish(Finish::shiny([1.0, 0.85, 0.7], 0.3, 0.6, 37.0))?;
    out.polygon(&[[2.0, 2.0, 0.0], [-2.0, 2.0, 0.0], [-2.0, -2.0, 0.0], [2.0, -2.0, 0.0]])?;

    let n = f64::from(size);
    let radius = 1.0 / (n - (n - 1.0) * TOOTH_HEIGHT / 2.0);
    let (first, pitch) = (-1.0 + radius, radius * (2.0 - TOOTH_HEIGHT));
    let gear = Gear {
        outer: OUTER_RATIO * radius,
        inner: (1.0 - TOOTH_HEIGHT) * radius,
        thickness: MAX_THICKNESS.min(1.0 / (2.0 * n)),
    };
    for iz in 0..size {
        for iy in 0..size {
            for ix in 0..size {
                out.finish(finish(ix, iy, iz))?;
                let center = [
                    first + f64::from(ix) * pitch,
                    first + f64::from(iy) * pitch,
                    1.0 + f64::from(iz) * (-1.0 / n),
                ];
                // Neighbours mesh: every other gear is turned by half a tooth.
                let turn = PI * f64::from((ix + iy + iz) % 2) / TEETH as f64;
                gear.emit(out, center, turn)?;
            }
        }
    }
    Ok(())
}

/// Colour and transparency by position: a fifth of the gears are glass.
fn finish(ix: u32, iy: u32, iz: u32) -> Finish {
    let mix = |a: u32, b: u32, c: u32, factor: f64| {
        0.01 + (f64::from(a * 3 + b * 2 + c + 1) * factor / 7.0).fract()
    };
    let color = [mix(ix, iy, iz, 5.0), mix(iy, iz, ix, 3.0), mix(iz, ix, iy, 2.0)];
    let brightest = color[0].max(color[1]).max(color[2]);
    let color = color.map(|c| c / brightest);
    if (ix * 4 + iy * 2 + iz).is_multiple_of(5) {
        Finish { transmittance: 0.8, ..Finish::matte(color, 0.2).with_index(1.1) }
    } else {
        Finish::matte(color, 1.0)
    }
}

/// The measures all gears of a scene share.
struct Gear {
    outer: f64,
    inner: f64,
    thickness: f64,
}

impl Gear {
    /// The upper face, the rectangles around, the lower face.
    fn emit<S: SceneSink>(
        &self,
        out: &mut Emitter<S>,
        center: Vec3,
        turn: f64,
    ) -> Result<(), S::Error> {
        let top = self.face(center, turn, 1.0);
        out.polygon(&top)?;
        let down = |p: Vec3| [p[0], p[1], p[2] - self.thickness];
        for (i, &a) in top.iter().enumerate() {
            let b = top[(i + 1) % FACE];
            out.polygon(&[a, down(a), down(b), b])?;
        }
        let below = down(center);
        out.polygon(&self.face(below, turn, -1.0))
    }

    /// The outline at the height of `center`, counter-clockwise seen from above if `sense` is 1
    /// and from below if it is -1.
    fn face(&self, center: Vec3, turn: f64, sense: f64) -> [Vec3; FACE] {
        let pitch = sense * (2.0 * PI / TEETH as f64);
        std::array::from_fn(|i| {
            let (tooth, corner) = (i / 4, i % 4);
            let middle = turn + sense * (2.0 * PI * tooth as f64 / TEETH as f64);
            let angle = middle + CORNERS[corner] * pitch;
            let radius = if corner < 2 { self.outer } else { self.inner };
            [radius * angle.cos() + center[0], radius * angle.sin() + center[1], center[2]]
        })
    }
}
