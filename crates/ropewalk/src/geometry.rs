//! The set of primitives that a tree is built over.

mod stored;

pub(crate) use stored::{BACK, FRONT, StoredTriangles, TRIANGLE_BYTES};

use crate::aabb::Aabb;
use crate::kernel::prefetch_line;
use crate::primitive::{Crossing, Primitive, Shape, ShapeError, Sides, SurfaceNormals, Triangle};
use crate::ray::{Hit, PreparedRay, Ray, Shear};
use crate::touch;
use std::sync::Arc;

/// Why a primitive was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GeometryError {
    /// The box of a primitive is empty, NaN or overflows `f32`.
    #[error("primitive {index}: its {what} is not finite; it must fit into f32")]
    NotFinite {
        /// Index the primitive would have had.
        index: usize,
        /// Which value.
        what: &'static str,
    },
    /// A shape holds a bad value.
    #[error("primitive {index}: {error}")]
    Shape {
        /// Index the primitive would have had.
        index: usize,
        /// What is wrong with it.
        error: ShapeError,
    },
    /// A mesh vertex is NaN or infinite.
    #[error("vertex {vertex} is ({}, {}, {}); every coordinate must be a finite f32", .found[0], .found[1], .found[2])]
    Vertex {
        /// Index of the vertex.
        vertex: usize,
        /// Its value.
        found: [f32; 3],
    },
    /// A mesh face names a vertex that does not exist.
    #[error("face {face} names vertex {found}; there are {vertices} vertices, numbered from 0")]
    Face {
        /// Index of the face.
        face: usize,
        /// The index found.
        found: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// A mesh has no faces.
    #[error("the mesh has no faces; at least one is needed")]
    EmptyMesh,
    /// More primitives than ids.
    #[error("too many primitives: at most {max} are supported")]
    TooMany {
        /// The limit.
        max: usize,
    },
}

/// The primitives of a scene, numbered in the order of their insertion, each with the sides on
/// which it can be hit.
#[derive(Clone, Default)]
pub struct Geometry {
    shapes: Vec<Shape>,
    sides: Vec<Sides>,
    /// The triangles of a saved scene; then there is nothing in `shapes` and `sides`.
    stored: Option<Arc<StoredTriangles>>,
    bounds: Option<Aabb>,
    degenerate: usize,
    /// Primitives that are no triangles.
    others: usize,
}

impl Geometry {
    /// Largest number of primitives: ids and references are 30-bit.
    pub const MAX_PRIMITIVES: usize = (1 << 30) - 1;

    /// An empty geometry.
    pub fn new() -> Self {
        Self::default()
    }

