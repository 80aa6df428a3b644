//! `ropewalk scene NAME --size N -o FILE.nff`

use crate::output::{thousands, usage};
use anyhow::Context;
use ropewalk_scene::spd::{self, Spd, SpdError};
use ropewalk_scene::{NffWriter, write_atomically};
use std::io::{ErrorKind, Write};
use std::path::PathBuf;

/// Arguments of `scene`.
#[derive(clap::Args)]
pub struct Args {
    /// balls, gears, mount, rings, teapot, tetra, tree, lattice, jacks, shells, sombrero or sample
    name: String,
    /// Size factor; the database's standard size if not given
    #[arg(long)]
    size: Option<u32>,
    /// File to write; standard output if not given
    #[arg(short, long)]
    output: Option<PathBuf>,
}

/// Writes the scene as it is generated.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let Some(spd) = Spd::from_name(&args.name) else {
        let names: Vec<_> = Spd::ALL.iter().map(|s| s.name()).collect();
        return Err(usage(format!(
            "no scene is called '{}'; scenes are: {}",
            args.name,
            names.join(", ")
        )));
    };
    let size = args.size.unwrap_or(spd.standard_size());
    let range = spd.sizes();
    if !range.contains(&size) {
        return Err(usage(format!(
            "size {size} of '{}' is out of range; sizes are {} to {}",
            spd.name(),
            range.start(),
            range.end()
        )));
    }
    match &args.output {
        None => {
            let out = std::io::BufWriter::new(std::io::stdout().lock());
            let mut writer = NffWriter::new(out);
            let written = spd::generate(spd, size, &mut writer);
            match written.map(|()| writer.into_inner().flush()) {
                Err(SpdError::Sink(e)) | Ok(Err(e)) if e.kind() != ErrorKind::BrokenPipe => {
                    Err(e).context("cannot write to standard output")
                }
                _ => Ok(()), // the reader of a closed pipe has seen enough
            }
        }
        Some(path) => {
            write_atomically(path, |file| -> anyhow::Result<()> {
                let mut writer = NffWriter::new(file);
                spd::generate(spd, size, &mut writer)?;
                Ok(())
            })
            .with_context(|| format!("cannot write {}", path.display()))?;
            let objects = thousands(spd.object_count(size));
            eprintln!("{}: {} at size {size}, {objects} objects", path.display(), spd.name());
            Ok(())
        }
    }
}
