//! Frustums of cones and cylinders, without caps.

use super::planar::{Extent, overlap};
use super::{AreaRamp, Crossing, Primitive, ShapeError, Sides, SurfaceNormals};
use crate::aabb::Aabb;
use crate::ray::PreparedRay;
use glam::DVec3;
use std::f64::consts::PI;

/// The side of a circular frustum from base to apex, open at both ends; a cylinder if the radii
/// are equal. The front is the outside.
///
/// Error: the ray is moved to its closest point to the frustum's middle, which is off by at most
/// `2^-50` of the distance; `t` is off by as much over the cosine at which the ray meets the
/// surface, and is then rounded once to `f32`. Within that distance of a rim or of a tangent it is
/// undecided whether there is a hit, and so it is within `2^-26` of the cone's size of its tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// Centre of the base.
    pub base: [f32; 3],
    /// Centre of the apex.
    pub apex: [f32; 3],
    /// Radius at the base, at least 0.
    pub base_radius: f32,
    /// Radius at the apex, at least 0.
    pub apex_radius: f32,
}

/// Slack of computed coordinates, as a share of the coordinates and radii that enter: fewer than
/// 64 roundings of 2^-53, trigonometric functions included.
const SLACK: f64 = 1.0 / (1u64 << 47) as f64;

/// How far a hit may lie beside the surface, as a share of what it was computed from: 32 roundings.
const ON_SURFACE: f64 = 1.0 / (1u64 << 48) as f64;

/// Each doubles the number of digits, and a root has eight at least.
const NEWTON_STEPS: usize = 3;

/// A point is as good as on the axis if it lies beside it by no more than this share of its distance from the base.
const ON_AXIS: f64 = 1.0 / (1u64 << 20) as f64;

/// Rounds of the clip: each narrows the piece by the box of the one before.
const CLIP_ROUNDS: usize = 3;

/// Samples along the axis and around it by which the area inside a cell is summed up, and bins
/// along the sweep: enough for 1 % of the cell's surface area.
const SAMPLES: [usize; 2] = [12, 16];
/// Samples of a surface that is [`SMALL`] against the cell.
const FEW_SAMPLES: [usize; 2] = [4, 6];
/// Share of the cell's area below which a surface's shape inside the cell hardly shows: a wrong
/// ramp is off by less than half of the surface, so by less than 1 % of the cell.
const SMALL: f64 = 0.02;
const BINS: usize = 8;

impl Cone {
    /// A frustum of finite points and radii of at least 0.
    ///
    /// # Errors
    /// [`ShapeError::NotFinite`] or [`ShapeError::BadRadius`].
    pub fn new(
        base: [f32; 3],
        base_radius: f32,
        apex: [f32; 3],
        apex_radius: f32,
    ) -> Result<Self, ShapeError> {
        super::check_points("base", &[base])?;
        super::check_points("apex", &[apex])?;
        super::check_radius("base radius", base_radius)?;
        super::check_radius("apex radius", apex_radius)?;
        Ok(Cone { base, apex, base_radius, apex_radius })
    }

    fn frame(&self) -> Frame {
        let base = vector(self.base);
        let axis = vector(self.apex) - base;
        let radius = f64::from(self.base_radius);
        Frame { base, axis, radius, growth: f64::from(self.apex_radius) - radius }
    }
}

/// The parameter near a root `tau` where a ray is on the surface, as far as `f64` can tell: where its distance from the axis is the
/// radius there, within [`ON_SURFACE`] of what enters.
///
/// Squares lose half of the digits where both are small, so near tips, and along generators, a root of the quadratic may be a
/// hundred millionth of the cone away from it; the walks rely on `HIT_ERROR`. `None` for the mirrored nappe, and within as
/// little of a tip where no step helps.
fn settled(tau: f64, (p0, p1): (DVec3, DVec3), (r0, r1): (f64, f64)) -> Option<f64> {
    let off = |tau: f64| {
        let p = p0 + tau * p1;
        let distance = p.length();
        (distance - (r0 + tau * r1), p.dot(p1) / distance - r1)
    };
    let (mut tau, (mut error, mut slope)) = (tau, off(tau));
    let size = |tau: f64| p0.length() + r0.abs() + tau.abs() * (p1.length() + r1.abs());
    for _ in 0..NEWTON_STEPS {
        if error.abs() <= ON_SURFACE * size(tau) {
            return Some(tau);
        }
        let next = tau - error / slope;
        let (next_error, next_slope) = off(next);
        if next_error.is_nan() || next_error.abs() >= error.abs() {
            return None;
        }
        (tau, error, slope) = (next, next_error, next_slope);
    }
    (error.abs() <= ON_SURFACE * size(tau)).then_some(tau)
}

fn vector(p: [f32; 3]) -> DVec3 {
    DVec3::from_array(p.map(f64::from))
}

