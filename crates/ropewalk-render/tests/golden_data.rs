//! Golden pictures of files of the shared data; ignored, with the reason, where these are absent.

#[allow(dead_code)]
#[path = "paths/common.rs"]
mod common;
#[path = "paths/golden.rs"]
mod golden;

use libtest_mimic::{Arguments, Failed};
use ropewalk_render::path::{Backdrop, Surroundings, Up};
use ropewalk_scene::{MeshLimits, Stage};
use ropewalk_testkit::data::trial;
use std::path::Path;

fn main() {
    let trials = vec![trial("golden_bunny", "mesh/bunny.ply.gz", bunny)];
    libtest_mimic::run(&Arguments::from_args(), trials).exit()
}

/// What the command makes of the file without options: on the ground, under sky and sun.
fn bunny(path: &Path) -> Result<(), Failed> {
    let made = Stage::read_monitored(path, &MeshLimits::DEFAULT, &())?;
    let around = Surroundings::of(&made, Up::Y);
    assert!(around.ground && matches!(around.backdrop, Backdrop::Sky));
    golden::golden("bunny", made, &around, None);
    Ok(())
}
