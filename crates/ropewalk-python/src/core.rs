//! A scene with its tree, and the batch queries.

use crate::error::{self, Failure};
use crate::faces::{Faces, MeshFaces, once};
use crate::figures::Build;
use crate::meshes::{Given, Mesh, geometry_of};
use crate::plan::{Plan, Watch, left_for_build, plan_of, sample};
use crate::rays::{Invalid, Rays, View, one};
use crate::surface::{self, Asked, Looked};
use crate::tasks::{block, blocks, checked, split, total, zeros};
use crate::walker::cell;
use crate::{state, work};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use ropewalk::build::{BuildSettings, CostChoice, Preset};
use ropewalk::kernel::{AllHits, BatchCaster, HitFilter};
use ropewalk::point::Cell;
use ropewalk::primitive::Primitive;
use ropewalk::ray::PreparedRay;
use ropewalk::wide::WideTree;
use ropewalk::{Geometry, Hit, Ray, Sides};
use ropewalk_scene::{FacetPolicy, NffLimits, load_monitored};
use std::cell::RefCell;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Primitives of so many hits ahead are asked for.
const AHEAD: usize = 8;

/// Rays that one task interleaves and traces: half a megabyte.
pub const BLOCK: usize = 16_384;

/// The same over trees of at least [`LARGE_TREE`] bytes: the engine sorts many incoherent rays there.
const LARGE_BLOCK: usize = 1 << 18;

/// See [`LARGE_BLOCK`].
const LARGE_TREE: usize = 32 << 20;

/// A geometry of one or more meshes and the tree over it. It never changes.
#[pyclass(frozen, module = "ropewalk._ropewalk")]
pub struct Core {
    pub(crate) geometry: Geometry,
    pub(crate) tree: WideTree,
    pub(crate) report: Build,
    pub(crate) faces: Faces,
    /// Masks of the meshes.
    pub(crate) masks: Vec<u32>,
    pub(crate) preset: Preset,
}

/// Parameters and primitives of a block.
type TAndPrim<'a> = (&'a mut [f32], &'a mut [i32]);

/// A geometry and its faces.
type Parts = (Geometry, Faces);

/// Parameters, primitives and meshes of hits, how many rays were invalid and which was the first.
type Answer<'py> =
    (Bound<'py, PyArray1<f32>>, Bound<'py, PyArray1<i32>>, Bound<'py, PyArray1<i32>>, usize, usize);

/// The same in rows that begin at the first array's entries.
type Lists<'py> = (
    Bound<'py, PyArray1<i64>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<i32>>,
    Bound<'py, PyArray1<i32>>,
    usize,
    usize,
);

#[pymethods]
impl Core {
    /// Builds a tree over meshes with a mask each.
    #[staticmethod]
    #[pyo3(signature = (meshes, masks, plan, threads, progress=None, memory_limit=None, rays=None))]
    fn build(
        py: Python<'_>,
        meshes: Vec<Given<'_>>,
        masks: Vec<u32>,
        plan: (String, String),
        threads: usize,
        progress: Option<Py<PyAny>>,
        memory_limit: Option<u64>,
        rays: Option<&Rays>,
    ) -> PyResult<Core> {
        let plan = Plan::new(&plan)?.with_rays(sample(py, rays)?);
        let one_mesh = meshes.len() == 1;
        let meshes: Vec<Mesh<'_>> = meshes.iter().map(Given::view).collect::<PyResult<_>>()?;
        let faces: Vec<MeshFaces<'_>> = meshes.iter().map(Mesh::faces).collect();
        let faces = Faces::of_meshes(&faces);
        // Before the triangles are copied; of is asked again, which costs nothing.
        let count = meshes.iter().map(|mesh| mesh.faces().primitive_count()).sum();
        left_for_build(memory_limit, faces.bytes() as u64, count)
            .map_err(|failure| failure.into_exception(one_mesh))?;
        let make = |_: &Watch<'_>| Ok((geometry_of(&meshes)?, faces));
        Self::of(py, make, masks, plan, threads, progress, memory_limit, one_mesh)
    }

