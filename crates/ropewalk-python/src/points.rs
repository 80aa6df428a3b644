//! Batches of points: the queries of `ropewalk::point` over a scene of triangles.

use crate::core::Core;
use crate::double::DoubleCore;
use crate::faces::Faces;
use crate::tasks::zeros;
use crate::{error, work};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use ropewalk::Geometry;
use ropewalk::double::DoubleGeometry;
use ropewalk::point::{Cell, PointError, PointQueries, Triangles, WindingMoments};
use std::sync::OnceLock;
use std::sync::atomic::AtomicBool;

/// Points of a task: some tenths of a second at most, so that Ctrl-C is heard.
const BLOCK: usize = 1 << 14;

/// The same where a point may take a tenth of a millisecond.
const SLOW_BLOCK: usize = 1 << 13;

/// The fewest points of a task where several threads share a batch.
const MIN_BLOCK: usize = 512;

/// Tasks a thread, so that none waits long for the slowest.
const TASKS_PER_THREAD: usize = 4;

/// Triangles that a task goes through where each point needs all of them.
const FULL_TASK: usize = 1 << 22;

/// What points are asked about.
#[derive(FromPyObject)]
pub enum Asked {
    Single(Py<Core>),
    Double(Py<DoubleCore>),
}

impl Asked {
    /// How triangles are numbered.
    fn faces(&self) -> &Faces {
        match self {
            Asked::Single(core) => core.get().faces(),
            Asked::Double(core) => core.get().faces(),
        }
    }

    fn queries(&self) -> PyResult<Queries<'_>> {
        match self {
            Asked::Single(core) => {
                let core = core.get();
                Ok(Queries::Single(queries(&core.tree, &core.geometry)?))
            }
            Asked::Double(core) => {
                let object = core.get().object().ok_or_else(|| {
                    let message =
                        "scene: points are answered over meshes; this one is of instances";
                    error::argument("scene", None, message.into())
                })?;
                Ok(Queries::Double(queries(&object.tree, &object.geometry)?))
            }
        }
    }
}

fn queries<'a, G: Triangles>(tree: &'a G::Tree, geometry: &'a G) -> PyResult<PointQueries<'a, G>> {
    PointQueries::new(tree, geometry)
        .map(|queries| queries.with_threads(1))
        .map_err(|e: PointError| error::argument("scene", None, format!("scene: {e}")))
}

/// Queries in either precision.
#[derive(Clone, Copy)]
enum Queries<'a> {
    Single(PointQueries<'a, Geometry>),
    Double(PointQueries<'a, DoubleGeometry>),
}

/// The same of either.
macro_rules! ask {
    ($queries:expr, $name:ident => $answer:expr) => {
        match $queries {
            Queries::Single($name) => $answer,
            Queries::Double($name) => $answer,
        }
    };
}

impl Asked {
    /// The cells of points, each to its own room; `None` where there are none: other primitives than triangles,
    /// or instances.
    pub fn locator(&self) -> Option<impl Fn(&[[f64; 3]]) -> Vec<Option<Cell>> + Sync + '_> {
        let queries = self.queries().ok()?;
        Some(move |points: &[[f64; 3]]| ask!(queries, queries => queries.locate(points)))
    }
}

/// Answers points over the scene of a [`Core`] or the meshes of a [`DoubleCore`].
#[pyclass(frozen, module = "ropewalk._ropewalk")]
pub struct Points {
    core: Asked,
    /// Made when first needed.
    moments: OnceLock<WindingMoments>,
}

/// Distances, primitives, meshes, nearest points and surface coordinates.
type Nearest<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<i32>>,
    Bound<'py, PyArray1<i32>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
);

