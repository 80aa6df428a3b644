//! Triangle sets of any size for the benchmarks.

use crate::scene::Mesh;
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
    collect(soup(n))
}

/// The same as a mesh, each triangle with its own vertices.
pub fn soup_mesh(n: usize) -> Mesh {
    let vertices: Vec<[f32; 3]> = soup(n).flatten().collect();
    let faces = (0..vertices.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Mesh { name: "soup".into(), vertices, faces }
}

fn soup(n: usize) -> impl Iterator<Item = [[f32; 3]; 3]> {
    let mut uniform = Uniform(1);
    let edge = (n.max(1) as f32).powf(-1.0 / 3.0);
    (0..n).map(move |_| {
        let center: [f32; 3] = std::array::from_fn(|_| uniform.next());
        std::array::from_fn(|_| center.map(|c| c + edge * (uniform.next() - 0.5)))
    })
}

/// About `n` triangles: a square grid over a wavy height field.
pub fn grid_mesh(n: usize) -> Geometry {
    let mesh = terrain_mesh(n);
    collect((0..mesh.faces.len() as u32).map(|face| mesh.triangle(face)))
}

/// The same as an indexed mesh over the unit square.
pub fn terrain_mesh(n: usize) -> Mesh {
    let side = ((n as f64 / 2.0).sqrt().round() as u32).max(1);
    let point = |k: u32| {
        let (i, j) = (k % (side + 1), k / (side + 1));
        let (x, y) = (i as f32 / side as f32, j as f32 / side as f32);
        [x, y, 0.2 * (12.0 * x).sin() * (9.0 * y).cos()]
    };
    let vertices = (0..(side + 1) * (side + 1)).map(point).collect();
    let square = |k: u32| {
        let a = k % side + k / side * (side + 1);
        let [b, c, d] = [a + 1, a + side + 2, a + side + 1];
        [[a, b, c], [a, c, d]]
    };
    let faces = (0..side * side).flat_map(square).collect();
    Mesh { name: "terrain".into(), vertices, faces }
}

/// About `n` triangles: a closed sphere with bumps, from a cube whose faces are grids. Everything
/// within 0.7 of the origin is inside, and sees all of the surface that no bump hides.
pub fn bumpy_sphere(n: usize) -> Mesh {
    let side = ((n as f64 / 12.0).sqrt().round() as u32).max(1);
    let point = |lattice: [u32; 3]| {
        // The same arithmetic for the same lattice point, so that the edges of the cube close.
        let p = lattice.map(|x| 2.0 * f64::from(x) / f64::from(side) - 1.0);
        let length = p.iter().map(|x| x * x).sum::<f64>().sqrt();
        let d = p.map(|x| x / length);
        let wave = |a: usize, frequency: f64| (frequency * d[a] + a as f64).sin();
        let radius = 1.0 + 0.15 * wave(0, 9.0) * wave(1, 8.0) * wave(2, 7.0);
        d.map(|x| (radius * x) as f32)
    };
    let mut mesh = Mesh { name: "bumpy-sphere".into(), ..Mesh::default() };
    for (axis, far) in [(0, 0), (0, side), (1, 0), (1, side), (2, 0), (2, side)] {
        let first = mesh.vertices.len() as u32;
        for k in 0..(side + 1) * (side + 1) {
            let mut lattice = [far; 3];
            lattice[(axis + 1) % 3] = k % (side + 1);
            lattice[(axis + 2) % 3] = k / (side + 1);
            mesh.vertices.push(point(lattice));
        }
        for k in 0..side * side {
            let a = first + k % side + k / side * (side + 1);
            let [b, c, d] = [a + 1, a + side + 2, a + side + 1];
            // Outward, on whichever end of the axis.
            let [b, d] = if far == 0 { [d, b] } else { [b, d] };
            mesh.faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

fn collect(triangles: impl Iterator<Item = [[f32; 3]; 3]>) -> Geometry {
    let mut geometry = Geometry::new();
    for vertices in triangles {
        // Coordinates lie near the unit cube and counts below the limit of ids.
        geometry.push(Triangle { vertices }, Sides::Both).expect("finite triangles");
    }
    geometry
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn meshes_have_about_the_size_asked_for_and_the_sphere_is_closed() {
        for n in [200, 1000, 5000] {
            for mesh in [soup_mesh(n), terrain_mesh(n), bumpy_sphere(n)] {
                let faces = mesh.faces.len();
                assert!(faces.abs_diff(n) <= n / 10 + 2, "{} {n} {faces}", mesh.name);
                assert_eq!(
                    mesh.clone().checked().unwrap().is_closed(),
                    mesh.name == "bumpy-sphere"
                );
            }
        }
        assert_eq!(grid_mesh(200).len(), 200);
    }
}
