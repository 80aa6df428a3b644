//! The scenes of the benchmark, none of which may be left out of a full run.

use super::mesh::{Mesh, MeshError, Scene};
use super::spd::tessellate;
use crate::workload::View;
use anyhow::Context;
use ropewalk_scene::spd::Spd;
use std::path::PathBuf;

/// Where a scene comes from.
#[derive(Clone, Copy, Debug)]
enum Source {
    /// A file below the shared data folder, with the view given here.
    Shared(&'static str, ViewFrom),
    /// `NAME.ply` and `NAME.cam` as written by the study's generator script.
    Study,
    /// A scene of the Standard Procedural Databases at a size factor, as triangles.
    Tessellated(Spd, u32),
}

/// How the view of a shared file is found.
#[derive(Clone, Copy, Debug)]
enum ViewFrom {
    /// From outside: the eye stands in this direction from the centre of the box, 0.9 diagonals
    /// away; the light stands above, beside the eye.
    Outside([f32; 3]),
    /// From inside, chosen by hand: eye, point looked at, up, view angle, light.
    Inside([f32; 3], [f32; 3], [f32; 3], f32, [f32; 3]),
}

/// A scene by name.
#[derive(Clone, Copy, Debug)]
pub struct SceneEntry {
    /// Name on the command line and in the record.
    pub name: &'static str,
    source: Source,
}

/// Distance of an outside eye from the centre, in diagonals of the box.
const ORBIT_DISTANCE: f32 = 0.9;
/// View angle of an outside view in degrees.
const ORBIT_FOV: f32 = 45.0;

const Y: [f32; 3] = [0.0, 1.0, 0.0];
const Z: [f32; 3] = [0.0, 0.0, 1.0];

use Source::{Shared, Study, Tessellated};
use ViewFrom::{Inside, Outside};

const ENTRIES: &[SceneEntry] = &[
    SceneEntry { name: "bunny", source: Shared("mesh/bunny.ply.gz", Outside([0.3, 0.4, 1.0])) },
    SceneEntry { name: "dragon", source: Shared("mesh/dragon.ply.gz", Outside([0.4, 0.5, 1.0])) },
    SceneEntry { name: "scallop", source: Shared("mesh/scallop.glb.gz", Outside([0.2, 0.8, 1.0])) },
    SceneEntry {
        name: "sponza",
        source: Shared(
            "scene/sponza.ply.gz",
            Inside([-10.0, 2.0, -0.4], [5.0, 4.5, 0.6], Y, 65.0, [0.5, 12.0, 0.3]),
        ),
    },
    SceneEntry {
        name: "kitchen_country",
        source: Shared(
            "scene/kitchen_country.ply.gz",
            Inside([1.1, 1.7, 2.8], [-1.3, 0.9, -0.8], Y, 60.0, [0.5, 2.6, 1.0]),
        ),
    },
    SceneEntry {
        name: "vianney_house",
        source: Shared(
            "scene/vianney_house.ply.gz",
            Inside([-36.0, 38.4, 13.3], [10.0, 36.0, 11.0], Z, 65.0, [2.8, 37.2, 13.8]),
        ),
    },
    SceneEntry {
        name: "munich",
        source: Shared(
            "scene/munich.ply.gz",
            Inside([350.0, -500.0, 200.0], [0.0, -80.0, 0.0], Z, 55.0, [300.0, -100.0, 800.0]),
        ),
    },
    SceneEntry {
        name: "teapot_in_munich",
        source: Shared(
            "scene/teapot_in_munich.ply.gz",
            Inside([100.35, 50.4, 0.2], [100.0, 50.0, 0.1], Z, 60.0, [110.0, 45.0, 60.0]),
        ),
    },
    SceneEntry {
        name: "oa_am_underworks2",
        source: Shared(
            "scene/oa_am_underworks2.ply.gz",
            Inside([160.0, 1170.0, 70.0], [-40.0, 200.0, -150.0], Z, 70.0, [0.0, 1100.0, 60.0]),
        ),
    },
    SceneEntry { name: "atrium", source: Study },
    SceneEntry { name: "sphereflake", source: Study },
    SceneEntry { name: "soup1m", source: Study },
    SceneEntry { name: "stadium", source: Study },
    // 7,381 spheres and a floor: 5,314,322 triangles.
    SceneEntry { name: "spd-balls-5m", source: Tessellated(Spd::Balls, 4) },
];

/// The list of scenes and the folders that hold them.
#[derive(Clone, Debug)]
pub struct Catalog {
    /// The shared data folder.
    pub data: PathBuf,
    /// Where the study's generator wrote its scenes.
    pub generated: PathBuf,
}

impl Catalog {
    /// All scenes in the order of the record.
    pub fn entries() -> &'static [SceneEntry] {
        ENTRIES
    }

