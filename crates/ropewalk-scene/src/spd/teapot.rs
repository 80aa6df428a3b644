//! Teapot: Newell's teapot with a bottom, tessellated, on a chequered board.

use super::emitter::{Emitter, Finish, SKY};
use super::teapot_patches::{ControlPoints, control_points};
use super::transform::{Vec3, cross, normalized};
use crate::{Camera, SceneSink};

/// Half the side of the board.
const BOARD: f64 = 4.0;

/// Distance in x and in y from the axis below which a vertex is the tip of the lid or of the
/// bottom, where the surface has no tangent plane; in units of the scene. Far above what rounding
/// leaves of a zero, and below the distance of the nearest other vertex at every valid size.
const TIP: f64 = 1e-4;

/// Height between the two tips.
const MIDDLE: f64 = 1.5;

type Matrix4 = [[f64; 4]; 4];

/// Bezier to power basis.
const BEZIER: Matrix4 =
    [[-1.0, 3.0, -3.0, 1.0], [3.0, -6.0, 3.0, 0.0], [-3.0, 3.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]];

/// `size^2` squares and 32 patches of `2 * size^2` triangles, less the ones that the eight
/// patches with a tip lose there.
pub(super) fn object_count(size: u32) -> u64 {
    let n = u64::from(size);
    n * n + 64 * n * n - 8 * n
}

pub(super) fn generate<S: SceneSink>(size: u32, out: &mut Emitter<S>) -> Result<(), S::Error> {
    out.head(
        SKY,
        Camera {
            from: [4.86, 7.2, 5.4],
            at: [0.0; 3],
            up: [0.0, 0.0, 1.0],
            angle: 45.0,
            hither: 1.0,
            resolution: [512; 2],
        },
        &[[-3.1, 9.8, 12.1], [11.3, 5.1, 8.8]],
    )?;
    board(size, out)?;
    out.finish(Finish::shiny([1.0, 0.5, 0.1], 0.75, 0.25, 37.0))?;
    control_points().try_for_each(|points| Patch::new(&points).emit(size, out))
}

/// The squares of a chessboard: first the white ones, then the grey ones.
fn board<S: SceneSink>(size: u32, out: &mut Emitter<S>) -> Result<(), S::Error> {
    let at = |i: u32| BOARD * (2.0 * f64::from(i) / f64::from(size) - 1.0);
    for (parity, shade) in [(1, 1.0), (0, 0.5)] {
        out.finish(Finish::shiny([shade; 3], 0.5, 0.5, 30.0))?;
        for i in 0..size {
            for j in (0..size).filter(|j| (i + j) % 2 == parity) {
                let (x0, x1, y0, y1) = (at(i), at(i + 1), at(j), at(j + 1));
                out.polygon(&[[x0, y0, 0.0], [x1, y0, 0.0], [x1, y1, 0.0], [x0, y1, 0.0]])?;
            }
        }
    }
    Ok(())
}

/// A vertex of the tessellation.
#[derive(Clone, Copy)]
struct Vertex {
    position: Vec3,
    normal: Vec3,
    is_tip: bool,
}

/// A bicubic patch: for x, y and z the matrix between the powers of s and of t.
struct Patch {
    coefficients: [Matrix4; 3],
}

impl Patch {
    fn new(points: &ControlPoints) -> Patch {
        let coefficients = std::array::from_fn(|axis| {
            let points = points.map(|row| row.map(|point| point[axis]));
            product(&product(&BEZIER, &points), &transpose(&BEZIER))
        });
        Patch { coefficients }
    }

    /// The triangles, row by row; a triangle with two corners in a tip is left out.
    fn emit<S: SceneSink>(&self, size: u32, out: &mut Emitter<S>) -> Result<(), S::Error> {
        let mut near = self.row(0, size);
        for i in 1..=size {
            let far = self.row(i, size);
            for (a, b) in near.windows(2).zip(far.windows(2)) {
                for triangle in [[a[0], a[1], b[1]], [b[1], b[0], a[0]]] {
                    if triangle.iter().filter(|vertex| vertex.is_tip).count() <= 1 {
                        out.patch(&triangle.map(|v| v.position), &triangle.map(|v| v.normal))?;
                    }
                }
            }
            near = far;
        }
        Ok(())
    }

    /// The vertices at `s = i / size`.
    fn row(&self, i: u32, size: u32) -> Vec<Vertex> {
        let at = |i: u32| f64::from(i) / f64::from(size);
        (0..=size).map(|j| self.vertex(at(i), at(j))).collect()
    }

    fn vertex(&self, s: f64, t: f64) -> Vertex {
        let (powers_s, slopes_s) = powers(s);
        let (powers_t, slopes_t) = powers(t);
        let blend = |s: &[f64; 4], t: &[f64; 4]| {
            self.coefficients.each_ref().map(|matrix| dot(&row_times(s, matrix), t))
        };
        let position = blend(&powers_s, &powers_t);
        let is_tip = position[0].abs() <= TIP && position[1].abs() <= TIP;
        let normal = if !is_tip {
            normalized(cross(blend(&powers_s, &slopes_t), blend(&slopes_s, &powers_t)))
        } else if position[2] > MIDDLE {
            [0.0, 0.0, 1.0]
        } else {
            [0.0, 0.0, -1.0]
        };
        Vertex { position, normal, is_tip }
    }
}

/// `[x^3, x^2, x, 1]` and their derivatives.
fn powers(x: f64) -> ([f64; 4], [f64; 4]) {
    let square = x * x;
    ([square * x, square, x, 1.0], [square * 3.0, x * 2.0, 1.0, 0.0])
}

fn dot(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
}

fn transpose(m: &Matrix4) -> Matrix4 {
    std::array::from_fn(|i| m.map(|row| row[i]))
}

fn row_times(row: &[f64; 4], m: &Matrix4) -> [f64; 4] {
    transpose(m).map(|column| dot(row, &column))
}

fn product(a: &Matrix4, b: &Matrix4) -> Matrix4 {
    a.map(|row| row_times(&row, b))
}