/// A frustum in `f64`: the point at share `s` of the axis is `base + s axis`, its circle has radius
/// `radius + s growth`.
struct Frame {
    base: DVec3,
    axis: DVec3,
    radius: f64,
    growth: f64,
}

/// A piece of the surface: a range of shares of the axis, and a range of angles, counted from
/// `toward` (unit, perpendicular to the axis) to `aside` (perpendicular to both).
struct Piece {
    shares: (f64, f64),
    toward: DVec3,
    aside: DVec3,
    angles: (f64, f64),
}

impl Frame {
    fn center(&self, s: f64) -> DVec3 {
        self.base + s * self.axis
    }

    fn radius_at(&self, s: f64) -> f64 {
        (self.radius + s * self.growth).max(0.0)
    }

    /// Extent of a circle of radius 1 on each axis: the sine between the two directions.
    fn sines(&self) -> [f64; 3] {
        let h = self.axis.to_array();
        let square = self.axis.length_squared();
        std::array::from_fn(|a| {
            let (b, c) = (h[(a + 1) % 3], h[(a + 2) % 3]);
            ((b * b + c * c) / square).sqrt().min(1.0)
        })
    }

    /// The box of the whole frustum, rounded outward; exact along and across the axes.
    fn bounds(&self) -> Aabb {
        let mut extent = Extent::EMPTY;
        let mut slack = [0.0f64; 3];
        let sines = if self.axis == DVec3::ZERO { [1.0; 3] } else { self.sines() };
        for s in [0.0, 1.0] {
            let (c, r) = (self.center(s).to_array(), self.radius_at(s));
            extent.add(std::array::from_fn(|a| c[a] - r * sines[a]));
            extent.add(std::array::from_fn(|a| c[a] + r * sines[a]));
            for a in 0..3 {
                if sines[a] != 0.0 && sines[a] != 1.0 {
                    slack[a] = slack[a].max(SLACK * (c[a].abs() + r));
                }
            }
        }
        extent.outward(slack)
    }

    /// The piece of the surface that may touch `cell`, conservatively; `None` if none does.
    fn piece_in(&self, cell: &Aabb) -> Option<Piece> {
        let square = self.axis.length_squared();
        let axis = self.axis / square.sqrt();
        let (lo, hi) = (vector(cell.min) - self.base, vector(cell.max) - self.base);
        let slack =
            SLACK * (lo.abs().max(hi.abs()).element_sum() + self.radius + self.growth.abs());
        // Interval of a linear function over the cell.
        let range = |g: DVec3| {
            let (p, q) = (g * lo, g * hi);
            (p.min(q).element_sum() - slack, p.max(q).element_sum() + slack)
        };
        let along = range(axis);
        let shares = (
            (along.0 / square.sqrt() - SLACK).max(0.0),
            (along.1 / square.sqrt() + SLACK).min(1.0),
        );
        if shares.0 > shares.1 {
            return None;
        }
        let radii = (self.radius_at(shares.0), self.radius_at(shares.1));
        let (r_min, r_max) =
            (radii.0.min(radii.1) * (1.0 - SLACK), radii.0.max(radii.1) * (1.0 + SLACK));
        // Look from the axis towards the cell's middle.
        let middle = 0.5 * (lo + hi);
        let beside = middle - axis * middle.dot(axis);
        let toward = if beside.length() > ON_AXIS * middle.length() {
            beside.normalize()
        } else {
            // What is left are roundings, which may point along the axis.
            axis.any_orthonormal_vector()
        };
        let toward = (toward - axis * toward.dot(axis)).normalize();
        let aside = axis.cross(toward);
        let (x, y) = (range(toward), range(aside));
        let farthest = x.1.abs().max(x.0.abs()).hypot(y.1.abs().max(y.0.abs()));
        if x.0 > r_max || y.0 > r_max || y.1 < -r_max || farthest < r_min {
            return None;
        }
        // cos(angle) = x / r and sin(angle) = y / r, each with the r that widens the range.
        let ratio = |x: f64, r: f64| if r > 0.0 { (x / r).clamp(-1.0, 1.0) } else { x.signum() };
        let cosine = ratio(x.0, if x.0 < 0.0 { r_min } else { r_max });
        let half = (cosine - SLACK).max(-1.0).acos();
        let mut angles = (-half, half);
        if x.0 >= 0.0 {
            let low = ratio(y.0, if y.0 < 0.0 { r_min } else { r_max });
            let high = ratio(y.1, if y.1 > 0.0 { r_min } else { r_max });
            angles.0 = angles.0.max((low - SLACK).max(-1.0).asin());
            angles.1 = angles.1.min((high + SLACK).min(1.0).asin());
            if angles.0 > angles.1 {
                return None;
            }
        }
        Some(Piece { shares, toward, aside, angles })
    }

