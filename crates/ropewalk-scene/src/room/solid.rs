//! Shapes as triangles: curved sheets, turned and swept bodies, boxes with rounded edges.

use super::looks::Look;
use crate::Stage;
use glam::{DAffine3, DVec3};
use std::f64::consts::{FRAC_PI_4, TAU};

/// Step for slopes, as a share of a sheet's parameters: small beside any curve of the room, large beside rounding.
const SLOPE_STEP: f64 = 1e-4;

/// How far from a tip, where a sheet has no slope across, the slope of its neighbourhood is taken.
const TIP_STEP: f64 = 1e-3;

/// Collects triangles with their looks.
pub struct Solids {
    pub stage: Stage,
    /// Segments grow in proportion to it.
    detail: u32,
    look: Look,
    color: [f32; 3],
    place: DAffine3,
    /// Boxes so far, which shifts the grain of each.
    boxes: u32,
}

impl Solids {
    pub fn new(detail: u32) -> Solids {
        Solids {
            stage: Stage::default(),
            detail,
            look: Look::Plaster,
            color: [1.0; 3],
            place: DAffine3::IDENTITY,
            boxes: 0,
        }
    }

    /// The look of all that follows.
    pub fn look(&mut self, look: Look) -> &mut Solids {
        (self.look, self.color) = (look, [1.0; 3]);
        self
    }

    /// The same, in a colour of its own.
    pub fn painted(&mut self, look: Look, color: [f32; 3]) -> &mut Solids {
        (self.look, self.color) = (look, color);
        self
    }

    /// Makes something in a frame of its own.
    pub fn within(&mut self, place: DAffine3, make: impl FnOnce(&mut Solids)) {
        let outer = self.place;
        self.place = outer * place;
        make(self);
        self.place = outer;
    }

    /// Segments of a curve that has `coarse` of them at detail 2.
    pub fn segments(&self, coarse: u32) -> u32 {
        (coarse * self.detail).div_ceil(2).max(coarse.min(3))
    }

    /// Segments of the rounding of an edge; none at detail 1.
    fn rounding(&self) -> u32 {
        (self.detail + 2) / 4
    }

    fn vertex(&mut self, p: DVec3) -> u32 {
        self.stage.mesh.vertices.push(self.place.transform_point3(p).to_array());
        self.stage.mesh.vertices.len() as u32 - 1
    }

    /// A triangle with normals and texture coordinates, left out if it has no area.
    pub fn face(&mut self, corners: [(u32, DVec3, [f64; 2]); 3]) {
        let [a, b, c] =
            corners.map(|(i, ..)| DVec3::from_array(self.stage.mesh.vertices[i as usize]));
        if (b - a).cross(c - a).length_squared() < 1e-20 {
            return;
        }
        let normal = |n: DVec3| self.place.transform_vector3(n).normalize_or_zero();
        let normals = corners.map(|(_, n, _)| normal(n).as_vec3().to_array());
        self.stage.mesh.faces.push(corners.map(|(i, ..)| i));
        self.stage.normals.push(normals);
        self.stage.uvs.push(corners.map(|(_, _, uv)| uv.map(|x| x as f32)));
        self.stage.colors.push([self.color; 3]);
        self.stage.material.push(self.look as u32);
    }

    /// A triangle of given points.
    pub fn triangle(&mut self, points: [DVec3; 3], normals: [DVec3; 3]) {
        let corners = [0, 1, 2].map(|k| (self.vertex(points[k]), normals[k], [0.0; 2]));
        self.face(corners);
    }

