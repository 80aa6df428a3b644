//! Spheres.

use super::planar::{overlap, round_down, round_up};
use super::{AreaRamp, Crossing, Primitive, ShapeError, Sides, SurfaceNormals};
use crate::aabb::Aabb;
use crate::ray::PreparedRay;
use std::f64::consts::{FRAC_PI_2, PI};

/// A sphere by centre and positive radius; hollow, with the outside as its front.
///
/// Error: the ray's closest point to the centre is off by at most `2^-50` of the distance between
/// origin and centre, and `t` by as much where the ray does not graze the sphere; it is then
/// rounded once to `f32`. Within that distance of a tangent the two roots, and whether there are
/// any, are undecided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Centre.
    pub center: [f32; 3],
    /// Radius; a sphere of radius 0 is degenerate and never hit.
    pub radius: f32,
}

/// Slack of squared lengths in the clip, as a share of the squares that enter: two differences,
/// three squares and two sums are fewer than 16 roundings of 2^-53.
const SQUARE_SLACK: f64 = 1.0 / (1u64 << 49) as f64;

/// Slack of a clipped coordinate, as a share of centre and radius: root, sum and margin.
const COORDINATE_SLACK: f64 = 1.0 / (1u64 << 50) as f64;

/// Slices in which the area of a sphere that the cell clips on other axes is summed up: enough
/// for 1 % of the cell's area.
const SLICES: usize = 12;

impl Sphere {
    /// A sphere of finite centre and radius; radius 0 is degenerate.
    ///
    /// # Errors
    /// [`ShapeError::NotFinite`] or [`ShapeError::BadRadius`].
    pub fn new(center: [f32; 3], radius: f32) -> Result<Self, ShapeError> {
        super::check_points("centre", &[center])?;
        super::check_radius("radius", radius)?;
        Ok(Sphere { center, radius })
    }

    /// The cell's corners relative to the centre.
    fn local(&self, cell: &Aabb) -> ([f64; 3], [f64; 3]) {
        let c = self.center.map(f64::from);
        let from = |p: [f32; 3]| std::array::from_fn(|a| f64::from(p[a]) - c[a]);
        (from(cell.min), from(cell.max))
    }
}

/// Smallest and largest distance from 0 in an interval.
fn distances(lo: f64, hi: f64) -> (f64, f64) {
    (lo.max(-hi).max(0.0), hi.abs().max(lo.abs()))
}

/// The angle, out of 2 pi, for which a circle of radius `r` around 0 lies in a rectangle.
fn arc_in_rectangle(r: f64, x: (f64, f64), y: (f64, f64)) -> f64 {
    // Per quadrant: the angle from the x axis is bounded below by the larger |x| and the smaller
    // |y|, above by the smaller |x| and the larger |y|.
    let halves = |(lo, hi): (f64, f64)| [(lo.max(0.0), hi), ((-hi).max(0.0), -lo)];
    let angle_x = halves(x).map(|(a, b)| ((b / r).clamp(0.0, 1.0).acos(), (a / r).min(1.0).acos()));
    let angle_y = halves(y).map(|(a, b)| ((a / r).min(1.0).asin(), (b / r).clamp(0.0, 1.0).asin()));
    let (some_x, some_y) = (halves(x).map(|(a, b)| a < b), halves(y).map(|(a, b)| a < b));
    let mut sum = 0.0;
    for i in 0..2 {
        for j in 0..2 {
            if some_x[i] && some_y[j] {
                let (lo, hi) = (angle_x[i].0.max(angle_y[j].0), angle_x[i].1.min(angle_y[j].1));
                sum += (hi - lo).clamp(0.0, FRAC_PI_2);
            }
        }
    }
    sum
}

impl Primitive for Sphere {
    fn bounds(&self) -> Aabb {
        let (c, r) = (self.center.map(f64::from), f64::from(self.radius));
        Aabb::new(c.map(|x| round_down(x - r)), c.map(|x| round_up(x + r)))
    }

