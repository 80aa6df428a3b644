//! Particles moved along segments, and cells to start from.

use crate::core::{Core, block, blocks, zeros};
use crate::{error, work};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use ropewalk::point::{Cell, PointQueries};
use ropewalk::walker::{Encounter, Events, Walker};
use std::ops::Range;

/// Particles of a task.
const PARTICLES: usize = 4096;

/// Points of a task.
const POINTS: usize = 16_384;

/// A cell as Python has it: -1 for none.
fn number(cell: Option<Cell>) -> i64 {
    cell.map_or(-1, |cell| i64::from(cell.to_bits()))
}

/// What a number stands for; what is none of a cell stands for no cell.
pub fn cell(number: i64) -> Option<Cell> {
    u32::try_from(number).ok().map(Cell::from_bits)
}

/// The cells of points, three numbers each; -1 outside of the scene's box.
#[pyfunction]
pub fn cells_of<'py>(
    py: Python<'py>,
    core: &Core,
    points: PyReadonlyArray1<'_, f64>,
    threads: usize,
) -> PyResult<Bound<'py, PyArray1<i64>>> {
    let (points, _) = points.as_slice()?.as_chunks::<3>();
    let mut cells = zeros::<i64>(points.len())?;
    let Ok(queries) = PointQueries::new(core.tree(), core.geometry()) else {
        // Other primitives than triangles: no cells, which is no more than a slower start.
        cells.fill(-1);
        return Ok(cells.into_pyarray(py));
    };
    let queries = queries.with_threads(1);
    let tasks = points.chunks(POINTS).zip(cells.chunks_mut(POINTS)).collect();
    work::for_each(py, threads, tasks, |(points, cells): (&[[f64; 3]], &mut [i64])| {
        for (to, cell) in cells.iter_mut().zip(queries.locate(points)) {
            *to = number(cell);
        }
    })?;
    Ok(cells.into_pyarray(py))
}

/// Where particles are and at which triangles they were stopped, afterwards.
type State<'py> = (Bound<'py, PyArray1<f32>>, Bound<'py, PyArray1<u32>>);

/// Row starts, segments, parameters, primitives, meshes, and whether they are entered.
type Rows<'py> = (
    Bound<'py, PyArray1<i64>>,
    Bound<'py, PyArray1<i32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<i32>>,
    Bound<'py, PyArray1<i32>>,
    Bound<'py, PyArray1<bool>>,
);

/// Moves particles along their rows of segments: their state, events, segments begun, and how many have
/// no end.
#[pyfunction]
pub fn walk<'py>(
    py: Python<'py>,
    core: &Core,
    positions: PyReadonlyArray1<'_, f32>,
    stopped: PyReadonlyArray1<'_, u32>,
    offsets: PyReadonlyArray1<'_, i64>,
    directions: PyReadonlyArray1<'_, f32>,
    lengths: PyReadonlyArray1<'_, f32>,
    stop: bool,
    threads: usize,
) -> PyResult<(State<'py>, Rows<'py>, Bound<'py, PyArray1<i32>>, usize)> {
    let (positions, _) = positions.as_slice()?.as_chunks::<3>();
    let (directions, _) = directions.as_slice()?.as_chunks::<3>();
    let (stopped, lengths) = (stopped.as_slice()?, lengths.as_slice()?);
    let offsets: Vec<usize> =
        offsets.as_slice()?.iter().map(|&o| usize::try_from(o).unwrap_or(usize::MAX)).collect();
    let n = positions.len();
    let fits = stopped.len() == n
        && offsets.len() == n + 1
        && offsets.is_sorted()
        && offsets[n] <= lengths.len()
        && directions.len() == lengths.len();
    if !fits {
        let reason = "rows, directions and lengths do not fit each other";
        return Err(error::argument("offsets", None, reason.into()));
    }
    let triangles = "the scene holds other primitives than triangles, which a Walker does not know";
    if core.tree().has_shapes() {
        return Err(error::argument("scene", None, triangles.into()));
    }
    let encounter = if stop { Encounter::Stop } else { Encounter::Pass };
    let tasks: Vec<Range<usize>> = blocks(n, block(n, threads, PARTICLES)).collect();
    let run = |part: Range<usize>| -> Option<(Walker<'_>, Events)> {
        let here = positions[part.clone()].to_vec();
        let walker = Walker::new(core.tree(), core.geometry(), here).ok()?;
        let mut walker = walker.with_threads(1).with_stopped(stopped[part.clone()].to_vec());
        let rows = &offsets[part.start..=part.end];
        let events = walker.run(rows, directions, lengths, encounter);
        Some((walker, events))
    };
    let parts: Option<Vec<(Walker<'_>, Events)>> =
        work::for_each(py, threads, tasks, run)?.into_iter().collect();
    let parts = parts.ok_or_else(|| error::argument("scene", None, triangles.into()))?;

    let found = parts.iter().map(|(_, events)| events.t.len()).sum();
    let (mut at, mut on) = (zeros::<f32>(0)?, zeros::<u32>(0)?);
    at.reserve(3 * n);
    on.reserve(n);
    let (mut rows, mut walked) = (zeros::<i64>(n + 1)?, zeros::<i32>(0)?);
    let (mut segment, mut t) = (zeros::<i32>(0)?, zeros::<f32>(0)?);
    let (mut prim, mut geom) = (zeros::<i32>(0)?, zeros::<i32>(found)?);
    let (mut entering, mut invalid, mut particle) = (vec![], 0, 0);
    for (walker, events) in &parts {
        at.extend_from_slice(walker.positions().as_flattened());
        on.extend_from_slice(walker.stopped_at());
        for &end in &events.offsets[1..] {
            particle += 1;
            rows[particle] = (t.len() + end) as i64;
        }
        segment.extend(events.segment.iter().map(|&s| s as i32));
        t.extend_from_slice(&events.t);
        prim.extend(events.prim_id.iter().map(|&p| p as i32));
        entering.extend_from_slice(&events.entering);
        walked.extend(events.walked.iter().map(|&w| w as i32));
        invalid += events.invalid;
    }
    crate::core::number(core.first_primitives(), bytemuck::cast_slice_mut(&mut prim), &mut geom);
    let state = (at.into_pyarray(py), on.into_pyarray(py));
    let events = (
        rows.into_pyarray(py),
        segment.into_pyarray(py),
        t.into_pyarray(py),
        prim.into_pyarray(py),
        geom.into_pyarray(py),
        entering.into_pyarray(py),
    );
    Ok((state, events, walked.into_pyarray(py), invalid))
}