    /// Loads a scene file or a built-in scene, object by object as primitives of one mesh.
    #[staticmethod]
    #[pyo3(signature = (path, plan, threads, progress=None, memory_limit=None, rays=None))]
    fn load(
        py: Python<'_>,
        path: &str,
        plan: (String, String),
        threads: usize,
        progress: Option<Py<PyAny>>,
        memory_limit: Option<u64>,
        rays: Option<&Rays>,
    ) -> PyResult<Core> {
        let plan = Plan::new(&plan)?.with_rays(sample(py, rays)?);
        let make = |monitor: &Watch<'_>| {
            let loaded = load_monitored(path, &NffLimits::default(), monitor);
            let scene = loaded.map_err(Failure::File)?.into_scene();
            let geometry = scene.geometry(FacetPolicy::TwoSided).map_err(Failure::Objects)?;
            let count = geometry.len() as u32;
            Ok((geometry, Faces::new(vec![0, count])))
        };
        Self::of(py, make, vec![!0], plan, threads, progress, memory_limit, true)
    }

    /// Builds what [`Core::state`] returned.
    #[staticmethod]
    #[pyo3(signature = (kinds, ends, numbers, starts, masks, plan, threads, quads=None))]
    fn from_state(
        py: Python<'_>,
        kinds: PyReadonlyArray1<'_, u8>,
        ends: PyReadonlyArray1<'_, u64>,
        numbers: PyReadonlyArray1<'_, f32>,
        starts: Vec<u32>,
        masks: Vec<u32>,
        plan: (String, String),
        threads: usize,
        quads: Option<PyReadonlyArray1<'_, u8>>,
    ) -> PyResult<Core> {
        let plan = Plan::new(&plan)?;
        let (kinds, ends, numbers) = (kinds.as_slice()?, ends.as_slice()?, numbers.as_slice()?);
        let bad = || error::argument("state", None, "the pickled scene is damaged".into());
        let sound = starts.len() == masks.len() + 1
            && starts.is_sorted()
            && starts.first() == Some(&0)
            && starts.last().is_some_and(|&n| n as usize == kinds.len());
        let geometry = state::read(kinds, ends, numbers).filter(|_| sound).ok_or_else(bad)?;
        let faces = match &quads {
            Some(quads) => Faces::with_seconds(&starts, quads.as_slice()?).ok_or_else(bad)?,
            None => Faces::new(starts),
        };
        Self::of(py, |_| Ok((geometry, faces)), masks, plan, threads, None, None, true)
    }

    /// Everything that makes the scene, as arrays and lists; the last is None without quads.
    #[allow(clippy::type_complexity)]
    fn state<'py>(
        &self,
        py: Python<'py>,
    ) -> (
        Bound<'py, PyArray1<u8>>,
        Bound<'py, PyArray1<u64>>,
        Bound<'py, PyArray1<f32>>,
        Vec<u32>,
        Vec<u32>,
        (&'static str, &'static str),
        Option<Bound<'py, PyArray1<u8>>>,
    ) {
        let (kinds, ends, numbers) = py.detach(|| state::write(&self.geometry));
        let (kinds, ends) = (kinds.into_pyarray(py), ends.into_pyarray(py));
        let plan = plan_of(self.preset, &self.report);
        let quads = self.faces.seconds().map(|bits| bits.into_pyarray(py));
        let starts = self.faces.primitive_starts();
        (kinds, ends, numbers.into_pyarray(py), starts, self.masks.clone(), plan, quads)
    }

    /// The first face of each mesh, and the number of faces.
    #[getter]
    fn starts(&self) -> Vec<u32> {
        self.faces.starts().to_vec()
    }

    /// Masks of the meshes.
    #[getter]
    fn masks(&self) -> Vec<u32> {
        self.masks.clone()
    }

    /// True if there are other primitives than triangles.
    #[getter]
    fn has_shapes(&self) -> bool {
        self.tree.has_shapes()
    }

    /// Lower and upper corner of the box of everything.
    #[getter]
    fn bounds(&self) -> Option<([f32; 3], [f32; 3])> {
        let bounds = self.geometry.bounds();
        (!self.geometry.is_empty()).then_some((bounds.min, bounds.max))
    }

    /// Figures of the build and of the tree.
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let figures = figures(py, &self.report, self.preset, self.masks.len())?;
        figures.set_item("tree_bytes", self.tree.bytes())?;
        figures.set_item("geometry_bytes", self.geometry.bytes() + self.faces.bytes())?;
        Ok(figures)
    }

    /// Parameter, primitive and mesh of the first hit of each ray; infinity, -1 and -1 for a miss.
    #[pyo3(signature = (rays, threads, start=None))]
    fn closest_hit<'py>(
        &self,
        py: Python<'py>,
        rays: &Rays,
        threads: usize,
        start: Option<PyReadonlyArray1<'_, i64>>,
    ) -> PyResult<Answer<'py>> {
        let start = start.as_ref().map(|cells| cells.as_slice()).transpose()?;
        let arrays = rays.borrow(py)?;
        let view = arrays.view()?;
        let n = view.count;
        let (mut t, mut prim, mut geom) = (zeros::<f32>(n)?, zeros::<i32>(n)?, zeros::<i32>(n)?);
        let block = block(n, threads, self.block_size());
        let chunks = t.chunks_mut(block).zip(prim.chunks_mut(block)).zip(geom.chunks_mut(block));
        let tasks = blocks(n, block).zip(chunks).collect();
        let trace = |(range, ((t, prim), geom)): (Range<usize>, (TAndPrim<'_>, _))| {
            let prim: &mut [u32] = bytemuck::cast_slice_mut(prim);
            let cells = self.cells(start, &range);
            let invalid = self.block(&view, range, |caster, filter, rays| match filter {
                _ if !cells.is_empty() => {
                    let caster = caster.with_cells(&cells);
                    match filter {
                        Some(filter) => {
                            caster.with_filter(filter).closest_hit_into(rays, t, prim);
                        }
                        None => drop(caster.closest_hit_into(rays, t, prim)),
                    }
                }
                Some(filter) => drop(caster.with_filter(filter).closest_hit_into(rays, t, prim)),
                None if rays.len() == 1 => {
                    let hit = caster.closest_hit_one(&rays[0]);
                    (t[0], prim[0]) = hit.map_or((f32::INFINITY, !0), |hit| (hit.t, hit.prim_id));
                }
                None => drop(caster.closest_hit_into(rays, t, prim)),
            });
            self.faces.number(prim, geom);
            invalid
        };
        let invalid = total(work::for_each(py, threads, tasks, trace)?);
        let (t, prim, geom) = (t.into_pyarray(py), prim.into_pyarray(py), geom.into_pyarray(py));
        Ok((t, prim, geom, invalid.count, invalid.first))
    }

    /// Whether each ray hits anything.
    #[pyo3(signature = (rays, threads, start=None))]
    fn occluded<'py>(
        &self,
        py: Python<'py>,
        rays: &Rays,
        threads: usize,
        start: Option<PyReadonlyArray1<'_, i64>>,
    ) -> PyResult<(Bound<'py, PyArray1<bool>>, usize, usize)> {
        let start = start.as_ref().map(|cells| cells.as_slice()).transpose()?;
        let arrays = rays.borrow(py)?;
        let view = arrays.view()?;
        let mut hit = vec![false; checked::<bool>(view.count)?];
        let block = block(view.count, threads, self.block_size());
        let tasks = blocks(view.count, block).zip(hit.chunks_mut(block)).collect();
        let trace = |(range, hit): (Range<usize>, &mut [bool])| {
            let cells = self.cells(start, &range);
            self.block(&view, range, |caster, filter, rays| match filter {
                _ if !cells.is_empty() => {
                    let caster = caster.with_cells(&cells);
                    match filter {
                        Some(filter) => {
                            caster.with_filter(filter).occluded_into(rays, hit);
                        }
                        None => drop(caster.occluded_into(rays, hit)),
                    }
                }
                Some(filter) => drop(caster.with_filter(filter).occluded_into(rays, hit)),
                None if rays.len() == 1 => hit[0] = caster.occluded_one(&rays[0]),
                None => drop(caster.occluded_into(rays, hit)),
            })
        };
        let invalid = total(work::for_each(py, threads, tasks, trace)?);
        Ok((hit.into_pyarray(py), invalid.count, invalid.first))
    }

    /// The number of faces that each ray hits.
    fn count_hits<'py>(
        &self,
        py: Python<'py>,
        rays: &Rays,
        threads: usize,
    ) -> PyResult<(Bound<'py, PyArray1<i32>>, usize, usize)> {
        let arrays = rays.borrow(py)?;
        let view = arrays.view()?;
        let mut counts = zeros::<i32>(view.count)?;
        let block = block(view.count, threads, BLOCK);
        let tasks = blocks(view.count, block).zip(counts.chunks_mut(block)).collect();
        let trace = |(range, counts): (Range<usize>, &mut [i32])| {
            self.block(&view, range, |caster, filter, rays| {
                if self.faces.has_quads() {
                    let mut all = AllHits::default();
                    self.first_of(caster, filter, rays, usize::MAX, &mut all);
                    for (count, row) in counts.iter_mut().zip(all.offsets.windows(2)) {
                        *count = (row[1] - row[0]) as i32;
                    }
                    return;
                }
                let found = match filter {
                    Some(filter) => caster.with_filter(filter).count_hits(rays),
                    None => caster.count_hits(rays),
                };
                counts.copy_from_slice(bytemuck::cast_slice(&found));
            })
        };
        let invalid = total(work::for_each(py, threads, tasks, trace)?);
        Ok((counts.into_pyarray(py), invalid.count, invalid.first))
    }

    /// The first `k` hits of each ray in order, or all of them.
    #[pyo3(signature = (rays, threads, k=None))]
    fn first_hits<'py>(
        &self,
        py: Python<'py>,
        rays: &Rays,
        threads: usize,
        k: Option<usize>,
    ) -> PyResult<Lists<'py>> {
        let arrays = rays.borrow(py)?;
        let view = arrays.view()?;
        let (n, k) = (view.count, k.unwrap_or(usize::MAX));
        let ranges = blocks(n, block(n, threads, BLOCK)).collect();
        let trace = |range: Range<usize>| {
            let mut all = AllHits::default();
            let invalid = self.block(&view, range, |caster, filter, rays| {
                self.first_of(caster, filter, rays, k, &mut all);
            });
            (all, invalid)
        };
        let (parts, invalid): (Vec<AllHits>, Vec<Invalid>) =
            work::for_each(py, threads, ranges, trace)?.into_iter().unzip();
        let invalid = total(invalid);
        let found = parts.iter().map(|part| part.t.len()).sum();
        let mut offsets = zeros::<i64>(n + 1)?;
        let (mut t, mut prim, mut geom) =
            (zeros::<f32>(found)?, zeros::<i32>(found)?, zeros::<i32>(found)?);
        let mut tasks = Vec::with_capacity(parts.len());
        let (mut ends, mut to) = (&mut offsets[1..], (&mut t[..], &mut prim[..], &mut geom[..]));
        let mut start = 0;
        for part in parts {
            let len = part.t.len();
            let row = (split(&mut to.0, len), split(&mut to.1, len), split(&mut to.2, len));
            let count = part.offsets.len() - 1;
            tasks.push((part, start, split(&mut ends, count), row));
            start += len;
        }
        work::for_each(py, threads, tasks, |(part, start, ends, (t, prim, geom))| {
            for (end, offset) in ends.iter_mut().zip(&part.offsets[1..]) {
                *end = (start + offset) as i64;
            }
            t.copy_from_slice(&part.t);
            let prim: &mut [u32] = bytemuck::cast_slice_mut(prim);
            prim.copy_from_slice(&part.prim_id);
            self.faces.number(prim, geom);
        })?;
        let (t, prim, geom) = (t.into_pyarray(py), prim.into_pyarray(py), geom.into_pyarray(py));
        Ok((offsets.into_pyarray(py), t, prim, geom, invalid.count, invalid.first))
    }

    /// Surface coordinates, unit normals, positions or cross products of edges of hits, by `what`, an array each, and how
    /// many of the hits are none: rays have been changed since. `ray` names the ray of each hit, or each ray has one.
    #[pyo3(signature = (what, rays, t, prim, geom, threads, ray=None))]
    fn surface<'py>(
        &self,
        py: Python<'py>,
        what: Vec<String>,
        rays: &Rays,
        t: PyReadonlyArray1<'py, f32>,
        prim: PyReadonlyArray1<'py, i32>,
        geom: PyReadonlyArray1<'py, i32>,
        threads: usize,
        ray: Option<PyReadonlyArray1<'py, i64>>,
    ) -> PyResult<(surface::Arrays<'py, f32>, usize)> {
        let arrays = rays.borrow(py)?;
        let view = arrays.view()?;
        let (t, prim, geom) = (t.as_slice()?, prim.as_slice()?, geom.as_slice()?);
        let ray = ray.as_ref().map(|ray| ray.as_slice()).transpose()?;
        let n = t.len();
        let rows = ray.map_or(view.count, <[i64]>::len);
        if prim.len() != n || geom.len() != n || rows != n {
            return Err(error::argument("hits", None, "arrays of hits differ in length".into()));
        }
        surface::gather(py, (n, threads, f32::NAN), &Asked::named(&what), |i, values| {
            // Hits are all over the scene, and what is worked out about one leaves time for others to come from memory.
            let ahead = i + AHEAD;
            if ahead < n
                && let Some(face) = self.faces.face(prim[ahead], geom[ahead])
            {
                self.geometry.prefetch(self.faces.primitives(face).start);
            }
            let Some(face) = self.faces.face(prim[i], geom[i]) else { return Looked::Miss };
            let ray = ray.map_or(i, |ray| ray[i] as usize);
            let line = (ray < view.count).then(|| view.line(ray));
            let found = line.is_some_and(|(origin, dir)| {
                let ray = Ray { origin, dir, t_min: t[i], t_max: t[i] };
                self.faces.primitives(face).any(|prim| {
                    let on = (prim, self.faces.part(prim), view.sides);
                    surface::look(&self.geometry, &ray, on, values)
                })
            });
            if found { Looked::Found } else { Looked::Lost }
        })
    }

    /// Seconds of this thread's CPU that the engine itself takes for the batch, rays interleaved and room
    /// for answers made beforehand: what the layer above costs is measured against it.
    fn engine_seconds(&self, py: Python<'_>, query: &str, rays: &Rays) -> PyResult<f64> {
        let clock = py.import("time")?.getattr("thread_time")?;
        let arrays = rays.borrow(py)?;
        let view = arrays.view()?;
        let mut rays = Vec::with_capacity(view.count);
        view.interleave(0..view.count, &mut rays);
        let caster = BatchCaster::new(&self.tree, &self.geometry).with_threads(1);
        let (mut t, mut prim) = (vec![0.0; rays.len()], vec![0; rays.len()]);
        let mut all = AllHits::default();
        let block = if query == "closest_hit" { self.block_size() } else { BLOCK };
        // The second time counts: the first one touches the room.
        let mut seconds = 0.0;
        for _ in 0..2 {
            let start: f64 = clock.call0()?.extract()?;
            for (i, rays) in rays.chunks(block).enumerate() {
                let at = i * block..i * block + rays.len();
                if query == "closest_hit" {
                    caster.closest_hit_into(rays, &mut t[at.clone()], &mut prim[at]);
                } else {
                    caster.all_hits_into(rays, &mut all);
                }
            }
            seconds = clock.call0()?.extract::<f64>()? - start;
        }
        Ok(seconds)
    }
}