    fn clipped_bounds(&self, cell: &Aabb) -> Option<Aabb> {
        let bounds = self.bounds();
        if cell.contains(&bounds) {
            return Some(bounds);
        }
        let loose = overlap(&bounds, cell)?;
        let (lo, hi) = self.local(&loose);
        let square = f64::from(self.radius).powi(2);
        let near_far: [_; 3] = std::array::from_fn(|a| distances(lo[a], hi[a]));
        let mut tight = loose;
        for a in 0..3 {
            // With the other two coordinates in their slabs, x_a^2 covers an interval.
            let ((n1, f1), (n2, f2)) = (near_far[(a + 1) % 3], near_far[(a + 2) % 3]);
            let (near, far) = (n1 * n1 + n2 * n2, f1 * f1 + f2 * f2);
            let outer = square - near + SQUARE_SLACK * (square + near);
            let inner = square - far - SQUARE_SLACK * (square + far);
            if outer < 0.0 {
                return None;
            }
            let center = f64::from(self.center[a]);
            let (outer, inner) = (outer.sqrt(), inner.max(0.0).sqrt());
            let slack = COORDINATE_SLACK * (center.abs() + outer);
            let faces = [
                (round_down(center - outer - slack), round_up(center - inner + slack)),
                (round_down(center + inner - slack), round_up(center + outer + slack)),
            ]
            .map(|(min, max)| (min.max(loose.min[a]), max.min(loose.max[a])));
            let kept = faces.into_iter().filter(|(min, max)| min <= max);
            (tight.min[a], tight.max[a]) = kept.reduce(|p, q| (p.0.min(q.0), p.1.max(q.1)))?;
        }
        Some(tight)
    }

    fn area(&self) -> f64 {
        4.0 * PI * f64::from(self.radius).powi(2)
    }

    /// Exact (Archimedes) where the cell clips the sphere on `axis` only; else to 1 % of the cell's
    /// surface area.
    fn area_ramps(&self, cell: &Aabb, axis: usize, out: &mut Vec<AreaRamp>) {
        let Some(part) = self.clipped_bounds(cell) else { return };
        if self.is_degenerate() {
            return;
        }
        let r = f64::from(self.radius);
        let (lo, hi) = self.local(&part);
        let lower = f64::from(cell.min[axis]) - f64::from(self.center[axis]);
        let mut ramp = |x: f64, width: f64| {
            out.push(AreaRamp { x: x - lower, width, ..Default::default() });
        };
        let (z0, z1) = (lo[axis].max(-r), hi[axis].min(r));
        let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
        let ([cell_lo, cell_hi], whole) = {
            let (lo, hi) = self.local(cell);
            ([lo, hi], [b, c].iter().all(|&k| lo[k] <= -r && hi[k] >= r))
        };
        if whole {
            ramp(z0, 2.0 * PI * r);
            ramp(z1, -2.0 * PI * r);
            return;
        }
        let thickness = (z1 - z0) / SLICES as f64;
        let mut width = 0.0;
        for i in 0..SLICES {
            // Two-point Gauss rule on the slice.
            let middle = z0 + (i as f64 + 0.5) * thickness;
            let angle = |offset: f64| {
                let z = middle + offset * thickness;
                let radius = ((r - z) * (r + z)).max(f64::MIN_POSITIVE).sqrt();
                arc_in_rectangle(radius, (cell_lo[b], cell_hi[b]), (cell_lo[c], cell_hi[c]))
            };
            let mean = 0.5 * (angle(-GAUSS_OFFSET) + angle(GAUSS_OFFSET));
            ramp(z0 + i as f64 * thickness, r * mean - width);
            width = r * mean;
        }
        ramp(z1, -width);
    }

    fn intersect(&self, ray: &PreparedRay, sides: Sides) -> Option<Crossing> {
        let l: [f64; 3] = std::array::from_fn(|a| f64::from(self.center[a]) - ray.origin[a]);
        let dot = |p: [f64; 3], q: [f64; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
        let dd = dot(ray.dir, ray.dir);
        // The closest point of the line, relative to the centre, is where the discriminant keeps
        // its digits however far the origin is.
        let middle = dot(l, ray.dir) / dd;
        let foot: [f64; 3] = std::array::from_fn(|a| l[a] - middle * ray.dir[a]);
        let (r, distance) = (f64::from(self.radius), dot(foot, foot).sqrt());
        if distance > r || r == 0.0 {
            return None;
        }
        let half = ((r - distance) * (r + distance) / dd).sqrt();
        [(middle - half, -half), (middle + half, half)].into_iter().find_map(|(t, facing)| {
            if sides.accepts(facing) { Crossing::in_range(ray, t) } else { None }
        })
    }

    fn normals(&self, point: [f64; 3], _crossing: Crossing) -> SurfaceNormals {
        let d: [f64; 3] = std::array::from_fn(|a| point[a] - f64::from(self.center[a]));
        let len = super::planar::length(d);
        let n = if len > 0.0 { d.map(|x| x / len) } else { [0.0, 0.0, 1.0] };
        SurfaceNormals { geometric: n, shading: n }
    }

    fn is_degenerate(&self) -> bool {
        self.radius == 0.0
    }
}

/// Abscissa of the two-point Gauss rule, `1 / (2 sqrt 3)` of the interval from its middle.
const GAUSS_OFFSET: f64 = 0.288_675_134_594_812_9;
