//! Nanoseconds and counted events per point of the queries about points.
//!
//! `point_profile SCENES [ROUNDS] [LEVEL] [EMBREE]`, names of scenes separated by commas, a level or `best`, and
//! the path of Embree's shared library, whose point query is then asked too, in the same rounds. Points: `near`, on
//! triangles drawn by area and moved by up to 1 % of the diagonal; `box`, uniform in the scene's box; `far`,
//! uniform in a box three times as large; `sorted`, those of `box` in the order of a Morton curve.

use anyhow::Context;
use ropewalk::kernel::Level;
use ropewalk::point::PointQueries;
use ropewalk_bench::harness::Clock;
use ropewalk_bench::own::Wave;
use ropewalk_bench::peer::{Embree, EmbreeScene, Quality};
use ropewalk_bench::scene::{Catalog, Mesh};
use ropewalk_bench::workload::Random;
use std::path::{Path, PathBuf};

/// Points of each kind.
const POINTS: usize = 1 << 16;

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let names = arguments.first().map_or("", String::as_str).split(',').filter(|s| !s.is_empty());
    let names: Vec<String> = names.map(str::to_owned).collect();
    let rounds: usize = arguments.get(1).map_or(Ok(7), |n| n.parse())?;
    let level = match arguments.get(2).map(String::as_str) {
        Some(name) if name != "best" => {
            Level::ALL.into_iter().find(|l| l.name() == name).context("no such level")?
        }
        _ => Level::best(),
    };
    let embree = arguments.get(3).map(|path| Embree::load(Path::new(path), 1)).transpose()?;
    let catalog =
        Catalog { data: PathBuf::from("../shared/data"), generated: "target/bench-scenes".into() };
    println!(
        "{:12} {:7} {:>8} {:>8} {:>6} {:>6} {:>6} {:>6} {:>8} {:>6} {:>6} {:>6}",
        "scene",
        "points",
        "embree",
        "ns near",
        "steps",
        "leaves",
        "blocks",
        "met",
        "ns side",
        "steps",
        "blocks",
        "tests"
    );
    for entry in Catalog::select(&names)? {
        let scene = catalog.load(&entry)?;
        let engine = Wave::build(&scene.mesh, 1)?;
        let queries = engine.points()?.with_level(level).context("level not available")?;
        let quality = Quality { high: true, robust: false, filter: false };
        let peer = embree.as_ref().map(|embree| EmbreeScene::build(embree, &scene.mesh, quality));
        let peer = peer.transpose()?;
        for (name, points) in kinds(&scene.mesh) {
            let single: Vec<[f32; 3]> = points.iter().map(|p| p.map(|x| x as f32)).collect();
            let mut found = vec![(f32::NAN, 0); points.len()];
            let ns = time(
                rounds,
                [
                    &mut || {
                        if let Some(peer) = &peer {
                            peer.closest_point(&scene.mesh, &single, &mut found);
                        }
                    },
                    &mut || drop(queries.closest_point(&points)),
                    &mut || drop(queries.sides(&points)),
                ],
            );
            print(entry.name, name, &queries, &points, ns);
            if peer.is_some() {
                compare(&queries.distance(&points), &found, scene.mesh.bounds().diagonal())?;
            }
        }
    }
    Ok(())
}

/// Fails where the peer's distance is another one, beyond what `f32` explains.
fn compare(distance: &[f64], found: &[(f32, u32)], diagonal: f64) -> anyhow::Result<()> {
    for (ours, theirs) in distance.iter().zip(found) {
        let difference = (ours - f64::from(theirs.0)).abs();
        anyhow::ensure!(difference <= 1e-4 * (diagonal + ours), "{ours} and {}", theirs.0);
    }
    Ok(())
}

fn print(scene: &str, name: &str, queries: &PointQueries<'_>, points: &[[f64; 3]], ns: [f64; 3]) {
    let per = |count: u64| count as f64 / points.len() as f64;
    let (near, side) = (queries.closest_point_events(points), queries.sides_events(points));
    println!(
        "{scene:12} {name:7} {:8.1} {:8.1} {:6.2} {:6.2} {:6.2} {:6.2} {:8.1} {:6.2} {:6.2} {:6.2}",
        ns[0],
        ns[1],
        per(near.steps),
        per(near.leaves),
        per(near.blocks),
        per(near.met),
        ns[2],
        per(side.steps),
        per(side.blocks),
        per(side.clear)
    );
}

/// The kinds of points by name.
fn kinds(mesh: &Mesh) -> [(&'static str, Vec<[f64; 3]>); 4] {
    let mut random = Random::new(1);
    let bounds = mesh.bounds();
    let size: [f64; 3] = std::array::from_fn(|a| bounds.extent(a));
    let mut inside = |scale: f64| -> Vec<[f64; 3]> {
        let point = |_| {
            std::array::from_fn(|a| {
                let middle = f64::from(bounds.min[a]) + size[a] / 2.0;
                round(middle + scale * size[a] * (random.unit() - 0.5))
            })
        };
        (0..POINTS).map(point).collect()
    };
    let (within, far) = (inside(1.0), inside(3.0));
    let mut sorted = within.clone();
    sorted.sort_by_cached_key(|p| {
        (0..48).fold(0u64, |code, bit| {
            let (axis, level) = (bit % 3, bit / 3);
            let x = (p[axis] - f64::from(bounds.min[axis])) / size[axis].max(1e-300);
            let digit = ((x * 65535.0) as u64) >> (15 - level) & 1;
            code << 1 | digit
        })
    });
    let mut sum = 0.0;
    let areas: Vec<f64> = (0..mesh.faces.len() as u32)
        .map(|face| {
            let vertices = mesh.triangle(face);
            let normal = ropewalk::primitive::Triangle { vertices }.scaled_normal();
            sum += normal.iter().map(|x| x * x).sum::<f64>().sqrt();
            sum
        })
        .collect();
    let shift = 0.01 * bounds.diagonal();
    let near = |_| {
        let wanted = random.unit() * sum;
        let face = areas.partition_point(|&area| area <= wanted).min(areas.len() - 1);
        let (u, v) = (random.unit(), random.unit());
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        let [a, b, c] = mesh.triangle(face as u32).map(|p| p.map(f64::from));
        let (by, out) = (shift * random.unit(), random.direction());
        std::array::from_fn(|i| round(a[i] + u * (b[i] - a[i]) + v * (c[i] - a[i]) + by * out[i]))
    };
    let near = (0..POINTS).map(near).collect();
    [("near", near), ("box", within), ("far", far), ("sorted", sorted)]
}

/// A number that peers with `f32` points can be asked about.
fn round(x: f64) -> f64 {
    f64::from(x as f32)
}

/// Median nanoseconds of thread CPU time a point, of each work.
fn time<const N: usize>(rounds: usize, mut works: [&mut dyn FnMut(); N]) -> [f64; N] {
    let mut all = [const { Vec::new() }; N];
    for _ in 0..rounds {
        for (all, work) in all.iter_mut().zip(&mut works) {
            let clock = Clock::start();
            work();
            all.push(clock.elapsed().0 * 1e9 / POINTS as f64);
        }
    }
    all.map(|mut all| {
        all.sort_by(f64::total_cmp);
        all[rounds / 2]
    })
}
