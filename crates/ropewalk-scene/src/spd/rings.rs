//! Rings: a pyramid of dodecahedral clusters of six pentagonal rings, before a wall.

use super::emitter::{Emitter, Finish, SKY};
use super::transform::{Affine, Axis, Vec3, add};
use crate::{Camera, SceneSink};
use std::f64::consts::PI;

/// Radius of cylinders and spheres, for clusters that fit the unit sphere.
const RADIUS: f64 = 0.07412;

/// Corners of a ring.
const CORNERS: usize = 5;

/// Red, green, blue and their complements.
const COLORS: [Vec3; 6] = [
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.0, 1.0, 1.0],
    [1.0, 0.0, 1.0],
    [1.0, 1.0, 0.0],
];

/// The wall and 30 spheres and 30 cylinders for each of `1 + 4 + ... + size^2` clusters.
pub(super) fn object_count(size: u32) -> u64 {
    let n = u64::from(size);
    10 * n * (n + 1) * (2 * n + 1) + 1
}

pub(super) fn generate<S: SceneSink>(size: u32, out: &mut Emitter<S>) -> Result<(), S::Error> {
    // Layers lie this far apart so that the pyramid just fills the view.
    let spread = 1.0 / (PI / 8.0).sin();
    let eye = [-1.0, -spread, 0.5];
    out.head(
        SKY,
        Camera {
            from: eye,
            at: [eye[0], eye[1] + 1.0, eye[2]],
            up: [0.0, 0.0, 1.0],
            angle: 45.0,
            hither: 1.0,
            resolution: [512; 2],
        },
        &[[3.0, -spread, 3.0], [-4.0, -spread, 1.0], [2.0, -spread, -4.0]],
    )?;
    out.finish(Finish::matte([1.0; 3], 1.0))?;
    let y = spread * f64::from(size + 1);
    // A little more than the view holds.
    let w = 1.01 * (y - eye[1]) * (PI / 8.0).tan();
    out.polygon(&[
        [w + eye[0], y, w + eye[2]],
        [-w + eye[0], y, w + eye[2]],
        [-w + eye[0], y, -w + eye[2]],
        [w + eye[0], y, -w + eye[2]],
    ])?;

    let rings = rings();
    for layer in 0..size {
        let side = |i: u32| f64::from(2 * i) - f64::from(layer);
        for iz in 0..=layer {
            for ix in 0..=layer {
                cluster(out, &rings, [side(ix), spread * f64::from(layer + 1), side(iz)])?;
            }
        }
    }
    Ok(())
}

/// Six rings of a cylinder and a sphere for each corner.
fn cluster<S: SceneSink>(
    out: &mut Emitter<S>,
    rings: &[[Vec3; CORNERS]; 6],
    center: Vec3,
) -> Result<(), S::Error> {
    for (ring, color) in rings.iter().zip(COLORS) {
        out.finish(Finish::shiny(color, 0.5, 0.2, 37.0))?;
        for i in 0..CORNERS {
            let corner = add(ring[i], center);
            let previous = add(ring[(i + CORNERS - 1) % CORNERS], center);
            out.cone((corner, RADIUS), (previous, RADIUS))?;
            out.sphere(corner, RADIUS)?;
        }
    }
    Ok(())
}

/// The rings join the midpoints of a dodecahedron's edges: one in the xy plane, five around it,
/// tilted by the angle between two faces.
fn rings() -> [[Vec3; CORNERS]; 6] {
    let scale = 1.0 / (1.0 + RADIUS);
    let flat: [Vec3; CORNERS] = std::array::from_fn(|i| {
        let angle = i as f64 * 2.0 * PI / 5.0;
        [scale * angle.cos(), scale * angle.sin(), 0.0]
    });
    let tilt = Affine::rotation(Axis::X, 2.0 * ((PI / 3.0).cos() / (PI / 5.0).sin()).acos());
    std::array::from_fn(|ring| match ring {
        0 => flat,
        _ => {
            let turn = Affine::rotation(Axis::Z, PI * (2.0 * (ring - 1) as f64 + 1.0) / 5.0);
            flat.map(|corner| turn.point(tilt.point(corner)))
        }
    })
}
