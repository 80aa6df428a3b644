//! Casts rays from inside of closed meshes at their edges and vertices, in `f32` and in `f64`, and counts those that hit
//! nothing.
//! `cargo run --release -p ropewalk-bench --bin closed -- --rays 1e8`.
//!
//! Meshes in `f64` also lie at other scales and far from the origin. Vertices are rounded to a grid before, so that many
//! rays meet edges and vertices exactly. Which points are inside is decided exactly, along another direction
//! (`PointQueries::sides`).

use anyhow::Context;
use clap::Parser;
use ropewalk::build::{BuildSettings, Preset};
use ropewalk::double::{DoubleCaster, DoubleGeometry, DoubleRay};
use ropewalk::kernel::BatchCaster;
use ropewalk::point::{PointQueries, Side};
use ropewalk::{Geometry, Ray};
use ropewalk_bench::harness::{Record, commit, cpu_name, today};
use ropewalk_bench::scene::{Catalog, Mesh};
use ropewalk_bench::scenes::bumpy_sphere;
use ropewalk_bench::workload::Random;
use std::path::PathBuf;

/// Counts rays from inside of closed meshes that are lost.
#[derive(Parser)]
struct Arguments {
    /// Rays of each precision over all meshes and places, such as 1e8.
    #[arg(long, default_value = "1e6")]
    rays: f64,
    /// Another seed casts other rays.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The folder of the CSV.
    #[arg(long, default_value = "bench/record")]
    out: PathBuf,
    /// The folder of shared scenes.
    #[arg(long, default_value = "../shared/data")]
    data: PathBuf,
    /// The folder of generated scenes.
    #[arg(long, default_value = "target/bench-scenes")]
    generated: PathBuf,
}

/// Rays of a batch.
const CHUNK: usize = 1 << 17;
/// Points inside of a mesh that rays start from.
const POINTS: usize = 256;
/// Cells of the grid that vertices are rounded to, across the longest side of the mesh.
const GRID: f64 = 65_536.0;

/// Closed meshes of the catalogue.
const SCENES: [&str; 3] = ["dragon", "scallop", "sphereflake"];

/// Scale and offset of the places in `f64`; in `f32` there is the first one alone.
const PLACES: [(f64, f64); 4] = [(1.0, 0.0), (1e-6, 0.0), (1e6, 0.0), (10.0, 1e7)];

/// What became of some rays.
#[derive(Clone, Copy, Default)]
struct Tally {
    rays: u64,
    lost: u64,
}

fn main() -> anyhow::Result<()> {
    let arguments = Arguments::parse();
    let catalog = Catalog { data: arguments.data.clone(), generated: arguments.generated.clone() };
    let mut meshes = vec![("bumpy-sphere".to_owned(), bumpy_sphere(300_000))];
    for entry in Catalog::select(&SCENES.map(str::to_owned))? {
        let mesh = catalog.load(&entry).with_context(|| entry.name.to_owned())?.mesh;
        anyhow::ensure!(mesh.is_closed(), "{}: expected a closed mesh", entry.name);
        meshes.push((entry.name.to_owned(), mesh));
    }
    let mut csv = "mesh,triangles,precision,scale,offset,rays,lost,seed,cpu,commit\n".to_owned();
    let (cpu, commit) = (cpu_name(), commit());
    let mut sums = [Tally::default(); 2];
    for (name, mesh) in &meshes {
        for (place, &(scale, offset)) in PLACES.iter().enumerate() {
            let vertices = placed(mesh, scale, offset);
            let seed = arguments.seed.wrapping_mul(31).wrapping_add(place as u64);
            let single = place == 0;
            let share = |places: usize| {
                (arguments.rays / (meshes.len() * places * CHUNK) as f64).ceil() as u64
            };
            let mut row = |precision: usize, tally: Tally| {
                let bits = ["f32", "f64"][precision];
                eprintln!(
                    "{name} {bits} x{scale:e} +{offset:e}: {} rays, {} lost",
                    tally.rays, tally.lost
                );
                csv += &format!(
                    "{name},{},{bits},{scale:e},{offset:e},{},{},{},\"{cpu}\",{commit}\n",
                    mesh.faces.len(),
                    tally.rays,
                    tally.lost,
                    arguments.seed
                );
                let sum = &mut sums[precision];
                sum.rays += tally.rays;
                sum.lost += tally.lost;
            };
            if single {
                row(0, in_f32(mesh, &vertices, share(1), seed)?);
            }
            row(1, in_f64(mesh, vertices, share(PLACES.len()), seed)?);
        }
    }
    let path =
        arguments.out.join(format!("closed-{}-{}.csv", today(), commit.replace('+', "-dirty")));
    Record::write(&path, &csv)?;
    for (precision, sum) in ["f32", "f64"].iter().zip(sums) {
        println!("{precision}: {} rays, {} lost", sum.rays, sum.lost);
    }
    println!("record: {}", path.display());
    anyhow::ensure!(sums.iter().all(|s| s.lost == 0), "some rays were lost");
    Ok(())
}

