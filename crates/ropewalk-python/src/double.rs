//! Scenes in `f64`, of meshes or of instances, and the batch queries: what [`Core`](crate::core::Core) is in
//! `f32`.

use crate::error::{self, Failure};
use crate::faces::{Faces, MeshFaces, Part, once};
use crate::figures::Build;
use crate::plan::{Plan, Watch, left_for_build, plan_of};
use crate::rays::{Arrays, Invalid, View, one};
use crate::surface::{self, Asked, Looked, Surface, Values};
use crate::tasks::{block, blocks, checked, split, total, zeros};
use crate::work;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use ropewalk::Sides;
use ropewalk::build::{BuildSettings, CostChoice, Preset, RaySample};
use ropewalk::double::{
    DoubleAllHits, DoubleCaster, DoubleFilter, DoubleGeometry, DoubleHit, DoubleRay,
};
use ropewalk::instance::{
    Instance, InstanceAllHits, InstanceCaster, InstanceFilter, InstanceHit, InstancedScene, Object,
    Transform,
};
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Rays of a task: a megabyte.
const BLOCK: usize = 16_384;

/// A batch of rays in `f64`; see [`Arrays`].
#[pyclass(frozen, module = "ropewalk._ropewalk")]
pub struct DoubleRays(Arrays<f64>);

#[pymethods]
impl DoubleRays {
    /// Arrays must be contiguous: three numbers a ray in `origins` and `directions`, one in the others.
    #[new]
    #[pyo3(signature = (count, origins, directions, t_min, t_max, masks=None, skip=None, faces="both"))]
    fn new(
        py: Python<'_>,
        count: usize,
        origins: Py<PyArray1<f64>>,
        directions: Py<PyArray1<f64>>,
        t_min: Py<PyArray1<f64>>,
        t_max: Py<PyArray1<f64>>,
        masks: Option<Py<PyArray1<u32>>>,
        skip: Option<Py<PyArray1<i32>>>,
        faces: &str,
    ) -> PyResult<DoubleRays> {
        let (lines, ranges) = ([origins, directions], [t_min, t_max]);
        Ok(DoubleRays(Arrays::new(py, count, lines, ranges, masks, skip, faces)?))
    }

    /// Number of rays.
    fn __len__(&self) -> usize {
        self.0.count()
    }

    /// Index of the first ray that can hit nothing; see `DoubleRay::is_valid`.
    fn first_invalid(&self, py: Python<'_>) -> PyResult<Option<usize>> {
        let arrays = self.0.borrow(py)?;
        let view = arrays.view()?;
        Ok(py.detach(|| (0..view.count).find(|&i| !ray_of(&view, i).is_valid())))
    }

    /// How many rays hit nothing whatever the scene, their ranges aside, and the first of them.
    fn invalid(&self, py: Python<'_>) -> PyResult<(usize, usize)> {
        let arrays = self.0.borrow(py)?;
        let view = arrays.view()?;
        let invalid = py.detach(|| rays_of(&view, 0..view.count).1);
        Ok((invalid.count, invalid.first))
    }
}

/// A ray.
fn ray_of(view: &View<'_, f64>, i: usize) -> DoubleRay {
    let ((origin, dir), (t_min, t_max)) = (view.line(i), view.range(i));
    DoubleRay { origin, dir, t_min, t_max }
}

/// Some rays, and how many of them hit nothing whatever the scene, their ranges aside.
fn rays_of(view: &View<'_, f64>, range: Range<usize>) -> (Vec<DoubleRay>, Invalid) {
    let mut invalid = Invalid::default();
    let start = range.start;
    let rays: Vec<DoubleRay> = range.map(|i| ray_of(view, i)).collect();
    for (i, ray) in rays.iter().enumerate() {
        let has_range = !ray.t_min.is_nan() && !ray.t_max.is_nan();
        let whole = DoubleRay::new(ray.origin, ray.dir);
        if !has_range || !whole.is_valid() {
            invalid = invalid.and(Invalid { count: 1, first: start + i });
        }
    }
    (rays, invalid)
}

