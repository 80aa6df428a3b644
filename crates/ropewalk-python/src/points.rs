//! Batches of points: the queries of `ropewalk::point` over a scene of triangles.

use crate::core::{Core, zeros};
use crate::{error, work};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use ropewalk::point::{Cell, PointError, PointQueries, WindingMoments, is_near};
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

/// Answers points over the scene of a [`Core`].
#[pyclass(frozen, module = "ropewalk._ropewalk")]
pub struct Points {
    core: Py<Core>,
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
    (Bound<'py, PyArray1<i64>>, Bound<'py, PyArray3<f32>>, Bound<'py, PyArray1<i32>>);

#[pymethods]
impl Points {
    /// Refuses scenes that hold other primitives than triangles.
    #[new]
    fn new(core: Py<Core>) -> PyResult<Points> {
        queries(core.get())?;
        Ok(Points { core, moments: OnceLock::new() })
    }

    /// How many points have no answer, and the first of them.
    #[staticmethod]
    fn invalid(points: PyReadonlyArray1<'_, f64>) -> PyResult<(usize, usize)> {
        let (points, _) = points.as_slice()?.as_chunks::<3>();
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
        let (points, core) = (chunked(&points)?, self.core.get());
        let (n, queries) = (points.len(), queries(core)?);
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
                let found = queries.closest_point(points);
                distance.copy_from_slice(&found.distance);
                let prim: &mut [u32] = bytemuck::cast_slice_mut(prim);
                prim.copy_from_slice(&found.prim_id);
                position.copy_from_slice(&found.point);
                uv.copy_from_slice(&found.uv);
                crate::core::number(core.first_primitives(), prim, geom);
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
            let found =
                if signed { queries.signed_distance(points) } else { queries.distance(points) };
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
                if let Ok(found) = queries.contains_by_winding(moments, points) {
                    out.copy_from_slice(&found);
                }
            });
        }
        self.each(py, &points, threads, BLOCK, |queries, points, out| {
            out.copy_from_slice(&queries.contains(points));
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
                if let Ok(found) = queries.winding_number_within(moments, points, accuracy) {
                    out.copy_from_slice(&found);
                }
            });
        }
        let triangles = self.core.get().geometry.len().max(1);
        let most = (FULL_TASK / triangles).clamp(1, BLOCK);
        self.each(py, &points, threads, most, |queries, points, out| {
            out.copy_from_slice(&queries.winding_number(points));
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
            for (out, cell) in out.iter_mut().zip(queries.locate(points)) {
                *out = cell.map_or(-1, |cell| i64::from(cell.to_bits()));
            }
        })
    }

    /// Boxes and numbers of references of leaves; NaN and -1 for what is no leaf. Of all leaves
    /// without `cells`.
    #[pyo3(signature = (cells=None))]
    fn cells<'py>(
        &self,
        py: Python<'py>,
        cells: Option<PyReadonlyArray1<'py, i64>>,
    ) -> PyResult<Leaves<'py>> {
        let core = self.core.get();
        let queries = queries(core)?;
        let cells = match &cells {
            Some(cells) => cells.as_slice()?.to_vec(),
            None => {
                let all = py.detach(|| queries.cells());
                all.into_iter().map(|cell| i64::from(cell.to_bits())).collect()
            }
        };
        let (mut bounds, mut counts) =
            (zeros::<[[f32; 3]; 2]>(cells.len())?, zeros::<i32>(cells.len())?);
        let tasks =
            (cells.chunks(BLOCK)).zip(bounds.chunks_mut(BLOCK).zip(counts.chunks_mut(BLOCK)));
        work::for_each(py, 1, tasks.collect(), |(cells, (bounds, counts))| {
            for ((&cell, bounds), count) in cells.iter().zip(bounds).zip(counts) {
                let cell = u32::try_from(cell).ok().map(Cell::from_bits);
                let leaf = cell.and_then(|cell| Some((queries.cell_box(cell)?, cell)));
                *bounds = leaf.map_or([[f32::NAN; 3]; 2], |(bounds, _)| [bounds.min, bounds.max]);
                *count = leaf.map_or(-1, |(_, cell)| queries.cell_primitives(cell).len() as i32);
            }
        })?;
        let n = cells.len();
        let bounds: Vec<f32> = bytemuck::cast_vec(bounds);
        let bounds = bounds.into_pyarray(py).reshape([n, 2, 3])?;
        Ok((cells.into_pyarray(py), bounds, counts.into_pyarray(py)))
    }
}

impl Points {
    /// The moments of the scene's triangles.
    fn moments(&self, py: Python<'_>, threads: usize) -> PyResult<&WindingMoments> {
        if self.moments.get().is_none() {
            let queries = queries(self.core.get())?;
            let made = if threads == 1 {
                py.detach(|| queries.winding_moments())
            } else {
                let (stop, queries) = (AtomicBool::new(false), queries.with_threads(0));
                work::watch(py, threads, &stop, |_| Ok(()), || queries.winding_moments())?
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
        answer: impl Fn(PointQueries<'_>, &[[f64; 3]], &mut [T]) + Sync,
    ) -> PyResult<Bound<'py, PyArray1<T>>> {
        let points = chunked(points)?;
        let queries = queries(self.core.get())?;
        let mut out = zeros::<T>(points.len())?;
        let block = block(points.len(), threads, most);
        let tasks = points.chunks(block).zip(out.chunks_mut(block)).collect();
        work::for_each(py, threads, tasks, |(points, out)| answer(queries, points, out))?;
        Ok(out.into_pyarray(py))
    }
}

fn queries(core: &Core) -> PyResult<PointQueries<'_>> {
    PointQueries::new(&core.tree, &core.geometry)
        .map(|queries| queries.with_threads(1))
        .map_err(|e: PointError| error::argument("scene", None, format!("scene: {e}")))
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
