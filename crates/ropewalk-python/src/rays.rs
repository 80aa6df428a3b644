//! Rays as NumPy has them: arrays beside each other, interleaved block by block.

use crate::error;
use numpy::{Element, PyArray1, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use ropewalk::{Ray, Sides};
use std::ops::Range;

/// Rays in arrays of floats, with one entry a ray or with one for all of them.
pub struct Arrays<T> {
    count: usize,
    origins: Py<PyArray1<T>>,
    directions: Py<PyArray1<T>>,
    t_min: Py<PyArray1<T>>,
    t_max: Py<PyArray1<T>>,
    masks: Option<Py<PyArray1<u32>>>,
    skip: Option<Py<PyArray1<i32>>>,
    sides: Sides,
}

/// A batch of rays in `f32`.
#[pyclass(frozen, module = "ropewalk._ropewalk")]
pub struct Rays(Arrays<f32>);

#[pymethods]
impl Rays {
    /// Arrays must be contiguous: three numbers a ray in `origins` and `directions`, one in the others.
    #[new]
    #[pyo3(signature = (count, origins, directions, t_min, t_max, masks=None, skip=None, faces="both"))]
    fn new(
        py: Python<'_>,
        count: usize,
        origins: Py<PyArray1<f32>>,
        directions: Py<PyArray1<f32>>,
        t_min: Py<PyArray1<f32>>,
        t_max: Py<PyArray1<f32>>,
        masks: Option<Py<PyArray1<u32>>>,
        skip: Option<Py<PyArray1<i32>>>,
        faces: &str,
    ) -> PyResult<Rays> {
        let (lines, ranges) = ([origins, directions], [t_min, t_max]);
        Ok(Rays(Arrays::new(py, count, lines, ranges, masks, skip, faces)?))
    }

    /// Number of rays.
    fn __len__(&self) -> usize {
        self.0.count()
    }

    /// Index of the first ray that can hit nothing; see `Ray::is_valid`.
    fn first_invalid(&self, py: Python<'_>) -> PyResult<Option<usize>> {
        let arrays = self.0.borrow(py)?;
        let view = arrays.view()?;
        Ok(py.detach(|| (0..view.count).find(|&i| !view.ray(i).is_valid())))
    }

    /// How many rays hit nothing whatever the scene, their ranges aside, and the first of them.
    fn invalid(&self, py: Python<'_>) -> PyResult<(usize, usize)> {
        let arrays = self.0.borrow(py)?;
        let view = arrays.view()?;
        let invalid = py.detach(|| view.interleave(0..view.count, &mut Vec::new()));
        Ok((invalid.count, invalid.first))
    }
}

impl Rays {
    /// The arrays, readable until the borrow is dropped.
    pub fn borrow<'py>(&self, py: Python<'py>) -> PyResult<Borrowed<'py, f32>> {
        self.0.borrow(py)
    }
}

impl<T: Element + Copy> Arrays<T> {
    /// Arrays must be contiguous: three numbers a ray in `origins` and `directions`, one in the others.
    pub fn new(
        py: Python<'_>,
        count: usize,
        [origins, directions]: [Py<PyArray1<T>>; 2],
        [t_min, t_max]: [Py<PyArray1<T>>; 2],
        masks: Option<Py<PyArray1<u32>>>,
        skip: Option<Py<PyArray1<i32>>>,
        faces: &str,
    ) -> PyResult<Self> {
        let sides = sides(faces)?;
        let rays = Arrays { count, origins, directions, t_min, t_max, masks, skip, sides };
        let arrays = rays.borrow(py)?;
        let view = arrays.view()?;
        let fits = |len: usize, each: usize| {
            len == each || each.checked_mul(count).is_some_and(|needed| len == needed)
        };
        let fit = fits(view.origins.len(), 3)
            && fits(view.directions.len(), 3)
            && fits(view.t_min.len(), 1)
            && fits(view.t_max.len(), 1)
            && view.masks.is_none_or(|masks| fits(masks.len(), 1))
            && view.skip.is_none_or(|skip| fits(skip.len(), 1));
        if !fit {
            return Err(error::argument("rays", None, "arrays of rays differ in length".into()));
        }
        drop(arrays);
        Ok(rays)
    }