impl Core {
    fn of(
        py: Python<'_>,
        make: impl FnOnce(&Watch<'_>) -> Result<Parts, Failure> + Send,
        masks: Vec<u32>,
        plan: Plan,
        threads: usize,
        progress: Option<Py<PyAny>>,
        memory_limit: Option<u64>,
        one_mesh: bool,
    ) -> PyResult<Core> {
        let settings = plan.settings(threads);
        let (stop, done) = (AtomicBool::new(false), AtomicU64::new(0));
        let show = |py: Python<'_>| match &progress {
            Some(progress) => {
                progress.call1(py, (f64::from_bits(done.load(Ordering::Relaxed)),)).map(drop)
            }
            None => Ok(()),
        };
        let job = || {
            let watch = Watch { stop: &stop, done: &done };
            let (geometry, faces) = make(&watch)?;
            let table = faces.bytes() as u64;
            let memory_limit = left_for_build(memory_limit, table, geometry.len())?;
            let settings = BuildSettings { memory_limit, ..settings.clone() };
            let (tree, report) =
                WideTree::build(&geometry, &settings, &watch).map_err(Failure::Build)?;
            Ok((geometry, faces, tree, report))
        };
        let (geometry, faces, tree, report) = work::watch(py, threads, &stop, show, job)?
            .map_err(|failure: Failure| failure.into_exception(one_mesh))?;
        if let Some(progress) = &progress {
            progress.call1(py, (1.0,))?;
        }
        let report = Build { primitives: faces.len(), ..Build::from(&report) };
        Ok(Core { geometry, tree, report, faces, masks, preset: plan.preset })
    }

