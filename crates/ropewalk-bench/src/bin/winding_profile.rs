//! Nanoseconds per winding number by moments, and how far they are from the sum over all triangles.
//!
//! `winding_profile SCENES [ROUNDS]`, names of scenes separated by commas. One thread; points are uniform in the
//! scene's box and near its surface (moved off vertices by up to 1 % of the diagonal).

use ropewalk::Geometry;
use ropewalk::point::{PointBruteForce, PointQueries};
use ropewalk_bench::harness::Clock;
use ropewalk_bench::own::Wave;
use ropewalk_bench::scene::Catalog;
use ropewalk_bench::workload::Random;
use std::path::PathBuf;

/// Points that are timed.
const POINTS: usize = 1 << 13;

/// Points that are compared with the sum.
const CHECKED: usize = 256;

const ACCURACIES: [f64; 4] = [0.45, 0.1, 0.01, 1e-3];

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let names = arguments.first().map_or("", String::as_str).split(',').filter(|s| !s.is_empty());
    let names: Vec<String> = names.map(str::to_owned).collect();
    let rounds: usize = arguments.get(1).map_or(Ok(3), |n| n.parse())?;
    let catalog =
        Catalog { data: PathBuf::from("../shared/data"), generated: "target/bench-scenes".into() };
    println!("nanoseconds a point (greatest error seen); {CHECKED} points beside the sum");
    for entry in Catalog::select(&names)? {
        let scene = catalog.load(&entry)?;
        let (mesh, mut random) = (&scene.mesh, Random::new(1));
        let geometry = Geometry::from_triangles(&mesh.vertices, &mesh.faces)?;
        let engine = Wave::build(mesh, 1)?;
        let queries: PointQueries<'_> = engine.points()?;
        let start = std::time::Instant::now();
        let moments = queries.winding_moments();
        let built = start.elapsed().as_secs_f64();
        let bytes = moments.bytes() as f64 / mesh.faces.len() as f64;
        println!("{}: {bytes:.0} bytes a triangle, built in {built:.3} s", entry.name);
        let bounds = mesh.bounds();
        let box_points: Vec<[f64; 3]> = (0..POINTS)
            .map(|_| {
                std::array::from_fn(|a| f64::from(bounds.min[a]) + bounds.extent(a) * random.unit())
            })
            .collect();
        let shift = 0.01 * bounds.diagonal();
        let near: Vec<[f64; 3]> = (0..POINTS)
            .map(|_| {
                let face = (random.unit() * mesh.faces.len() as f64) as u32;
                let [a, ..] = mesh.triangle(face);
                let (by, out) = (shift * random.unit(), random.direction());
                std::array::from_fn(|i| f64::from(a[i]) + by * out[i])
            })
            .collect();
        for (name, points) in [("box", box_points), ("near", near)] {
            let clock = Clock::start();
            let oracle = PointBruteForce { geometry: &geometry };
            let exact: Vec<f64> =
                points[..CHECKED].iter().map(|&p| oracle.winding_number(p)).collect();
            let sum = clock.elapsed().0 * 1e9 / CHECKED as f64;
            print!("  {name:5} sum {sum:9.0}");
            for accuracy in ACCURACIES {
                let found =
                    queries.winding_number_within(&moments, &points[..CHECKED], accuracy)?;
                let off = found.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                let ns = median(rounds, || {
                    drop(queries.winding_number_within(&moments, &points, accuracy));
                });
                print!("   {accuracy:e}: {ns:6.0} ({off:.0e})");
            }
            let ns = median(rounds, || drop(queries.contains_by_winding(&moments, &points)));
            println!("   contains {ns:6.0}");
        }
    }
    Ok(())
}

fn median(rounds: usize, mut work: impl FnMut()) -> f64 {
    let mut all: Vec<f64> = (0..rounds)
        .map(|_| {
            let clock = Clock::start();
            work();
            clock.elapsed().0 * 1e9 / POINTS as f64
        })
        .collect();
    all.sort_by(f64::total_cmp);
    all[rounds / 2]
}
