//! Rays meant to find differences: random ones, and ones aimed at edges and vertices.

use crate::scene::Mesh;
use crate::workload::Random;
use ropewalk::{Aabb, Ray};

/// Where the rays of a chunk come from and where they go.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Aim {
    /// From anywhere about the scene in any direction.
    Random,
    /// At points inside of triangles.
    Faces,
    /// At points on edges.
    Edges,
    /// At vertices.
    Vertices,
    /// From points on triangles, edges and vertices in any direction.
    Surface,
    /// Parallel to an axis through a vertex: in the planes that trees cut with.
    Axis,
    /// Short segments that continue each other, from the surface.
    Short,
    /// Groups of 64 rays from one eye into a narrow window, every eighth at a vertex.
    Coherent,
    /// From inside of a closed mesh at its edges and vertices: every ray must hit.
    Inside,
}

impl Aim {
    /// All of them.
    pub const ALL: [Aim; 9] = [
        Aim::Random,
        Aim::Faces,
        Aim::Edges,
        Aim::Vertices,
        Aim::Surface,
        Aim::Axis,
        Aim::Short,
        Aim::Coherent,
        Aim::Inside,
    ];

    /// The name in the record.
    pub fn name(self) -> &'static str {
        match self {
            Aim::Random => "random",
            Aim::Faces => "faces",
            Aim::Edges => "edges",
            Aim::Vertices => "vertices",
            Aim::Surface => "surface",
            Aim::Axis => "axis",
            Aim::Short => "short",
            Aim::Coherent => "coherent",
            Aim::Inside => "inside",
        }
    }
}

/// Rays of a coherent group.
const GROUP: usize = 64;
/// Segments of a walk before it starts anew.
const SEGMENTS: usize = 64;
/// Mean length of a short segment, in diagonals.
const SHORT: f64 = 0.005;
/// Half the width of a coherent group's window, in diagonals.
const WINDOW: f64 = 0.01;

/// Draws rays for a mesh.
pub struct Marksman<'a> {
    /// What is aimed at.
    pub mesh: &'a Mesh,
    /// Its box.
    pub bounds: Aabb,
    /// Points inside of the mesh, if it is closed.
    pub inside: &'a [[f32; 3]],
}

impl Marksman<'_> {
    /// `count` rays from a seed. [`Aim::Inside`] needs a point inside.
    pub fn rays(&self, aim: Aim, count: usize, seed: u64) -> Vec<Ray> {
        let mut random = Random::new(seed);
        let mut rays = Vec::with_capacity(count);
        while rays.len() < count {
            match aim {
                Aim::Coherent => self.group(&mut random, &mut rays),
                Aim::Short => self.walk(&mut random, &mut rays),
                _ => rays.push(self.single(aim, &mut random)),
            }
        }
        rays.truncate(count);
        rays
    }

    fn single(&self, aim: Aim, random: &mut Random) -> Ray {
        let from = self.about(random);
        match aim {
            Aim::Random => Ray::new(from, random.direction().map(|x| x as f32)),
            Aim::Faces => self.towards(from, self.on_face(random), random),
            Aim::Edges => self.towards(from, self.on_edge(random), random),
            Aim::Vertices => self.towards(from, self.vertex(random), random),
            Aim::Inside => {
                let from = self.inside[random.below(self.inside.len())];
                let at =
                    if random.below(2) == 0 { self.on_edge(random) } else { self.vertex(random) };
                self.towards(from, at, random)
            }
            Aim::Axis => {
                let (mut from, axis) = (self.vertex(random), random.below(3));
                let mut dir = [0.0; 3];
                dir[axis] = if random.below(2) == 0 { 1.0 } else { -1.0 };
                from[axis] -= (self.bounds.diagonal() * random.unit()) as f32 * dir[axis];
                Ray::new(from, dir)
            }
            _ => Ray::new(self.on_surface(random), random.direction().map(|x| x as f32)),
        }
    }

    fn group(&self, random: &mut Random, rays: &mut Vec<Ray>) {
        let (from, at) = (self.about(random), self.vertex(random));
        let window = WINDOW * self.bounds.diagonal() * random.unit();
        for i in 0..GROUP {
            let jitter = if i % 8 == 0 { 0.0 } else { window };
            let at = at.map(|x| (f64::from(x) + jitter * (2.0 * random.unit() - 1.0)) as f32);
            rays.push(self.towards(from, at, random));
        }
    }

    fn walk(&self, random: &mut Random, rays: &mut Vec<Ray>) {
        let mut at = self.on_surface(random);
        for _ in 0..SEGMENTS {
            let dir = random.direction().map(|x| x as f32);
            let length = random.exponential(SHORT * self.bounds.diagonal()) as f32;
            let ray = Ray::new(at, dir).with_range(0.0, length);
            at = ray.at(length).map(|x| x as f32);
            rays.push(ray);
        }
    }

    /// A ray at a point, half of them with a direction of unit length.
    fn towards(&self, from: [f32; 3], at: [f32; 3], random: &mut Random) -> Ray {
        let mut way: [f64; 3] = std::array::from_fn(|a| f64::from(at[a]) - f64::from(from[a]));
        if random.below(2) == 0 {
            let length = way.iter().map(|x| x * x).sum::<f64>().sqrt();
            way = way.map(|x| x / length);
        }
        Ray::new(from, way.map(|x| x as f32))
    }

    /// A point of the box with half its size around it.
    fn about(&self, random: &mut Random) -> [f32; 3] {
        std::array::from_fn(|a| {
            let (lo, size) = (f64::from(self.bounds.min[a]), self.bounds.extent(a));
            (lo + size * (2.0 * random.unit() - 0.5)) as f32
        })
    }

    fn corners(&self, random: &mut Random) -> [[f32; 3]; 3] {
        self.mesh.triangle(random.below(self.mesh.faces.len()) as u32)
    }

    fn vertex(&self, random: &mut Random) -> [f32; 3] {
        let corners = self.corners(random);
        corners[random.below(3)]
    }

    fn on_edge(&self, random: &mut Random) -> [f32; 3] {
        let (corners, first, part) = (self.corners(random), random.below(3), random.unit());
        blend(corners[first], corners[(first + 1) % 3], part)
    }

    fn on_face(&self, random: &mut Random) -> [f32; 3] {
        let [a, b, c] = self.corners(random);
        let (u, v) = (random.unit(), random.unit());
        blend(a, blend(b, c, v), u.sqrt())
    }

    fn on_surface(&self, random: &mut Random) -> [f32; 3] {
        match random.below(3) {
            0 => self.on_face(random),
            1 => self.on_edge(random),
            _ => self.vertex(random),
        }
    }
}

/// `a` at 0, `b` at 1, rounded to `f32`.
fn blend(a: [f32; 3], b: [f32; 3], part: f64) -> [f32; 3] {
    let mix = |a: f32, b: f32| (f64::from(a) + part * (f64::from(b) - f64::from(a))) as f32;
    std::array::from_fn(|i| mix(a[i], b[i]))
}