    /// The geometry.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// How what is hit is numbered.
    pub fn faces(&self) -> &Faces {
        &self.faces
    }

    /// The first `k` hits of each ray, each face once.
    fn first_of(
        &self,
        caster: BatchCaster<'_>,
        filter: Option<RayFilter<'_>>,
        rays: &[Ray],
        k: usize,
        all: &mut AllHits,
    ) {
        // Of twice as many hits no more than half are seconds of quads.
        let most = if self.faces.has_quads() { k.saturating_mul(2) } else { k };
        match filter {
            Some(filter) => caster.with_filter(filter).first_hits_into(rays, most, all),
            None => caster.first_hits_into(rays, most, all),
        }
        if self.faces.has_quads() {
            let AllHits { offsets, t, prim_id } = all;
            let found: Vec<u32> = prim_id.iter().map(|&prim| self.faces.of(prim)).collect();
            let left = once(
                offsets,
                k,
                |i| u64::from(found[i]),
                |to, from| {
                    (t[to], prim_id[to]) = (t[from], prim_id[from]);
                },
            );
            t.truncate(left);
            prim_id.truncate(left);
        }
    }

    /// The tree.
    pub fn tree(&self) -> &WideTree {
        &self.tree
    }

    /// The cells from which the rays of a range start, if any are given: one for all or one a ray.
    fn cells(&self, start: Option<&[i64]>, range: &Range<usize>) -> Vec<Option<Cell>> {
        let Some(start) = start else { return Vec::new() };
        self.tree.link_up();
        let of = |i: usize| start.get(if start.len() == 1 { 0 } else { i }).copied().and_then(cell);
        range.clone().map(of).collect()
    }

