//! `ropewalk validate SCENE`

use crate::engine;
use anyhow::Context;
use ropewalk::method::Method;
use ropewalk::{Accelerator, Walk};

/// Arguments of `validate`.
#[derive(clap::Args)]
pub struct Args {
    /// A .nff, .obj, .ply, .stl, .off, .gltf or .glb file, also gzipped, or a built-in scene such as spd:balls:4
    scene: String,
    /// Check only this method's tree; all of them if not given
    #[arg(long)]
    method: Option<String>,
    /// Threads; 0 is one per core
    #[arg(long, default_value_t = 0)]
    threads: usize,
}

/// Builds each distinct tree once and checks it, its ropes and its rope trees.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let methods = match &args.method {
        Some(name) => vec![engine::method(name)?],
        None => Method::all(),
    };
    let loaded = engine::load(&args.scene)?;
    say!("{}: {} primitives", loaded.scene.name, loaded.geometry.len());
    let mut seen = Vec::new();
    for method in methods {
        let threaded = matches!(method.walk, Walk::Ropes | Walk::RopeTrees);
        let Some(settings) = method.build.clone() else { continue };
        if !threaded && seen.contains(&settings) {
            continue;
        }
        seen.push(settings);
        let engine = engine::build(&loaded.geometry, &method, args.threads)?;
        check(&engine.accelerator).with_context(|| format!("method {}", method.name))?;
        let leaves = engine.report.map_or(0, |r| r.tree.leaves);
        say!("  {:<24} ok, {leaves} leaves", method.name);
    }
    Ok(())
}

fn check(accelerator: &Accelerator) -> anyhow::Result<()> {
    let tree = accelerator.tree();
    tree.validate(accelerator.geometry())?;
    if let Some(ropes) = accelerator.ropes() {
        ropes.validate(tree)?;
    }
    if let Some(rope_trees) = accelerator.rope_trees() {
        rope_trees.validate(tree)?;
    }
    Ok(())
}