/// The vertices on a grid, scaled and moved.
fn placed(mesh: &Mesh, scale: f64, offset: f64) -> Vec<[f64; 3]> {
    let bounds = mesh.bounds();
    let longest = (0..3).map(|a| bounds.extent(a)).fold(0.0, f64::max);
    let cell = (longest / GRID).log2().ceil().exp2();
    let on_grid = |p: &[f32; 3]| p.map(|x| (f64::from(x) / cell).round() * cell * scale + offset);
    mesh.vertices.iter().map(on_grid).collect()
}

/// Where rays are aimed at: vertices, and middles of edges.
fn targets(random: &mut Random, mesh: &Mesh, vertices: &[[f64; 3]]) -> [f64; 3] {
    let face = mesh.faces[random.below(mesh.faces.len())].map(|i| vertices[i as usize]);
    let (corner, vertex) = (random.below(3), random.below(2) == 0);
    let next = face[(corner + 1) % 3];
    if vertex { next } else { std::array::from_fn(|a| (face[corner][a] + next[a]) / 2.0) }
}

fn in_f64(mesh: &Mesh, vertices: Vec<[f64; 3]>, chunks: u64, seed: u64) -> anyhow::Result<Tally> {
    let geometry = DoubleGeometry::from_triangles(vertices.clone(), mesh.faces.clone())?;
    let (tree, _) = geometry.build(&settings(), &())?;
    let queries = PointQueries::new(&tree, &geometry)?;
    let mut random = Random::new(seed);
    let inside = points_inside(&mut random, &vertices, |points| queries.sides(points))?;
    let caster = DoubleCaster::new(&tree, &geometry);
    let mut tally = Tally::default();
    for _ in 0..chunks {
        let ray = |_| {
            let from = inside[random.below(inside.len())];
            let at = targets(&mut random, mesh, &vertices);
            DoubleRay::new(from, std::array::from_fn(|a| at[a] - from[a]))
        };
        let rays: Vec<DoubleRay> = (0..CHUNK).map(ray).collect();
        tally.add(&caster.closest_hit(&rays).prim_id);
    }
    Ok(tally)
}

fn in_f32(mesh: &Mesh, vertices: &[[f64; 3]], chunks: u64, seed: u64) -> anyhow::Result<Tally> {
    let single: Vec<[f32; 3]> = vertices.iter().map(|p| p.map(|x| x as f32)).collect();
    let geometry = Geometry::from_triangles(&single, &mesh.faces)?;
    let (tree, _) = ropewalk::wide::WideTree::build(&geometry, &settings(), &())?;
    let queries = PointQueries::new(&tree, &geometry)?;
    let mut random = Random::new(seed);
    let inside = points_inside(&mut random, vertices, |points| queries.sides(points))?;
    let caster = BatchCaster::new(&tree, &geometry);
    let mut tally = Tally::default();
    for _ in 0..chunks {
        let ray = |_| {
            let from = inside[random.below(inside.len())];
            let at = targets(&mut random, mesh, vertices);
            Ray::new(from.map(|x| x as f32), std::array::from_fn(|a| (at[a] - from[a]) as f32))
        };
        let rays: Vec<Ray> = (0..CHUNK).map(ray).collect();
        tally.add(&caster.closest_hit(&rays).prim_id);
    }
    Ok(tally)
}

fn settings() -> BuildSettings {
    BuildSettings::preset(Preset::Balanced)
}

/// Points of the box that are inside and that `f32` can write.
fn points_inside(
    random: &mut Random,
    vertices: &[[f64; 3]],
    sides: impl Fn(&[[f64; 3]]) -> Vec<Side>,
) -> anyhow::Result<Vec<[f64; 3]>> {
    let low: [f64; 3] =
        std::array::from_fn(|a| vertices.iter().map(|p| p[a]).fold(f64::INFINITY, f64::min));
    let high: [f64; 3] =
        std::array::from_fn(|a| vertices.iter().map(|p| p[a]).fold(f64::NEG_INFINITY, f64::max));
    let mut found = Vec::new();
    for _ in 0..100 {
        let point = |_| {
            std::array::from_fn(|a| f64::from((low[a] + (high[a] - low[a]) * random.unit()) as f32))
        };
        let points: Vec<[f64; 3]> = (0..4096).map(point).collect();
        let sides = sides(&points);
        let inside = points.iter().zip(sides).filter(|(_, side)| *side == Side::Inside);
        found.extend(inside.map(|(p, _)| *p));
        if found.len() >= POINTS {
            found.truncate(POINTS);
            return Ok(found);
        }
    }
    anyhow::bail!("expected a mesh with an inside")
}

impl Tally {
    fn add(&mut self, prim_id: &[u32]) {
        self.rays += prim_id.len() as u64;
        self.lost += prim_id.iter().filter(|&&id| id == u32::MAX).count() as u64;
    }
}
