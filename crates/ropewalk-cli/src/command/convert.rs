//! `ropewalk convert FROM TO`

use crate::interrupt::{self, Cancel};
use crate::output::{print_json, thousands, usage};
use anyhow::Context;
use ropewalk_scene::room::room;
use ropewalk_scene::{
    Builtin, MergeError, MeshLimits, MeshOutput, Recognised, Stage, parse_builtin, recognise,
    write_atomically,
};
use serde::Serialize;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Arguments of `convert`.
#[derive(clap::Args)]
pub struct Args {
    /// A mesh in OBJ, PLY, STL, OFF or glTF, gzipped or not, or stage:room
    from: PathBuf,
    /// The file to write: .obj, .ply, .stl, .off or .glb, the binary form where there is one
    to: PathBuf,
    /// Make one of vertices at the same place, or within a distance of the first one that is kept: --merge=0.001
    #[arg(
        long,
        value_name = "DISTANCE",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "0",
        allow_negative_numbers = true
    )]
    merge: Option<f64>,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Output {
    from: PathBuf,
    to: PathBuf,
    vertices: usize,
    triangles: usize,
    /// Vertices that became others; none if that was not asked for.
    merged: Option<usize>,
    bytes: u64,
    lost: Vec<String>,
    seconds: f64,
}

/// Reads a mesh and writes its positions and faces.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let start = Instant::now();
    let Some(format) = MeshOutput::of_name(&args.to) else {
        let name = args.to.display();
        return Err(usage(format!(
            "{name}: expected a name that ends in .obj, .ply, .stl, .off or .glb"
        )));
    };
    if let Some(distance) = args.merge.filter(|d| !(*d >= 0.0 && d.is_finite())) {
        return Err(usage(MergeError::Distance(distance).to_string()));
    }
    if is_same(&args.from, &args.to) {
        return Err(usage(format!("{}: the input itself is not overwritten", args.to.display())));
    }
    let from = args.from.to_string_lossy();
    let builtin = parse_builtin(&from)?;
    let is_scene = match builtin {
        Some(Builtin::Spd(..)) => true,
        Some(Builtin::Room(_)) => false,
        None => recognise(&from)? == Recognised::Nff,
    };
    if is_scene {
        anyhow::bail!(
            "{from}: expected a mesh, found a scene in NFF, whose shapes are no triangles"
        );
    }
    let cancel = Cancel::new();
    let bar = interrupt::spinner("reading");
    let stage = if let Some(Builtin::Room(size)) = builtin {
        room(size).with_context(|| format!("{from}: there is no room of that size"))
    } else {
        let stage = Stage::read_monitored(&args.from, &MeshLimits::DEFAULT, &cancel);
        stage.map_err(anyhow::Error::from)
    };
    bar.set_message("writing");
    if cancel.is_set() {
        return Err(interrupt::interrupted());
    }
    let mut stage = stage?;
    let merge = |distance| stage.mesh.merge_vertices(distance, &cancel);
    let merged = match args.merge.map(merge).transpose() {
        Err(MergeError::Cancelled) => return Err(interrupt::interrupted()),
        merged => merged?,
    };
    let written = write_atomically(&args.to, |out| -> io::Result<()> {
        stage.mesh.write(format, &mut Stoppable { out, cancel: &cancel })
    });
    bar.finish_and_clear();
    if cancel.is_set() && written.is_err() {
        return Err(interrupt::interrupted());
    }
    written.with_context(|| format!("cannot write {}", args.to.display()))?;
    let output = Output {
        from: args.from.clone(),
        to: args.to.clone(),
        vertices: stage.mesh.vertices.len(),
        triangles: stage.mesh.faces.len(),
        merged,
        bytes: std::fs::metadata(&args.to).map_or(0, |data| data.len()),
        lost: lost(&stage, format),
        seconds: start.elapsed().as_secs_f64(),
    };
    if args.json {
        return print_json(&output);
    }
    eprintln!(
        "{}: {} triangles, {} bytes",
        args.to.display(),
        thousands(output.triangles as u64),
        thousands(output.bytes)
    );
    if let Some(merged) = merged {
        eprintln!(
            "  merged: {} vertices, {} are left",
            thousands(merged as u64),
            thousands(output.vertices as u64)
        );
    }
    for what in &output.lost {
        eprintln!("  lost: {what}");
    }
    Ok(())
}

/// True if both names lead to one file.
fn is_same(from: &Path, to: &Path) -> bool {
    let real = |path: &Path| path.canonicalize().ok();
    real(from).is_some_and(|from| Some(from) == real(to))
}

/// What the input says and the output does not.
fn lost(stage: &Stage, format: MeshOutput) -> Vec<String> {
    let counted = |count: usize, what: &str| (count > 0).then(|| format!("{what} ({count})"));
    let is_plain = stage.materials == [Default::default()];
    let told = |is_told: bool, what: &str| is_told.then(|| what.to_owned());
    let rounded = format.rounds() && !stage.mesh.is_single();
    let all = [
        counted(if is_plain { 0 } else { stage.materials.len() }, "materials"),
        counted(stage.images.len(), "textures"),
        told(!stage.normals.is_empty(), "normals"),
        told(!stage.uvs.is_empty(), "texture coordinates"),
        told(!stage.colors.is_empty(), "colours"),
        counted(stage.lights.len(), "lights"),
        told(stage.camera.is_some(), "the camera"),
        told(rounded, "digits of coordinates beyond single precision"),
        told(format == MeshOutput::Stl, "which triangles share vertices"),
    ];
    let mut all: Vec<String> = all.into_iter().flatten().collect();
    all.extend(stage.skipped.iter().map(|what| format!("{what} (not read)")));
    all
}

/// Fails once Ctrl-C was pressed.
struct Stoppable<'a, W> {
    out: W,
    cancel: &'a Cancel,
}

impl<W: Write> Write for Stoppable<'_, W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.cancel.is_set() {
            return Err(io::Error::other("interrupted"));
        }
        self.out.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}