    /// Rays of a task that asks for first hits.
    fn block_size(&self) -> usize {
        if self.tree.bytes() >= LARGE_TREE { LARGE_BLOCK } else { BLOCK }
    }

    /// Interleaves some rays and has them traced, with a filter where one is needed.
    fn block<'a>(
        &'a self,
        view: &View<'a>,
        range: Range<usize>,
        trace: impl FnOnce(BatchCaster<'a>, Option<RayFilter<'a>>, &[Ray]),
    ) -> Invalid {
        thread_local! {
            static RAYS: RefCell<Vec<Ray>> = const { RefCell::new(Vec::new()) };
        }
        let masks = masks_that_refuse(&self.masks, view.masks, &range);
        let sides = (view.sides != Sides::Both).then_some(view);
        let is_plain = masks.is_none() && view.skip.is_none() && sides.is_none();
        let filter = (!is_plain).then_some(RayFilter {
            first: range.start,
            core: self,
            masks,
            skip: view.skip,
            sides: sides.copied(),
        });
        RAYS.with_borrow_mut(|rays| {
            let invalid = view.interleave(range, rays);
            let caster = BatchCaster::new(&self.tree, &self.geometry).with_threads(1);
            trace(caster, filter, rays);
            invalid
        })
    }
}

/// Masks of rays and meshes, a primitive a ray that does not count, and sides.
struct RayFilter<'a> {
    first: usize,
    core: &'a Core,
    masks: Option<&'a [u32]>,
    skip: Option<&'a [u32]>,
    /// The rays, where only one side of primitives is hit.
    sides: Option<View<'a>>,
}

