//! `ropewalk info FILE`

use crate::output::{print_json, thousands, usage};
use crate::saved;
use ropewalk::file::{
    AnyOpened, FORMAT_VERSION, LAYOUT_VERSION, Opened, SHAPES_LAYOUT_VERSION, Tag, short,
};
use ropewalk::wide::WideTree;
use ropewalk_scene::parse_builtin;
use serde::Serialize;
use std::time::Instant;

/// Arguments of `info`.
#[derive(clap::Args)]
pub struct Args {
    /// A saved scene, from `ropewalk build --save` or `Scene.save` in Python; a mesh in OBJ, PLY, STL, OFF or glTF; a
    /// scene in NFF; a built-in scene such as spd:balls:4 or stage:room
    file: String,
    /// Of a saved scene, check all checksums as well
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
    precision: &'static str,
    primitives: usize,
    degenerate: usize,
    bounds: Option<Corners>,
    treelets: usize,
    blocks: usize,
    bytes_per_primitive: f64,
    preset: Option<&'static str>,
    build: Option<Build>,
    sections: Vec<Section>,
    seconds: f64,
}

/// Lower and upper corner.
#[derive(Serialize)]
#[serde(untagged)]
enum Corners {
    Single([[f32; 3]; 2]),
    Double([[f64; 3]; 2]),
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
        Tag::VERTICES => "vertices in f64",
        Tag::FACES => "triangles by their vertices",
        Tag::BOX => "box of the vertices",
        Tag::FLAT => "triangles without area",
        Tag::FIGURES => "figures of the build",
        Tag(name) if name == *b"view" => "the scene's view",
        Tag(name) if name == *b"mesh" => "meshes of the Python package",
        Tag(name) if name == *b"quad" => "quads of the Python package",
        _ => "not known",
    }
}

/// Opens, checks and prints.
pub fn run(args: &Args) -> anyhow::Result<()> {
    // What is not there is said by those who open saved scenes.
    let is_builtin = parse_builtin(&args.file)?.is_some();
    let is_other = is_builtin || std::path::Path::new(&args.file).exists();
    if is_other && !saved::is_saved(&args.file) {
        if args.verify {
            return Err(usage(format!("{}: --verify is for saved scenes", args.file)));
        }
        return super::mesh_info::run(&args.file, args.json);
    }
    let start = Instant::now();
    let scene = saved::open_any(&args.file, args.verify)?;
    let seconds = start.elapsed().as_secs_f64();
    let output = match &scene {
        AnyOpened::Single(scene) => {
            let (geometry, bounds) = (&scene.geometry, scene.geometry.bounds());
            let corners = Corners::Single([bounds.min, bounds.max]);
            let what = What {
                precision: "single",
                primitives: geometry.len(),
                degenerate: geometry.degenerate_count(),
                bounds: (!geometry.is_empty()).then_some(corners),
            };
            Output::new(args, scene, &scene.tree, what, seconds)
        }
        AnyOpened::Double(scene) => {
            let geometry = &scene.geometry;
            let what = What {
                precision: "double",
                primitives: geometry.len(),
                degenerate: geometry.degenerate_count(),
                bounds: geometry.bounds().map(|(min, max)| Corners::Double([min, max])),
            };
            Output::new(args, scene, scene.tree.wide(), what, seconds)
        }
    };
    if args.json { print_json(&output) } else { output.print() }
}

/// What the geometry of a scene is, in either precision.
struct What {
    precision: &'static str,
    primitives: usize,
    degenerate: usize,
    bounds: Option<Corners>,
}

impl Output {
    fn new<T, G>(
        args: &Args,
        scene: &Opened<T, G>,
        tree: &WideTree,
        what: What,
        seconds: f64,
    ) -> Self {
        let (figures, What { precision, primitives, degenerate, bounds }) = (&scene.figures, what);
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
            layout_version: match tree.has_shapes() {
                true => SHAPES_LAYOUT_VERSION,
                false => LAYOUT_VERSION,
            },
            verified: args.verify,
            geometry_hash: short(&scene.geometry_hash),
            precision,
            primitives,
            degenerate,
            bounds,
            treelets: tree.treelets(),
            blocks: tree.blocks(),
            bytes_per_primitive: tree.bytes() as f64 / primitives.max(1) as f64,
            preset: figures.as_ref().and_then(|figures| Some(figures.preset?.name())),
            build,
            sections: sections.collect(),
            seconds,
        }
    }

    fn print(&self) -> anyhow::Result<()> {
        say!(
            "{}: a saved scene, {} bytes, format {}, tree layout {}",
            self.file,
            thousands(self.bytes),
            self.format_version,
            self.layout_version
        );
        let checked = if self.verified { ", all checksums" } else { "" };
        say!("  checked         header, sizes and links{checked} ({:.1} ms)", 1e3 * self.seconds);
        say!(
            "  geometry        {}..., by its bits, {} precision",
            self.geometry_hash,
            self.precision
        );
        say!(
            "  primitives      {:>12}   of them without area {}",
            thousands(self.primitives as u64),
            thousands(self.degenerate as u64)
        );
        match &self.bounds {
            Some(Corners::Single([low, high])) => {
                say!("  box             {low:?} to {high:?}");
            }
            Some(Corners::Double([low, high])) => {
                say!("  box             {low:?} to {high:?}");
            }
            None => {}
        }
        say!("  treelets        {:>12}", thousands(self.treelets as u64));
        say!("  blocks          {:>12}", thousands(self.blocks as u64));
        say!("  tree                         {:.0} bytes a primitive", self.bytes_per_primitive);
        if let Some(build) = &self.build {
            say!("  preset          {:>12}", self.preset.unwrap_or("none"));
            say!("  inner nodes     {:>12}", thousands(build.inner_nodes as u64));
            say!(
                "  leaves          {:>12}   empty {}",
                thousands(build.leaves as u64),
                thousands(build.empty_leaves as u64)
            );
            say!(
                "  references      {:>12}   {:.2} per primitive",
                thousands(build.references as u64),
                build.duplication
            );
            say!("  depth           {:>12}", build.depth);
            say!(
                "  a line visits   {:.1} inner nodes, {:.1} leaves, {:.1} primitives (predicted)",
                build.predicted_steps,
                build.predicted_leaves,
                build.predicted_tests
            );
        }
        say!("  {:8}{:>14}{:>16}  {:18}", "section", "offset", "bytes", "checksum");
        for section in &self.sections {
            say!(
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
