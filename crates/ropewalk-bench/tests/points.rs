//! Points against real meshes: equal to brute force, and on the right side of closed surfaces.

use libtest_mimic::{Arguments, Failed, Trial};
use ropewalk::build::{BuildSettings, Preset};
use ropewalk::kernel::Level;
use ropewalk::point::{PointBruteForce, PointQueries, Side};
use ropewalk::primitive::Triangle;
use ropewalk::wide::WideTree;
use ropewalk::{Geometry, Sides};
use ropewalk_bench::scene::Mesh;
use ropewalk_bench::workload::Random;
use ropewalk_testkit::data::trial;
use std::path::Path;

/// Scale and offset of each mesh, which is brought to size 1 first.
const PLACES: [(f32, f32); 4] = [(1e-6, 0.0), (1.0, 0.0), (1e6, 0.0), (1e6, 1e7)];

/// Points of each kind that go to brute force.
const POINTS: usize = 20;

fn main() {
    let files = [
        ("bunny", "mesh/bunny.ply.gz", false),
        ("dragon", "mesh/dragon.ply.gz", false),
        ("teapot", "mesh/teapot_newell.ply.gz", false),
        ("sponza", "scene/sponza.ply.gz", false),
        ("scallop", "mesh/scallop.glb.gz", true),
    ];
    let test = |(name, path, closed): (&'static str, &str, bool)| -> Trial {
        trial(format!("points::{name}"), path, move |file| check(name, file, closed))
    };
    libtest_mimic::run(&Arguments::from_args(), files.map(test).into_iter().collect()).exit()
}

fn check(name: &str, file: &Path, closed: bool) -> Result<(), Failed> {
    let mesh = Mesh::read(name, file).map_err(|error| error.to_string())?;
    for (scale, offset) in PLACES {
        check_at(&mesh, closed, scale / mesh.bounds().diagonal() as f32, offset)?;
    }
    Ok(())
}

fn check_at(mesh: &Mesh, closed: bool, scale: f32, offset: f32) -> Result<(), Failed> {
    let mut geometry = Geometry::new();
    for face in 0..mesh.faces.len() as u32 {
        let vertices = mesh.triangle(face).map(|p| p.map(|x| x * scale + offset));
        geometry.push(Triangle { vertices }, Sides::Both)?;
    }
    let (tree, _) = WideTree::build(&geometry, &BuildSettings::preset(Preset::Fast), &())?;
    let oracle = PointBruteForce { geometry: &geometry };
    let points = points(&geometry);
    let closest: Vec<_> = points.iter().map(|&p| oracle.closest_point(p).unwrap()).collect();
    let sides: Vec<_> = points.iter().map(|&p| oracle.side(p)).collect();
    let queries = PointQueries::new(&tree, &geometry)?;
    for level in Level::ALL {
        let Some(queries) = queries.with_level(level) else { continue };
        let found = queries.closest_point(&points);
        for (i, nearest) in closest.iter().enumerate() {
            let same = (found.distance[i], found.prim_id[i], found.point[i]);
            assert_eq!(same, (nearest.distance, nearest.prim_id, nearest.point));
        }
        assert_eq!(queries.sides(&points), sides);
    }
    if closed {
        check_faces(&geometry, &queries);
    }
    Ok(())
}

/// Anywhere in the box and around, on vertices, on edges, beside faces.
fn points(geometry: &Geometry) -> Vec<[f64; 3]> {
    let mut random = Random::new(7);
    let bounds = geometry.bounds();
    let mut points = Vec::new();
    for _ in 0..POINTS {
        let [a, b, c] = corners(geometry, random.below(geometry.len()) as u32);
        let mut around = |scale: f64| {
            std::array::from_fn(|i| {
                let (low, size) = (f64::from(bounds.min[i]), bounds.extent(i));
                low + size * (0.5 + scale * (random.unit() - 0.5))
            })
        };
        points.extend([around(1.0), around(3.0), a]);
        points.push(std::array::from_fn(|i| 0.5 * (a[i] + b[i])));
        let out = 0.001 * bounds.diagonal() * random.unit();
        points.push(std::array::from_fn(|i| (a[i] + b[i] + c[i]) / 3.0 + out));
    }
    points
}

/// Points beside the middles of faces are on both sides, all vertices on the surface. Faces so small that
/// another may lie between are passed over.
fn check_faces(geometry: &Geometry, queries: &PointQueries<'_>) {
    let mut points = Vec::new();
    for id in 0..geometry.len() as u32 {
        let triangle = Triangle { vertices: corners(geometry, id).map(|p| p.map(|x| x as f32)) };
        let [a, b, c] = corners(geometry, id);
        let normal = triangle.scaled_normal();
        let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
        let largest = a.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let by = 1e-9 * largest.max(geometry.bounds().diagonal());
        if length.sqrt() < 1e3 * by {
            continue;
        }
        for by in [by, -by] {
            let middle = |i: usize| (a[i] + b[i] + c[i]) / 3.0 + by * normal[i] / length;
            points.push(std::array::from_fn(middle));
        }
        points.push(a);
    }
    let sides = queries.sides(&points);
    let outward = sides.chunks(3).filter(|s| s[..2] == [Side::Outside, Side::Inside]).count();
    let inward = sides.chunks(3).filter(|s| s[..2] == [Side::Inside, Side::Outside]).count();
    let faces = points.len() / 3;
    println!("{faces} faces: {outward} outward, {inward} inward");
    assert!(sides.chunks(3).all(|s| s[2] == Side::On));
    assert!(faces > 1000 && outward + inward == faces, "{outward} and {inward} of {faces}");
}

fn corners(geometry: &Geometry, id: u32) -> [[f64; 3]; 3] {
    let ropewalk::Shape::Triangle(triangle) = geometry.shape(id) else {
        unreachable!("only triangles were added")
    };
    triangle.vertices.map(|p| p.map(f64::from))
}