    /// Number of rays.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The arrays, readable until the borrow is dropped.
    pub fn borrow<'py>(&self, py: Python<'py>) -> PyResult<Borrowed<'py, T>> {
        Ok(Borrowed {
            count: self.count,
            sides: self.sides,
            origins: borrow(py, &self.origins)?,
            directions: borrow(py, &self.directions)?,
            t_min: borrow(py, &self.t_min)?,
            t_max: borrow(py, &self.t_max)?,
            masks: self.masks.as_ref().map(|masks| borrow(py, masks)).transpose()?,
            skip: self.skip.as_ref().map(|skip| borrow(py, skip)).transpose()?,
        })
    }
}

fn borrow<'py, T: Element>(
    py: Python<'py>,
    array: &Py<PyArray1<T>>,
) -> PyResult<PyReadonlyArray1<'py, T>> {
    Ok(array.bind(py).try_readonly()?)
}

/// Borrowed arrays.
pub struct Borrowed<'py, T: Element> {
    count: usize,
    sides: Sides,
    origins: PyReadonlyArray1<'py, T>,
    directions: PyReadonlyArray1<'py, T>,
    t_min: PyReadonlyArray1<'py, T>,
    t_max: PyReadonlyArray1<'py, T>,
    masks: Option<PyReadonlyArray1<'py, u32>>,
    skip: Option<PyReadonlyArray1<'py, i32>>,
}

impl<T: Element> Borrowed<'_, T> {
    /// Their numbers.
    pub fn view(&self) -> PyResult<View<'_, T>> {
        let masks = self.masks.as_ref().map(|masks| masks.as_slice()).transpose()?;
        let skip = self.skip.as_ref().map(|skip| skip.as_slice()).transpose()?;
        Ok(View {
            count: self.count,
            sides: self.sides,
            origins: self.origins.as_slice()?,
            directions: self.directions.as_slice()?,
            t_min: self.t_min.as_slice()?,
            t_max: self.t_max.as_slice()?,
            masks,
            skip: skip.map(bytemuck::cast_slice),
        })
    }
}

/// The numbers of some rays.
#[derive(Clone, Copy)]
pub struct View<'a, T = f32> {
    /// How many rays.
    pub count: usize,
    /// The sides of primitives that are hit.
    pub sides: Sides,
    origins: &'a [T],
    directions: &'a [T],
    t_min: &'a [T],
    t_max: &'a [T],
    /// Masks of the rays.
    pub masks: Option<&'a [u32]>,
    /// Primitives to ignore, numbered through all meshes; `u32::MAX` is none.
    pub skip: Option<&'a [u32]>,
}

/// Rays of a batch that hit nothing whatever the scene, their ranges aside.
#[derive(Clone, Copy, Debug, Default)]
pub struct Invalid {
    /// How many.
    pub count: usize,
    /// The first of them.
    pub first: usize,
}

impl Invalid {
    /// Those of two batches, the first batch before the second.
    pub fn and(self, later: Invalid) -> Invalid {
        let first = if self.count > 0 { self.first } else { later.first };
        Invalid { count: self.count + later.count, first }
    }
}

impl<T: Copy> View<'_, T> {
    /// Origin and direction of a ray.
    #[inline(always)]
    pub fn line(&self, i: usize) -> ([T; 3], [T; 3]) {
        (three(self.origins, i), three(self.directions, i))
    }

    /// Smallest and largest parameter of a ray.
    #[inline(always)]
    pub fn range(&self, i: usize) -> (T, T) {
        (one(self.t_min, i), one(self.t_max, i))
    }
}

