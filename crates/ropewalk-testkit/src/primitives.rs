//! Random primitives of every kind, points on their surfaces, and cells around such points.

use crate::rays::Draw;
use ropewalk::primitive::{Cone, Patch, Polygon, Sphere, Triangle};
use ropewalk::{Aabb, Geometry, Shape, Sides};

/// The kinds of primitives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Triangles.
    Triangle,
    /// Concave polygons.
    Polygon,
    /// Triangles and polygons with normals.
    Patch,
    /// Spheres.
    Sphere,
    /// Frustums of cones and cylinders.
    Cone,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Kind; 5] =
        [Kind::Triangle, Kind::Polygon, Kind::Patch, Kind::Sphere, Kind::Cone];
}

/// Where coordinates are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Space {
    /// Uniform in a box of a few units.
    Unit,
    /// Sizes and offsets uniform in the exponent, over some 2^40.
    Exponent,
    /// Small integers, where exact ties happen and polygons are exactly planar.
    Grid,
}

impl Space {
    /// All spaces.
    pub const ALL: [Space; 3] = [Space::Unit, Space::Exponent, Space::Grid];
}

/// A primitive and a way to draw points of its surface.
#[derive(Clone)]
pub struct Sample {
    /// The primitive.
    pub shape: Shape,
    /// Triangles that cover a planar primitive exactly; empty for curved ones.
    pub pieces: Vec<[[f32; 3]; 3]>,
}

type V = [f64; 3];

fn add(p: V, s: f64, q: V) -> V {
    std::array::from_fn(|a| p[a] + s * q[a])
}