    /// The box of a piece, rounded outward.
    fn piece_bounds(&self, piece: &Piece) -> Aabb {
        let (toward, aside) = (piece.toward.to_array(), piece.aside.to_array());
        let (low, high) = piece.angles;
        // Range of the unit circle's coordinate over the angles: at its ends, and where it peaks.
        let waves: [_; 3] = std::array::from_fn(|a| {
            let at = |angle: f64| toward[a] * angle.cos() + aside[a] * angle.sin();
            let (p, q) = (at(low), at(high));
            let peak = aside[a].atan2(toward[a]);
            let amplitude = toward[a].hypot(aside[a]);
            let within = |angle: f64| {
                [-2.0 * PI, 0.0, 2.0 * PI]
                    .iter()
                    .any(|turn| (low - SLACK..=high + SLACK).contains(&(angle + turn)))
            };
            (
                if within(peak + PI) { -amplitude } else { p.min(q) },
                if within(peak) { amplitude } else { p.max(q) },
            )
        });
        let mut extent = Extent::EMPTY;
        let mut slack = [0.0f64; 3];
        for s in [piece.shares.0, piece.shares.1] {
            let (c, r) = (self.center(s).to_array(), self.radius_at(s));
            extent.add(std::array::from_fn(|a| c[a] + r * waves[a].0));
            extent.add(std::array::from_fn(|a| c[a] + r * waves[a].1));
            for a in 0..3 {
                slack[a] = slack[a].max(SLACK * (c[a].abs() + r + self.axis.to_array()[a].abs()));
            }
        }
        extent.outward(slack)
    }

    /// Narrows `cell` to the part that the surface can touch, and the piece that touches it.
    fn narrow(&self, cell: &Aabb) -> Option<(Aabb, Piece)> {
        let mut part = *cell;
        let mut piece = self.piece_in(&part)?;
        for _ in 0..CLIP_ROUNDS {
            let next = overlap(&self.piece_bounds(&piece), &part)?;
            if next == part {
                break;
            }
            part = next;
            piece = self.piece_in(&part)?;
        }
        Some((part, piece))
    }
}

impl Primitive for Cone {
    fn bounds(&self) -> Aabb {
        self.frame().bounds()
    }

    /// Conservative, and tight up to the curvature of the piece inside the cell.
    fn clipped_bounds(&self, cell: &Aabb) -> Option<Aabb> {
        let frame = self.frame();
        let bounds = frame.bounds();
        if cell.contains(&bounds) {
            return Some(bounds);
        }
        let loose = overlap(&bounds, cell)?;
        if self.is_degenerate() {
            return Some(loose);
        }
        frame.narrow(&loose).map(|(part, _)| part)
    }

    fn area(&self) -> f64 {
        let frame = self.frame();
        if frame.axis == DVec3::ZERO {
            return 0.0;
        }
        let slant = frame.axis.length().hypot(frame.growth);
        PI * (2.0 * frame.radius + frame.growth) * slant
    }

    /// Summed up over samples, to 1 % of the cell's surface area.
    fn area_ramps(&self, cell: &Aabb, axis: usize, out: &mut Vec<AreaRamp>) {
        let frame = self.frame();
        let Some(loose) = overlap(&frame.bounds(), cell) else { return };
        if self.is_degenerate() {
            return;
        }
        let lower = f64::from(cell.min[axis]);
        let small = self.area() <= SMALL * cell.area();
        if small && cell.contains(&self.bounds()) {
            let bounds = self.bounds();
            let (lo, hi) = (f64::from(bounds.min[axis]), f64::from(bounds.max[axis]));
            let width = self.area() / (hi - lo); // bounds are rounded outward: never flat
            out.push(AreaRamp { x: lo - lower, width, ..Default::default() });
            out.push(AreaRamp { x: hi - lower, width: -width, ..Default::default() });
            return;
        }
        let Some((part, piece)) = frame.narrow(&loose) else { return };
        let inside = Extent::widened(cell, [0.0; 3]);
        let (lo, hi) = (f64::from(part.min[axis]), f64::from(part.max[axis]));
        let samples = if small { FEW_SAMPLES } else { SAMPLES };
        let (bins, total) = frame.sampled_area(&piece, &inside, axis, (lo, hi), samples);
        if hi <= lo {
            out.push(AreaRamp { x: lo - lower, step: total, ..Default::default() });
            return;
        }
        let thickness = (hi - lo) / BINS as f64;
        let mut before = 0.0;
        for (i, area) in bins.into_iter().chain([0.0]).enumerate() {
            let width = area / thickness;
            if width != before {
                let x = lo + i as f64 * thickness - lower;
                out.push(AreaRamp { x, width: width - before, ..Default::default() });
                before = width;
            }
        }
    }