    /// A curved sheet over the unit square, its front where `du x dv` points. `uv` are texture coordinates.
    pub fn sheet(
        &mut self,
        [across, along]: [u32; 2],
        at: impl Fn(f64, f64) -> DVec3,
        uv: impl Fn(f64, f64) -> [f64; 2],
    ) {
        let slopes = |u: f64, v: f64| {
            let (u0, u1) = ((u - SLOPE_STEP).max(0.0), (u + SLOPE_STEP).min(1.0));
            let (v0, v1) = ((v - SLOPE_STEP).max(0.0), (v + SLOPE_STEP).min(1.0));
            (at(u1, v) - at(u0, v)).cross(at(u, v1) - at(u, v0))
        };
        let normal = |u: f64, v: f64| {
            let n = slopes(u, v);
            // Slopes of a sheet of a metre and of a tip differ by orders of magnitude.
            let near = slopes(u, v.clamp(TIP_STEP, 1.0 - TIP_STEP));
            if n.length() > 0.2 * near.length() {
                n.normalize_or_zero()
            } else {
                near.normalize_or_zero()
            }
        };
        let first = self.stage.mesh.vertices.len() as u32;
        let mut made = Vec::new();
        for j in 0..=along {
            for i in 0..=across {
                let (u, v) = (f64::from(i) / f64::from(across), f64::from(j) / f64::from(along));
                self.vertex(at(u, v));
                made.push((normal(u, v), uv(u, v)));
            }
        }
        let corner = |i: u32, j: u32| {
            let index = j * (across + 1) + i;
            let (n, uv) = made[index as usize];
            (first + index, n, uv)
        };
        for j in 0..along {
            for i in 0..across {
                let [a, b, c, d] =
                    [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
                self.face([a, b, c]);
                self.face([a, c, d]);
            }
        }
    }

    /// A body turned around the vertical axis: a smooth curve through points of radius and height. Its front is outside
    /// where the curve goes up.
    pub fn turned(&mut self, profile: &[[f64; 2]], around: u32, along: u32) {
        let points: Vec<DVec3> = profile.iter().map(|&[r, y]| DVec3::new(r, y, 0.0)).collect();
        let at = |u: f64, v: f64| {
            let p = curve(&points, v);
            let (sine, cosine) = (TAU * u).sin_cos();
            DVec3::new(p.x.max(0.0) * cosine, p.y, -p.x.max(0.0) * sine)
        };
        let size = [self.segments(around), self.segments(along)];
        self.sheet(size, at, |u, v| [u, v]);
    }

    /// A body of elliptic section along a smooth curve; `radii` are those across `hint` and along it.
    pub fn swept(
        &mut self,
        path: &[DVec3],
        hint: DVec3,
        radii: impl Fn(f64) -> [f64; 2],
        [around, along]: [u32; 2],
    ) {
        let frame = |v: f64| {
            let v0 = (v - SLOPE_STEP).max(0.0);
            let tangent = (curve(path, v0 + SLOPE_STEP) - curve(path, v0)).normalize();
            let across = hint.cross(tangent).normalize();
            (across, tangent.cross(across))
        };
        let length = path.windows(2).map(|p| p[0].distance(p[1])).sum::<f64>();
        let out = |turn: f64, v: f64| {
            let ((across, up), [a, b]) = (frame(v), radii(v));
            let (sine, cosine) = (TAU * turn).sin_cos();
            a * cosine * across + b * sine * up
        };
        let around = self.segments(around);
        let tile = self.look.tile();
        let grain = |u: f64, v: f64| [v * length / tile, u * 0.1 / tile];
        self.sheet([around, self.segments(along)], |u, v| curve(path, v) + out(u, v), grain);
        self.sheet([around, 1], |u, v| curve(path, 1.0) + (1.0 - v) * out(u, 1.0), grain);
        self.sheet([around, 1], |u, v| curve(path, 0.0) + (1.0 - v) * out(-u, 0.0), grain);
    }

    /// A straight round bar.
    pub fn bar(&mut self, from: DVec3, to: DVec3, radii: [f64; 2], around: u32) {
        let way = (to - from).normalize();
        let hint = if way.y.abs() < 0.9 { DVec3::Y } else { DVec3::X };
        let radius = |v: f64| [radii[0] + v * (radii[1] - radii[0]); 2];
        self.swept(&[from, to], hint, radius, [around, 1]);
    }

    /// A box with sharp edges.
    pub fn block(&mut self, low: [f64; 3], high: [f64; 3]) {
        let (low, high) = (DVec3::from_array(low), DVec3::from_array(high));
        self.framed_box(0.5 * (low + high), 0.5 * (high - low), 0.0);
    }

    /// A box with edges rounded by `radius`.
    pub fn rounded(&mut self, low: [f64; 3], high: [f64; 3], radius: f64) {
        let (low, high) = (DVec3::from_array(low), DVec3::from_array(high));
        let half = 0.5 * (high - low);
        self.framed_box(0.5 * (low + high), half, radius.min(half.min_element()));
    }

    fn framed_box(&mut self, center: DVec3, half: DVec3, radius: f64) {
        let rounding = if radius > 0.0 { self.rounding() } else { 0 };
        let inner = half - radius;
        // Angles from the middle of one edge to that of the opposite one, and on which side each line lies.
        let turn = |i: u32| FRAC_PI_4 * f64::from(i) / f64::from(rounding.max(1));
        let left = (0..=rounding).map(|i| (-1.0, -turn(rounding - i).tan()));
        let right = (0..=rounding).map(|i| (1.0, turn(i).tan()));
        let lines: Vec<(f64, f64)> = left.chain(right).collect();
        self.boxes += 1;
        let shift = f64::from(self.boxes % 97) * 0.173;
        let tile = self.look.tile();
        for axis in 0..3 {
            let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
            // The grain runs along the longer side of each face.
            let (long, short) = if half[i] >= half[j] { (i, j) } else { (j, i) };
            for side in [-1.0, 1.0] {
                let first = self.stage.mesh.vertices.len() as u32;
                let mut made = Vec::new();
                for &(b, slope_b) in &lines {
                    for &(a, slope_a) in &lines {
                        let mut n = DVec3::ZERO;
                        (n[axis], n[i], n[j]) = (side, slope_a, slope_b);
                        let n = n.normalize();
                        let mut p = DVec3::ZERO;
                        (p[axis], p[i], p[j]) = (side * inner[axis], a * inner[i], b * inner[j]);
                        let p = p + radius * n;
                        self.vertex(center + p);
                        made.push((
                            n,
                            [(p[long] / tile) + shift, (p[short] / tile) + 0.31 * shift],
                        ));
                    }
                }
                let count = lines.len() as u32;
                let corner = |a: u32, b: u32| {
                    let index = b * count + a;
                    let (n, uv) = made[index as usize];
                    (first + index, n, uv)
                };
                for b in 0..count - 1 {
                    for a in 0..count - 1 {
                        let [p, q, r, s] = [
                            corner(a, b),
                            corner(a + 1, b),
                            corner(a + 1, b + 1),
                            corner(a, b + 1),
                        ];
                        if side > 0.0 {
                            self.face([p, q, r]);
                            self.face([p, r, s]);
                        } else {
                            self.face([p, r, q]);
                            self.face([p, s, r]);
                        }
                    }
                }
            }
        }
    }
}

/// A point of the smooth curve through points, `v` from 0 to 1 (E. Catmull and R. Rom 1974, uniform).
fn curve(points: &[DVec3], v: f64) -> DVec3 {
    let last = points.len() - 1;
    let place = v.clamp(0.0, 1.0) * last as f64;
    let k = (place as usize).min(last - 1);
    let t = place - k as f64;
    let (b, c) = (points[k], points[k + 1]);
    let a = if k > 0 { points[k - 1] } else { 2.0 * b - c };
    let d = if k + 1 < last { points[k + 2] } else { 2.0 * c - b };
    0.5 * (2.0 * b
        + t * (c - a)
        + t * t * (2.0 * a - 5.0 * b + 4.0 * c - d)
        + t * t * t * (3.0 * (b - c) + d - a))
}
