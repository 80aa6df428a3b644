//! The set of primitives that a tree is built over.

use crate::aabb::Aabb;
use crate::primitive::{Crossing, Primitive, Shape, ShapeError, Sides, SurfaceNormals, Triangle};
use crate::ray::{Hit, PreparedRay, Ray};

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
    bounds: Option<Aabb>,
    degenerate: usize,
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
        self.bounds = Some(self.bounds.map_or(b, |s| s.union(&b)));
        self.shapes.push(shape);
        self.sides.push(sides);
        Ok(index as u32)
    }

    /// Number of primitives, degenerate ones included.
    pub fn len(&self) -> usize {
        self.shapes.len()
    }

    /// True if there is no primitive.
    pub fn is_empty(&self) -> bool {
        self.shapes.is_empty()
    }

    /// How many primitives have no area; they are kept and never hit.
    pub fn degenerate_count(&self) -> usize {
        self.degenerate
    }

    /// The box of everything; [`Aabb::EMPTY`] without primitives.
    pub fn bounds(&self) -> Aabb {
        self.bounds.unwrap_or(Aabb::EMPTY)
    }

    /// The shape of a primitive.
    ///
    /// # Panics
    /// If `prim_id` is out of range.
    pub fn shape(&self, prim_id: u32) -> &Shape {
        &self.shapes[prim_id as usize]
    }

    /// The sides on which a primitive can be hit.
    pub fn sides(&self, prim_id: u32) -> Sides {
        self.sides[prim_id as usize]
    }

    /// Tests one primitive: the first crossing in the ray's range.
    #[inline]
    pub fn intersect(&self, prim_id: u32, ray: &PreparedRay) -> Option<Hit> {
        let i = prim_id as usize;
        let Crossing { t, u, v } = self.shapes[i].intersect(ray, self.sides[i])?;
        Some(Hit { t, prim_id, u, v })
    }

    /// The normals at a hit of `ray`.
    pub fn normals(&self, ray: &Ray, hit: &Hit) -> SurfaceNormals {
        let crossing = Crossing { t: hit.t, u: hit.u, v: hit.v };
        self.shape(hit.prim_id).normals(ray.at(hit.t), crossing)
    }
}
