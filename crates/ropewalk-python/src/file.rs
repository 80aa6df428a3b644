//! Scenes in files: saved, opened by a map or a copy, and compared with arrays.

use crate::core::Core;
use crate::double::DoubleCore;
use crate::error::{self, Failure};
use crate::faces::{Faces, MeshFaces, Rows};
use crate::figures::Build;
use crate::work;
use numpy::PyReadonlyArray2;
use pyo3::prelude::*;
use ropewalk::GeometryError;
use ropewalk::build::{Monitor, Preset};
use ropewalk::file::{
    AnyOpened, Check, Contents, Extra, Figures, Hash, Opened, Tag, mesh_hash, short, triangles_hash,
};
use ropewalk::instance::Object;
use ropewalk_file::{OpenError, SaveError};
use std::path::{Path, PathBuf};

/// The section that holds meshes: their number, the first primitive of each and the number of primitives, the
/// mask of each; all `u32`.
const MESHES: Tag = Tag(*b"mesh");

/// The section that says which triangles are the second ones of quads: a bit each. Absent without quads.
const QUADS: Tag = Tag(*b"quad");

/// A scene of either precision.
#[derive(FromPyObject)]
pub enum AnyCore<'py> {
    Single(PyRef<'py, Core>),
    Double(PyRef<'py, DoubleCore>),
}

/// Saves a scene; the bytes of the file.
#[pyfunction]
pub fn save(py: Python<'_>, core: AnyCore<'_>, path: PathBuf) -> PyResult<u64> {
    match &core {
        AnyCore::Single(core) => {
            let contents = Contents::new(&core.tree, &core.geometry);
            write(py, path, contents, &core.report, core.preset, (&core.faces, &core.masks))
        }
        AnyCore::Double(core) => {
            let (object, report) = core.built().ok_or_else(|| {
                let message =
                    "scenes of instances cannot be saved; save the scenes that they place";
                error::not_saved(format!("cannot save {}: {message}", path.display()))
            })?;
            let contents = Contents::of_double(&object.tree, &object.geometry);
            let meshes = (core.faces(), core.mesh_masks());
            write(py, path, contents, report, core.built_with(), meshes)
        }
    }
}

/// Writes a scene with its meshes, their faces and masks.
fn write(
    py: Python<'_>,
    path: PathBuf,
    contents: Contents<'_>,
    report: &Build,
    preset: Preset,
    (faces, masks): (&Faces, &[u32]),
) -> PyResult<u64> {
    let figures = Figures {
        preset: Some(preset),
        duplication: report.duplication,
        tree: report.tree.clone(),
    };
    let numbers = [masks.len() as u32].into_iter().chain(faces.primitive_starts());
    let numbers = numbers.chain(masks.iter().copied());
    let mut extra =
        vec![Extra { tag: MESHES, bytes: numbers.flat_map(u32::to_le_bytes).collect() }];
    extra.extend(faces.seconds().map(|bytes| Extra { tag: QUADS, bytes }));
    let contents = Contents { figures: Some(&figures), extra: &extra, ..contents };
    let save = |stop: &work::Stop<'_>| ropewalk_file::save_monitored(&path, &contents, stop);
    let saved = work::alone(py, save)?;
    Ok(saved.map_err(|error: SaveError| error::not_saved(error.to_string()))?.bytes)
}

/// Opens a saved scene, a [`Core`] or a [`DoubleCore`]: maps it, or copies it. With a mesh, only a scene that was
/// built over it alone.
#[pyfunction]
#[pyo3(signature = (path, verify, copy, rounded=None, vertices=None, faces=None))]
pub fn open(
    py: Python<'_>,
    path: PathBuf,
    verify: bool,
    copy: bool,
    rounded: Option<PyReadonlyArray2<'_, f32>>,
    vertices: Option<PyReadonlyArray2<'_, f64>>,
    faces: Option<PyReadonlyArray2<'_, u32>>,
) -> PyResult<Py<PyAny>> {
    let check = if verify { Check::Everything } else { Check::Structure };
    let open = |stop: &work::Stop<'_>| match copy {
        true => ropewalk_file::read_monitored(&path, check, stop),
        false => ropewalk_file::open_monitored(&path, check, stop),
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
    let rows = match &faces {
        Some(faces) => Rows::new(faces.as_slice()?, faces.as_array().ncols()),
        None => None,
    };
    match scene {
        AnyOpened::Single(scene) => {
            let expected = match (&rounded, rows) {
                (Some(vertices), Some(rows)) => {
                    let (vertices, _) = vertices.as_slice()?.as_chunks::<3>();
                    let hash = work::alone(py, |stop| rounded_hash(vertices, rows, stop))?;
                    Some((rows, hash.map_err(|failure| failure.into_exception(true))?))
                }
                _ => None,
            };
            let geometry = &scene.geometry;
            let (count, degenerate) = (geometry.len(), geometry.degenerate_count());
            let (faces, masks) =
                checked(&path, (count, &scene.geometry_hash, &scene.extra), expected)?;
            let Opened { tree, geometry, figures, .. } = *scene;
            let (preset, report) = built(figures, faces.len(), degenerate);
            Ok(Py::new(py, Core { geometry, tree, report, faces, masks, preset })?.into_any())
        }
        AnyOpened::Double(scene) => {
            let expected = match (&vertices, rows) {
                (Some(vertices), Some(rows)) => {
                    let (vertices, _) = vertices.as_slice()?.as_chunks::<3>();
                    let hash = work::alone(py, |stop| match rows.triangles_alone() {
                        Some(faces) => mesh_hash(vertices, faces, stop),
                        None => {
                            let cut: Vec<_> =
                                rows.triangles().map(|(_, corners)| corners).collect();
                            mesh_hash(vertices, &cut, stop)
                        }
                    })?;
                    Some((rows, hash.map_err(|error| error::other(error.to_string()))?))
                }
                _ => None,
            };
            let geometry = &scene.geometry;
            let (count, degenerate) = (geometry.len(), geometry.degenerate_count());
            let (faces, masks) =
                checked(&path, (count, &scene.geometry_hash, &scene.extra), expected)?;
            let Opened { tree, geometry, figures, .. } = *scene;
            let (preset, report) = built(figures, faces.len(), degenerate);
            let object = Object { geometry, tree };
            Ok(Py::new(py, DoubleCore::of(object, report, (faces, masks), preset))?.into_any())
        }
    }
}

/// Preset and figures of a saved scene.
fn built(figures: Option<Figures>, primitives: usize, degenerate: usize) -> (Preset, Build) {
    let Figures { preset, duplication, tree } = figures.unwrap_or_default();
    let (cost_model, sample_rays) = (None, 0);
    let report =
        Build { primitives, degenerate, duplication, tree, cost_model, sample_rays, seconds: 0.0 };
    (preset.unwrap_or(Preset::Balanced), report)
}

/// Faces and masks of the meshes of a file of so many primitives and that hash, if they are what is expected.
fn checked(
    path: &Path,
    (found, found_hash, extra): (usize, &Hash, &[Extra]),
    expected: Option<(Rows<'_>, Hash)>,
) -> PyResult<(Faces, Vec<u32>)> {
    let refuse =
        |reason: String| error::file("OtherGeometryError", format!("{}: {reason}", path.display()));
    let damaged = |section: &str| {
        let message = format!("section {section} does not fit the number of primitives");
        error::file("SceneFileError", format!("{}: {message}", path.display()))
    };
    let (starts, masks) = meshes(found, extra).ok_or_else(|| damaged("mesh"))?;
    let faces = match extra.iter().find(|extra| extra.tag == QUADS) {
        Some(extra) => Faces::with_seconds(&starts, &extra.bytes).ok_or_else(|| damaged("quad"))?,
        None => Faces::new(starts),
    };
    if let Some((rows, hash)) = expected {
        if masks.len() != 1 {
            return Err(refuse(format!("it holds {} meshes; expected one", masks.len())));
        }
        if faces.len() != rows.len() {
            let (found, expected) = (faces.len(), rows.len());
            return Err(refuse(format!(
                "it was built for {found} primitives; expected {expected}"
            )));
        }
        if hash != *found_hash || Faces::of_meshes(&[MeshFaces::Rows(rows)]) != faces {
            let (expected, found) = (short(&hash), short(found_hash));
            return Err(refuse(format!(
                "it was built for other geometry; expected hash {expected}, found {found}"
            )));
        }
    }
    Ok((faces, masks))
}

/// First primitives and masks of the meshes of a file: one mesh if it does not say. `None` if what it says
/// cannot be.
fn meshes(primitives: usize, extra: &[Extra]) -> Option<(Vec<u32>, Vec<u32>)> {
    let Some(extra) = extra.iter().find(|extra| extra.tag == MESHES) else {
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
fn rounded_hash(
    vertices: &[[f32; 3]],
    faces: Rows<'_>,
    monitor: &dyn Monitor,
) -> Result<Hash, Failure> {
    let wrong = |i: &u32| *i as usize >= vertices.len();
    let found = faces
        .triangles()
        .find_map(|(face, corners)| corners.into_iter().find(wrong).map(|found| (face, found)));
    if let Some((face, found)) = found {
        let error = GeometryError::Face { face, found, vertices: vertices.len() };
        return Err(Failure::Mesh(0, error));
    }
    // Half a hash is never looked at: the call raises.
    let corners = faces.triangles().enumerate();
    let corners = corners.take_while(|(i, _)| i % (1 << 14) != 0 || !monitor.is_cancelled());
    Ok(triangles_hash(corners.map(|(_, (_, corners))| corners.map(|i| vertices[i as usize]))))
}
