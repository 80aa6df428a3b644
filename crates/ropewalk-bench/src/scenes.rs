//! Triangle sets of any size for the benchmarks.

use ropewalk::primitive::Triangle;
use ropewalk::{Geometry, Sides};

/// Uniform numbers in `0 ..= 1` (SplitMix64), the same on every machine.
struct Uniform(u64);

impl Uniform {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
    }
}

/// `n` triangles with uniform places in the unit cube and edges of about the mean distance of
/// neighbours, `n^(-1/3)`.
pub fn random_soup(n: usize) -> Geometry {
    let mut uniform = Uniform(1);
    let edge = (n.max(1) as f32).powf(-1.0 / 3.0);
    collect((0..n).map(|_| {
        let center: [f32; 3] = std::array::from_fn(|_| uniform.next());
        std::array::from_fn(|_| center.map(|c| c + edge * (uniform.next() - 0.5)))
    }))
}

/// About `n` triangles: a square grid over a wavy height field.
pub fn grid_mesh(n: usize) -> Geometry {
    let side = ((n as f64 / 2.0).sqrt().round() as usize).max(1);
    let point = move |i: usize, j: usize| {
        let (x, y) = (i as f32 / side as f32, j as f32 / side as f32);
        [x, y, 0.2 * (12.0 * x).sin() * (9.0 * y).cos()]
    };
    collect((0..side * side).flat_map(move |k| {
        let (i, j) = (k % side, k / side);
        let [a, b] = [point(i, j), point(i + 1, j)];
        let [c, d] = [point(i + 1, j + 1), point(i, j + 1)];
        [[a, b, c], [a, c, d]]
    }))
}

fn collect(triangles: impl Iterator<Item = [[f32; 3]; 3]>) -> Geometry {
    let mut geometry = Geometry::new();
    for vertices in triangles {
        // Coordinates lie near the unit cube and counts below the limit of ids.
        geometry.push(Triangle { vertices }, Sides::Both).expect("finite triangles");
    }
    geometry
}