fn cross(p: V, q: V) -> V {
    [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
}

fn unit(p: V) -> V {
    let len = p.iter().map(|x| x * x).sum::<f64>().sqrt();
    p.map(|x| x / len)
}

fn round(p: V) -> [f32; 3] {
    p.map(|x| x as f32)
}

fn wide(p: [f32; 3]) -> V {
    p.map(f64::from)
}

/// Two directions that complete the unit vector `n` to a right-handed frame.
fn frame(n: V) -> (V, V) {
    let smallest = (0..3).fold(0, |k, a| if n[a].abs() < n[k].abs() { a } else { k });
    let mut other = [0.0; 3];
    other[smallest] = 1.0;
    let e = unit(cross(other, n));
    (e, cross(n, e))
}

/// A star-shaped polygon of 4 to 24 corners and its centre, from which every corner is seen.
fn star(draw: &mut Draw, space: Space) -> (V, Vec<V>) {
    let corners = 4 + draw.below(21);
    let (center, size) = place(draw, space);
    let (e, f) = match space {
        // Whole multiples of two whole vectors lie in one plane exactly.
        Space::Grid => loop {
            let (e, f) = (wide(draw.grid_point(2)), wide(draw.grid_point(2)));
            if cross(e, f) != [0.0; 3] {
                break (e, f);
            }
        },
        _ => {
            let (e, f) = frame(unit(wide(draw.direction())));
            (e.map(|x| x * size), f.map(|x| x * size))
        }
    };
    let mut outline: Vec<(f64, [f64; 2])> = Vec::new();
    while outline.len() < 3 {
        for i in 0..corners {
            let angle = (i as f64 + draw.uniform(0.0, 0.9)) / corners as f64;
            let (sin, cos) = (angle * std::f64::consts::TAU).sin_cos();
            let r = draw.uniform(0.3, 1.0);
            let mut p = [r * cos, r * sin];
            if space == Space::Grid {
                p = p.map(|x| (4.0 * x).round());
            }
            if p != [0.0; 2] {
                outline.push((p[1].atan2(p[0]), p));
            }
        }
        // Strictly growing angle, no gap of half a turn or more: star-shaped around the centre.
        outline.sort_by(|p, q| p.0.total_cmp(&q.0));
        outline.dedup_by(|p, q| p.0 == q.0);
        let turn = |i: usize| {
            let (p, q) = (outline[i].1, outline[(i + 1) % outline.len()].1);
            p[0] * q[1] - p[1] * q[0]
        };
        if (0..outline.len()).any(|i| turn(i) <= 0.0) {
            outline.clear();
        }
    }
    (center, outline.into_iter().map(|(_, [x, y])| add(add(center, x, e), y, f)).collect())
}

/// A centre and a size.
fn place(draw: &mut Draw, space: Space) -> (V, f64) {
    match space {
        Space::Unit => (wide(draw.direction()), draw.uniform(0.1, 1.0)),
        Space::Exponent => {
            let size = draw.exponent(-20.0, 20.0).abs();
            // Near the origin, at its own scale, or far away.
            let reach = size * draw.uniform(-4.0, 12.0).exp2();
            (wide(draw.direction()).map(|x| x * reach), size)
        }
        Space::Grid => (wide(draw.grid_point(4)), (1 + draw.below(4)) as f64),
    }
}

fn triangle(draw: &mut Draw, space: Space) -> [[f32; 3]; 3] {
    let (center, size) = place(draw, space);
    std::array::from_fn(|_| match space {
        Space::Grid => draw.grid_point(4),
        Space::Unit => round(add(center, size, wide(draw.direction()))),
        // Slivers and needles among them.
        Space::Exponent => {
            let r = size * draw.uniform(-12.0, 0.0).exp2();
            round(add(center, r, wide(draw.direction())))
        }
    })
}

fn polygon(draw: &mut Draw, space: Space) -> (Vec<[f32; 3]>, Vec<[[f32; 3]; 3]>) {
    let (center, corners) = star(draw, space);
    let corners: Vec<_> = corners.into_iter().map(round).collect();
    let n = corners.len();
    let pieces = (0..n).map(|i| [round(center), corners[i], corners[(i + 1) % n]]).collect();
    (corners, pieces)
}

/// A random primitive.
pub fn sample(draw: &mut Draw, kind: Kind, space: Space) -> Sample {
    let of = |shape: Shape, pieces| Sample { shape, pieces };
    match kind {
        Kind::Triangle => {
            let vertices = triangle(draw, space);
            of(Triangle { vertices }.into(), vec![vertices])
        }
        Kind::Polygon => {
            let (corners, pieces) = polygon(draw, space);
            of(Polygon::new(corners).expect("finite corners").into(), pieces)
        }
        Kind::Patch => {
            let (corners, pieces) = if draw.chance(0.5) {
                let corners = triangle(draw, space);
                (corners.to_vec(), vec![corners])
            } else {
                polygon(draw, space)
            };
            let normals = corners.iter().map(|_| draw.direction()).collect();
            of(Patch::new(corners, normals).expect("finite corners").into(), pieces)
        }
        Kind::Sphere => {
            let (center, radius) = place(draw, space);
            of(Sphere { center: round(center), radius: radius as f32 }.into(), Vec::new())
        }
        Kind::Cone => {
            let (base, size) = place(draw, space);
            let direction = match space {
                Space::Grid => wide(loop {
                    let d = draw.grid_point(3);
                    if d != [0.0; 3] {
                        break d;
                    }
                }),
                _ => wide(draw.direction()).map(|x| x * size * draw.uniform(-6.0, 2.0).exp2()),
            };
            let mut radius = || match space {
                Space::Grid => draw.below(4) as f32,
                _ if draw.chance(0.1) => 0.0,
                _ => (size * draw.uniform(-4.0, 0.0).exp2()) as f32,
            };
            let (first, second) = (radius(), radius());
            let apex_radius = if draw.chance(0.3) { first } else { second };
            let cone = Cone {
                base: round(base),
                apex: round(add(base, 1.0, direction)),
                base_radius: first,
                apex_radius,
            };
            of(cone.into(), Vec::new())
        }
    }
}

/// `n` random primitives of one kind, or of all kinds if `kind` is `None`, with random sides; the
/// space is `Unit` for even seeds, `Grid` for odd ones.
pub fn random_geometry(kind: Option<Kind>, n: usize, seed: u64) -> Geometry {
    let mut draw = Draw::new(seed);
    let space = if seed.is_multiple_of(2) { Space::Unit } else { Space::Grid };
    let mut geometry = Geometry::new();
    for _ in 0..n {
        let kind = kind.unwrap_or_else(|| Kind::ALL[draw.below(Kind::ALL.len())]);
        let sides = [Sides::Both, Sides::Both, Sides::Front, Sides::Back][draw.below(4)];
        let shape = sample(&mut draw, kind, space).shape;
        geometry.push(shape, sides).expect("finite coordinates and few primitives");
    }
    geometry
}

impl Sample {
    /// A point of the surface, off it by rounding in `f64` alone, or for polygons by what the
    /// vertices miss their plane. Corners, rims and points with exact coordinates among them.
    pub fn point(&self, draw: &mut Draw) -> V {
        match &self.shape {
            Shape::Sphere(s) => {
                let mut d = wide(draw.direction());
                if draw.chance(0.2) {
                    d = [0.0; 3];
                    d[draw.below(3)] = if draw.chance(0.5) { 1.0 } else { -1.0 };
                }
                add(wide(s.center), f64::from(s.radius), unit(d))
            }
            Shape::Cone(c) => {
                let (base, apex) = (wide(c.base), wide(c.apex));
                let axis = add(apex, -1.0, base);
                let share = [0.0, 0.5, 1.0, draw.uniform(0.0, 1.0)][draw.below(4)];
                let (r0, r1) = (f64::from(c.base_radius), f64::from(c.apex_radius));
                let center = add(base, share, axis);
                if axis == [0.0; 3] {
                    return base;
                }
                let (e, f) = frame(unit(axis));
                let turn = draw.uniform(0.0, 8.0);
                let turn = if draw.chance(0.3) { turn.floor() } else { turn };
                let (sin, cos) = (turn * std::f64::consts::FRAC_PI_4).sin_cos();
                let r = r0 + share * (r1 - r0);
                add(add(center, r * cos, e), r * sin, f)
            }
            _ => {
                let piece = self.pieces[draw.below(self.pieces.len())].map(wide);
                let weights = match draw.below(4) {
                    // A corner of the outline, its edge, a point with short coordinates, any.
                    0 => [0.0, 1.0, 0.0],
                    1 => [0.0, 0.5, 0.5],
                    2 => [0.5, 0.25, 0.25],
                    _ => {
                        let (u, v) = (draw.uniform(0.0, 1.0), draw.uniform(0.0, 1.0));
                        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                        [1.0 - u - v, u, v]
                    }
                };
                let mut sum = [0.0; 3];
                for (w, p) in weights.into_iter().zip(piece) {
                    sum = add(sum, w, p);
                }
                sum
            }
        }
    }
}

/// A random closed cell that holds `point`; each face passes through it, as near as `f32` allows,
/// with probability 1/3, and is far away with 1/3.
pub fn cell_around(draw: &mut Draw, point: V, size: f64) -> Aabb {
    let down = |x: f64| {
        let f = x as f32;
        if f64::from(f) > x { f.next_down() } else { f }
    };
    let mut reach = || match draw.below(3) {
        0 => 0.0,
        1 => size * draw.uniform(-12.0, 0.0).exp2(),
        _ => 4.0 * size,
    };
    Aabb {
        min: std::array::from_fn(|a| down(point[a] - reach())),
        max: std::array::from_fn(|a| -down(-(point[a] + reach()))),
    }
}
