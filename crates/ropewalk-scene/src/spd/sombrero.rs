//! Sombrero: a height field of a damped cosine.

use super::emitter::{Emitter, Finish, SKY};
use super::transform::Vec3;
use crate::{Camera, SceneSink};

/// Ends of the square in x and z.
const LOW: f64 = -4.0;
const HIGH: f64 = 4.0;

/// Height of the plane.
const BASE: f64 = -3.0;

/// Angular frequency: two pi, to the digits that the database was made with.
#[allow(clippy::approx_constant)]
const FREQUENCY: f64 = 2.0 * 3.14159265358;

/// Samples a side.
fn side(size: u32) -> u32 {
    16 << size
}

/// Two triangles for each cell between the samples.
pub(super) fn object_count(size: u32) -> u64 {
    2 * u64::from(side(size) - 1).pow(2)
}

pub(super) fn generate<S: SceneSink>(size: u32, out: &mut Emitter<S>) -> Result<(), S::Error> {
    out.head(
        SKY,
        Camera {
            from: [0.0, 5.0, -8.0],
            at: [0.0; 3],
            up: [0.0, 0.0, 1.0],
            angle: 40.0,
            hither: 0.01,
            resolution: [512; 2],
        },
        &[[10.0, 10.0, -10.0]],
    )?;
    out.finish(Finish::shiny([1.0, 0.1, 0.1], 0.8, 0.0, 40.0).with_index(1.0))?;

    let n = side(size);
    let spacing = (HIGH - LOW) / f64::from(n - 1);
    let mut near = row(n, 0);
    for i in 1..n {
        let far = row(n, i);
        let (z0, z1) = (LOW + f64::from(i - 1) * spacing, LOW + f64::from(i) * spacing);
        for (j, (a, b)) in near.windows(2).zip(far.windows(2)).enumerate() {
            let (x0, x1) = (LOW + j as f64 * spacing, LOW + (j + 1) as f64 * spacing);
            let diagonal: [Vec3; 2] = [[x0, BASE + a[0], z0], [x1, BASE + b[1], z1]];
            out.polygon(&[diagonal[0], diagonal[1], [x1, BASE + a[1], z0]])?;
            out.polygon(&[diagonal[0], [x0, BASE + b[0], z1], diagonal[1]])?;
        }
        near = far;
    }
    Ok(())
}

/// The heights of row `i`, rounded to `f32` as the database stores them. The samples are taken
/// at steps of 1/n of the square and drawn at steps of 1/(n - 1), as published.
fn row(n: u32, i: u32) -> Vec<f64> {
    let at = |i: u32| LOW + f64::from(i) * ((HIGH - LOW) / f64::from(n));
    let y = at(i);
    (0..n)
        .map(|j| {
            let x = at(j);
            let r = (x * x + y * y).sqrt();
            let height = 3.0 * (FREQUENCY * r).cos() * (-r).exp() / 3.0;
            f64::from(height as f32)
        })
        .collect()
}
