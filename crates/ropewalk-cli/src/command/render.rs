//! `ropewalk render SCENE`

use super::paths;
use crate::engine;
use crate::interrupt;
use crate::output::{PerRay, Rays, Seconds, Tree, print_json, thousands, usage};
use ropewalk::method::Method;
use ropewalk_render::{
    AovKind, Monitor, Render, RenderSettings, check_image_path, render, write_image,
};
use ropewalk_scene::{Builtin, FacetPolicy, Recognised, parse_builtin, recognise};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Arguments of `render`.
#[derive(clap::Args)]
pub struct Args {
    /// A .nff, .obj, .ply, .stl, .off, .gltf or .glb file, also gzipped, or a built-in scene such as spd:balls:4 or stage:room
    pub scene: String,
    /// Picture to write: .png or .exr; SCENE.png in this folder if not given
    #[arg(short, long)]
    pub output: Option<PathBuf>,
    /// Picture size, such as 640x480; the scene's own if not given
    #[arg(long, value_parser = size, conflicts_with = "spd_rules")]
    pub size: Option<[u32; 2]>,
    /// Samples per pixel; 1 if not given, 64 of paths
    #[arg(long, conflicts_with = "spd_rules")]
    pub samples: Option<u32>,
    /// Largest ray depth, the eye ray being 1; 5 if not given, 16 of paths
    #[arg(long)]
    pub depth: Option<u32>,
    /// Rays of mirrors, glass and shadows only (Whitted 1980), as for NFF files and built-in scenes
    #[arg(long, conflicts_with = "path", help_heading = "Rays of mirrors and glass only")]
    whitted: bool,
    /// The rules of the database: rays through the pixels' corners, four averaged
    #[arg(long, help_heading = "Rays of mirrors and glass only")]
    spd_rules: bool,
    /// Hit all surfaces from both sides; without this opaque ones are hit from their front only, as
    /// the database's rules have it, except in a scene called teapot
    #[arg(long, help_heading = "Rays of mirrors and glass only")]
    two_sided: bool,
    /// How to build and walk; an unknown name lists them all
    #[arg(long, help_heading = "Rays of mirrors and glass only")]
    method: Option<String>,
    /// Extra pictures beside the first: depth, normal, steps, tests (comma-separated)
    #[arg(long, value_delimiter = ',', help_heading = "Rays of mirrors and glass only")]
    aov: Vec<String>,
    /// Threads; 0 is one per core
    #[arg(long, default_value_t = 0)]
    pub threads: usize,
    /// One JSON object on standard output
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub paths: paths::Options,
}

impl Args {
    /// The first option given that only pictures by mirrors and glass have.
    fn whitted_option(&self) -> Option<&'static str> {
        let options = [
            (self.spd_rules, "--spd-rules"),
            (self.two_sided, "--two-sided"),
            (self.method.is_some(), "--method"),
            (!self.aov.is_empty(), "--aov"),
        ];
        options.into_iter().find(|(given, _)| *given).map(|(_, name)| name)
    }
}

fn size(text: &str) -> Result<[u32; 2], String> {
    let parts: Vec<_> = text.split('x').map(str::parse::<u32>).collect();
    match parts[..] {
        [Ok(w), Ok(h)] if (1..=65_536).contains(&w) && (1..=65_536).contains(&h) => Ok([w, h]),
        _ => Err("expected WIDTHxHEIGHT with sides from 1 to 65536, such as 640x480".into()),
    }
}

#[derive(Serialize)]
struct Output {
    scene: String,
    method: &'static str,
    picture: String,
    aov: Vec<String>,
    rays: Rays,
    tree: Tree,
    per_ray: PerRay,
    seconds: Seconds,
}

