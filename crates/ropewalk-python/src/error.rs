//! The package's exceptions, which python/ropewalk/_errors.py defines.

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use ropewalk::GeometryError;
use ropewalk::build::BuildError;
use ropewalk::double::DoubleGeometryError;
use ropewalk::wide::CompileError;
use ropewalk_scene::{Fault, SceneError};
use std::any::Any;

/// An exception of the package.
fn raise(class: &str, message: String, argument: Option<&str>, index: Option<usize>) -> PyErr {
    Python::attach(|py| {
        let made = py.import("ropewalk._errors").and_then(|errors| {
            errors.getattr(class)?.call1((message.clone(), argument, index)).map(PyErr::from_value)
        });
        made.unwrap_or_else(|_| PyRuntimeError::new_err(message))
    })
}

/// An argument is wrong.
pub fn argument(argument: &str, index: Option<usize>, message: String) -> PyErr {
    raise("ArgumentError", message, Some(argument), index)
}

/// Something else went wrong.
pub fn other(message: String) -> PyErr {
    raise("InternalError", message, None, None)
}

/// A file is not what it should be, or cannot be had; `class` says which.
pub fn file(class: &str, message: String) -> PyErr {
    raise(class, message, Some("path"), None)
}

/// A scene could not be saved.
pub fn not_saved(message: String) -> PyErr {
    raise("SceneWriteError", message, Some("path"), None)
}

/// There is not enough memory.
pub fn memory(message: String) -> PyErr {
    raise("OutOfMemoryError", message, None, None)
}

/// A panic, which is a defect of this package.
pub fn panic(payload: Box<dyn Any + Send>) -> PyErr {
    let text = payload.downcast_ref::<String>().map(String::as_str);
    let text = text.or_else(|| payload.downcast_ref::<&str>().copied()).unwrap_or("no message");
    other(format!("a defect of ropewalk, please report it: {text}"))
}

/// Why there is no scene.
pub enum Failure {
    /// A mesh, by its number, cannot be used.
    Mesh(usize, GeometryError),
    /// Meshes in `f64` cannot be used; what names a vertex or a face has been checked before.
    Double(DoubleGeometryError),
    /// The tree cannot be built.
    Build(BuildError),
    /// The scene does not fit into its memory limit.
    Memory {
        /// Bytes needed at least.
        needed: u64,
        /// The limit.
        limit: u64,
    },
    /// The file cannot be read.
    File(SceneError),
    /// The objects of a file cannot be used.
    Objects(GeometryError),
}

impl Failure {
    /// The exception; a scene of one mesh was made of the arguments `vertices` and `faces`.
    pub fn into_exception(self, one_mesh: bool) -> PyErr {
        match self {
            Failure::Mesh(mesh, error) => {
                let name = |array: &str| {
                    if one_mesh { array.to_owned() } else { format!("meshes[{mesh}].{array}") }
                };
                match error {
                    GeometryError::Vertex { vertex, found: [x, y, z] } => {
                        let name = name("vertices");
                        let message = format!(
                            "{name}[{vertex}] is ({x}, {y}, {z}); expected finite numbers within the range of float32"
                        );
                        argument(&name, Some(vertex), message)
                    }
                    GeometryError::Face { face, found, vertices } => {
                        let name = name("faces");
                        let message = format!(
                            "{name}[{face}] names vertex {found}; expected 0 to {}",
                            vertices.saturating_sub(1)
                        );
                        argument(&name, Some(face), message)
                    }
                    // The number of the primitive is one of all meshes.
                    GeometryError::Shape { error, .. } => {
                        let name = format!("meshes[{mesh}]");
                        argument(&name, None, format!("{name}: {error}"))
                    }
                    GeometryError::NotFinite { what, .. } => {
                        let name = format!("meshes[{mesh}]");
                        argument(&name, None, format!("{name}: a {what} does not fit into float32"))
                    }
                    _ => argument(&name("faces"), None, error.to_string()),
                }
            }
            Failure::Double(error) => argument("vertices", None, error.to_string()),
            Failure::Memory { needed, limit } => {
                let message = format!(
                    "memory_limit: the scene needs about {needed} bytes at least, {limit} are allowed"
                );
                raise("OutOfMemoryError", message, Some("memory_limit"), None)
            }
            Failure::Build(error) => match &error {
                BuildError::Compile(
                    CompileError::Memory { .. } | CompileError::TooLarge { .. },
                )
                | BuildError::TooLarge { .. } => memory(error.to_string()),
                BuildError::Memory { .. } => {
                    raise("OutOfMemoryError", error.to_string(), Some("memory_limit"), None)
                }
                BuildError::Setting { field, .. } => argument(field, None, error.to_string()),
                _ => other(error.to_string()),
            },
            Failure::File(error) => {
                let class = match (error.fault(), &error) {
                    (_, SceneError::Open { .. }) => "SceneNotFoundError",
                    (Fault::System, _) => "SceneReadError",
                    _ => "SceneFileError",
                };
                raise(class, error.to_string(), Some("path"), None)
            }
            Failure::Objects(error) => {
                raise("SceneFileError", error.to_string(), Some("path"), None)
            }
        }
    }
}
