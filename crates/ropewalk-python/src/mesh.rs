//! Mesh files as arrays.

use crate::error::{Failure, argument};
use crate::work;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyString;
use ropewalk_scene::{
    Builtin, Loaded, Mesh, MeshLimits, NffLimits, PlacedMeshes, Placement, Recognised, SceneError,
    load_monitored, parse_builtin, recognise,
};
use std::path::Path;
use std::sync::Arc;

/// Vertices and faces.
type Arrays<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<u32>>);

/// Meshes; of each placement its mesh, its matrix, the name of its node and its node, -1 for none.
type Placed<'py> = (
    Vec<Arrays<'py>>,
    Bound<'py, PyArray1<i32>>,
    Bound<'py, PyArray3<f64>>,
    Vec<Bound<'py, PyString>>,
    Bound<'py, PyArray1<i64>>,
);

/// The mesh in a file, told by its content, then by its name; None if it is a scene in NFF or a built-in one. Vertices within the
/// distance `merge` are merged.
#[pyfunction]
#[pyo3(signature = (path, merge=None))]
pub fn read_mesh<'py>(
    py: Python<'py>,
    path: &str,
    merge: Option<f64>,
) -> PyResult<Option<Arrays<'py>>> {
    if is_scene(path, |builtin| matches!(builtin, Builtin::Spd(..)))? {
        return Ok(None);
    }
    let load = |monitor: &work::Stop<'_>| load_monitored(path, &NffLimits::default(), monitor);
    let Loaded::Mesh(_, mut mesh) = work::alone(py, load)?.map_err(failed)? else {
        return Ok(None);
    };
    if let Some(distance) = merge {
        work::alone(py, |monitor: &work::Stop<'_>| mesh.merge_vertices(distance, monitor))?
            .map_err(|error| argument("merge", None, format!("merge: {error}")))?;
    }
    arrays(py, mesh).map(Some)
}

/// The meshes in a file, each once, and where they are placed; None as of `read_mesh`.
#[pyfunction]
pub fn read_instances<'py>(py: Python<'py>, path: &str) -> PyResult<Option<Placed<'py>>> {
    if is_scene(path, |_| true)? {
        return Ok(None);
    }
    let read = |monitor: &work::Stop<'_>| {
        PlacedMeshes::read_monitored(Path::new(path), &MeshLimits::DEFAULT, monitor)
    };
    let placed = work::alone(py, read)?.map_err(|error| failed(error.into()))?;
    let PlacedMeshes { meshes, placements } = placed;
    let meshes = meshes.into_iter().map(|mesh| arrays(py, mesh)).collect::<PyResult<_>>()?;
    // Placements of one node share their name.
    let mut names: Vec<Bound<'py, PyString>> = Vec::with_capacity(placements.len());
    for (i, placement) in placements.iter().enumerate() {
        let is_shared = i > 0 && Arc::ptr_eq(&placement.name, &placements[i - 1].name);
        let last = names.last().filter(|_| is_shared).cloned();
        names.push(last.unwrap_or_else(|| PyString::new(py, &placement.name)));
    }
    let mesh = placements.iter().map(|placement| placement.mesh as i32);
    let node = |placement: &Placement| placement.node.map_or(-1, i64::from);
    let matrices = placements.iter().flat_map(|placement| placement.transform.as_flattened());
    let matrices: Vec<f64> = matrices.copied().collect();
    Ok(Some((
        meshes,
        PyArray1::from_iter(py, mesh),
        matrices.into_pyarray(py).reshape([placements.len(), 3, 4])?,
        names,
        PyArray1::from_iter(py, placements.iter().map(node)),
    )))
}

fn failed(error: SceneError) -> PyErr {
    Failure::File(error).into_exception(true)
}

/// True of a scene in NFF and of built-in ones that are scenes to the caller.
fn is_scene(path: &str, is_builtin_scene: impl Fn(&Builtin) -> bool) -> PyResult<bool> {
    Ok(match parse_builtin(path).map_err(failed)? {
        Some(builtin) => is_builtin_scene(&builtin),
        None => matches!(recognise(path).map_err(failed)?, Recognised::Nff),
    })
}

fn arrays(py: Python<'_>, mesh: Mesh) -> PyResult<Arrays<'_>> {
    let (v, f) = (mesh.vertices.len(), mesh.faces.len());
    let vertices = bytemuck::cast_vec::<[f64; 3], f64>(mesh.vertices).into_pyarray(py);
    let faces = bytemuck::cast_vec::<[u32; 3], u32>(mesh.faces).into_pyarray(py);
    Ok((vertices.reshape([v, 3])?, faces.reshape([f, 3])?))
}
