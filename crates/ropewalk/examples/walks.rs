//! What each walk costs on a soup of small triangles: counted events and time per ray; rope walks
//! also with a known start leaf (marked +).
//!
//! `cargo run --release -p ropewalk --example walks [TRIANGLES [RAYS]]`

use ropewalk::build::build_default;
use ropewalk::primitive::Triangle;
use ropewalk::traverse::{Counts, LeafId, NoCounts};
use ropewalk::{Accelerator, Geometry, Ray, Sides, Walk};
use ropewalk_testkit::rays::Draw;
use std::sync::Arc;
use std::time::Instant;

fn soup(draw: &mut Draw, count: usize) -> Geometry {
    let size = 1.5 * (count as f64).powf(-1.0 / 3.0);
    let mut geometry = Geometry::new();
    for _ in 0..count {
        let center: [f64; 3] = std::array::from_fn(|_| draw.uniform(0.0, 1.0));
        let vertices =
            std::array::from_fn(|_| center.map(|c| (c + draw.uniform(-0.5, 0.5) * size) as f32));
        geometry.push(Triangle { vertices }, Sides::Both).expect("coordinates are finite");
    }
    geometry
}

/// Rays between two uniform points of the unit cube, continued to infinity.
fn inner_rays(draw: &mut Draw, count: usize) -> Vec<Ray> {
    let ray = |draw: &mut Draw| {
        let origin = std::array::from_fn(|_| draw.uniform(0.0, 1.0) as f32);
        Ray::new(origin, draw.direction())
    };
    (0..count).map(|_| ray(draw)).collect()
}

/// Rays from a distance that cross the cube, mostly without a hit when the soup is thin.
fn outer_rays(draw: &mut Draw, count: usize) -> Vec<Ray> {
    let ray = |draw: &mut Draw| {
        let (out, target) =
            (draw.direction(), std::array::from_fn::<f64, 3, _>(|_| draw.uniform(0.0, 1.0)));
        let origin: [f32; 3] = std::array::from_fn(|a| 0.5 + 3.0 * out[a]);
        Ray::new(origin, std::array::from_fn(|a| target[a] as f32 - origin[a]))
    };
    (0..count).map(|_| ray(draw)).collect()
}

/// Nanoseconds per ray: the best of seven rounds for each batch of 500 rays, so that other work on
/// the machine disturbs little.
fn nanoseconds(accelerator: &Accelerator, rays: &[(Ray, Option<LeafId>)]) -> f64 {
    let batch = |rays: &[(Ray, Option<LeafId>)]| {
        let round = |_| {
            let start = Instant::now();
            let hits = rays.iter().filter_map(|(ray, start)| {
                accelerator.closest_hit_from(ray, *start, &mut NoCounts).0
            });
            std::hint::black_box(hits.map(|hit| hit.t).sum::<f32>());
            start.elapsed().as_nanos()
        };
        (0..7).map(round).min().unwrap_or(0)
    };
    rays.chunks(500).map(batch).sum::<u128>() as f64 / rays.len() as f64
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1).map(|x| x.parse::<usize>());
    let triangles = arguments.next().unwrap_or(Ok(10_000))?;
    let rays = arguments.next().unwrap_or(Ok(100_000))?;
    let mut draw = Draw::new(1);
    let geometry = Arc::new(soup(&mut draw, triangles));
    let tree = Arc::new(build_default(&geometry)?.0);
    let leaves = tree.nodes().len() / 2 + 1;
    println!("{triangles} triangles, {leaves} leaves, {} references", tree.reference_count());
    for (name, rays) in
        [("inner", inner_rays(&mut draw, rays)), ("outer", outer_rays(&mut draw, rays))]
    {
        println!(
            "\n{name:14} {:>7} {:>7} {:>7} {:>7} {:>7} {:>8} {:>7} {:>7} {:>7} {:>7}",
            "tests",
            "steps",
            "leaves",
            "empty",
            "ropes",
            "2-d",
            "restart",
            "ns/ray",
            "B/leaf",
            "thread"
        );
        let mut expected = None;
        let runs = [
            (Walk::SungShirley, false),
            (Walk::TaB, false),
            (Walk::Ropes, false),
            (Walk::RopeTrees, false),
            (Walk::Ropes, true),
            (Walk::RopeTrees, true),
        ];
        for (walk, known) in runs {
            if known && name != "inner" {
                continue;
            }
            let start = Instant::now();
            let accelerator = Accelerator::new(geometry.clone(), tree.clone(), walk)?;
            let threading = start.elapsed().as_secs_f64() * 1e3;
            let start = |ray: &Ray| accelerator.locate(ray.origin).filter(|_| known);
            let rays: Vec<_> = rays.iter().map(|ray| (*ray, start(ray))).collect();
            let mut counts = Counts::default();
            let hits: Vec<_> = rays
                .iter()
                .map(|(ray, start)| accelerator.closest_hit_from(ray, *start, &mut counts).0)
                .collect();
            assert!(expected.get_or_insert_with(|| hits.clone()) == &hits, "{walk:?} differs");
            let best = nanoseconds(&accelerator, &rays);
            let per_ray = |events: u64| events as f64 / rays.len() as f64;
            println!(
                "{:14} {:7.3} {:7.3} {:7.3} {:7.3} {:7.3} {:8.3} {:7.5} {:7.0} {:7.1} {:5.1} ms",
                format!("{}{}", walk.name(), if known { " +" } else { "" }),
                per_ray(counts.intersection_tests),
                per_ray(counts.traversal_steps),
                per_ray(counts.leaf_visits),
                per_ray(counts.empty_leaf_visits),
                per_ray(counts.rope_crossings),
                per_ray(counts.rope_tree_steps),
                per_ray(counts.restarts),
                best,
                accelerator.bytes() as f64 / leaves as f64,
                threading,
            );
        }
    }
    Ok(())
}
