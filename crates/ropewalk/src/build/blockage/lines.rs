//! Uniform random lines, and how many of them end on a primitive.

use crate::aabb::Aabb;
use crate::geometry::Geometry;
use crate::ray::Ray;
use crate::traverse::{NoCounts, Occluded, sung_shirley};
use crate::tree::BspTree;

/// A sample of lines through a geometry, answered by a tree over it.
pub(super) struct Lines<'a> {
    geometry: &'a Geometry,
    tree: &'a BspTree,
    random: Random,
}

impl<'a> Lines<'a> {
    /// The same lines for the same seed.
    pub fn new(geometry: &'a Geometry, tree: &'a BspTree, seed: u64) -> Self {
        Lines { geometry, tree, random: Random(seed) }
    }

    /// The share of `count` segments drawn by `draw` that hit a primitive (on a side that can be
    /// hit). A segment of no length hits nothing.
    pub fn share_ended(&mut self, count: u32, draw: impl Fn(&mut Random) -> [[f64; 3]; 2]) -> f64 {
        let mut ended = 0u32;
        for _ in 0..count {
            let [from, to] = draw(&mut self.random);
            let origin = from.map(|x| x as f32);
            let dir = std::array::from_fn(|a| (to[a] - from[a]) as f32);
            let ray = Ray::new(origin, dir).with_range(0.0, 1.0);
            let counts = &mut NoCounts;
            ended += u32::from(sung_shirley::<Occluded, _>(self.geometry, self.tree, &ray, counts));
        }
        f64::from(ended) / f64::from(count.max(1))
    }
}

/// Random segments (SplitMix64: Steele, Lea and Flood 2014).
pub(super) struct Random(u64);

impl Random {
    /// Uniform in `0 .. 1`.
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// The part inside `cell` of a uniform line that leaves it through its upper (or lower) face
    /// on `axis`, from its entry to that face.
    pub fn towards_face(&mut self, cell: &Aabb, axis: usize, upper: bool) -> [[f64; 3]; 2] {
        let face = self.on_face(cell, axis, upper);
        let inwards = self.cosine_inwards(axis, upper);
        [exit(cell, face, inwards), face]
    }

    /// The part inside `cell` of a uniform line that meets it.
    pub fn across(&mut self, cell: &Aabb) -> [[f64; 3]; 2] {
        let weights = [0, 1, 2].map(|axis| cell.face_area(axis));
        let mut draw = self.uniform() * weights.iter().sum::<f64>();
        let axis = (0..2).find(|&axis| {
            draw -= weights[axis];
            draw < 0.0
        });
        let (axis, upper) = (axis.unwrap_or(2), self.uniform() < 0.5);
        let face = self.on_face(cell, axis, upper);
        let inwards = self.cosine_inwards(axis, upper);
        [face, exit(cell, face, inwards)]
    }

    /// A uniform point on a face.
    fn on_face(&mut self, cell: &Aabb, axis: usize, upper: bool) -> [f64; 3] {
        let mut point =
            std::array::from_fn(|a| f64::from(cell.min[a]) + self.uniform() * cell.extent(a));
        point[axis] = f64::from(if upper { cell.max[axis] } else { cell.min[axis] });
        point
    }

    /// A cosine-weighted direction away from a face into the cell: with a uniform point on the
    /// surface it makes a uniform line (Santalo 1976).
    fn cosine_inwards(&mut self, axis: usize, upper: bool) -> [f64; 3] {
        let (radius, angle) = (self.uniform().sqrt(), std::f64::consts::TAU * self.uniform());
        let height = (1.0 - radius * radius).sqrt();
        let mut dir = [0.0; 3];
        dir[axis] = if upper { -height } else { height };
        dir[(axis + 1) % 3] = radius * angle.cos();
        dir[(axis + 2) % 3] = radius * angle.sin();
        dir
    }
}

/// Where a line from a point on the cell's surface into the cell leaves it.
fn exit(cell: &Aabb, from: [f64; 3], dir: [f64; 3]) -> [f64; 3] {
    let mut t_exit = f64::INFINITY;
    for axis in 0..3 {
        let face = if dir[axis] > 0.0 { cell.max[axis] } else { cell.min[axis] };
        if dir[axis] != 0.0 {
            t_exit = t_exit.min((f64::from(face) - from[axis]) / dir[axis]);
        }
    }
    let t = t_exit.max(0.0);
    std::array::from_fn(|axis| from[axis] + t * dir[axis])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::build_default;
    use crate::primitive::Sides;
    use crate::primitive::{Primitive, Sphere};

    /// Uniform lines hit a convex body inside a cell with the ratio of the areas (Crofton).
    #[test]
    fn uniform_lines_obey_crofton() {
        let cell = Aabb::new([-1.0, -2.0, -1.5], [1.0, 2.0, 1.5]);
        let sphere = Sphere { center: [0.3, -0.8, 0.2], radius: 0.65 };
        let mut geometry = Geometry::new();
        geometry.push(sphere, Sides::Both).expect("finite sphere");
        let (tree, _) = build_default(&geometry).expect("default settings");
        let count = 40_000;
        let share = Lines::new(&geometry, &tree, 1).share_ended(count, |r| r.across(&cell));
        let expected = sphere.area() / cell.area();
        // Five standard errors.
        let tolerance = 5.0 * (expected * (1.0 - expected) / f64::from(count)).sqrt();
        assert!((share - expected).abs() < tolerance, "{share} {expected}");
    }

    #[test]
    fn segments_stay_in_the_cell() {
        let cell = Aabb::new([-1.0, 3.0, 0.0], [2.0, 4.0, 0.5]);
        let mut random = Random(7);
        let inside = |p: [f64; 3]| {
            // One rounding in f64 of coordinates below 4.
            (0..3).all(|a| {
                p[a] >= f64::from(cell.min[a]) - 1e-15 && p[a] <= f64::from(cell.max[a]) + 1e-15
            })
        };
        for i in 0..300 {
            let [from, to] = random.towards_face(&cell, i % 3, i % 2 == 0);
            assert!(inside(from) && inside(to), "{from:?} {to:?}");
            let face = if i % 2 == 0 { cell.max } else { cell.min }[i % 3];
            assert_eq!(to[i % 3], f64::from(face));
        }
    }
}
