//! The extension module of the Python package `ropewalk`: arrays in, arrays out.
//!
//! It is as thin as it can be: python/ropewalk checks what users give and makes contiguous arrays of
//! it, this module shares rays out over threads without the GIL and stops when Ctrl-C is pressed.

#![forbid(unsafe_code)]
// Signatures are those that Python sees.
#![allow(clippy::too_many_arguments)]

mod core;
mod double;
mod error;
mod faces;
mod figures;
mod file;
mod mesh;
mod meshes;
mod plan;
mod points;
mod rays;
mod state;
mod surface;
mod tasks;
mod walker;
mod work;

use pyo3::prelude::*;

/// Compiled part of the package; everything in it is private to the package.
#[pymodule(gil_used = false)]
mod _ropewalk {
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::core::Core;
    #[pymodule_export]
    use crate::double::{DoubleCore, DoubleRays};
    #[pymodule_export]
    use crate::file::{open, save};
    #[pymodule_export]
    use crate::mesh::{read_instances, read_mesh};
    #[pymodule_export]
    use crate::points::Points;
    #[pymodule_export]
    use crate::rays::Rays;
    #[pymodule_export]
    use crate::walker::{cells_of, walk, walk_double};

    /// NumPy's C interface is looked up when the first array is seen, and Ctrl-C in the middle of that would be
    /// a panic: so one is made here.
    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.py().import("numpy")?;
        numpy::PyArray1::<f64>::zeros(module.py(), 0, false);
        Ok(())
    }

    /// The SIMD level that queries use on this machine: scalar, avx2 or avx512.
    #[pyfunction]
    fn simd_level() -> &'static str {
        ropewalk::kernel::Level::best().name()
    }

    /// How many threads `threads=0` means.
    #[pyfunction]
    fn default_threads() -> usize {
        crate::work::default_threads()
    }
}