impl HitFilter for RayFilter<'_> {
    #[inline]
    fn accepts(&self, ray: usize, hit: &Hit) -> bool {
        let ray = self.first + ray;
        let core = self.core;
        self.skip.is_none_or(|skip| one(skip, ray) != core.faces.of(hit.prim_id))
            && self.masks.is_none_or(|masks| {
                // An altered file may name primitives that are not there.
                let mesh = core.masks.get(core.faces.mesh(hit.prim_id));
                one(masks, ray) & mesh.copied().unwrap_or(!0) != 0
            })
            && self.sides.is_none_or(|view| {
                // The test of brute force, for one side: the same signs decide.
                let (origin, dir) = view.line(ray);
                let ray = PreparedRay::new(&Ray { origin, dir, t_min: hit.t, t_max: hit.t });
                let shape = core.geometry.shape(hit.prim_id);
                ray.is_some_and(|ray| shape.intersect(&ray, view.sides).is_some())
            })
    }
}

/// Figures of a build, those of its bytes left to the caller.
pub fn figures<'py>(
    py: Python<'py>,
    report: &Build,
    preset: Preset,
    meshes: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let (figures, stats) = (PyDict::new(py), &report.tree);
    figures.set_item("preset", preset.name())?;
    figures.set_item("cost_model", report.cost_model.map(CostChoice::name))?;
    figures.set_item("sample_rays", report.sample_rays)?;
    figures.set_item("meshes", meshes)?;
    figures.set_item("primitives", report.primitives)?;
    figures.set_item("degenerate", report.degenerate)?;
    figures.set_item("references", stats.references)?;
    figures.set_item("duplication", report.duplication)?;
    figures.set_item("inner_nodes", stats.inner_nodes)?;
    figures.set_item("leaves", stats.leaves)?;
    figures.set_item("empty_leaves", stats.empty_leaves)?;
    figures.set_item("max_depth", stats.max_depth)?;
    figures.set_item("predicted_steps", stats.predicted_inner_visits)?;
    figures.set_item("predicted_leaves", stats.predicted_leaf_visits)?;
    figures.set_item("predicted_tests", stats.predicted_intersection_tests)?;
    figures.set_item("leaf_sizes", stats.leaf_sizes.clone())?;
    figures.set_item("seconds", report.seconds)?;
    Ok(figures)
}

/// The masks of rays if any ray of the range may miss any mesh by them: filters cost coherent rays
/// their beams.
pub fn masks_that_refuse<'a>(
    meshes: &[u32],
    masks: Option<&'a [u32]>,
    range: &Range<usize>,
) -> Option<&'a [u32]> {
    let Some(masks) = masks else {
        return meshes.contains(&0).then_some(&[!0]);
    };
    let common = meshes.iter().fold(!0, |all, mask| all & mask);
    let asked = if masks.len() == 1 { masks } else { &masks[range.clone()] };
    asked.iter().any(|mask| mask & common == 0).then_some(masks)
}
