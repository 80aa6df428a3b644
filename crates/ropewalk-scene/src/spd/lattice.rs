//! Lattice: shiny spheres at the points of a cubic grid, matte cylinders between neighbours.

use super::emitter::{Emitter, Finish, SKY};
use super::transform::Vec3;
use crate::{Camera, SceneSink};

/// Radius of a sphere in grid steps.
const SPHERE_RADIUS: f64 = 1.0 / 4.0;

/// Radius of a cylinder in grid steps.
const CYLINDER_RADIUS: f64 = 1.0 / 16.0;

/// Share of the gap between a sphere's centre and a cylinder's end that is kept, so that
/// cylinders reach into the spheres.
const OVERLAP: f64 = 0.99;

/// `(size + 1)^3` spheres and a cylinder for each edge of the grid.
pub(super) fn object_count(size: u32) -> u64 {
    let n = u64::from(size);
    (n + 1).pow(3) + 3 * n * (n + 1).pow(2)
}

pub(super) fn generate<S: SceneSink>(size: u32, out: &mut Emitter<S>) -> Result<(), S::Error> {
    let n = f64::from(size);
    let step = 1.0 / n;
    let middle = (f64::from(size / 2) + 0.5) * step;
    let half = 1.0 / (2.0 * n);
    out.head(
        SKY,
        Camera {
            from: [middle, 1.0, 1.0 - half],
            at: [middle, -1.0, -1.0 - half],
            up: [0.2, 1.0, 0.0],
            angle: 60.0,
            hither: 0.0,
            resolution: [512; 2],
        },
        &[
            [2.0, 0.5, 0.5],
            [-1.0, 0.5, 0.5],
            [0.5, 2.0, 0.5],
            [0.5, -1.0, 0.5],
            [0.5, 0.5, 2.0],
            [0.5, 0.5, -1.0],
        ],
    )?;

    let (sphere, cylinder) = (SPHERE_RADIUS / n, CYLINDER_RADIUS / n);
    let inset = sphere * (1.0 - (CYLINDER_RADIUS / SPHERE_RADIUS).sqrt()) * OVERLAP;
    for x in 0..=size {
        for y in 0..=size {
            for z in 0..=size {
                let cell = [x, y, z];
                let center: Vec3 = cell.map(|i| f64::from(i) / n);
                out.finish(Finish::shiny([0.9; 3], 0.5, 0.5, 37.0))?;
                out.sphere(center, sphere)?;
                for axis in (0..3).filter(|&axis| cell[axis] != size) {
                    let mut color = [0.1; 3];
                    color[axis] = 0.9;
                    out.finish(Finish::matte(color, 0.99))?;
                    let (mut base, mut apex) = (center, center);
                    base[axis] = center[axis] + inset;
                    apex[axis] = center[axis] + step - inset;
                    out.cone((base, cylinder), (apex, cylinder))?;
                }
            }
        }
    }
    Ok(())
}
