//! Triangles in `f64`.

use super::narrow::{Frame, MARGIN, Narrowed};
use super::{DoubleHit, DoubleRay, Rows};
use crate::build::{BuildError, BuildReport, BuildSettings, Monitor, RaySample};
use crate::geometry::{Geometry, GeometryError};
use crate::point::expansion::Expansion;
use crate::primitive::{Sides, Triangle};
use crate::ray::Shear;
use crate::touch;
use crate::wide::WideTree;

/// Why a mesh was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DoubleGeometryError {
    /// A vertex is NaN, infinite or beyond [`DoubleGeometry::MAX_COORDINATE`].
    #[error("vertex {vertex} is ({}, {}, {}); every coordinate must be finite and at most 1e100 in size", .found[0], .found[1], .found[2])]
    Vertex {
        /// Index of the vertex.
        vertex: usize,
        /// Its value.
        found: [f64; 3],
    },
    /// A face names a vertex that does not exist, or the number of faces is wrong.
    #[error(transparent)]
    Mesh(#[from] GeometryError),
}

/// An indexed mesh in `f64`, face `i` as primitive `i`, hit on both sides.
#[derive(Clone)]
pub struct DoubleGeometry {
    vertices: Rows<[f64; 3]>,
    faces: Rows<[u32; 3]>,
    /// Faces without area, ascending.
    degenerate: Rows<u32>,
    frame: Frame,
    bounds: Option<([f64; 3], [f64; 3])>,
    /// What the kernels take for a geometry: they read triangles from the tree alone.
    none: Geometry,
}

/// A tree over a [`DoubleGeometry`].
#[derive(Debug)]
pub struct DoubleTree {
    wide: WideTree,
}

impl DoubleTree {
    pub(crate) fn of_file(wide: WideTree) -> Self {
        DoubleTree { wide }
    }

    /// The tree over the rounded triangles, in the numbers of the search.
    pub fn wide(&self) -> &WideTree {
        &self.wide
    }

    /// Bytes of the tree, its own copy of the triangles included.
    pub fn bytes(&self) -> usize {
        self.wide.bytes()
    }
}

impl DoubleGeometry {
    /// Coordinates larger than this are refused: their products would overflow.
    pub const MAX_COORDINATE: f64 = 1e100;

    /// The triangles of an indexed mesh. Vertices that no face names do not matter, but must be finite.
    ///
    /// # Errors
    /// [`DoubleGeometryError`] for a vertex that is not finite or too large, and if there is no face, a
    /// face names a vertex that does not exist or there are too many faces.
    pub fn from_triangles(
        vertices: Vec<[f64; 3]>,
        faces: Vec<[u32; 3]>,
    ) -> Result<Self, DoubleGeometryError> {
        let fits = |x: &f64| x.abs() <= Self::MAX_COORDINATE;
        if let Some(vertex) = vertices.iter().position(|p| !p.iter().all(fits)) {
            return Err(DoubleGeometryError::Vertex { vertex, found: vertices[vertex] });
        }
        if faces.is_empty() {
            return Err(GeometryError::EmptyMesh.into());
        }
        let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for (face, corners) in faces.iter().enumerate() {
            for &found in corners {
                let Some(p) = vertices.get(found as usize) else {
                    let vertices = vertices.len();
                    return Err(GeometryError::Face { face, found, vertices }.into());
                };
                for a in 0..3 {
                    (min[a], max[a]) = (min[a].min(p[a]), max[a].max(p[a]));
                }
            }
        }
        if faces.len() > Geometry::MAX_PRIMITIVES {
            return Err(GeometryError::TooMany { max: Geometry::MAX_PRIMITIVES }.into());
        }
        let (frame, bounds) = (Frame::new(min, max), Some((min, max)));
        let (vertices, faces) = (Rows::Own(vertices), Rows::Own(faces));
        let (degenerate, none) = (Rows::Own(Vec::new()), Geometry::new());
        let mut geometry = DoubleGeometry { vertices, faces, degenerate, frame, bounds, none };
        let flat = |&face: &u32| geometry.has_no_area(face);
        geometry.degenerate = Rows::Own((0..geometry.len() as u32).filter(flat).collect());
        Ok(geometry)
    }

