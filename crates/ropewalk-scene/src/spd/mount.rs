//! Mount: a fractal mountain (after Carpenter 1980) and four glass spheres before it.

use super::emitter::{Emitter, Finish, SKY};
use super::transform::{Affine, Axis, Vec3, add, normalized};
use crate::{Camera, SceneSink};
use std::f64::consts::PI;

/// Between 2 (smooth) and 3 (rough).
const FRACTAL_DIMENSION: f64 = 2.2;

/// Chooses the mountain.
const SEED: u64 = 21;

/// Lower end of the square in x and y.
const CORNER: f64 = -1.0;

/// Side of the square.
const WIDTH: f64 = 2.0;

/// Displacement of the middle of a square over that of the middle of an edge: its corners are
/// farther away. The square root of two, to the digits that the database was made with.
#[allow(clippy::approx_constant)]
const DIAGONAL: f64 = 1.4142136;

/// Four spheres and `2 * 4^size` triangles.
pub(super) fn object_count(size: u32) -> u64 {
    2 * 4u64.pow(size) + 4
}

pub(super) fn generate<S: SceneSink>(size: u32, out: &mut Emitter<S>) -> Result<(), S::Error> {
    out.head(
        SKY,
        Camera {
            from: [-1.6, 1.6, 1.7],
            at: [0.0; 3],
            up: [0.0, 0.0, 1.0],
            angle: 45.0,
            hither: 0.01,
            resolution: [512; 2],
        },
        &[[-100.0, -100.0, 100.0]],
    )?;
    let glass = Finish::shiny([1.0; 3], 0.1, 0.1, 6.7).with_index(1.5);
    out.finish(Finish { transmittance: 0.9, ..glass })?;
    spheres(out, [-0.8, 0.8, 1.0], 0.17)?;

    out.finish(Finish::matte([0.5, 0.45, 0.35], 1.0))?;
    let ratio = 2.0 / (2.0f64.ln() / (FRACTAL_DIMENSION - 1.0)).exp();
    let terrain = Terrain { size, roughness: (ratio * ratio - 1.0).sqrt() };
    terrain.grow(out, 1 << size, [0, 0], [0.0; 4])
}

/// A pyramid of four touching spheres around `center`.
fn spheres<S: SceneSink>(out: &mut Emitter<S>, center: Vec3, radius: f64) -> Result<(), S::Error> {
    let top = [0.0, 0.0, radius * (3.0f64 / 2.0).sqrt()];
    out.sphere(add(center, top), radius)?;
    let tilt =
        Affine::rotation_about(normalized([1.0, 1.0, 0.0]), (-1.0f64 / 3.0).acos()).vector(top);
    (0..3).try_for_each(|i| {
        let turn = Affine::rotation(Axis::Z, f64::from(i) * 2.0 * PI / 3.0);
        out.sphere(add(turn.vector(tilt), center), radius)
    })
}

/// A square grid of `2^size` cells a side.
struct Terrain {
    size: u32,
    roughness: f64,
}

impl Terrain {
    /// The square of `width` cells whose lower left corner is cell `[x, y]`; `z` holds its
    /// heights, counter-clockwise from that corner.
    fn grow<S: SceneSink>(
        &self,
        out: &mut Emitter<S>,
        width: u32,
        [x, y]: [u32; 2],
        z: [f64; 4],
    ) -> Result<(), S::Error> {
        if width == 1 {
            return self.cell(out, [x, y], z);
        }
        let half = width / 2;
        let rise = f64::from(half) * WIDTH / self.cells() * self.roughness;
        let edge = |a: f64, b: f64, x, y| (a + b) / 2.0 + rise * self.deviate(x, y);
        let [ll, lr, ur, ul] = z;
        let lower = edge(ll, lr, x + half, y);
        let right = edge(lr, ur, x + width, y + half);
        let upper = edge(ur, ul, x + half, y + width);
        let left = edge(ul, ll, x, y + half);
        let middle = (ll + lr + ur + ul) / 4.0 + DIAGONAL * rise * self.deviate(x + half, y + half);
        self.grow(out, half, [x, y], [ll, lower, middle, left])?;
        self.grow(out, half, [x + half, y], [lower, lr, right, middle])?;
        self.grow(out, half, [x + half, y + half], [middle, right, ur, upper])?;
        self.grow(out, half, [x, y + half], [left, middle, upper, ul])
    }

    /// The two triangles of a cell.
    fn cell<S: SceneSink>(
        &self,
        out: &mut Emitter<S>,
        [x, y]: [u32; 2],
        z: [f64; 4],
    ) -> Result<(), S::Error> {
        let at = |i: u32| CORNER + f64::from(i) * WIDTH / self.cells();
        let (left, right, lower, upper) = (at(x), at(x + 1), at(y), at(y + 1));
        let corners =
            [[left, lower, z[0]], [right, lower, z[1]], [right, upper, z[2]], [left, upper, z[3]]];
        out.polygon(&corners[..3])?;
        out.polygon(&[corners[2], corners[3], corners[0]])
    }

    /// Cells a side.
    fn cells(&self) -> f64 {
        f64::from(1u32 << self.size)
    }

    /// The random displacement of a grid point: the same whichever square asks for it.
    fn deviate(&self, x: u32, y: u32) -> f64 {
        gauss(SEED + hash(x.into(), y.into(), self.size))
    }
}

/// The hash of the published database. It makes the mountain repeat itself, which the published
/// figures are measured on.
fn hash(x: u64, y: u64, size: u32) -> u64 {
    let shifted = |value: u64, bits: u32| bits.checked_sub(size).map_or(0, |bits| value << bits);
    (shifted(x, 23) + shifted(y, 15) + shifted(x, 7)) & 0xffff
}

/// A normal deviate: the polar method on a linear congruential generator (Press et al.,
/// Numerical Recipes, `gasdev`), started anew at each `seed`.
fn gauss(seed: u64) -> f64 {
    const MODULUS: u64 = 134_456;
    let step = |state: u64| (28_411 + state * 8_121) % MODULUS;
    let symmetric = |state: u64| state as f64 * 2.0 / MODULUS as f64 - 1.0;
    let mut state = seed;
    loop {
        let first = step(state);
        state = step(first);
        let (a, b) = (symmetric(first), symmetric(state));
        let r = a * a + b * b;
        if r < 1.0 {
            return a * (-2.0 * r.ln() / r).sqrt();
        }
    }
}
