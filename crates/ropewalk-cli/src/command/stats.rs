//! `ropewalk stats SCENE`

use crate::engine;
use crate::output::{Tree, print_json, thousands};
use ropewalk::build::BuildReport;
use ropewalk::method::Method;
use serde::Serialize;

/// Arguments of `stats`.
#[derive(clap::Args)]
pub struct Args {
    /// A .nff, .obj, .ply, .stl, .off, .gltf or .glb file, also gzipped, or a built-in scene such as spd:balls:4
    scene: String,
    /// How to build and walk; an unknown name lists them all
    #[arg(long, default_value = Method::DEFAULT)]
    method: String,
    /// Threads; 0 is one per core
    #[arg(long, default_value_t = 0)]
    threads: usize,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

/// Predicted figures of a ray that hits the scene's box and ends nowhere.
#[derive(Serialize)]
pub struct Predicted {
    pub traversal_steps: f64,
    pub leaf_visits: f64,
    pub empty_leaf_visits: f64,
    pub intersection_tests: f64,
}

impl Predicted {
    pub fn new(report: &BuildReport) -> Self {
        let s = &report.tree;
        Predicted {
            traversal_steps: s.predicted_inner_visits,
            leaf_visits: s.predicted_leaf_visits,
            empty_leaf_visits: s.predicted_empty_leaf_visits,
            intersection_tests: s.predicted_intersection_tests,
        }
    }
}

#[derive(Serialize)]
struct Output {
    scene: String,
    method: &'static str,
    primitives: usize,
    degenerate: usize,
    tree: Tree,
    duplication: f64,
    mean_leaf_depth: f64,
    predicted: Option<Predicted>,
    seconds: Seconds,
}

#[derive(Serialize)]
struct Seconds {
    read: f64,
    build: f64,
}

/// Builds and prints.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let method = engine::method(&args.method)?;
    let loaded = engine::load(&args.scene)?;
    let engine = engine::build(&loaded.geometry, &method, args.threads)?;
    let bytes = engine.accelerator.bytes() as u64;
    let report = engine.report.as_ref();
    let output = Output {
        scene: loaded.scene.name.clone(),
        method: method.name,
        primitives: loaded.geometry.len(),
        degenerate: loaded.geometry.degenerate_count(),
        tree: report.map(|r| Tree::new(r, bytes)).unwrap_or_default(),
        duplication: report.map_or(0.0, |r| r.duplication),
        mean_leaf_depth: report.map_or(0.0, |r| r.tree.mean_depth),
        predicted: report.map(Predicted::new),
        seconds: Seconds { read: loaded.seconds, build: engine.build_seconds },
    };
    if args.json {
        return print_json(&output);
    }
    let t = &output.tree;
    say!("{}, {} ({})", output.scene, method.name, method.title);
    say!(
        "  primitives      {:>12}   of them without area {}",
        thousands(output.primitives as u64),
        output.degenerate
    );
    say!("  inner nodes     {:>12}", thousands(t.inner_nodes));
    say!("  leaves          {:>12}   empty {}", thousands(t.leaves), thousands(t.empty_leaves));
    say!(
        "  references      {:>12}   {:.2} per primitive",
        thousands(t.references),
        output.duplication
    );
    say!("  depth           {:>12}   mean {:.1}", t.depth, output.mean_leaf_depth);
    say!("  bytes           {:>12}   ropes included", thousands(t.bytes));
    if let Some(p) = &output.predicted {
        say!(
            "  predicted       {:.1} steps, {:.1} leaves ({:.1} empty), {:.1} tests a ray",
            p.traversal_steps,
            p.leaf_visits,
            p.empty_leaf_visits,
            p.intersection_tests
        );
    }
    say!("  seconds         read {:.2}, build {:.2}", output.seconds.read, t.build_seconds);
    Ok(())
}
