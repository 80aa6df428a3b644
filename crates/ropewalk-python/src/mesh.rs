//! Mesh files as arrays.

use crate::error::Failure;
use crate::work;
use numpy::{IntoPyArray, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use ropewalk_scene::{
    Builtin, Loaded, NffLimits, Recognised, load_monitored, parse_builtin, recognise,
};

/// Vertices and faces.
type Arrays<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<u32>>);

/// The mesh in a file, told by its content, then by its name; None if it is a scene in NFF or a built-in one.
#[pyfunction]
pub fn read_mesh<'py>(py: Python<'py>, path: &str) -> PyResult<Option<Arrays<'py>>> {
    let failed = |error| Failure::File(error).into_exception(true);
    let is_scene = match parse_builtin(path).map_err(failed)? {
        Some(builtin) => matches!(builtin, Builtin::Spd(..)),
        None => matches!(recognise(path).map_err(failed)?, Recognised::Nff),
    };
    if is_scene {
        return Ok(None);
    }
    let load = |monitor: &work::Stop<'_>| load_monitored(path, &NffLimits::default(), monitor);
    let loaded = work::alone(py, load)?;
    let loaded = loaded.map_err(failed)?;
    let Loaded::Mesh(_, mesh) = loaded else { return Ok(None) };
    let (v, f) = (mesh.vertices.len(), mesh.faces.len());
    let vertices = bytemuck::cast_vec::<[f64; 3], f64>(mesh.vertices).into_pyarray(py);
    let faces = bytemuck::cast_vec::<[u32; 3], u32>(mesh.faces).into_pyarray(py);
    Ok(Some((vertices.reshape([v, 3])?, faces.reshape([f, 3])?)))
}