    /// The entries with these names; all of them if `names` is empty.
    ///
    /// # Errors
    /// Names the first unknown scene and lists the known ones.
    pub fn select(names: &[String]) -> Result<Vec<SceneEntry>, MeshError> {
        if names.is_empty() {
            return Ok(ENTRIES.to_vec());
        }
        let known = || ENTRIES.iter().map(|e| e.name).collect::<Vec<_>>().join(", ");
        names
            .iter()
            .map(|n| {
                let found = ENTRIES.iter().find(|e| e.name == n).copied();
                found.with_context(|| format!("unknown scene {n}; the scenes are {}", known()))
            })
            .collect()
    }

    /// Reads a scene.
    ///
    /// # Errors
    /// If its files are absent or malformed.
    pub fn load(&self, entry: &SceneEntry) -> Result<Scene, MeshError> {
        match entry.source {
            Shared(path, view) => {
                let mesh = Mesh::read(entry.name, &self.data.join(path))?;
                let view = match view {
                    Outside(direction) => outside(&mesh, direction),
                    Inside(eye, at, up, fov_degrees, light) => {
                        View { eye, at, up, fov_degrees, light }
                    }
                };
                Ok(Scene { mesh, view })
            }
            Tessellated(spd, size) => tessellate(entry.name, spd, size),
            Study => {
                let file = |ext| self.generated.join(format!("{}.{ext}", entry.name));
                let mesh = Mesh::read(entry.name, &file("ply"))
                    .context("run scripts/bench, which generates the scene")?;
                let camera = std::fs::read_to_string(file("cam"))
                    .with_context(|| format!("{} cannot be read", file("cam").display()))?;
                Ok(Scene { mesh, view: parse_camera(&camera)? })
            }
        }
    }
}

fn outside(mesh: &Mesh, direction: [f32; 3]) -> View {
    let bounds = mesh.bounds();
    let center: [f32; 3] = std::array::from_fn(|a| 0.5 * (bounds.min[a] + bounds.max[a]));
    let diagonal = bounds.diagonal() as f32;
    let length = direction.iter().map(|x| x * x).sum::<f32>().sqrt();
    let eye: [f32; 3] =
        std::array::from_fn(|a| center[a] + direction[a] / length * ORBIT_DISTANCE * diagonal);
    let light = std::array::from_fn(|a| center[a] + [0.5, 1.0, 0.9][a] * diagonal);
    View { eye, at: center, up: Y, fov_degrees: ORBIT_FOV, light }
}

/// Eye, point looked at, view angle and light: ten numbers.
fn parse_camera(text: &str) -> Result<View, MeshError> {
    let v: Vec<f32> = text
        .split_ascii_whitespace()
        .map(|w| w.parse().with_context(|| format!("camera: expected a number, found {w}")))
        .collect::<Result<_, _>>()?;
    let [ex, ey, ez, ax, ay, az, fov_degrees, lx, ly, lz] = v[..] else {
        anyhow::bail!("camera: expected 10 numbers, found {}", v.len());
    };
    Ok(View { eye: [ex, ey, ez], at: [ax, ay, az], up: Y, fov_degrees, light: [lx, ly, lz] })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_scenes_and_short_cameras_are_errors() {
        assert!(Catalog::select(&["bunny".into(), "nonesuch".into()]).is_err());
        assert_eq!(Catalog::select(&[]).unwrap().len(), ENTRIES.len());
        assert!(parse_camera("1 2 3").is_err());
        assert_eq!(parse_camera("1 2 3 4 5 6 50 7 8 9").unwrap().light, [7.0, 8.0, 9.0]);
    }

    #[test]
    fn an_absent_scene_is_an_error() {
        let dir = tempfile::tempdir().unwrap();
        let catalog = Catalog { data: dir.path().into(), generated: dir.path().into() };
        let files = |e: &&SceneEntry| !matches!(e.source, Tessellated(..));
        for entry in Catalog::entries().iter().filter(files) {
            assert!(catalog.load(entry).is_err(), "{}", entry.name);
        }
    }
}
