//! Bounds of the primitives that are no triangles, by which most of them are passed over without a test.

use super::{Block, WIDTH};
use crate::primitive::{Primitive, Shape};

/// Everything that a ray can be said to hit lies within `radius` of `center` and, unless `axis` is 0, within
/// `thickness` of the line through `center` along `axis`.
///
/// Both are widened for what the numbers and the test of a primitive are off by; see docs/numerics.md.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bound {
    /// A point in the middle.
    pub center: [f32; 3],
    /// Farthest point.
    pub radius: f32,
    /// Of unit length, or 0.
    pub axis: [f32; 3],
    /// Farthest point from the line.
    pub thickness: f32,
}

/// What a test may be off by, as a share of the primitive's coordinates: eight times
/// [`HIT_ERROR`](crate::primitive::HIT_ERROR).
const OFF: f64 = 1.0 / (1u64 << 38) as f64;

/// Room for 32 roundings to `f32`, as a share of a radius.
const ROUNDINGS: f64 = 1.0 / (1u32 << 19) as f64;

/// What turning the axis by its rounding moves a point by, as a share of its distance.
const TURN: f64 = 1.0 / (1u32 << 22) as f64;

/// The thickness is larger by this share, so that the error of the square can be bounded without a root.
const SPARE: f64 = 1.0 / 128.0;

fn between(p: [f64; 3], q: [f64; 3]) -> f64 {
    (0..3).map(|a| (p[a] - q[a]).powi(2)).sum::<f64>().sqrt()
}

/// Rounded up.
fn up(x: f64) -> f32 {
    let y = x as f32;
    if f64::from(y) < x { y.next_up() } else { y }
}

impl Bound {
    /// The bound of a shape.
    pub fn of(shape: &Shape) -> Bound {
        let bounds = shape.bounds();
        let (min, max) = (bounds.min.map(f64::from), bounds.max.map(f64::from));
        let largest = min.iter().chain(&max).fold(0.0f64, |most, x| most.max(x.abs()));
        let (center, radius, axis, thickness) = match shape {
            Shape::Sphere(sphere) => (sphere.center, f64::from(sphere.radius), [0.0; 3], 0.0),
            Shape::Cone(cone) => {
                let (base, apex) = (cone.base.map(f64::from), cone.apex.map(f64::from));
                let middle: [f64; 3] = std::array::from_fn(|a| 0.5 * (base[a] + apex[a]));
                let (center, length) = (middle.map(|x| x as f32), between(base, apex));
                let widest = f64::from(cone.base_radius.max(cone.apex_radius));
                let shift = between(center.map(f64::from), middle);
                let radius = (0.5 * length).hypot(widest) + shift;
                let axis = std::array::from_fn(|a| match length {
                    0.0 => 0.0,
                    _ => ((apex[a] - base[a]) / length) as f32,
                });
                (center, radius, axis, widest + shift + TURN * radius)
            }
            _ => {
                let center: [f32; 3] = std::array::from_fn(|a| (0.5 * (min[a] + max[a])) as f32);
                let at = center.map(f64::from);
                (center, between(at, min).max(between(at, max)), [0.0; 3], 0.0)
            }
        };
        let wide = |x: f64| (x + OFF * largest) * (1.0 + ROUNDINGS);
        let thickness = up(wide(thickness) * (1.0 + SPARE));
        Bound { center, radius: up(wide(radius)), axis, thickness }
    }
}

impl Block {
    /// Writes the bound of a shape to a lane.
    pub(crate) fn set_bound(&mut self, lane: usize, bound: &Bound) {
        let Bound { center: [x, y, z], radius, axis: [a, b, c], thickness } = *bound;
        let rows = self.vertex.as_flattened_mut();
        for (row, x) in rows.iter_mut().zip([f32::NAN, x, y, z, radius, a, b, c, thickness]) {
            row[lane] = x;
        }
    }

    /// The bound in a lane; `None` if it holds a triangle or nothing.
    pub fn bound(&self, lane: usize) -> Option<Bound> {
        let rows = self.vertex.as_flattened();
        let [nan, x, y, z, radius, a, b, c, thickness] =
            std::array::from_fn(|i| rows[i][lane % WIDTH]);
        let bound = Bound { center: [x, y, z], radius, axis: [a, b, c], thickness };
        (nan.is_nan() && !x.is_nan()).then_some(bound)
    }

    /// True if the block holds primitives that are no triangles; then it holds no triangle.
    #[inline(always)]
    pub fn holds_shapes(&self) -> bool {
        self.vertex[0][0][0].is_nan() & !self.vertex[0][1][0].is_nan()
    }
}
