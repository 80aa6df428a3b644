//! `ropewalk info FILE`

use crate::output::{print_json, thousands};
use crate::saved;
use ropewalk::file::{FORMAT_VERSION, LAYOUT_VERSION, Opened, Tag, short};
use serde::Serialize;
use std::time::Instant;

/// Arguments of `info`.
#[derive(clap::Args)]
pub struct Args {
    /// A saved scene, from `ropewalk build --save` or `Scene.save` in Python
    file: String,
    /// Check all checksums as well
    #[arg(long)]
    verify: bool,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Output {
    file: String,
    bytes: u64,
    format_version: u32,
    layout_version: u32,
    verified: bool,
    geometry_hash: String,
    primitives: usize,
    degenerate: usize,
    bounds: Option<[[f32; 3]; 2]>,
    treelets: usize,
    blocks: usize,
    bytes_per_primitive: f64,
    preset: Option<&'static str>,
    build: Option<Build>,
    sections: Vec<Section>,
    seconds: f64,
}

/// Figures of the build.
#[derive(Serialize)]
struct Build {
    inner_nodes: usize,
    leaves: usize,
    empty_leaves: usize,
    references: usize,
    duplication: f64,
    depth: usize,
    predicted_steps: f64,
    predicted_leaves: f64,
    predicted_tests: f64,
}

#[derive(Serialize)]
struct Section {
    name: String,
    meaning: &'static str,
    offset: u64,
    bytes: u64,
    checksum: String,
}

fn meaning(tag: Tag) -> &'static str {
    match tag {
        Tag::TREE => "treelets and blocks",
        Tag::OVERFLOW => "leaves of many blocks",
        Tag::TRIANGLES => "triangles",
        Tag::SIDES => "sides on which triangles are hit",
        Tag::KINDS => "kinds of primitives",
        Tag::ENDS => "where the numbers of primitives end",
        Tag::NUMBERS => "numbers of primitives",
        Tag::FIGURES => "figures of the build",
        Tag(name) if name == *b"view" => "the scene's view",
        Tag(name) if name == *b"mesh" => "meshes of the Python package",
        _ => "not known",
    }
}

/// Opens, checks and prints.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let start = Instant::now();
    let scene = saved::open(&args.file, args.verify)?;
    let output = Output::new(args, &scene, start.elapsed().as_secs_f64());
    if args.json { print_json(&output) } else { output.print() }
}

impl Output {
    fn new(args: &Args, scene: &Opened, seconds: f64) -> Self {
        let Opened { tree, geometry, figures, .. } = scene;
        let bounds = geometry.bounds();
        let build = figures.as_ref().map(|figures| Build {
            inner_nodes: figures.tree.inner_nodes,
            leaves: figures.tree.leaves,
            empty_leaves: figures.tree.empty_leaves,
            references: figures.tree.references,
            duplication: figures.duplication,
            depth: figures.tree.max_depth,
            predicted_steps: figures.tree.predicted_inner_visits,
            predicted_leaves: figures.tree.predicted_leaf_visits,
            predicted_tests: figures.tree.predicted_intersection_tests,
        });
        let sections = scene.sections.iter().map(|section| Section {
            name: section.tag.to_string(),
            meaning: meaning(section.tag),
            offset: section.offset,
            bytes: section.len,
            checksum: short(&section.checksum),
        });
        Output {
            file: args.file.clone(),
            bytes: scene.bytes,
            format_version: FORMAT_VERSION,
            layout_version: LAYOUT_VERSION,
            verified: args.verify,
            geometry_hash: short(&scene.geometry_hash),
            primitives: geometry.len(),
            degenerate: geometry.degenerate_count(),
            bounds: (!geometry.is_empty()).then_some([bounds.min, bounds.max]),
            treelets: tree.treelets(),
            blocks: tree.blocks(),
            bytes_per_primitive: tree.bytes() as f64 / geometry.len().max(1) as f64,
            preset: figures.as_ref().and_then(|figures| Some(figures.preset?.name())),
            build,
            sections: sections.collect(),
            seconds,
        }
    }

    fn print(&self) -> anyhow::Result<()> {
        println!(
            "{}: a saved scene, {} bytes, format {}, tree layout {}",
            self.file,
            thousands(self.bytes),
            self.format_version,
            self.layout_version
        );
        let checked = if self.verified { ", all checksums" } else { "" };
        println!(
            "  checked         header, sizes and links{checked} ({:.1} ms)",
            1e3 * self.seconds
        );
        println!("  geometry        {}..., by its bits", self.geometry_hash);
        println!(
            "  primitives      {:>12}   of them without area {}",
            thousands(self.primitives as u64),
            thousands(self.degenerate as u64)
        );
        if let Some([low, high]) = self.bounds {
            println!("  box             {low:?} to {high:?}");
        }
        println!("  treelets        {:>12}", thousands(self.treelets as u64));
        println!("  blocks          {:>12}", thousands(self.blocks as u64));
        println!(
            "  tree                         {:.0} bytes a primitive",
            self.bytes_per_primitive
        );
        if let Some(build) = &self.build {
            println!("  preset          {:>12}", self.preset.unwrap_or("none"));
            println!("  inner nodes     {:>12}", thousands(build.inner_nodes as u64));
            println!(
                "  leaves          {:>12}   empty {}",
                thousands(build.leaves as u64),
                thousands(build.empty_leaves as u64)
            );
            println!(
                "  references      {:>12}   {:.2} per primitive",
                thousands(build.references as u64),
                build.duplication
            );
            println!("  depth           {:>12}", build.depth);
            println!(
                "  a line visits   {:.1} inner nodes, {:.1} leaves, {:.1} primitives (predicted)",
                build.predicted_steps, build.predicted_leaves, build.predicted_tests
            );
        }
        println!("  {:8}{:>14}{:>16}  {:18}", "section", "offset", "bytes", "checksum");
        for section in &self.sections {
            println!(
                "  {:8}{:>14}{:>16}  {}..  {}",
                section.name,
                section.offset,
                thousands(section.bytes),
                section.checksum,
                section.meaning
            );
        }
        Ok(())
    }
}
