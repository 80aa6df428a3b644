//! `ropewalk build SCENE --save FILE`

use crate::controls::Controls;
use crate::output::{print_json, thousands};
use crate::{engine, saved};
use ropewalk::file::{Contents, Figures};
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;

/// Arguments of `build`.
#[derive(clap::Args)]
pub struct Args {
    /// A .nff or .nff.gz file, or a built-in scene such as spd:balls:4
    scene: String,
    /// The file to save to, written whole or not at all; .rope is usual
    #[arg(long, value_name = "FILE")]
    save: PathBuf,
    #[command(flatten)]
    controls: Controls,
    /// Threads; 0 is one per core. The file is the same for any number
    #[arg(long, default_value_t = 0)]
    threads: usize,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

/// Pixels along a side of the picture from which sample rays are drawn.
const SAMPLE_SIDE: usize = 256;

#[derive(Serialize)]
struct Output {
    scene: String,
    preset: &'static str,
    cost_model: &'static str,
    sample_rays: usize,
    primitives: usize,
    tree_bytes: usize,
    file_bytes: u64,
    seconds: Seconds,
}

#[derive(Serialize)]
struct Seconds {
    read: f64,
    build: f64,
    save: f64,
}

/// Builds and saves.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let (preset, model) = args.controls.names()?;
    let loaded = engine::load(&args.scene)?;
    let settings = args.controls.settings(&loaded, SAMPLE_SIDE, args.threads)?;
    let (tree, report) = engine::build_wide(&loaded.geometry, &settings)?;
    let figures = Figures::new(&report, Some(preset));
    let extra = [saved::view_section(&saved::view_of(&loaded))];
    let contents = Contents {
        figures: Some(&figures),
        extra: &extra,
        ..Contents::new(&tree, &loaded.geometry)
    };
    let start = Instant::now();
    let written = ropewalk_file::save(&args.save, &contents)?;
    let output = Output {
        scene: loaded.scene.name.clone(),
        preset: preset.name(),
        cost_model: model.name(),
        sample_rays: settings.rays.len(),
        primitives: loaded.geometry.len(),
        tree_bytes: tree.bytes(),
        file_bytes: written.bytes,
        seconds: Seconds {
            read: loaded.seconds,
            build: report.seconds,
            save: start.elapsed().as_secs_f64(),
        },
    };
    if args.json {
        return print_json(&output);
    }
    say!(
        "{}: {}, {} primitives, {} bytes; seconds: read {:.2}, build {:.2}, save {:.2}",
        args.save.display(),
        output.scene,
        thousands(output.primitives as u64),
        thousands(output.file_bytes),
        output.seconds.read,
        output.seconds.build,
        output.seconds.save
    );
    Ok(())
}