/// What rays are cast at.
enum Held {
    /// Meshes and the tree over them.
    Meshes(Arc<Object>, Build),
    /// Objects in their places, which are numbered as meshes are, with the faces of each where any has quads.
    Instances(Box<InstancedScene>, Vec<Arc<Faces>>),
}

/// Meshes or instances in `f64` and the trees over them. It never changes.
#[pyclass(frozen, module = "ropewalk._ropewalk")]
pub struct DoubleCore {
    held: Held,
    /// Those of all meshes, or of all instances.
    faces: Arc<Faces>,
    /// Masks of the meshes.
    masks: Vec<u32>,
    preset: Preset,
}

/// Parameters, primitives and meshes of hits, how many rays were invalid and which was the first.
type Answer<'py> =
    (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<i32>>, Bound<'py, PyArray1<i32>>, usize, usize);

/// Parameters and primitives of a block.
type TAndPrim<'a> = (&'a mut [f64], &'a mut [i32]);

/// Vertices and faces.
type Mesh<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<u32>>);

/// The same in rows that begin at the first array's entries.
type Lists<'py> = (
    Bound<'py, PyArray1<i64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<i32>>,
    Bound<'py, PyArray1<i32>>,
    usize,
    usize,
);

#[pymethods]
impl DoubleCore {
    /// Builds a tree over the vertices and faces of all meshes one after another; `starts` are the first
    /// face of each mesh and the number of faces.
    #[staticmethod]
    #[pyo3(signature = (vertices, faces, starts, masks, plan, threads, progress=None, memory_limit=None, rays=None))]
    fn build(
        py: Python<'_>,
        vertices: PyReadonlyArray2<'_, f64>,
        faces: PyReadonlyArray2<'_, u32>,
        starts: Vec<u32>,
        masks: Vec<u32>,
        plan: (String, String),
        threads: usize,
        progress: Option<Py<PyAny>>,
        memory_limit: Option<u64>,
        rays: Option<&DoubleRays>,
    ) -> PyResult<DoubleCore> {
        let plan = Plan::new(&plan)?;
        let arrays = rays.map(|rays| rays.0.borrow(py)).transpose()?;
        let view = arrays.as_ref().map(|arrays| arrays.view()).transpose()?;
        let bad = || error::argument("starts", None, "they do not fit the faces".into());
        let width = faces.as_array().ncols();
        let rows = crate::faces::Rows::new(faces.as_slice()?, width).ok_or_else(bad)?;
        let sound = starts.len() == masks.len() + 1
            && starts.is_sorted()
            && starts.first() == Some(&0)
            && starts.last().is_some_and(|&n| n as usize == rows.len());
        if !sound {
            return Err(bad());
        }
        let (vertices, _) = vertices.as_slice()?.as_chunks::<3>();
        let faces = Faces::of_meshes(&[MeshFaces::Rows(rows)]).with_starts(starts);
        let (settings, preset) = (plan.settings(threads), plan.preset);
        let (stop, done) = (AtomicBool::new(false), AtomicU64::new(0));
        let show = |py: Python<'_>| match &progress {
            Some(progress) => {
                progress.call1(py, (f64::from_bits(done.load(Ordering::Relaxed)),)).map(drop)
            }
            None => Ok(()),
        };
        let job = || {
            // The scene keeps vertices and faces; the build works on triangles of its own.
            let count = rows.triangle_count();
            let kept = size_of_val(vertices) + count * size_of::<[u32; 3]>() + faces.bytes();
            let memory_limit = left_for_build(memory_limit, kept as u64, count)?;
            let settings = BuildSettings { memory_limit, ..settings.clone() };
            let triangles = match rows.triangles_alone() {
                Some(triangles) => triangles.to_vec(),
                None => {
                    let mut cut = Vec::with_capacity(count);
                    cut.extend(rows.triangles().map(|(_, corners)| corners));
                    cut
                }
            };
            let geometry = DoubleGeometry::from_triangles(vertices.to_vec(), triangles)
                .map_err(Failure::Double)?;
            let rays = view.map_or_else(RaySample::default, |view| {
                geometry.ray_sample(&rays_of(&view, 0..view.count).0)
            });
            let settings = BuildSettings { rays, ..settings };
            let watch = Watch { stop: &stop, done: &done };
            Object::build(geometry, &settings, &watch).map_err(Failure::Build)
        };
        let (object, report) = work::watch(py, threads, &stop, show, job)?
            .map_err(|failure: Failure| failure.into_exception(true))?;
        if let Some(progress) = &progress {
            progress.call1(py, (1.0,))?;
        }
        let report = Build { primitives: faces.len(), ..Build::from(&report) };
        Ok(DoubleCore::of(object, report, (faces, masks), preset))
    }

    /// Places objects made by [`DoubleCore::build`]: twelve numbers an instance are the rows of its matrix.
    #[staticmethod]
    fn place(
        py: Python<'_>,
        objects: Vec<PyRef<'_, DoubleCore>>,
        matrices: PyReadonlyArray1<'_, f64>,
        masks: Vec<u32>,
        threads: usize,
    ) -> PyResult<DoubleCore> {
        let (rows, _) = matrices.as_slice()?.as_chunks::<12>();
        if rows.len() != objects.len() || masks.len() != objects.len() {
            return Err(error::argument("instances", None, "arrays differ in length".into()));
        }
        let mut instances = Vec::with_capacity(objects.len());
        let (mut starts, mut next, mut triangles) = (vec![0], 0u64, 0u64);
        for (i, (core, m)) in objects.iter().zip(rows).enumerate() {
            let refuse = |message: String| {
                error::argument("instances", Some(i), format!("instances[{i}]: {message}"))
            };
            let Held::Meshes(object, _) = &core.held else {
                return Err(refuse("expected a scene of meshes, found instances".into()));
            };
            let row = |r: usize| [m[4 * r], m[4 * r + 1], m[4 * r + 2], m[4 * r + 3]];
            let transform = Transform::new([row(0), row(1), row(2)])
                .map_err(|error| refuse(format!("matrix: {error}")))?;
            next += core.faces.len() as u64;
            triangles += object.geometry.len() as u64;
            if triangles > i32::MAX as u64 {
                return Err(refuse("more than 2^31 - 1 primitives, all instances counted".into()));
            }
            starts.push(next as u32);
            instances.push(Instance { object: object.clone(), transform });
        }
        let mut of: Vec<Arc<Faces>> = objects.iter().map(|core| core.faces.clone()).collect();
        if !of.iter().any(|faces| faces.has_quads()) {
            of.clear();
        }
        drop(objects);
        let stop = AtomicBool::new(false);
        let job = || InstancedScene::new(instances, usize::from(threads == 1));
        let scene = work::watch(py, threads, &stop, |_| Ok(()), job)?
            .map_err(|error| error::argument("instances", None, error.to_string()))?;
        Ok(DoubleCore {
            held: Held::Instances(Box::new(scene), of),
            faces: Arc::new(Faces::new(starts)),
            masks,
            preset: Preset::Balanced,
        })
    }

    /// Vertices and faces, of four corners if any are quads, from which [`DoubleCore::build`] makes the same again.
    fn meshes<'py>(&self, py: Python<'py>) -> PyResult<Mesh<'py>> {
        let Held::Meshes(object, _) = &self.held else {
            return Err(error::other("instances have no mesh of their own".into()));
        };
        let (vertices, triangles) = (object.geometry.vertices(), object.geometry.faces());
        let vertices = PyArray1::from_slice(py, vertices.as_flattened());
        let vertices = vertices.reshape([vertices.len()? / 3, 3])?;
        if !self.faces.has_quads() {
            let faces = PyArray1::from_slice(py, triangles.as_flattened());
            return Ok((vertices, faces.reshape([triangles.len(), 3])?));
        }
        let mut rows: Vec<[u32; 4]> = Vec::with_capacity(self.faces.len());
        for (prim, &[a, b, c]) in triangles.iter().enumerate() {
            match (self.faces.part(prim as u32), rows.last_mut()) {
                (Part::Second, Some(row)) => row[3] = c,
                _ => rows.push([a, b, c, c]),
            }
        }
        let faces = PyArray1::from_slice(py, rows.as_flattened());
        Ok((vertices, faces.reshape([rows.len(), 4])?))
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

    /// True if anything but triangles is in the scene.
    #[getter]
    fn has_shapes(&self) -> bool {
        false
    }

    /// Names of the preset and of the cost model.
    #[getter]
    fn plan(&self) -> (&'static str, &'static str) {
        match &self.held {
            Held::Meshes(_, report) => plan_of(self.preset, report),
            Held::Instances(..) => (self.preset.name(), CostChoice::default().name()),
        }
    }

    /// Lower and upper corner of the box of everything.
    #[getter]
    fn bounds(&self) -> Option<([f64; 3], [f64; 3])> {
        match &self.held {
            Held::Meshes(object, _) => object.geometry.bounds(),
            Held::Instances(scene, _) => scene.bounds(),
        }
    }

    /// Figures of the build and of the tree.
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let count = self.masks.len();
        match &self.held {
            Held::Meshes(object, report) => {
                let figures = crate::core::figures(py, report, self.preset, count)?;
                figures.set_item("tree_bytes", object.tree.bytes())?;
                let table = self.faces.bytes();
                figures.set_item("geometry_bytes", object.geometry.bytes() + table)?;
                Ok(figures)
            }
            Held::Instances(scene, _) => {
                let figures =
                    crate::core::figures(py, &Build::from(scene.report()), self.preset, count)?;
                let mut objects: Vec<&Arc<Object>> =
                    scene.instances().iter().map(|placed| &placed.object).collect();
                let flat = |object: &&Arc<Object>| object.geometry.degenerate_count();
                let degenerate: usize = objects.iter().map(flat).sum();
                objects.sort_by_key(|object| Arc::as_ptr(object));
                objects.dedup_by_key(|object| Arc::as_ptr(object));
                let tree: usize = objects.iter().map(|object| object.tree.bytes()).sum();
                let mesh: usize = objects.iter().map(|object| object.geometry.bytes()).sum();
                figures.set_item("primitives", self.faces.len())?;
                figures.set_item("degenerate", degenerate)?;
                figures.set_item("tree_bytes", tree + scene.bytes())?;
                figures.set_item("geometry_bytes", mesh)?;
                Ok(figures)
            }
        }
    }

    /// Parameter, primitive and mesh of the first hit of each ray; infinity, -1 and -1 for a miss. Cells to
    /// start from are of no use here.
    #[pyo3(signature = (rays, threads, _start=None))]
    fn closest_hit<'py>(
        &self,
        py: Python<'py>,
        rays: &DoubleRays,
        threads: usize,
        _start: Option<PyReadonlyArray1<'_, i64>>,
    ) -> PyResult<Answer<'py>> {
        let arrays = rays.0.borrow(py)?;
        let view = arrays.view()?;
        let n = view.count;
        let (mut t, mut prim, mut geom) = (zeros::<f64>(n)?, zeros::<i32>(n)?, zeros::<i32>(n)?);
        let block = block(n, threads, BLOCK);
        let chunks = t.chunks_mut(block).zip(prim.chunks_mut(block)).zip(geom.chunks_mut(block));
        let tasks = blocks(n, block).zip(chunks).collect();
        let trace = |(range, ((t, prim), geom)): (Range<usize>, (TAndPrim<'_>, _))| {
            let prim: &mut [u32] = bytemuck::cast_slice_mut(prim);
            let (rays, invalid) = rays_of(&view, range.clone());
            match (&self.held, self.filter(&view, &range)) {
                (Held::Meshes(object, _), filter) => {
                    match filter {
                        Some(f) => cast(object).with_filter(f).closest_hit_into(&rays, t, prim),
                        None => cast(object).closest_hit_into(&rays, t, prim),
                    }
                    self.faces.number(prim, geom);
                }
                (Held::Instances(scene, of), filter) => {
                    let geom: &mut [u32] = bytemuck::cast_slice_mut(geom);
                    match filter {
                        Some(f) => {
                            place(scene).with_filter(f).closest_hit_into(&rays, t, geom, prim)
                        }
                        None => place(scene).closest_hit_into(&rays, t, geom, prim),
                    }
                    faces_within(of, geom, prim);
                }
            }
            invalid
        };
        let invalid = total(work::for_each(py, threads, tasks, trace)?);
        let (t, prim, geom) = (t.into_pyarray(py), prim.into_pyarray(py), geom.into_pyarray(py));
        Ok((t, prim, geom, invalid.count, invalid.first))
    }

    /// Whether each ray hits anything; see [`DoubleCore::closest_hit`].
    #[pyo3(signature = (rays, threads, _start=None))]
    fn occluded<'py>(
        &self,
        py: Python<'py>,
        rays: &DoubleRays,
        threads: usize,
        _start: Option<PyReadonlyArray1<'_, i64>>,
    ) -> PyResult<(Bound<'py, PyArray1<bool>>, usize, usize)> {
        let arrays = rays.0.borrow(py)?;
        let view = arrays.view()?;
        let mut hit = vec![false; checked::<bool>(view.count)?];
        let block = block(view.count, threads, BLOCK);
        let tasks = blocks(view.count, block).zip(hit.chunks_mut(block)).collect();
        let trace = |(range, hit): (Range<usize>, &mut [bool])| {
            let (rays, invalid) = rays_of(&view, range.clone());
            match (&self.held, self.filter(&view, &range)) {
                (Held::Meshes(object, _), Some(f)) => {
                    cast(object).with_filter(f).occluded_into(&rays, hit);
                }
                (Held::Meshes(object, _), None) => cast(object).occluded_into(&rays, hit),
                (Held::Instances(scene, _), Some(f)) => {
                    place(scene).with_filter(f).occluded_into(&rays, hit);
                }
                (Held::Instances(scene, _), None) => place(scene).occluded_into(&rays, hit),
            }
            invalid
        };
        let invalid = total(work::for_each(py, threads, tasks, trace)?);
        Ok((hit.into_pyarray(py), invalid.count, invalid.first))
    }

    /// The number of faces that each ray hits.
    fn count_hits<'py>(
        &self,
        py: Python<'py>,
        rays: &DoubleRays,
        threads: usize,
    ) -> PyResult<(Bound<'py, PyArray1<i32>>, usize, usize)> {
        let arrays = rays.0.borrow(py)?;
        let view = arrays.view()?;
        let mut counts = zeros::<i32>(view.count)?;
        let block = block(view.count, threads, BLOCK);
        let tasks = blocks(view.count, block).zip(counts.chunks_mut(block)).collect();
        let trace = |(range, counts): (Range<usize>, &mut [i32])| {
            let (rays, invalid) = rays_of(&view, range.clone());
            if self.has_quads() {
                let all = self.first_of(&view, &range, &rays, usize::MAX);
                for (count, row) in counts.iter_mut().zip(all.offsets.windows(2)) {
                    *count = (row[1] - row[0]) as i32;
                }
                return invalid;
            }
            let found = match (&self.held, self.filter(&view, &range)) {
                (Held::Meshes(object, _), Some(f)) => cast(object).with_filter(f).count_hits(&rays),
                (Held::Meshes(object, _), None) => cast(object).count_hits(&rays),
                (Held::Instances(scene, _), Some(f)) => {
                    place(scene).with_filter(f).count_hits(&rays)
                }
                (Held::Instances(scene, _), None) => place(scene).count_hits(&rays),
            };
            counts.copy_from_slice(bytemuck::cast_slice(&found));
            invalid
        };
        let invalid = total(work::for_each(py, threads, tasks, trace)?);
        Ok((counts.into_pyarray(py), invalid.count, invalid.first))
    }

    /// The first `k` hits of each ray in order, or all of them.
    #[pyo3(signature = (rays, threads, k=None))]
    fn first_hits<'py>(
        &self,
        py: Python<'py>,
        rays: &DoubleRays,
        threads: usize,
        k: Option<usize>,
    ) -> PyResult<Lists<'py>> {
        let arrays = rays.0.borrow(py)?;
        let view = arrays.view()?;
        let (n, k) = (view.count, k.unwrap_or(usize::MAX));
        let ranges = blocks(n, block(n, threads, BLOCK)).collect();
        let trace = |range: Range<usize>| {
            let (rays, invalid) = rays_of(&view, range.clone());
            (self.first_of(&view, &range, &rays, k), invalid)
        };
        let (parts, invalid): (Vec<InstanceAllHits>, Vec<Invalid>) =
            work::for_each(py, threads, ranges, trace)?.into_iter().unzip();
        let invalid = total(invalid);
        let found = parts.iter().map(|part| part.t.len()).sum();
        let mut offsets = zeros::<i64>(n + 1)?;
        let (mut t, mut prim, mut geom) =
            (zeros::<f64>(found)?, zeros::<i32>(found)?, zeros::<i32>(found)?);
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
            match &self.held {
                Held::Meshes(..) => self.faces.number(prim, geom),
                Held::Instances(_, of) => {
                    geom.copy_from_slice(bytemuck::cast_slice(&part.instance));
                    faces_within(of, &part.instance, prim);
                }
            }
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
        rays: &DoubleRays,
        t: PyReadonlyArray1<'py, f64>,
        prim: PyReadonlyArray1<'py, i32>,
        geom: PyReadonlyArray1<'py, i32>,
        threads: usize,
        ray: Option<PyReadonlyArray1<'py, i64>>,
    ) -> PyResult<(surface::Arrays<'py, f64>, usize)> {
        let arrays = rays.0.borrow(py)?;
        let view = arrays.view()?;
        let (t, prim, geom) = (t.as_slice()?, prim.as_slice()?, geom.as_slice()?);
        let ray = ray.as_ref().map(|ray| ray.as_slice()).transpose()?;
        let n = t.len();
        let rows = ray.map_or(view.count, <[i64]>::len);
        if prim.len() != n || geom.len() != n || rows != n {
            return Err(error::argument("hits", None, "arrays of hits differ in length".into()));
        }
        surface::gather(py, (n, threads, f64::NAN), &Asked::named(&what), |i, values| {
            let Some(face) = self.faces.face(prim[i], geom[i]) else { return Looked::Miss };
            let ray = ray.map_or(i, |ray| ray[i] as usize);
            let ray = (ray < view.count).then(|| ray_of(&view, ray).with_range(t[i], t[i]));
            let found = ray.is_some_and(|ray| self.look((face, geom[i], view.sides), &ray, values));
            if found { Looked::Found } else { Looked::Lost }
        })
    }
}

