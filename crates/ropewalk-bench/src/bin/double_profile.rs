//! What scenes in `f64` cost beside the same ones in `f32`.
//!
//! `double_profile SCENES WORKLOADS [ROUNDS]`, names separated by commas: nanoseconds of thread CPU time a ray on
//! one thread, interleaved, of the `f32` engine, of its wave alone (without beams and entry search, which `f64` rays
//! do not have) and of the `f64` engine on the same triangles and rays; bytes a triangle of trees and geometry;
//! seconds of the builds.

use anyhow::Context;
use ropewalk::build::{BuildSettings, Preset};
use ropewalk::double::{DoubleCaster, DoubleGeometry, DoubleRay};
use ropewalk::kernel::{BatchCaster, Start};
use ropewalk_bench::harness::{Clock, Engine, Spread};
use ropewalk_bench::own::Wave;
use ropewalk_bench::scene::Catalog;
use ropewalk_bench::workload::{Generator, Kind, Question, Sizes};
use std::path::PathBuf;

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let list = |i: usize| {
        let text: &str = arguments.get(i).map_or("", String::as_str);
        text.split(',').filter(|s| !s.is_empty()).map(str::to_owned).collect::<Vec<String>>()
    };
    let rounds: usize = arguments.get(2).map_or(Ok(7), |n| n.parse())?;
    let catalog =
        Catalog { data: PathBuf::from("../shared/data"), generated: "target/bench-scenes".into() };
    println!(
        "{:17} {:9} {:>7} {:>7} {:>7} {:>6} {:>7} {:>7} {:>7} {:>7} {:>6}",
        "scene",
        "workload",
        "f32",
        "wave",
        "f64",
        "ratio",
        "tree32",
        "tree64",
        "mesh64",
        "build",
        "times"
    );
    for entry in Catalog::select(&list(0))? {
        let scene = catalog.load(&entry)?;
        let settings = BuildSettings { threads: 1, ..BuildSettings::preset(Preset::Balanced) };
        let clock = Clock::start();
        let engine = Wave::with_settings(&scene.mesh, &settings)?;
        let single_seconds = clock.elapsed().0;
        let vertices = scene.mesh.vertices.iter().map(|p| p.map(f64::from)).collect();
        let clock = Clock::start();
        let geometry = DoubleGeometry::from_triangles(vertices, scene.mesh.faces.clone())?;
        let (tree, _) = geometry.build(&settings, &())?;
        let seconds = clock.elapsed().0;
        let trace = |rays: &[ropewalk::Ray], out: &mut [_]| engine.closest(rays, out);
        let sizes = Sizes { side: 512, chords: 16_384, walk: 1 << 18 };
        let generator = Generator::new(&scene.mesh, &scene.view, sizes, &trace);
        for name in list(1) {
            let kind = Kind::named(&name).with_context(|| format!("no workload {name}"))?;
            let rays = generator.workload(kind).rays;
            let wide = |ray: &ropewalk::Ray| {
                let ray64 = DoubleRay::new(ray.origin.map(f64::from), ray.dir.map(f64::from));
                ray64.with_range(ray.t_min.into(), ray.t_max.into())
            };
            let rays64: Vec<DoubleRay> = rays.iter().map(wide).collect();
            let caster = Wave::caster(&engine);
            let wave = caster.with_beams(false).with_start(Start::Root);
            let double = DoubleCaster::new(&tree, &geometry).with_threads(1);
            let question = kind.question();
            let ns = time(
                rounds,
                rays.len(),
                [
                    &mut || ask(&caster, question, &rays),
                    &mut || ask(&wave, question, &rays),
                    &mut || ask_double(&double, question, &rays64),
                ],
            );
            if std::env::var_os("EVENTS").is_some() {
                println!("  {:?}", wave.closest_hit_events(&rays));
                println!("  {:?}", double.closest_hit_events(&rays64));
            }
            let each = |bytes: usize| bytes as f64 / geometry.len() as f64;
            println!(
                "{:17} {name:9} {:7.1} {:7.1} {:7.1} {:6.2} {:7.1} {:7.1} {:7.1} {seconds:7.2} {:6.2}",
                entry.name,
                ns[0],
                ns[1],
                ns[2],
                ns[1] / ns[2],
                each(engine.bytes()),
                each(tree.bytes()),
                each(geometry.bytes()),
                seconds / single_seconds,
            );
        }
    }
    Ok(())
}

fn ask(caster: &BatchCaster<'_>, question: Question, rays: &[ropewalk::Ray]) {
    match question {
        Question::Occluded => drop(caster.occluded(rays)),
        Question::AllHits => drop(caster.all_hits(rays)),
        Question::FirstHits(k) => drop(caster.first_hits(rays, k)),
        _ => drop(caster.closest_hit(rays)),
    }
}

fn ask_double(caster: &DoubleCaster<'_>, question: Question, rays: &[DoubleRay]) {
    match question {
        Question::Occluded => drop(caster.occluded(rays)),
        Question::AllHits => drop(caster.all_hits(rays)),
        Question::FirstHits(k) => drop(caster.first_hits(rays, k)),
        _ => drop(caster.closest_hit(rays)),
    }
}

/// Median nanoseconds of thread CPU time a ray, of each work.
fn time<const N: usize>(rounds: usize, rays: usize, mut works: [&mut dyn FnMut(); N]) -> [f64; N] {
    let mut all = [const { Vec::new() }; N];
    for _ in 0..rounds {
        for (all, work) in all.iter_mut().zip(&mut works) {
            let clock = Clock::start();
            work();
            all.push(clock.elapsed().0 * 1e9 / rays as f64);
        }
    }
    all.map(|all| Spread::of(&all).map_or(f64::NAN, |spread| spread.median))
}