/// Renders and writes the pictures.
pub fn run(args: &Args) -> anyhow::Result<()> {
    // By content, then by name, as every command tells files.
    let is_mesh = || -> anyhow::Result<bool> {
        Ok(match parse_builtin(&args.scene)? {
            Some(builtin) => matches!(builtin, Builtin::Room(_)),
            None => matches!(recognise(&args.scene)?, Recognised::Mesh(_)),
        })
    };
    if args.paths.path || (!args.whitted && is_mesh()?) {
        return match args.whitted_option() {
            Some(name) => Err(usage(format!("{name} needs --whitted: paths do not have it"))),
            None => paths::run(args),
        };
    }
    if let Some(name) = args.paths.given() {
        return Err(usage(format!("{name} needs --path: only pictures of paths have it")));
    }
    let method = engine::method(args.method.as_deref().unwrap_or(Method::DEFAULT))?;
    let aovs = aovs(&args.aov)?;
    let policy = args.two_sided.then_some(FacetPolicy::TwoSided);
    let loaded = engine::load_as(&args.scene, policy)?;
    let picture = args
        .output
        .clone()
        .unwrap_or_else(|| format!("{}.png", loaded.scene.name.replace(':', "_")).into());
    check_image_path(&picture)?;
    let engine = engine::build(&loaded.geometry, &method, args.threads)?;
    let settings = RenderSettings {
        size: args.size,
        samples_per_pixel: args.samples.unwrap_or(1),
        max_depth: args.depth.unwrap_or(5),
        spd_rules: args.spd_rules,
        threads: (args.threads > 0).then_some(args.threads),
        aov: !aovs.is_empty(),
        ..RenderSettings::default()
    };
    let bar = interrupt::bar(1000, "render");
    let flag = interrupt::flag();
    let progress = |p: ropewalk_render::Progress| {
        bar.set_length(p.total as u64);
        bar.set_position(p.done as u64);
    };
    let monitor = Monitor { progress: Some(&progress), cancel: Some(&flag) };
    let done = render(&loaded.scene, &loaded.geometry, &engine.accelerator, &settings, monitor)?;
    bar.finish_and_clear();
    if done.cancelled {
        return Err(interrupt::interrupted());
    }
    done.write(&picture)?;
    let mut extra = Vec::new();
    for aov in aovs {
        extra.push(write_aov(&picture, aov, &done)?);
    }
    let rays = Rays::from(&done.counts);
    let output = Output {
        scene: loaded.scene.name.clone(),
        method: method.name,
        picture: picture.display().to_string(),
        aov: extra,
        rays,
        tree: engine
            .report
            .as_ref()
            .map(|r| Tree::new(r, engine.accelerator.bytes() as u64))
            .unwrap_or_default(),
        per_ray: PerRay::new(&done.traversal, rays.total()),
        seconds: Seconds {
            read: loaded.seconds,
            build: engine.build_seconds,
            trace: done.seconds_trace,
        },
    };
    if args.json { print_json(&output) } else { print_text(&output) }
}

fn aovs(names: &[String]) -> anyhow::Result<Vec<AovKind>> {
    let known = || AovKind::ALL.iter().map(|a| a.name()).collect::<Vec<_>>().join(", ");
    names
        .iter()
        .map(|name| {
            AovKind::ALL.into_iter().find(|a| a.name() == name).ok_or_else(|| {
                usage(format!("no extra picture is called '{name}'; there are: {}", known()))
            })
        })
        .collect()
}

/// `picture.png` gives `picture.steps.png`.
fn write_aov(picture: &Path, aov: AovKind, done: &Render) -> anyhow::Result<String> {
    let extension = picture.extension().and_then(|e| e.to_str()).unwrap_or("png");
    let path = picture.with_extension(format!("{}.{extension}", aov.name()));
    if let Some(image) = done.aov_image(aov) {
        write_image(&path, &image)?;
    }
    Ok(path.display().to_string())
}

fn print_text(o: &Output) -> anyhow::Result<()> {
    let Output { rays: r, per_ray: p, seconds: s, .. } = o;
    say!("{}, {}: {}", o.scene, o.method, o.picture);
    for path in &o.aov {
        say!("  {path}");
    }
    say!(
        "  rays     {} primary ({} hit), {} reflected, {} refracted, {} shadow ({} hit)",
        thousands(r.primary),
        thousands(r.primary_hits),
        thousands(r.reflection),
        thousands(r.refraction),
        thousands(r.shadow),
        thousands(r.shadow_hits)
    );
    say!(
        "  per ray  {:.2} intersection tests, {:.2} traversal steps, {:.2} leaves",
        p.intersection_tests,
        p.traversal_steps,
        p.leaf_visits
    );
    say!(
        "  seconds  read {:.2}, build {:.2}, trace {:.2} ({:.2} million rays a second)",
        s.read,
        s.build,
        s.trace,
        r.total() as f64 / s.trace.max(1e-9) / 1e6
    );
    Ok(())
}