impl DoubleCore {
    /// The meshes and the tree over them; `None` of instances.
    pub fn object(&self) -> Option<&Arc<Object>> {
        match &self.held {
            Held::Meshes(object, _) => Some(object),
            Held::Instances(..) => None,
        }
    }

    /// The same, with figures of the build.
    pub fn built(&self) -> Option<(&Object, &Build)> {
        match &self.held {
            Held::Meshes(object, report) => Some((object, report)),
            Held::Instances(..) => None,
        }
    }

    /// Meshes that have been built, their faces and masks.
    pub fn of(
        object: Object,
        report: Build,
        (faces, masks): (Faces, Vec<u32>),
        preset: Preset,
    ) -> Self {
        let held = Held::Meshes(Arc::new(object), report);
        DoubleCore { held, faces: Arc::new(faces), masks, preset }
    }

    /// How what is hit is numbered.
    pub fn faces(&self) -> &Faces {
        &self.faces
    }

    /// True if any face, of meshes or of instances, is a quad.
    fn has_quads(&self) -> bool {
        self.faces.has_quads() || matches!(&self.held, Held::Instances(_, of) if !of.is_empty())
    }

    /// The first `k` hits of each ray, each face once.
    fn first_of(
        &self,
        view: &View<'_, f64>,
        range: &Range<usize>,
        rays: &[DoubleRay],
        k: usize,
    ) -> InstanceAllHits {
        // Of twice as many hits no more than half are seconds of quads.
        let most = if self.has_quads() { k.saturating_mul(2) } else { k };
        let mut all = match (&self.held, self.filter(view, range)) {
            (Held::Meshes(object, _), Some(f)) => {
                of_meshes(cast(object).with_filter(f).first_hits(rays, most))
            }
            (Held::Meshes(object, _), None) => of_meshes(cast(object).first_hits(rays, most)),
            (Held::Instances(scene, _), Some(f)) => {
                place(scene).with_filter(f).first_hits(rays, most)
            }
            (Held::Instances(scene, _), None) => place(scene).first_hits(rays, most),
        };
        if !self.has_quads() {
            return all;
        }
        let face = |i: usize| match &self.held {
            Held::Meshes(..) => u64::from(self.faces.of(all.prim_id[i])),
            Held::Instances(_, of) => {
                let instance = all.instance[i];
                u64::from(instance) << 32 | u64::from(of[instance as usize].of(all.prim_id[i]))
            }
        };
        let found: Vec<u64> = (0..all.prim_id.len()).map(face).collect();
        let InstanceAllHits { offsets, t, prim_id, instance } = &mut all;
        let left = once(
            offsets,
            k,
            |i| found[i],
            |to, from| {
                (t[to], prim_id[to]) = (t[from], prim_id[from]);
                if !instance.is_empty() {
                    instance[to] = instance[from];
                }
            },
        );
        t.truncate(left);
        prim_id.truncate(left);
        instance.truncate(left);
        all
    }