    fn intersect(&self, ray: &PreparedRay, sides: Sides) -> Option<Crossing> {
        let frame = self.frame();
        let square = frame.axis.length_squared();
        if self.is_degenerate() {
            return None;
        }
        let (origin, dir) = (DVec3::from_array(ray.origin), DVec3::from_array(ray.dir));

        // The ray's closest point to the frustum's middle: there the quadratic keeps its digits.
        let from_middle = origin - frame.center(0.5);
        let shift = -from_middle.dot(dir) / dir.length_squared();
        let foot = from_middle + shift * dir;

        // Along the axis the ray is at share 1/2 + s0 + tau s1, and beside it at p0 + tau p1; the
        // surface has radius r0 + tau r1 there.
        let (s0, s1) = (foot.dot(frame.axis) / square, dir.dot(frame.axis) / square);
        let (p0, p1) = (foot - s0 * frame.axis, dir - s1 * frame.axis);
        let (r0, r1) = (frame.radius_at(0.5) + s0 * frame.growth, s1 * frame.growth);

        // |p0 + tau p1|^2 = (r0 + tau r1)^2. With Lagrange's identity the discriminant is a
        // difference of two squares, and so keeps its sign near tangents.
        let a = p1.length_squared() - r1 * r1;
        let b = p0.dot(p1) - r0 * r1;
        let c = (p0.length() - r0) * (p0.length() + r0);
        let (big, small) = ((r0 * p1 - r1 * p0).length(), p0.cross(p1).length());
        if small > big {
            return None;
        }
        let root = ((big - small) * (big + small)).sqrt();

        // Citardauq's form for the root that would cancel.
        let q = if b < 0.0 { root - b } else { -(b + root) };
        let roots =
            if b < 0.0 { [(c / q, -root), (q / a, root)] } else { [(q / a, -root), (c / q, root)] };
        let ordered = if roots[1].0 < roots[0].0 { [roots[1], roots[0]] } else { roots };
        let within = |tau: f64| (0.0..=1.0).contains(&(0.5 + (s0 + tau * s1)));
        ordered.into_iter().find_map(|(tau, facing)| {
            // A NaN root (no quadratic term) fails this test, and so does the mirrored nappe,
            // which lies beyond the apex.
            if !within(tau) || !sides.accepts(facing) {
                return None;
            }
            let tau = settled(tau, (p0, p1), (r0, r1)).filter(|&tau| within(tau))?;
            Crossing::in_range(ray, shift + tau)
        })
    }

    fn normals(&self, point: [f64; 3], _crossing: Crossing) -> SurfaceNormals {
        let frame = self.frame();
        let from_base = DVec3::from_array(point) - frame.base;
        let along = frame.axis.normalize_or_zero();
        let across = from_base - along * from_base.dot(along);
        let slope = frame.growth / frame.axis.length();
        // At the tip there is no normal but the axis's own direction.
        let tip = if frame.growth < 0.0 { along } else { -along };
        let n =
            across.try_normalize().map_or(tip, |out| (out - slope * along).normalize()).to_array();
        SurfaceNormals { geometric: n, shading: n }
    }

    fn is_degenerate(&self) -> bool {
        self.base == self.apex || (self.base_radius == 0.0 && self.apex_radius == 0.0)
    }
}

impl Frame {
    /// Area of the piece inside a cell, in bins from `lo` to `hi` along `axis`, and its sum.
    fn sampled_area(
        &self,
        piece: &Piece,
        cell: &Extent,
        axis: usize,
        (lo, hi): (f64, f64),
        samples: [usize; 2],
    ) -> ([f64; BINS], f64) {
        let (s, angle) = (piece.shares, piece.angles);
        let step = ((s.1 - s.0) / samples[0] as f64, (angle.1 - angle.0) / samples[1] as f64);
        let element = self.axis.length().hypot(self.growth) * step.0 * step.1;
        let mut directions = [DVec3::ZERO; SAMPLES[1]];
        for (j, direction) in directions[..samples[1]].iter_mut().enumerate() {
            let (sin, cos) = (angle.0 + (j as f64 + 0.5) * step.1).sin_cos();
            *direction = piece.toward * cos + piece.aside * sin;
        }
        let scale = if hi > lo { BINS as f64 / (hi - lo) } else { 0.0 };
        let (mut bins, mut total) = ([0.0; BINS], 0.0);
        for i in 0..samples[0] {
            let share = s.0 + (i as f64 + 0.5) * step.0;
            let (center, r) = (self.center(share), self.radius_at(share));
            for direction in &directions[..samples[1]] {
                let p = (center + r * *direction).to_array();
                if cell.contains(p) {
                    let bin = ((p[axis] - lo) * scale) as usize;
                    bins[bin.min(BINS - 1)] += r * element;
                    total += r * element;
                }
            }
        }
        (bins, total)
    }
}
