//! Tetra: a tetrahedron divided again and again into four of half its size (Glassner 1984; Kay
//! and Kajiya 1986).

use super::emitter::{Emitter, Finish, SKY};
use super::transform::Vec3;
use crate::{Camera, SceneSink};

/// The corners of the cube that make a tetrahedron: those whose signs multiply to 1.
const CORNERS: [Vec3; 4] =
    [[-1.0, -1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [1.0, 1.0, 1.0]];

/// The faces, counter-clockwise from outside.
const FACES: [[usize; 3]; 4] = [[0, 1, 2], [3, 2, 1], [2, 3, 0], [1, 0, 3]];

/// `4^size` triangles.
pub(super) fn object_count(size: u32) -> u64 {
    4u64.pow(size)
}

pub(super) fn generate<S: SceneSink>(size: u32, out: &mut Emitter<S>) -> Result<(), S::Error> {
    out.head(
        SKY,
        Camera {
            from: [1.022846, -3.177154, -2.174512],
            at: [-0.004103, -0.004103, 0.216539],
            up: [-0.816497, -0.816497, 0.816497],
            angle: 45.0,
            hither: 1.0,
            resolution: [512; 2],
        },
        &[[2.0, -18.0, -5.0]],
    )?;
    out.finish(Finish::matte([1.0, 0.2, 0.2], 1.0))?;
    divide(out, size, [0.0; 3], 1.0)
}

/// The part of the pyramid inside the cube of half width `half` at `center`.
fn divide<S: SceneSink>(
    out: &mut Emitter<S>,
    depth: u32,
    center: Vec3,
    half: f64,
) -> Result<(), S::Error> {
    let corners = |half: f64| CORNERS.map(|c| std::array::from_fn(|i| center[i] + c[i] * half));
    if depth > 1 {
        let half = half / 2.0;
        return corners(half).into_iter().try_for_each(|sub| divide(out, depth - 1, sub, half));
    }
    let corner = corners(half);
    FACES.iter().try_for_each(|face| out.polygon(&face.map(|vertex| corner[vertex])))
}
