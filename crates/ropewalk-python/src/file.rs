//! Scenes in files: saved, opened by a map or a copy, and compared with arrays.

use crate::core::Core;
use crate::error::{self, Failure};
use crate::figures::Build;
use crate::work;
use numpy::{PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use ropewalk::GeometryError;
use ropewalk::build::{Monitor, Preset};
use ropewalk::file::{Check, Contents, Extra, Figures, Hash, Opened, Tag, short, triangles_hash};
use ropewalk_file::{OpenError, SaveError};
use std::path::PathBuf;

/// The section that holds meshes: their number, the first primitive of each and the number of primitives, the
/// mask of each; all `u32`.
const MESHES: Tag = Tag(*b"mesh");

/// Saves a scene; the bytes of the file.
#[pyfunction]
pub fn save(py: Python<'_>, core: &Core, path: PathBuf) -> PyResult<u64> {
    let figures = Figures {
        preset: Some(core.preset),
        duplication: core.report.duplication,
        tree: core.report.tree.clone(),
    };
    let numbers = [core.masks.len() as u32].into_iter().chain(core.starts.iter().copied());
    let numbers = numbers.chain(core.masks.iter().copied());
    let extra = [Extra { tag: MESHES, bytes: numbers.flat_map(u32::to_le_bytes).collect() }];
    let contents = Contents {
        figures: Some(&figures),
        extra: &extra,
        ..Contents::new(&core.tree, &core.geometry)
    };
    let save = |stop: &work::Stop<'_>| ropewalk_file::save_monitored(&path, &contents, stop);
    let saved = work::alone(py, save)?;
    Ok(saved.map_err(|error: SaveError| error::not_saved(error.to_string()))?.bytes)
}

/// Opens a saved scene: maps it, or copies it. With a mesh, only a scene that was built over it alone.
#[pyfunction]
#[pyo3(signature = (path, verify, copy, vertices=None, faces=None))]
pub fn open(
    py: Python<'_>,
    path: PathBuf,
    verify: bool,
    copy: bool,
    vertices: Option<PyReadonlyArray2<'_, f32>>,
    faces: Option<PyReadonlyArray2<'_, u32>>,
) -> PyResult<Core> {
    let check = if verify { Check::Everything } else { Check::Structure };
    let open = |stop: &work::Stop<'_>| match copy {
        true => ropewalk_file::read_monitored(&path, check, stop),
        false => ropewalk_file::open_monitored(&path, check, stop),
    };
    let expected = match (&vertices, &faces) {
        (Some(vertices), Some(faces)) => {
            let (count, (vertices, _)) = (faces.shape()[0], vertices.as_slice()?.as_chunks::<3>());
            let (faces, _) = faces.as_slice()?.as_chunks::<3>();
            let hash = work::alone(py, |stop| mesh_hash(vertices, faces, stop))?;
            Some((count, hash.map_err(|failure| failure.into_exception(true))?))
        }
        _ => None,
    };
    // A header and links are checked in milliseconds, for which no thread is started.
    let scene = if verify || copy { work::alone(py, open)? } else { work::here(py, open)? };
    let scene = scene.map_err(|error: OpenError| {
        let message = error.to_string();
        match error {
            OpenError::Open { .. } => error::file("SceneNotFoundError", message),
            OpenError::Read { .. } => error::file("SceneReadError", message),
            _ => error::file("SceneFileError", message),
        }
    })?;
    let refuse =
        |reason: String| error::file("OtherGeometryError", format!("{}: {reason}", path.display()));
    let (starts, masks) = meshes(&scene).ok_or_else(|| {
        let message = "section mesh does not fit the number of primitives";
        error::file("SceneFileError", format!("{}: {message}", path.display()))
    })?;
    if let Some((faces, hash)) = expected {
        let found = scene.geometry.len();
        if masks.len() != 1 {
            return Err(refuse(format!("it holds {} meshes; expected one", masks.len())));
        }
        if found != faces {
            return Err(refuse(format!("it was built for {found} primitives; expected {faces}")));
        }
        if hash != scene.geometry_hash {
            let (expected, found) = (short(&hash), short(&scene.geometry_hash));
            return Err(refuse(format!(
                "it was built for other geometry; expected hash {expected}, found {found}"
            )));
        }
    }
    let Opened { tree, geometry, figures, .. } = scene;
    let figures = figures.unwrap_or_default();
    let report = Build {
        primitives: geometry.len(),
        degenerate: geometry.degenerate_count(),
        duplication: figures.duplication,
        tree: figures.tree,
        seconds: 0.0,
    };
    let preset = figures.preset.unwrap_or(Preset::Balanced);
    Ok(Core { geometry, tree, report, starts, masks, preset })
}

/// First primitives and masks of the meshes of a file: one mesh if it does not say. `None` if what it says
/// cannot be.
fn meshes(scene: &Opened) -> Option<(Vec<u32>, Vec<u32>)> {
    let primitives = scene.geometry.len();
    let Some(extra) = scene.extra.iter().find(|extra| extra.tag == MESHES) else {
        return Some((vec![0, primitives as u32], vec![!0]));
    };
    let (words, []) = extra.bytes.as_chunks::<4>() else { return None };
    let words: Vec<u32> = words.iter().map(|&word| u32::from_le_bytes(word)).collect();
    let (&count, rest) = words.split_first()?;
    let (starts, masks) = rest.split_at_checked((count as usize).checked_add(1)?)?;
    let fits = masks.len() == count as usize
        && starts.first() == Some(&0)
        && starts.is_sorted()
        && starts.last().is_some_and(|&last| last as usize == primitives);
    fits.then(|| (starts.to_vec(), masks.to_vec()))
}

/// The hash of the geometry that a scene of one mesh has.
fn mesh_hash(
    vertices: &[[f32; 3]],
    faces: &[[u32; 3]],
    monitor: &dyn Monitor,
) -> Result<Hash, Failure> {
    let wrong = |i: &u32| *i as usize >= vertices.len();
    if let Some(face) = faces.iter().position(|corners| corners.iter().any(wrong)) {
        let found = faces[face].into_iter().find(wrong).unwrap_or_default();
        let error = GeometryError::Face { face, found, vertices: vertices.len() };
        return Err(Failure::Mesh(0, error));
    }
    // Half a hash is never looked at: the call raises.
    let faces = faces.chunks(1 << 14).take_while(|_| !monitor.is_cancelled()).flatten();
    Ok(triangles_hash(faces.map(|corners| corners.map(|i| vertices[i as usize]))))
}