    /// The geometry of a file, of finite bounds in order. Vertices, faces and degenerate faces may be any numbers:
    /// what names nothing is never hit.
    pub(crate) fn of_file(
        (vertices, faces): (Rows<[f64; 3]>, Rows<[u32; 3]>),
        degenerate: Rows<u32>,
        (min, max): ([f64; 3], [f64; 3]),
    ) -> Self {
        let (frame, bounds) = (Frame::new(min, max), Some((min, max)));
        DoubleGeometry { vertices, faces, degenerate, frame, bounds, none: Geometry::new() }
    }

    /// True if vertices and faces lie in a file.
    pub fn is_shared(&self) -> bool {
        matches!(self.faces, Rows::Stored(_))
    }

    /// Faces without area, ascending.
    pub fn degenerate(&self) -> &[u32] {
        &self.degenerate
    }

    /// Builds a tree; see [`WideTree::build`]. The report counts the triangles that are degenerate in
    /// `f64`.
    ///
    /// # Errors
    /// See [`build`](crate::build::build).
    pub fn build(
        &self,
        settings: &BuildSettings,
        monitor: &dyn Monitor,
    ) -> Result<(DoubleTree, BuildReport), BuildError> {
        let settings = BuildSettings { margin: MARGIN, ..settings.clone() };
        let left_out = |id, _: &Triangle| self.is_degenerate(id);
        let rounded = self.rounded();
        let (wide, report) = WideTree::build_without(&left_out, &rounded, &settings, monitor)?;
        Ok((DoubleTree { wide }, BuildReport { degenerate: self.degenerate_count(), ..report }))
    }

    /// A sample of rays for [`DoubleGeometry::build`], in the numbers of the search. Those that start or end
    /// beyond their reach are left out too.
    pub fn ray_sample(&self, rays: &[DoubleRay]) -> RaySample {
        let narrowed = rays.iter().filter_map(|ray| match self.frame.ray(ray) {
            Narrowed::Ray(ray, _) => Some(ray),
            Narrowed::Misses | Narrowed::Beyond => None,
        });
        RaySample::of(rays.len(), narrowed)
    }

    /// Number of triangles, degenerate ones included.
    pub fn len(&self) -> usize {
        self.faces.len()
    }

    /// True if there is no triangle.
    pub fn is_empty(&self) -> bool {
        self.faces.is_empty()
    }

    /// How many triangles have no area; they are kept and never hit.
    pub fn degenerate_count(&self) -> usize {
        self.degenerate.len()
    }

    /// Lower and upper corner of the box of all triangles.
    pub fn bounds(&self) -> Option<([f64; 3], [f64; 3])> {
        self.bounds
    }