    /// Masks of the meshes.
    pub fn mesh_masks(&self) -> &[u32] {
        &self.masks
    }

    /// The preset.
    pub fn built_with(&self) -> Preset {
        self.preset
    }

    /// Writes what is asked about the hit of a ray whose range holds its parameter alone; false if the ray does
    /// not hit the face there on a side that counts.
    fn look(
        &self,
        (face, geom, sides): (u32, i32, Sides),
        ray: &DoubleRay,
        values: &mut Values<'_, '_, f64>,
    ) -> bool {
        let (object, transform, face, ray, faces) = match &self.held {
            Held::Meshes(object, _) => (object, None, face, *ray, Some(&*self.faces)),
            Held::Instances(scene, of) => {
                let geom = geom as usize;
                let placed = &scene.instances()[geom];
                let ray = placed.transform.ray_to_object(ray);
                let face = face - self.faces.starts()[geom];
                (&placed.object, Some(&placed.transform), face, ray, of.get(geom).map(|of| &**of))
            }
        };
        let prims = faces.map_or(face..face + 1, |faces| faces.primitives(face));
        // Both triangles of a quad may be hit there, one of them on the other side.
        let hit = prims
            .into_iter()
            .find_map(|prim| Some((prim, object.geometry.intersect_on(prim, &ray, sides)?)));
        let Some((prim, hit)) = hit else { return false };
        // What is hit is a triangle of the geometry.
        let (Some(corners), Some(normal)) =
            (object.geometry.triangle(prim), object.geometry.normal(prim))
        else {
            return false;
        };
        values.write(|surface| match surface {
            Surface::Coordinates => {
                let part = faces.map_or(Part::Whole, |faces| faces.part(prim));
                let [u, v] = part.coordinates([hit.u, hit.v]);
                [u, v, 0.0]
            }
            Surface::Normal => transform.map_or(normal, |transform| transform.normal(normal)),
            Surface::Position => {
                let [a, b, c] = corners;
                let p =
                    std::array::from_fn(|i| a[i] + hit.u * (b[i] - a[i]) + hit.v * (c[i] - a[i]));
                transform.map_or(p, |transform| transform.point(p))
            }
            Surface::Cross => {
                surface::cross(corners.map(|p| transform.map_or(p, |transform| transform.point(p))))
            }
        });
        true
    }

