//! A triangle mesh with a view.

use crate::workload::{Surface, View, triangle_normal};
use ropewalk::{Aabb, Ray};
use ropewalk_scene::MeshLimits;
use std::path::Path;

/// An indexed triangle mesh. Every face refers to existing vertices and every vertex is finite;
/// faces without area are kept.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Name for reports.
    pub name: String,
    /// Positions.
    pub vertices: Vec<[f32; 3]>,
    /// Three vertex indices a triangle.
    pub faces: Vec<[u32; 3]>,
}

/// A mesh and its view.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Geometry.
    pub mesh: Mesh,
    /// View.
    pub view: View,
}

/// Why a mesh could not be read.
pub type MeshError = anyhow::Error;

impl Mesh {
    /// Reads a mesh file of a format that its name tells; see [`ropewalk_scene::Mesh::read`].
    ///
    /// # Errors
    /// Says what was expected where, and what was found.
    pub fn read(name: &str, path: &Path) -> Result<Mesh, MeshError> {
        let read = ropewalk_scene::Mesh::read(path, &MeshLimits::DEFAULT)?;
        let vertices = read.vertices.into_iter().map(|v| v.map(|x| x as f32)).collect();
        Mesh { name: name.to_owned(), vertices, faces: read.faces }.checked()
    }

    /// The mesh itself, if its indices and vertices are sound.
    ///
    /// # Errors
    /// Names the first face or vertex that is not.
    pub fn checked(self) -> Result<Mesh, MeshError> {
        let n = self.vertices.len();
        if let Some(v) = self.vertices.iter().position(|v| v.iter().any(|x| !x.is_finite())) {
            anyhow::bail!("vertex {v} is not finite");
        }
        if let Some(f) = self.faces.iter().position(|f| f.iter().any(|&i| i as usize >= n)) {
            anyhow::bail!("face {f} refers to vertex {:?} of {n}", self.faces[f]);
        }
        if self.faces.is_empty() {
            anyhow::bail!("the mesh has no faces");
        }
        Ok(self)
    }

    /// The corners of a face.
    pub fn triangle(&self, face: u32) -> [[f32; 3]; 3] {
        self.faces[face as usize].map(|v| self.vertices[v as usize])
    }

    /// True if the surface has no rim: each edge has as many faces on its one side as on the other,
    /// vertices at the same place counted as one.
    pub fn is_closed(&self) -> bool {
        let mut places: Vec<[u32; 3]> = self.vertices.iter().map(place).collect();
        places.sort_unstable();
        places.dedup();
        let id = |v: u32| {
            let place = place(&self.vertices[v as usize]);
            places.partition_point(|p| *p < place) as u32
        };
        let mut edges = Vec::with_capacity(3 * self.faces.len());
        for face in &self.faces {
            let [a, b, c] = face.map(id);
            edges.extend(
                [(a, b), (b, c), (c, a)]
                    .into_iter()
                    .filter(|(from, to)| from != to)
                    .map(|(from, to)| if from < to { (from, to, 1i8) } else { (to, from, -1) }),
            );
        }
        edges.sort_unstable();
        edges
            .chunk_by(|x, y| (x.0, x.1) == (y.0, y.1))
            .all(|uses| uses.iter().map(|e| i64::from(e.2)).sum::<i64>() == 0)
    }

    /// The box of all vertices that a face uses.
    pub fn bounds(&self) -> Aabb {
        Aabb::from_points(self.faces.iter().flatten().map(|&v| self.vertices[v as usize]))
    }
}

impl Surface for Mesh {
    fn bounds(&self) -> Aabb {
        Mesh::bounds(self)
    }

    fn facing_normal(&self, prim: u32, ray: &Ray) -> Option<[f64; 3]> {
        triangle_normal(self.triangle(prim), ray)
    }
}

/// A position as something that can be sorted; -0 is 0.
fn place(vertex: &[f32; 3]) -> [u32; 3] {
    vertex.map(|x| (x + 0.0).to_bits())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unsound_meshes_are_refused() {
        let sound = Mesh {
            name: "a".into(),
            vertices: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            faces: vec![[0, 1, 2]],
        };
        assert!(sound.clone().checked().is_ok());
        assert!(Mesh { faces: vec![[0, 1, 3]], ..sound.clone() }.checked().is_err());
        assert!(Mesh { faces: vec![], ..sound.clone() }.checked().is_err());
        assert!(Mesh { vertices: vec![[f32::NAN; 3]; 3], ..sound }.checked().is_err());
    }
}