/// Numbers, boxes, and how many primitives each refers to; of leaves.
type Leaves<'py> =
    (Bound<'py, PyArray1<i64>>, Bound<'py, PyArray3<f64>>, Bound<'py, PyArray1<i32>>);

#[pymethods]
impl Points {
    /// Refuses scenes that hold other primitives than triangles, and instances.
    #[new]
    fn new(core: Asked) -> PyResult<Points> {
        core.queries()?;
        Ok(Points { core, moments: OnceLock::new() })
    }

    /// How many points have no answer, and the first of them.
    fn invalid(&self, points: PyReadonlyArray1<'_, f64>) -> PyResult<(usize, usize)> {
        let (points, queries) = (chunked(&points)?, self.core.queries()?);
        let is_near = |p: &[f64; 3]| ask!(queries, queries => queries.is_near(p));
        let mut wrong = points.iter().enumerate().filter(|(_, p)| !is_near(p)).map(|(i, _)| i);
        let first = wrong.next();
        Ok((first.map_or(0, |_| 1 + wrong.count()), first.unwrap_or(0)))
    }

    /// The nearest triangles.
    fn closest_point<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray1<'py, f64>,
        threads: usize,
    ) -> PyResult<Nearest<'py>> {
        let (points, queries) = (chunked(&points)?, self.core.queries()?);
        let (n, faces) = (points.len(), self.core.faces());
        let (mut distance, mut prim, mut geom) =
            (zeros::<f64>(n)?, zeros::<i32>(n)?, zeros::<i32>(n)?);
        let (mut position, mut uv) = (zeros::<[f64; 3]>(n)?, zeros::<[f64; 2]>(n)?);
        let block = block(n, threads, BLOCK);
        let tasks = (points.chunks(block))
            .zip(distance.chunks_mut(block))
            .zip(prim.chunks_mut(block).zip(geom.chunks_mut(block)))
            .zip(position.chunks_mut(block).zip(uv.chunks_mut(block)))
            .collect();
        work::for_each(
            py,
            threads,
            tasks,
            |(((points, distance), (prim, geom)), (position, uv))| {
                let found = ask!(queries, queries => queries.closest_point(points));
                distance.copy_from_slice(&found.distance);
                let prim: &mut [u32] = bytemuck::cast_slice_mut(prim);
                prim.copy_from_slice(&found.prim_id);
                position.copy_from_slice(&found.point);
                uv.copy_from_slice(&found.uv);
                if faces.has_quads() {
                    for (uv, &prim) in uv.iter_mut().zip(prim.iter()) {
                        *uv = faces.part(prim).coordinates(*uv);
                    }
                }
                faces.number(prim, geom);
            },
        )?;
        Ok((
            distance.into_pyarray(py),
            prim.into_pyarray(py),
            geom.into_pyarray(py),
            rows(py, position)?,
            rows(py, uv)?,
        ))
    }

    /// Distances, signed where a surface is taken for closed: negative inside.
    fn distance<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray1<'py, f64>,
        signed: bool,
        threads: usize,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.each(py, &points, threads, BLOCK, |queries, points, out| {
            let found = ask!(queries, queries => match signed {
                true => queries.signed_distance(points),
                false => queries.distance(points),
            });
            out.copy_from_slice(&found);
        })
    }

    /// Inside or on a closed surface by parity, or inside of any by winding numbers.
    fn contains<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray1<'py, f64>,
        winding: bool,
        threads: usize,
    ) -> PyResult<Bound<'py, PyArray1<bool>>> {
        if winding {
            let moments = self.moments(py, threads)?;
            return self.each(py, &points, threads, SLOW_BLOCK, |queries, points, out| {
                let found = ask!(queries, queries => queries.contains_by_winding(moments, points));
                if let Ok(found) = found {
                    out.copy_from_slice(&found);
                }
            });
        }
        self.each(py, &points, threads, BLOCK, |queries, points, out| {
            out.copy_from_slice(&ask!(queries, queries => queries.contains(points)));
        })
    }

    /// Generalised winding numbers, off by `accuracy` at most; 0 is the sum over all triangles.
    fn winding_number<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray1<'py, f64>,
        accuracy: f64,
        threads: usize,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        if accuracy > 0.0 {
            let moments = self.moments(py, threads)?;
            return self.each(py, &points, threads, SLOW_BLOCK, |queries, points, out| {
                let found = ask!(queries, queries => {
                    queries.winding_number_within(moments, points, accuracy)
                });
                if let Ok(found) = found {
                    out.copy_from_slice(&found);
                }
            });
        }
        let triangles = self.core.faces().len().max(1);
        let most = (FULL_TASK / triangles).clamp(1, BLOCK);
        self.each(py, &points, threads, most, |queries, points, out| {
            out.copy_from_slice(&ask!(queries, queries => queries.winding_number(points)));
        })
    }

    /// The leaf that holds each point; -1 outside of the tree's box.
    fn locate<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray1<'py, f64>,
        threads: usize,
    ) -> PyResult<Bound<'py, PyArray1<i64>>> {
        self.each(py, &points, threads, BLOCK, |queries, points, out| {
            let cells = ask!(queries, queries => queries.locate(points));
            for (out, cell) in out.iter_mut().zip(cells) {
                *out = cell.map_or(-1, |cell| i64::from(cell.to_bits()));
            }
        })
    }

    /// Boxes of leaves and how many faces each refers to; NaN and -1 for what is no leaf. Of all leaves
    /// without `cells`.
    #[pyo3(signature = (cells=None))]
    fn cells<'py>(
        &self,
        py: Python<'py>,
        cells: Option<PyReadonlyArray1<'py, i64>>,
    ) -> PyResult<Leaves<'py>> {
        let (queries, faces) = (self.core.queries()?, self.core.faces());
        let faces_in = |mut prims: Vec<u32>| {
            if faces.has_quads() {
                prims.iter_mut().for_each(|prim| *prim = faces.of(*prim));
                prims.sort_unstable();
                prims.dedup();
            }
            prims.len() as i32
        };
        let cells = match &cells {
            Some(cells) => cells.as_slice()?.to_vec(),
            None => {
                let all = py.detach(|| ask!(queries, queries => queries.cells()));
                all.into_iter().map(|cell| i64::from(cell.to_bits())).collect()
            }
        };
        let (mut bounds, mut counts) =
            (zeros::<[[f64; 3]; 2]>(cells.len())?, zeros::<i32>(cells.len())?);
        let tasks =
            (cells.chunks(BLOCK)).zip(bounds.chunks_mut(BLOCK).zip(counts.chunks_mut(BLOCK)));
        work::for_each(py, 1, tasks.collect(), |(cells, (bounds, counts))| {
            for ((&cell, bounds), count) in cells.iter().zip(bounds).zip(counts) {
                let cell = u32::try_from(cell).ok().map(Cell::from_bits);
                (*bounds, *count) = ([[f64::NAN; 3]; 2], -1);
                let Some(cell) = cell else { continue };
                ask!(queries, queries => if let Some(corners) = queries.cell_corners(cell) {
                    (*bounds, *count) = (corners, faces_in(queries.cell_primitives(cell)));
                });
            }
        })?;
        let n = cells.len();
        let bounds: Vec<f64> = bytemuck::cast_vec(bounds);
        let bounds = bounds.into_pyarray(py).reshape([n, 2, 3])?;
        Ok((cells.into_pyarray(py), bounds, counts.into_pyarray(py)))
    }
}