    /// A filter, where any ray of the range may have hits that do not count.
    fn filter<'a>(&'a self, view: &View<'a, f64>, range: &Range<usize>) -> Option<RayFilter<'a>> {
        let masks = crate::core::masks_that_refuse(&self.masks, view.masks, range);
        let is_plain = masks.is_none() && view.skip.is_none() && view.sides == Sides::Both;
        (!is_plain).then_some(RayFilter { first: range.start, core: self, masks, view: *view })
    }
}

/// Masks of rays and meshes, a primitive a ray that does not count, and sides.
struct RayFilter<'a> {
    first: usize,
    core: &'a DoubleCore,
    masks: Option<&'a [u32]>,
    view: View<'a, f64>,
}

impl RayFilter<'_> {
    fn accepts_mesh(&self, ray: usize, mesh: usize) -> bool {
        self.masks.is_none_or(|masks| one(masks, ray) & self.core.masks[mesh] != 0)
    }

    /// Whether the face, numbered through all meshes, is not the one that the ray ignores.
    fn counts(&self, ray: usize, face: u32) -> bool {
        self.view.skip.is_none_or(|skip| one(skip, ray) != face)
    }

    /// Whether the ray, moved into the space of the triangles, hits one on a side that counts.
    fn meets(
        &self,
        ray: usize,
        (prim, t): (u32, f64),
        geometry: &DoubleGeometry,
        place: impl Fn(&DoubleRay) -> DoubleRay,
    ) -> bool {
        let sides = self.view.sides;
        sides == Sides::Both || {
            let ray = place(&ray_of(&self.view, ray)).with_range(t, t);
            geometry.intersect_on(prim, &ray, sides).is_some()
        }
    }
}

