//! Meshes as Python gives them, and the primitives that they are.

use crate::error::{self, Failure};
use crate::faces::{MeshFaces, Rows};
use numpy::PyReadonlyArray2;
use pyo3::prelude::*;
use ropewalk::primitive::{Cone, Sphere, Triangle};
use ropewalk::{Geometry, GeometryError, Sides};

/// A mesh as Python gives it.
#[derive(FromPyObject)]
pub enum Given<'py> {
    /// Vertices, and faces of three or four corners.
    Mesh(PyReadonlyArray2<'py, f32>, PyReadonlyArray2<'py, u32>),
    /// Rows of four numbers for spheres (centre, radius), of eight for cones (base, apex, their radii).
    Shapes(PyReadonlyArray2<'py, f32>),
}

/// A mesh.
pub enum Mesh<'a> {
    Faces(&'a [[f32; 3]], Rows<'a>),
    Spheres(&'a [[f32; 4]]),
    Cones(&'a [[f32; 8]]),
}

impl Given<'_> {
    /// The mesh.
    pub fn view(&self) -> PyResult<Mesh<'_>> {
        let bad = || error::argument("meshes", None, "arrays of a wrong shape".into());
        match self {
            Given::Mesh(vertices, faces) => {
                let width = faces.as_array().ncols();
                let faces = Rows::new(faces.as_slice()?, width).ok_or_else(bad)?;
                Ok(Mesh::Faces(vertices.as_slice()?.as_chunks::<3>().0, faces))
            }
            Given::Shapes(rows) => match rows.as_array().ncols() {
                4 => Ok(Mesh::Spheres(rows.as_slice()?.as_chunks::<4>().0)),
                8 => Ok(Mesh::Cones(rows.as_slice()?.as_chunks::<8>().0)),
                _ => Err(bad()),
            },
        }
    }
}

impl<'a> Mesh<'a> {
    /// Its faces.
    pub fn faces(&self) -> MeshFaces<'a> {
        match *self {
            Mesh::Faces(_, rows) => MeshFaces::Rows(rows),
            Mesh::Spheres(rows) => MeshFaces::Single(rows.len()),
            Mesh::Cones(rows) => MeshFaces::Single(rows.len()),
        }
    }
}

/// The primitives of some meshes.
pub fn geometry_of(meshes: &[Mesh<'_>]) -> Result<Geometry, Failure> {
    let mut geometry = Geometry::new();
    for (mesh, given) in meshes.iter().enumerate() {
        let refuse = |error| Failure::Mesh(mesh, error);
        match *given {
            Mesh::Faces(vertices, faces) => {
                if let Some(vertex) = vertices.iter().position(|p| p.iter().any(|x| !x.is_finite()))
                {
                    return Err(refuse(GeometryError::Vertex { vertex, found: vertices[vertex] }));
                }
                match faces.triangles_alone() {
                    Some(faces) if meshes.len() == 1 && !faces.is_empty() => {
                        geometry = Geometry::from_triangles(vertices, faces).map_err(refuse)?;
                    }
                    _ => push_faces(&mut geometry, vertices, faces).map_err(refuse)?,
                }
            }
            Mesh::Spheres(rows) => {
                for &[x, y, z, radius] in rows {
                    let sphere = Sphere { center: [x, y, z], radius };
                    geometry.push(sphere, Sides::Both).map_err(refuse)?;
                }
            }
            Mesh::Cones(rows) => {
                for &[a, b, c, x, y, z, base_radius, apex_radius] in rows {
                    let (base, apex) = ([a, b, c], [x, y, z]);
                    let cone = Cone { base, apex, base_radius, apex_radius };
                    geometry.push(cone, Sides::Both).map_err(refuse)?;
                }
            }
        }
    }
    Ok(geometry)
}

/// Adds the triangles of some faces.
fn push_faces(
    geometry: &mut Geometry,
    vertices: &[[f32; 3]],
    faces: Rows<'_>,
) -> Result<(), GeometryError> {
    for (face, corners) in faces.triangles() {
        if let Some(&found) = corners.iter().find(|&&i| i as usize >= vertices.len()) {
            return Err(GeometryError::Face { face, found, vertices: vertices.len() });
        }
        let vertices = corners.map(|i| vertices[i as usize]);
        geometry.push(Triangle { vertices }, Sides::Both)?;
    }
    Ok(())
}
