//! What is known of a hit beyond its parameter, worked out when it is asked for.

use crate::core::BLOCK;
use crate::faces::Part;
use crate::tasks::{block, blocks, split, zeros};
use crate::work;
use numpy::{Element, IntoPyArray, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use ropewalk::primitive::Primitive;
use ropewalk::ray::PreparedRay;
use ropewalk::{Geometry, Ray, Sides};

/// What can be asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Surface {
    /// Barycentric weights of vertices 1 and 2, on quads see [`Part::coordinates`]; 0 on what is neither.
    Coordinates,
    /// Unit normal, to the side from which vertices run counter-clockwise.
    Normal,
    /// The point; on triangles from their vertices, which is nearer to them than origin and direction
    /// lead.
    Position,
    /// Cross product of the edges 0-1 and 0-2 of a triangle; 0 on what is none.
    Cross,
}

impl Surface {
    /// By its name in Python.
    fn named(name: &str) -> Surface {
        match name {
            "uv" => Surface::Coordinates,
            "normal" => Surface::Normal,
            "cross" => Surface::Cross,
            _ => Surface::Position,
        }
    }

    /// Numbers a hit.
    fn width(self) -> usize {
        if self == Surface::Coordinates { 2 } else { 3 }
    }
}

/// What is asked about hits.
#[derive(Clone, Debug)]
pub struct Asked(Vec<Surface>);

impl Asked {
    /// By names in Python, in their order.
    pub fn named(names: &[String]) -> Asked {
        Asked(names.iter().map(|name| Surface::named(name)).collect())
    }
}

/// Values of one hit, one row each in the order in which they were asked for.
pub struct Values<'a, 'r, T> {
    asked: &'a Asked,
    rows: &'a mut [&'r mut [T]],
    at: usize,
}

impl<T: Copy> Values<'_, '_, T> {
    /// Writes what is asked; `value` returns it, two numbers in the first places or three.
    pub fn write(&mut self, mut value: impl FnMut(Surface) -> [T; 3]) {
        for (row, &surface) in self.rows.iter_mut().zip(&self.asked.0) {
            let width = surface.width();
            row[self.at * width..][..width].copy_from_slice(&value(surface)[..width]);
        }
    }
}

/// What became of a hit whose surface was asked about.
pub enum Looked {
    /// Its values are written.
    Found,
    /// It is a miss.
    Miss,
    /// The ray does not hit the primitive there on a side that counts.
    Lost,
}

/// Arrays of numbers, one for each thing that was asked.
pub type Arrays<'py, T> = Vec<Bound<'py, PyArray2<T>>>;

/// Arrays of what is asked about `n` hits, `nan` for misses, and how many of the hits are none; `look` writes the values
/// of one.
pub fn gather<'py, T: Element + Copy + bytemuck::Zeroable + Send>(
    py: Python<'py>,
    (n, threads, nan): (usize, usize, T),
    asked: &Asked,
    look: impl Fn(usize, &mut Values<'_, '_, T>) -> Looked + Sync,
) -> PyResult<(Arrays<'py, T>, usize)> {
    let block = block(n, threads, BLOCK);
    let mut arrays = Vec::with_capacity(asked.0.len());
    for surface in &asked.0 {
        arrays.push(zeros::<T>(n * surface.width())?);
    }
    let mut rest: Vec<&mut [T]> = arrays.iter_mut().map(|values| &mut values[..]).collect();
    let mut tasks = Vec::with_capacity(n.div_ceil(block.max(1)));
    for range in blocks(n, block) {
        let rows = rest.iter_mut().zip(&asked.0);
        let rows: Vec<_> = rows.map(|(row, s)| split(row, range.len() * s.width())).collect();
        tasks.push((range, rows));
    }
    let work = |(range, mut rows): (std::ops::Range<usize>, Vec<&mut [T]>)| {
        let mut lost = 0;
        for (at, i) in range.enumerate() {
            let mut values = Values { asked, rows: &mut rows, at };
            match look(i, &mut values) {
                Looked::Found => continue,
                Looked::Miss => {}
                Looked::Lost => lost += 1,
            }
            values.write(|_| [nan; 3]);
        }
        lost
    };
    let lost = work::for_each(py, threads, tasks, work)?.into_iter().sum();
    let arrays = arrays.into_iter().zip(&asked.0);
    let arrays =
        arrays.map(|(v, s)| v.into_pyarray(py).reshape([n, s.width()])).collect::<PyResult<_>>()?;
    Ok((arrays, lost))
}

/// Writes what is asked about the hit of a ray whose range holds its parameter alone; false
/// if the ray does not hit the primitive there on a side that counts.
pub fn look(
    geometry: &Geometry,
    ray: &Ray,
    (prim, part, sides): (u32, Part, Sides),
    values: &mut Values<'_, '_, f32>,
) -> bool {
    let Some(prepared) = PreparedRay::new(ray) else { return false };
    let Some(hit) = geometry.intersect(prim, &prepared) else { return false };
    // Both triangles of a quad may be hit there, one of them on the other side.
    if part != Part::Whole
        && sides != Sides::Both
        && geometry.shape(prim).intersect(&prepared, sides).is_none()
    {
        return false;
    }
    let rounded = |p: [f64; 3]| p.map(|x| x as f32);
    let corners = || geometry.triangle(prim).map(|t| t.vertices.map(|p| p.map(f64::from)));
    values.write(|surface| match surface {
        Surface::Coordinates => {
            let [u, v] = part.coordinates([hit.u, hit.v]);
            [u, v, 0.0]
        }
        Surface::Normal => rounded(geometry.normals(ray, &hit).geometric),
        Surface::Position => rounded(match corners() {
            Some([a, b, c]) => {
                let (u, v) = (f64::from(hit.u), f64::from(hit.v));
                std::array::from_fn(|i| a[i] + u * (b[i] - a[i]) + v * (c[i] - a[i]))
            }
            None => ray.at(hit.t),
        }),
        Surface::Cross => rounded(corners().map_or([0.0; 3], cross)),
    });
    true
}

/// Cross product of the edges 0-1 and 0-2.
pub fn cross([a, b, c]: [[f64; 3]; 3]) -> [f64; 3] {
    let edge = |p: [f64; 3]| [p[0] - a[0], p[1] - a[1], p[2] - a[2]];
    let (e, f) = (edge(b), edge(c));
    let cross = |i: usize, j: usize| e[i] * f[j] - e[j] * f[i];
    [cross(1, 2), cross(2, 0), cross(0, 1)]
}