    /// Bytes of the vertices and faces.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.vertices[..])
            + size_of_val(&self.faces[..])
            + size_of_val(&self.degenerate[..])
    }

    /// The vertices of a triangle; `None` if there is none of this number, as where an altered file names it or
    /// its vertices.
    #[inline(always)]
    pub fn triangle(&self, prim_id: u32) -> Option<[[f64; 3]; 3]> {
        let &[a, b, c] = self.faces.get(prim_id as usize)?;
        let vertex = |i: u32| self.vertices.get(i as usize).copied();
        Some([vertex(a)?, vertex(b)?, vertex(c)?])
    }

    /// The unit normal of a triangle, towards the side from which its vertices run counter-clockwise; NaN
    /// for a degenerate one, `None` as for [`DoubleGeometry::triangle`].
    pub fn normal(&self, prim_id: u32) -> Option<[f64; 3]> {
        let (_, n) = edges_and_normal(self.triangle(prim_id)?);
        let largest = size(n);
        let n = n.map(|x| x / largest);
        let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
        Some(n.map(|x| x / length))
    }

    /// Tests one triangle: [`Triangle::meet`] on the coordinates as they were given. The hit, if its
    /// parameter is finite and in the ray's range; what is no triangle is not hit.
    pub fn intersect(&self, prim_id: u32, ray: &DoubleRay) -> Option<DoubleHit> {
        self.intersect_on(prim_id, ray, Sides::Both)
    }

    /// The same on some sides alone.
    pub fn intersect_on(&self, prim_id: u32, ray: &DoubleRay, sides: Sides) -> Option<DoubleHit> {
        if !ray.is_valid() {
            return None;
        }
        // An altered file may name what is not there.
        let corners = self.triangle(prim_id)?;
        let corner = |i: usize, axis: usize| corners[i][axis];
        let frame = Shear::along(&ray.origin, &ray.dir);
        let met = Triangle::meet(corner, &frame, sides)?;
        let accepted = met.t.is_finite() && ray.t_min <= met.t && met.t <= ray.t_max;
        // Points on one line can enclose a ray only by rounding.
        (accepted && !self.is_degenerate(prim_id)).then_some(DoubleHit {
            t: met.t + 0.0,
            prim_id,
            u: met.u,
            v: met.v,
        })
    }

    /// Leaves out of all hits of a ray, or of those that a filter accepts, in order, the triangles beside its way where it meets an
    /// edge or a vertex: which do not count in lists (docs/numerics.md). True if there were any.
    pub fn leave_out(&self, ray: &DoubleRay, hits: &mut Vec<DoubleHit>) -> bool {
        let frame = Shear::along(&ray.origin, &ray.dir);
        let tie = |a: &DoubleHit, b: &DoubleHit| touch::double_tie(a.t, b.t);
        touch::leave_out(hits, &frame, tie, |hit| self.triangle(hit.prim_id))
    }

    /// The triangles of the search.
    fn rounded(&self) -> Geometry {
        let mut rounded = Geometry::new();
        for corners in self.faces.iter() {
            let vertices = corners.map(|i| self.frame.point(self.vertices[i as usize]));
            let id = rounded.push(Triangle { vertices }, Sides::Both);
            debug_assert!(id.is_ok(), "coordinates are finite, and their number has been checked");
        }
        rounded
    }

    /// A geometry without primitives.
    pub(crate) fn none(&self) -> &Geometry {
        &self.none
    }

    /// The vertices as given.
    pub fn vertices(&self) -> &[[f64; 3]] {
        &self.vertices
    }

    /// The numbers of each triangle's vertices.
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    #[inline(always)]
    pub(super) fn frame(&self) -> &Frame {
        &self.frame
    }

    /// A ray for the search.
    pub(crate) fn narrow(&self, ray: &DoubleRay) -> Narrowed {
        self.frame.ray(ray)
    }

    pub(super) fn is_degenerate(&self, prim_id: u32) -> bool {
        !self.degenerate.is_empty() && self.degenerate.binary_search(&prim_id).is_ok()
    }

    /// True if the vertices lie on one line exactly.
    fn has_no_area(&self, face: u32) -> bool {
        let Some(p) = self.triangle(face) else { return true };
        let ((e, f), n) = edges_and_normal(p);
        size(n) <= NORMAL_FILTER * size(e) * size(f)
            && [(1, 2), (2, 0), (0, 1)].into_iter().all(|(i, j)| is_flat(p, i, j))
    }
}

/// A normal below this share of the product of two edges may be rounding alone.
const NORMAL_FILTER: f64 = 1.0 / (1u64 << 48) as f64;

/// Two edges of a triangle and their cross product.
fn edges_and_normal([a, b, c]: [[f64; 3]; 3]) -> (([f64; 3], [f64; 3]), [f64; 3]) {
    let e: [f64; 3] = std::array::from_fn(|i| b[i] - a[i]);
    let f: [f64; 3] = std::array::from_fn(|i| c[i] - a[i]);
    let cross = |i: usize, j: usize| e[i] * f[j] - e[j] * f[i];
    ((e, f), [cross(1, 2), cross(2, 0), cross(0, 1)])
}

fn size(v: [f64; 3]) -> f64 {
    v.iter().fold(0.0f64, |m, x| m.max(x.abs()))
}

/// True if the projection on two axes has no area, decided without rounding.
fn is_flat(p: [[f64; 3]; 3], i: usize, j: usize) -> bool {
    let mut area = Expansion::<12>::new();
    for k in 0..3 {
        let (a, b) = (p[k], p[(k + 1) % 3]);
        area.add_product(a[i], b[j]);
        area.add_product(-a[j], b[i]);
    }
    area.sign() == 0
}