impl Points {
    /// The moments of the scene's triangles.
    fn moments(&self, py: Python<'_>, threads: usize) -> PyResult<&WindingMoments> {
        if self.moments.get().is_none() {
            let queries = self.core.queries()?;
            let moments = |n| ask!(queries, queries => queries.with_threads(n).winding_moments());
            let made = if threads == 1 {
                py.detach(|| moments(1))
            } else {
                let stop = AtomicBool::new(false);
                work::watch(py, threads, &stop, |_| Ok(()), || moments(0))?
            };
            // Two threads may make them at once; they are the same.
            let _ = self.moments.set(made);
        }
        self.moments.get().ok_or_else(|| error::other("moments are missing".into()))
    }

    /// One number a point.
    fn each<'py, T: numpy::Element + bytemuck::Zeroable + Clone + Send>(
        &self,
        py: Python<'py>,
        points: &PyReadonlyArray1<'py, f64>,
        threads: usize,
        most: usize,
        answer: impl Fn(Queries<'_>, &[[f64; 3]], &mut [T]) + Sync,
    ) -> PyResult<Bound<'py, PyArray1<T>>> {
        let points = chunked(points)?;
        let queries = self.core.queries()?;
        let mut out = zeros::<T>(points.len())?;
        let block = block(points.len(), threads, most);
        let tasks = points.chunks(block).zip(out.chunks_mut(block)).collect();
        work::for_each(py, threads, tasks, |(points, out)| answer(queries, points, out))?;
        Ok(out.into_pyarray(py))
    }
}

fn chunked<'a>(points: &'a PyReadonlyArray1<'_, f64>) -> PyResult<&'a [[f64; 3]]> {
    Ok(points.as_slice()?.as_chunks::<3>().0)
}

fn rows<'py, const N: usize>(
    py: Python<'py>,
    values: Vec<[f64; N]>,
) -> PyResult<Bound<'py, PyArray2<f64>>>
where
    [f64; N]: bytemuck::Pod,
{
    let n = values.len();
    bytemuck::cast_vec::<[f64; N], f64>(values).into_pyarray(py).reshape([n, N])
}

/// Points of a task, `most` at most.
fn block(points: usize, threads: usize, most: usize) -> usize {
    match threads {
        1 => most,
        _ => points.div_ceil(threads.max(1) * TASKS_PER_THREAD).max(MIN_BLOCK).min(most),
    }
}
