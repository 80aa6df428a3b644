//! The arbiter of disputed answers: every triangle tested in `f64`, with the error bound of an
//! `f32` engine around each decision.

use crate::answer::BenchHit;
use crate::scene::Mesh;
use rayon::prelude::*;
use ropewalk::Ray;

/// Error of an `f32` triangle test, as a multiple of `2^-24`: differences of corners and origin
/// are rounded once, a cross product, a dot product and a quotient add some 10 roundings more, and
/// cancellation between terms of the size of the distance doubles that. 32 bounds what plain
/// Möller-Trumbore forms show on well-shaped triangles.
const ERROR_ULPS: f64 = 32.0;
const UNIT_ROUNDOFF: f64 = 1.0 / 16_777_216.0;

/// A triangle that the ray hits or may hit within the error bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// The face.
    pub prim: u32,
    /// Parameter of the plane's crossing in `f64`.
    pub t: f64,
    /// Largest error of an engine's `t`.
    pub t_error: f64,
    /// True if no error within the bound turns the hit into a miss.
    pub certain: bool,
    /// The `f64` decision itself.
    pub exact: bool,
}

/// Brute force in `f64` over a mesh.
pub struct Oracle<'a> {
    mesh: &'a Mesh,
}

/// Triangles per parallel piece.
const PIECE: usize = 16_384;

impl<'a> Oracle<'a> {
    /// An oracle for a mesh.
    pub fn new(mesh: &'a Mesh) -> Self {
        Oracle { mesh }
    }

    /// All triangles that the ray hits or may hit, by `t`, then by face.
    pub fn candidates(&self, ray: &Ray) -> Vec<Candidate> {
        let pieces = self.mesh.faces.par_chunks(PIECE).enumerate();
        let mut all: Vec<Candidate> = pieces
            .flat_map_iter(|(piece, faces)| {
                let first = (piece * PIECE) as u32;
                (first..first + faces.len() as u32).filter_map(|prim| self.test(ray, prim))
            })
            .collect();
        all.sort_unstable_by(|a, b| a.t.total_cmp(&b.t).then(a.prim.cmp(&b.prim)));
        all
    }

    /// The hits by the `f64` decision alone, in order.
    pub fn exact(&self, ray: &Ray) -> Vec<BenchHit> {
        let candidates = self.candidates(ray);
        let hits = candidates.iter().filter(|c| c.exact);
        hits.map(|c| BenchHit { t: c.t as f32, prim: c.prim }).collect()
    }

    /// One triangle: the ray is moved to the origin, the corners are projected along it, and the
    /// distance of the projected origin from the projected edges is compared with the error.
    fn test(&self, ray: &Ray, prim: u32) -> Option<Candidate> {
        let origin = ray.origin.map(f64::from);
        let dir = ray.dir.map(f64::from);
        let corners = self.mesh.triangle(prim).map(|v| v.map(f64::from));
        let [a, b, c] = corners.map(|v| std::array::from_fn(|i| v[i] - origin[i]));
        let reach = [a, b, c].iter().flatten().fold(0.0f64, |m: f64, x: &f64| m.max(x.abs()));
        let error = ERROR_ULPS * UNIT_ROUNDOFF * reach;

        let (x, y) = perpendicular(dir);
        let [p, q, r] = [a, b, c].map(|v| [dot(v, x), dot(v, y)]);
        // Quick rejection: the projected box is farther away than the error.
        for k in 0..2 {
            let (lo, hi) = (p[k].min(q[k]).min(r[k]), p[k].max(q[k]).max(r[k]));
            if lo > error || hi < -error {
                return None;
            }
        }
        let normal = cross(sub(b, a), sub(c, a));
        let facing = dot(normal, dir);
        let size = dot(normal, normal).sqrt();
        if size == 0.0 {
            return None;
        }
        let edges = [area(p, q), area(q, r), area(r, p)];
        let inside = edges.iter().all(|&e| e >= 0.0) || edges.iter().all(|&e| e <= 0.0);
        let distance = [(p, q), (q, r), (r, p)]
            .iter()
            .map(|&(s, e)| distance_to_segment(s, e))
            .fold(f64::INFINITY, f64::min);
        if !inside && distance > error {
            return None;
        }
        // Grazing rays: t is uncertain over the whole extent of the triangle along the ray.
        let cosine = (facing / size).abs();
        let along = [a, b, c].map(|v| dot(v, dir));
        let (near, far) =
            (along[0].min(along[1]).min(along[2]), along[0].max(along[1]).max(along[2]));
        let t = if facing == 0.0 { near } else { (dot(normal, a) / facing).clamp(near, far) };
        let t_error = (error / cosine.max(UNIT_ROUNDOFF)).min(far - near + error);
        let (t_min, t_max) = (f64::from(ray.t_min), f64::from(ray.t_max));
        if t < t_min - t_error || t > t_max + t_error {
            return None;
        }
        let in_range = t >= t_min + t_error && t <= t_max - t_error;
        Some(Candidate {
            prim,
            t,
            t_error,
            certain: inside && distance > error && in_range,
            exact: inside && facing != 0.0 && t >= t_min && t <= t_max,
        })
    }
}

/// Two unit vectors that are perpendicular to a unit vector and to each other.
fn perpendicular(d: [f64; 3]) -> ([f64; 3], [f64; 3]) {
    let helper = if d[0].abs() < 0.7 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let x = cross(d, helper);
    let length = dot(x, x).sqrt();
    let x = x.map(|v| v / length);
    (x, cross(d, x))
}

/// Twice the signed area of the origin and two points.
fn area(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// Distance of the origin from a segment.
fn distance_to_segment(s: [f64; 2], e: [f64; 2]) -> f64 {
    let way = [e[0] - s[0], e[1] - s[1]];
    let square = way[0] * way[0] + way[1] * way[1];
    let part = if square > 0.0 { -(s[0] * way[0] + s[1] * way[1]) / square } else { 0.0 };
    let part = part.clamp(0.0, 1.0);
    (s[0] + part * way[0]).hypot(s[1] + part * way[1])
}

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| a[i] - b[i])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Mesh {
        Mesh {
            name: "square".into(),
            vertices: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
            faces: vec![[0, 1, 2], [0, 2, 3]],
        }
    }

    #[test]
    fn a_hit_inside_is_certain_and_one_on_the_shared_edge_is_not() {
        let mesh = square();
        let oracle = Oracle::new(&mesh);
        let inside = oracle.candidates(&Ray::new([0.7, 0.2, 2.0], [0.0, 0.0, -1.0]));
        assert_eq!(inside.len(), 1);
        assert!(inside[0].certain && inside[0].exact && (inside[0].t - 2.0).abs() < 1e-12);
        let edge = oracle.candidates(&Ray::new([0.5, 0.5, 2.0], [0.0, 0.0, -1.0]));
        assert_eq!(edge.len(), 2);
        assert!(edge.iter().all(|c| !c.certain && c.exact));
    }

    #[test]
    fn what_lies_beyond_the_range_or_beside_is_no_candidate() {
        let mesh = square();
        let oracle = Oracle::new(&mesh);
        let down =
            |x: f32, t_max: f32| Ray::new([x, 0.2, 2.0], [0.0, 0.0, -1.0]).with_range(0.0, t_max);
        assert!(oracle.candidates(&down(0.7, 1.9)).is_empty());
        assert!(oracle.candidates(&down(1.1, 9.0)).is_empty());
        let at_end = oracle.candidates(&down(0.7, 2.0));
        assert!(at_end.len() == 1 && !at_end[0].certain);
    }
}