    /// The triangles of an indexed mesh, face `i` as primitive `i`, hit on both sides.
    ///
    /// # Errors
    /// [`GeometryError`] if there is no face, a face names a vertex that does not exist, a vertex
    /// is not finite or there are too many faces.
    pub fn from_triangles(
        vertices: &[[f32; 3]],
        faces: &[[u32; 3]],
    ) -> Result<Geometry, GeometryError> {
        if faces.is_empty() {
            return Err(GeometryError::EmptyMesh);
        }
        if let Some(vertex) = vertices.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
            return Err(GeometryError::Vertex { vertex, found: vertices[vertex] });
        }
        let mut geometry = Geometry::new();
        geometry.shapes.reserve(faces.len());
        geometry.sides.reserve(faces.len());
        for (face, corners) in faces.iter().enumerate() {
            if let Some(&found) = corners.iter().find(|&&i| i as usize >= vertices.len()) {
                return Err(GeometryError::Face { face, found, vertices: vertices.len() });
            }
            let vertices = corners.map(|i| vertices[i as usize]);
            geometry.push(Triangle { vertices }, Sides::Both)?;
        }
        Ok(geometry)
    }

    /// Adds a primitive and returns its id.
    ///
    /// # Errors
    /// [`GeometryError`] if the shape holds a bad value, its box is not finite or there are too
    /// many primitives.
    pub fn push(&mut self, shape: impl Into<Shape>, sides: Sides) -> Result<u32, GeometryError> {
        if let Some(stored) = self.stored.take() {
            self.shapes = stored.shapes().to_vec();
            self.sides = (0..stored.len()).map(|i| stored.sides(i)).collect();
        }
        let (shape, index) = (shape.into(), self.shapes.len());
        if index >= Self::MAX_PRIMITIVES {
            return Err(GeometryError::TooMany { max: Self::MAX_PRIMITIVES });
        }
        shape.check().map_err(|error| GeometryError::Shape { index, error })?;
        let b = shape.bounds();
        if b.is_empty() || b.min.iter().chain(&b.max).any(|x| !x.is_finite()) {
            return Err(GeometryError::NotFinite { index, what: "bounding box" });
        }
        self.degenerate += usize::from(shape.is_degenerate());
        self.others += usize::from(!matches!(shape, Shape::Triangle(_)));
        self.bounds = Some(self.bounds.map_or(b, |s| s.union(&b)));
        self.shapes.push(shape);
        self.sides.push(sides);
        Ok(index as u32)
    }

    /// The triangles of a saved scene, which are used where they lie.
    pub(crate) fn of_stored(stored: StoredTriangles, bounds: Aabb, degenerate: usize) -> Geometry {
        let bounds = (stored.len() > 0).then_some(bounds);
        Geometry { stored: Some(Arc::new(stored)), bounds, degenerate, ..Geometry::new() }
    }

    /// True if the primitives lie in the file of a saved scene.
    pub fn is_shared(&self) -> bool {
        self.stored.is_some()
    }

    /// Bytes of the primitives, without what polygons and patches hold; those of a saved scene lie in its
    /// file.
    pub fn bytes(&self) -> usize {
        let own = size_of_val(&self.shapes[..]) + size_of_val(&self.sides[..]);
        self.stored.as_ref().map_or(own, |stored| stored.bytes())
    }

    /// Number of primitives, degenerate ones included.
    pub fn len(&self) -> usize {
        self.stored.as_ref().map_or(self.shapes.len(), |stored| stored.len())
    }

    /// True if there is no primitive.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// How many primitives have no area; they are kept and never hit.
    pub fn degenerate_count(&self) -> usize {
        self.degenerate
    }

    /// True if there is anything but triangles.
    pub fn has_shapes(&self) -> bool {
        self.others > 0
    }

    /// The box of everything; [`Aabb::EMPTY`] without primitives.
    pub fn bounds(&self) -> Aabb {
        self.bounds.unwrap_or(Aabb::EMPTY)
    }

    /// The shape of a primitive. If the primitives lie in a file, the first call makes shapes of all of
    /// them, some 50 bytes each; [`Geometry::triangle`] does not.
    ///
    /// # Panics
    /// If `prim_id` is out of range.
    pub fn shape(&self, prim_id: u32) -> &Shape {
        let stored = self.stored.as_ref();
        let shapes = stored.map_or(&self.shapes[..], |stored| stored.shapes());
        &shapes[prim_id as usize]
    }

    /// Asks memory for a primitive that is looked at soon; one that is not there does no harm.
    #[inline]
    pub fn prefetch(&self, prim_id: u32) {
        if self.stored.is_none() {
            let shape = self.shapes.as_ptr().wrapping_add(prim_id as usize).cast::<u8>();
            prefetch_line(shape);
            prefetch_line(shape.wrapping_add(size_of::<Shape>() - 1));
        }
    }

    /// The triangle of a primitive; `None` if it is of another kind or there is none of this number.
    #[inline]
    pub fn triangle(&self, prim_id: u32) -> Option<Triangle> {
        if let Some(stored) = &self.stored {
            return stored.triangle(prim_id as usize);
        }
        match self.shapes.get(prim_id as usize)? {
            Shape::Triangle(triangle) => Some(*triangle),
            _ => None,
        }
    }

    /// The sides on which a primitive can be hit.
    ///
    /// # Panics
    /// If `prim_id` is out of range.
    pub fn sides(&self, prim_id: u32) -> Sides {
        let i = prim_id as usize;
        self.stored.as_ref().map_or_else(|| self.sides[i], |stored| stored.sides(i))
    }

    /// Tests one primitive: the first crossing in the ray's range. `None` also if there is no primitive of
    /// this number: an altered file may name it.
    #[inline]
    pub fn intersect(&self, prim_id: u32, ray: &PreparedRay) -> Option<Hit> {
        let i = prim_id as usize;
        let crossing = if let Some(stored) = &self.stored {
            stored.triangle(i)?.intersect(ray, stored.sides(i))?
        } else {
            self.shapes.get(i)?.intersect(ray, self.sides[i])?
        };
        let Crossing { t, u, v } = crossing;
        Some(Hit { t, prim_id, u, v })
    }

    /// All hits of a ray in order, found by going through all primitives: the definition of what
    /// [`BatchCaster::all_hits`](crate::kernel::BatchCaster::all_hits) answers.
    pub fn all_hits(&self, ray: &Ray) -> Vec<Hit> {
        let Some(prepared) = PreparedRay::new(ray) else { return Vec::new() };
        let prims = 0..self.len() as u32;
        let mut hits: Vec<Hit> = prims.filter_map(|id| self.intersect(id, &prepared)).collect();
        hits.sort_by(|a, b| (a.t + 0.0).total_cmp(&(b.t + 0.0)).then(a.prim_id.cmp(&b.prim_id)));
        self.leave_out(ray, &mut hits);
        hits
    }

    /// Leaves out of all hits of a valid ray, or of those that a filter accepts, in order, the triangles beside its way where it meets
    /// an edge or a vertex: which do not count in lists (docs/numerics.md). True if there were any.
    pub fn leave_out(&self, ray: &Ray, hits: &mut Vec<Hit>) -> bool {
        let triangle =
            |hit: &Hit| Some(self.triangle(hit.prim_id)?.vertices.map(|p| p.map(f64::from)));
        touch::leave_out(hits, &Shear::new(ray), |a, b| touch::tie(a.t, b.t), triangle)
    }

    /// False if [`Geometry::leave_out`] would leave out none of the hits with these parameters and primitives.
    pub(crate) fn may_leave_out(&self, ray: &Ray, t: &[f32], prim_id: &[u32]) -> bool {
        let tie = |i: usize, j: usize| touch::tie(t[i], t[j]);
        if !(1..t.len()).any(|i| tie(i - 1, i)) {
            return false;
        }
        let triangle =
            |i: usize| Some(self.triangle(prim_id[i])?.vertices.map(|p| p.map(f64::from)));
        touch::concerns(t.len(), &Shear::new(ray), tie, triangle)
    }

    /// The normals at a hit of `ray`.
    ///
    /// # Panics
    /// If there is no primitive of this number.
    pub fn normals(&self, ray: &Ray, hit: &Hit) -> SurfaceNormals {
        let crossing = Crossing { t: hit.t, u: hit.u, v: hit.v };
        match self.triangle(hit.prim_id) {
            Some(triangle) => triangle.normals(ray.at(hit.t), crossing),
            None => self.shape(hit.prim_id).normals(ray.at(hit.t), crossing),
        }
    }
}
