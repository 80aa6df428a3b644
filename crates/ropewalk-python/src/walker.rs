//! Particles moved along segments, and cells to start from.

use crate::core::{Core, masks_that_refuse};
use crate::double::DoubleCore;
use crate::faces::Faces;
use crate::points::Asked;
use crate::tasks::{block, blocks, zeros};
use crate::{error, rays, work};
use numpy::{Element, IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use ropewalk::Sides;
use ropewalk::point::Cell;
use ropewalk::walker::{Crossed, CrossingFilter, Encounter, Events, Walker, WalkerGeometry};
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
    core: Asked,
    points: PyReadonlyArray1<'_, f64>,
    threads: usize,
) -> PyResult<Bound<'py, PyArray1<i64>>> {
    let (points, _) = points.as_slice()?.as_chunks::<3>();
    let mut cells = zeros::<i64>(points.len())?;
    let Some(locate) = core.locator() else {
        // No cells, which is no more than a slower start.
        cells.fill(-1);
        return Ok(cells.into_pyarray(py));
    };
    let tasks = points.chunks(POINTS).zip(cells.chunks_mut(POINTS)).collect();
    work::for_each(py, threads, tasks, |(points, cells): (&[[f64; 3]], &mut [i64])| {
        for (to, cell) in cells.iter_mut().zip(locate(points)) {
            *to = number(cell);
        }
    })?;
    Ok(cells.into_pyarray(py))
}

/// A scene of triangles in either precision.
struct Meshes<'a, G: WalkerGeometry> {
    tree: &'a G::Tree,
    geometry: &'a G,
    faces: &'a Faces,
    /// Masks of the meshes.
    masks: &'a [u32],
}

/// Masks of particles and meshes, and the sides that are met.
struct Met<'a> {
    faces: &'a Faces,
    /// Masks of the meshes.
    meshes: &'a [u32],
    /// Number of the first particle.
    first: usize,
    /// One for all particles or one a particle.
    masks: Option<&'a [u32]>,
    sides: Sides,
}

impl CrossingFilter for Met<'_> {
    #[inline]
    fn accepts(&self, particle: usize, crossed: &Crossed) -> bool {
        let side = match self.sides {
            Sides::Both => true,
            Sides::Front => crossed.entering,
            Sides::Back => !crossed.entering,
        };
        side && self.masks.is_none_or(|masks| {
            // An altered file may name primitives that are not there.
            let mesh = self.meshes.get(self.faces.mesh(crossed.prim_id));
            rays::one(masks, self.first + particle) & mesh.copied().unwrap_or(!0) != 0
        })
    }

    #[inline]
    fn passes(&self, passed: u32, prim: u32) -> bool {
        self.faces.of(passed) == self.faces.of(prim)
    }
}

/// Where particles are and at which faces they were stopped, afterwards.
type State<'py, T> = (Bound<'py, PyArray1<T>>, Bound<'py, PyArray1<u32>>);

/// Row starts, segments, parameters, primitives, meshes, and whether they are entered.
type Rows<'py, T> = (
    Bound<'py, PyArray1<i64>>,
    Bound<'py, PyArray1<i32>>,
    Bound<'py, PyArray1<T>>,
    Bound<'py, PyArray1<i32>>,
    Bound<'py, PyArray1<i32>>,
    Bound<'py, PyArray1<bool>>,
);

/// Positions of particles, and the triangles at which they were stopped.
type Walked<T> = (Vec<[T; 3]>, Vec<u32>);

/// What a task is left with.
type Part<T> = (Walked<T>, Events<T>);

/// Row starts, directions and lengths of segments, and what is done at a triangle.
type Segments<'a, T> = (&'a [usize], &'a [[T; 3]], &'a [T], Encounter);

/// What moved particles come back as: their state, events, segments begun, and how many have no end.
type Moved<'py, T> = (State<'py, T>, Rows<'py, T>, Bound<'py, PyArray1<i32>>, usize);

fn moved<F: CrossingFilter, G: WalkerGeometry>(
    mut walker: Walker<'_, F, G>,
    (rows, directions, lengths, encounter): Segments<'_, G::Float>,
) -> Part<G::Float> {
    let events = walker.run(rows, directions, lengths, encounter);
    ((walker.positions().to_vec(), walker.stopped_at().to_vec()), events)
}

/// Moves particles along their rows of segments: their state, events, segments begun, and how many have
/// no end.
#[pyfunction]
#[pyo3(signature = (core, positions, stopped, offsets, directions, lengths, stop, threads, masks=None, faces="both"))]
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
    masks: Option<PyReadonlyArray1<'_, u32>>,
    faces: &str,
) -> PyResult<Moved<'py, f32>> {
    if core.tree().has_shapes() {
        return Err(error::argument("scene", None, TRIANGLES.into()));
    }
    let (tree, geometry) = (core.tree(), core.geometry());
    let meshes = Meshes { tree, geometry, faces: core.faces(), masks: &core.masks };
    let arrays = (positions, stopped, offsets, directions, lengths);
    walk_among(py, &meshes, arrays, stop, threads, masks, faces)
}

