//! Build speed, memory and predicted cost of the presets on scenes of the benchmark:
//! `cargo run --release -p ropewalk-bench --bin build_presets -- --scenes bunny,atrium`.

use anyhow::Context;
use clap::Parser;
use ropewalk::Geometry;
use ropewalk::build::{BuildSettings, Preset, build};
use ropewalk::cost::LeafCost;
use ropewalk::tree::{BspTree, NodeKind};
use ropewalk::wide::{Treelet, WideTree};
use ropewalk_bench::harness::{Clock, Spread, peak_resident};
use ropewalk_bench::own::geometry;
use ropewalk_bench::scene::Catalog;
use std::path::PathBuf;

/// Prints one CSV row a scene and preset.
#[derive(Parser)]
struct Arguments {
    /// Scenes, separated by commas; all without this.
    #[arg(long, value_delimiter = ',')]
    scenes: Vec<String>,
    /// Presets, separated by commas; all without this.
    #[arg(long, value_delimiter = ',')]
    presets: Vec<String>,
    /// Builds of each, interleaved; the median is printed.
    #[arg(long, default_value_t = 3)]
    rounds: usize,
    /// Threads; with more than one, wall time is printed.
    #[arg(long, default_value_t = 1)]
    threads: usize,
    /// Overrides the number of references from which on planes are binned.
    #[arg(long)]
    binned_from: Option<usize>,
    /// Overrides the cost of a traversal step.
    #[arg(long)]
    traversal_cost: Option<f64>,
    /// Overrides the price of memory.
    #[arg(long)]
    size_cost: Option<f64>,
    /// Overrides the largest price of memory to a ray that hits the node.
    #[arg(long)]
    max_size_price: Option<f64>,
    /// Overrides the duplication limit.
    #[arg(long)]
    max_duplication: Option<f64>,
    /// The folder of shared scenes.
    #[arg(long, default_value = "../shared/data")]
    data: PathBuf,
    /// The folder of generated scenes.
    #[arg(long, default_value = "target/bench-scenes")]
    generated: PathBuf,
}

/// A preset on a scene, with what its builds took.
struct Entry {
    name: &'static str,
    settings: BuildSettings,
    seconds: Vec<[f64; 2]>,
    last: Option<(BspTree, WideTree)>,
}

fn main() -> anyhow::Result<()> {
    let arguments = Arguments::parse();
    let catalog = Catalog { data: arguments.data.clone(), generated: arguments.generated.clone() };
    println!(
        "scene,preset,triangles,mtri_per_s,build_s,compile_s,bytes_per_triangle,references_per_triangle,block_fill,treelet_fill,treelet_bytes_share,inner_nodes,predicted_cost,vm_hwm_mib"
    );
    for entry in Catalog::select(&arguments.scenes)? {
        let scene = catalog.load(&entry)?;
        let geometry = geometry(&scene.mesh)?;
        let mut entries = entries(&arguments)?;
        for _ in 0..arguments.rounds.max(1) {
            for entry in &mut entries {
                entry.run(&geometry, arguments.threads)?;
            }
        }
        for entry in &entries {
            entry.print(&scene.mesh.name, &geometry)?;
        }
    }
    Ok(())
}

fn entries(arguments: &Arguments) -> anyhow::Result<Vec<Entry>> {
    let wanted = |p: &Preset| {
        arguments.presets.is_empty() || arguments.presets.iter().any(|n| n == p.name())
    };
    let entry = |preset: Preset| {
        let mut settings =
            BuildSettings { threads: arguments.threads, ..BuildSettings::preset(preset) };
        settings.traversal_cost = arguments.traversal_cost.unwrap_or(settings.traversal_cost);
        settings.size_cost = arguments.size_cost.unwrap_or(settings.size_cost);
        settings.max_size_price = arguments.max_size_price.unwrap_or(settings.max_size_price);
        settings.max_duplication = arguments.max_duplication.unwrap_or(settings.max_duplication);
        if preset == Preset::Balanced {
            settings.binned_from = arguments.binned_from.unwrap_or(settings.binned_from);
        }
        Entry { name: preset.name(), settings, seconds: Vec::new(), last: None }
    };
    let entries: Vec<Entry> = Preset::ALL.into_iter().filter(wanted).map(entry).collect();
    anyhow::ensure!(!entries.is_empty(), "the presets are fast, balanced, best and compact");
    Ok(entries)
}

impl Entry {
    fn run(&mut self, geometry: &Geometry, threads: usize) -> anyhow::Result<()> {
        self.last = None;
        let clock = Clock::start();
        let seconds = |(cpu, wall)| if threads == 1 { cpu } else { wall };
        let (tree, _) = build(geometry, &self.settings, &())?;
        let built = seconds(clock.elapsed());
        let wide = WideTree::compile(&tree, geometry)?;
        self.seconds.push([built, seconds(clock.elapsed()) - built]);
        self.last = Some((tree, wide));
        Ok(())
    }

    fn print(&self, scene: &str, geometry: &Geometry) -> anyhow::Result<()> {
        let (tree, wide) = self.last.as_ref().context("built at least once")?;
        let median = |of: &dyn Fn(&[f64; 2]) -> f64| {
            Spread::of(&self.seconds.iter().map(of).collect::<Vec<_>>()).map_or(0.0, |s| s.median)
        };
        let n = geometry.len() as f64;
        let planes = tree.nodes().len() / 2;
        let treelet_bytes = wide.treelets() * size_of::<Treelet>();
        println!(
            "{scene},{},{},{:.3},{:.3},{:.3},{:.1},{:.3},{:.3},{:.3},{:.3},{},{:.4},{}",
            self.name,
            geometry.len(),
            n * 1e-6 / median(&|s| s[0] + s[1]),
            median(&|s| s[0]),
            median(&|s| s[1]),
            wide.bytes() as f64 / n,
            tree.reference_count() as f64 / n,
            tree.reference_count() as f64 / (8 * wide.blocks().max(1)) as f64,
            planes as f64 / (7 * wide.treelets().max(1)) as f64,
            treelet_bytes as f64 / wide.bytes() as f64,
            planes,
            predicted_cost(tree, &BuildSettings::preset(Preset::Best)),
            peak_resident().unwrap_or(0) >> 20,
        );
        Ok(())
    }
}

/// What a uniform line through the root is expected to cost.
fn predicted_cost(tree: &BspTree, settings: &BuildSettings) -> f64 {
    let (mut cost, root) = (0.0, tree.bounds().area());
    let leaf_cost: LeafCost = settings.leaf_cost;
    tree.for_each_node(|_, kind, cell, _| {
        cost += cell.area() / root
            * match kind {
                NodeKind::Inner { .. } => settings.traversal_cost,
                NodeKind::Leaf { count, .. } => leaf_cost.leaf(count as usize),
            };
    });
    cost
}