impl DoubleFilter for RayFilter<'_> {
    fn accepts(&self, ray: usize, hit: &DoubleHit) -> bool {
        let ray = self.first + ray;
        let Held::Meshes(object, _) = &self.core.held else { return true };
        self.counts(ray, self.core.faces.of(hit.prim_id))
            && self.accepts_mesh(ray, self.core.faces.mesh(hit.prim_id))
            && self.meets(ray, (hit.prim_id, hit.t), &object.geometry, |ray| *ray)
    }
}

impl InstanceFilter for RayFilter<'_> {
    fn accepts(&self, ray: usize, hit: &InstanceHit) -> bool {
        let ray = self.first + ray;
        let Held::Instances(scene, of) = &self.core.held else { return true };
        let instance = hit.instance as usize;
        let placed = &scene.instances()[instance];
        let face = of.get(instance).map_or(hit.prim_id, |of| of.of(hit.prim_id));
        self.counts(ray, self.core.faces.starts()[instance] + face)
            && self.meets(ray, (hit.prim_id, hit.t), &placed.object.geometry, |ray| {
                placed.transform.ray_to_object(ray)
            })
    }

    fn visits(&self, ray: usize, instance: u32) -> bool {
        self.accepts_mesh(self.first + ray, instance as usize)
    }
}

fn of_meshes(DoubleAllHits { offsets, t, prim_id }: DoubleAllHits) -> InstanceAllHits {
    InstanceAllHits { offsets, t, prim_id, instance: Vec::new() }
}

/// Replaces triangles by faces within their instances; misses stay what they are.
fn faces_within(of: &[Arc<Faces>], instance: &[u32], prim: &mut [u32]) {
    if of.is_empty() {
        return;
    }
    for (prim, &instance) in prim.iter_mut().zip(instance) {
        if let Some(of) = of.get(instance as usize) {
            *prim = of.of(*prim);
        }
    }
}

fn cast(object: &Object) -> DoubleCaster<'_> {
    DoubleCaster::new(&object.tree, &object.geometry).with_threads(1)
}

fn place(scene: &InstancedScene) -> InstanceCaster<'_> {
    InstanceCaster::new(scene).with_threads(1)
}