impl View<'_, f32> {
    #[inline(always)]
    fn ray(&self, i: usize) -> Ray {
        let ((origin, dir), (t_min, t_max)) = (self.line(i), self.range(i));
        Ray { origin, dir, t_min, t_max }
    }

    /// Writes some rays to `rays`.
    pub fn interleave(&self, range: Range<usize>, rays: &mut Vec<Ray>) -> Invalid {
        rays.clear();
        // One or one a ray is asked once, not for each ray: that took longer than all the rest.
        let (origins, one_origin) = lines(self.origins, &range);
        let (directions, one_direction) = lines(self.directions, &range);
        let fine = if self.t_min.len() == 1 && self.t_max.len() == 1 {
            let t = (self.t_min[0], self.t_max[0]);
            let ends = |_| t;
            match (one_origin, one_direction) {
                (false, false) => fill(rays, &range, |i| origins[i], |i| directions[i], ends),
                (true, false) => fill(rays, &range, |_| origins[0], |i| directions[i], ends),
                (false, true) => fill(rays, &range, |i| origins[i], |_| directions[0], ends),
                (true, true) => fill(rays, &range, |_| origins[0], |_| directions[0], ends),
            }
        } else {
            let origin = |i: usize| origins[if one_origin { 0 } else { i }];
            let direction = |i: usize| directions[if one_direction { 0 } else { i }];
            fill(rays, &range, origin, direction, |i| self.range(range.start + i))
        };
        if fine {
            return Invalid::default();
        }
        let wrong = |ray: &Ray| {
            let is_finite = ray.origin.iter().chain(&ray.dir).all(|x| x.is_finite());
            !is_finite || ray.dir == [0.0; 3] || ray.t_min.is_nan() || ray.t_max.is_nan()
        };
        let one = |i| Invalid { count: 1, first: range.start + i };
        let wrong = rays.iter().enumerate().filter(|(_, ray)| wrong(ray)).map(|(i, _)| one(i));
        wrong.fold(Invalid::default(), Invalid::and)
    }
}

/// The points of some rays and whether there is but one for all.
fn lines<'a>(values: &'a [f32], range: &Range<usize>) -> (&'a [[f32; 3]], bool) {
    let (points, _) = values.as_chunks::<3>();
    if points.len() == 1 { (points, true) } else { (&points[range.clone()], false) }
}

/// Writes rays whose parts are given by their number in the range; false if there may be one that is invalid.
#[inline(always)]
fn fill(
    rays: &mut Vec<Ray>,
    range: &Range<usize>,
    origin: impl Fn(usize) -> [f32; 3],
    direction: impl Fn(usize) -> [f32; 3],
    ends: impl Fn(usize) -> (f32, f32),
) -> bool {
    let mut fine = true;
    rays.extend((0..range.len()).map(|i| {
        // Numbers, not rows of them: these would be put together in memory and wait for it.
        let ([ox, oy, oz], [dx, dy, dz], (t_min, t_max)) = (origin(i), direction(i), ends(i));
        // 0 times infinity or NaN is NaN, and a sum of NaN is NaN.
        let sum = (ox * 0.0 + oy * 0.0 + oz * 0.0) + (dx * 0.0 + dy * 0.0 + dz * 0.0);
        fine &= (sum == 0.0) & ((dx != 0.0) | (dy != 0.0) | (dz != 0.0));
        fine &= !t_min.is_nan() & !t_max.is_nan();
        Ray { origin: [ox, oy, oz], dir: [dx, dy, dz], t_min, t_max }
    }));
    fine
}

/// The sides of a name.
pub fn sides(faces: &str) -> PyResult<Sides> {
    match faces {
        "both" => Ok(Sides::Both),
        "front" => Ok(Sides::Front),
        "back" => Ok(Sides::Back),
        _ => {
            let message = format!("faces is '{faces}'; expected both, front or back");
            Err(error::argument("faces", None, message))
        }
    }
}

/// Entry `i` of an array with one entry a ray, or with one for all.
#[inline(always)]
pub fn one<T: Copy>(values: &[T], i: usize) -> T {
    values[if values.len() == 1 { 0 } else { i }]
}

#[inline(always)]
fn three<T: Copy>(values: &[T], i: usize) -> [T; 3] {
    let at = if values.len() == 3 { 0 } else { 3 * i };
    [values[at], values[at + 1], values[at + 2]]
}