/// The same in `f64`.
#[pyfunction]
#[pyo3(signature = (core, positions, stopped, offsets, directions, lengths, stop, threads, masks=None, faces="both"))]
pub fn walk_double<'py>(
    py: Python<'py>,
    core: &DoubleCore,
    positions: PyReadonlyArray1<'_, f64>,
    stopped: PyReadonlyArray1<'_, u32>,
    offsets: PyReadonlyArray1<'_, i64>,
    directions: PyReadonlyArray1<'_, f64>,
    lengths: PyReadonlyArray1<'_, f64>,
    stop: bool,
    threads: usize,
    masks: Option<PyReadonlyArray1<'_, u32>>,
    faces: &str,
) -> PyResult<Moved<'py, f64>> {
    let object = core.object().ok_or_else(|| {
        let instances = "scene: particles move among meshes; this one is of instances";
        error::argument("scene", None, instances.into())
    })?;
    let (tree, geometry) = (&object.tree, &object.geometry);
    let meshes = Meshes { tree, geometry, faces: core.faces(), masks: core.mesh_masks() };
    let arrays = (positions, stopped, offsets, directions, lengths);
    walk_among(py, &meshes, arrays, stop, threads, masks, faces)
}

/// Why a scene is refused.
const TRIANGLES: &str =
    "the scene holds other primitives than triangles and quads, which a Walker does not know";

/// Positions, triangles at which particles were stopped, rows, directions and lengths.
type Arrays<'py, T> = (
    PyReadonlyArray1<'py, T>,
    PyReadonlyArray1<'py, u32>,
    PyReadonlyArray1<'py, i64>,
    PyReadonlyArray1<'py, T>,
    PyReadonlyArray1<'py, T>,
);

fn walk_among<'py, G: WalkerGeometry<Float: Element>>(
    py: Python<'py>,
    meshes: &Meshes<'_, G>,
    (positions, stopped, offsets, directions, lengths): Arrays<'_, G::Float>,
    stop: bool,
    threads: usize,
    masks: Option<PyReadonlyArray1<'_, u32>>,
    faces: &str,
) -> PyResult<Moved<'py, G::Float>> {
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
    let sides = rays::sides(faces)?;
    let masks = masks.as_ref().map(|masks| masks.as_slice()).transpose()?;
    if !fits || masks.is_some_and(|masks| masks.len() != 1 && masks.len() != n) {
        let reason = "rows, directions, lengths and masks do not fit each other";
        return Err(error::argument("offsets", None, reason.into()));
    }
    let encounter = if stop { Encounter::Stop } else { Encounter::Pass };
    let tasks: Vec<Range<usize>> = blocks(n, block(n, threads, PARTICLES)).collect();
    let masks = masks_that_refuse(meshes.masks, masks, &(0..n));
    let faces = meshes.faces;
    let is_plain = masks.is_none() && sides == Sides::Both && !faces.has_quads();
    let primitive = |&face: &u32| match face {
        u32::MAX => face,
        _ => faces.primitives(face).start,
    };
    let run = |part: Range<usize>| -> Option<Part<G::Float>> {
        let here = positions[part.clone()].to_vec();
        let walker = Walker::new(meshes.tree, meshes.geometry, here).ok()?;
        let stopped = stopped[part.clone()].iter().map(primitive).collect();
        let walker = walker.with_threads(1).with_stopped(stopped);
        let segments = (&offsets[part.start..=part.end], directions, lengths, encounter);
        Some(if is_plain {
            moved(walker, segments)
        } else {
            let met = Met { faces, meshes: meshes.masks, first: part.start, masks, sides };
            moved(walker.with_filter(met), segments)
        })
    };
    let parts: Option<Vec<Part<G::Float>>> =
        work::for_each(py, threads, tasks, run)?.into_iter().collect();
    let parts = parts.ok_or_else(|| error::argument("scene", None, TRIANGLES.into()))?;

    let found = parts.iter().map(|(_, events)| events.t.len()).sum();
    let (mut at, mut on) = (Vec::<G::Float>::new(), zeros::<u32>(0)?);
    at.reserve(3 * n);
    on.reserve(n);
    let (mut rows, mut walked) = (zeros::<i64>(n + 1)?, zeros::<i32>(0)?);
    let (mut segment, mut t) = (zeros::<i32>(0)?, Vec::<G::Float>::new());
    let (mut prim, mut geom) = (zeros::<i32>(0)?, zeros::<i32>(found)?);
    let (mut entering, mut invalid, mut particle) = (vec![], 0, 0);
    for ((positions, stopped), events) in &parts {
        at.extend_from_slice(positions.as_flattened());
        on.extend(stopped.iter().map(|&prim| faces.of(prim)));
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
    faces.number(bytemuck::cast_slice_mut(&mut prim), &mut geom);
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
