//! Meshes of a file, each once, and where they are placed.

use super::error::Result;
use super::{Mesh, MeshError, MeshFormat, MeshLimits, Watched};
use ropewalk::build::Monitor;
use std::path::Path;
use std::sync::Arc;

/// Three rows of an affine transform, the last column of which is the translation.
pub type Matrix = [[f64; 4]; 3];

/// Nothing moves.
pub const IDENTITY: Matrix = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

/// Meshes, each once and in its own space, and where they are placed: what a file of nodes says before their transforms are
/// worked into the vertices. [`PlacedMeshes::flatten`] does that.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlacedMeshes {
    /// Meshes in the order of their first placement. Each has faces.
    pub meshes: Vec<Mesh>,
    /// Placements in the order of the file; at least one a mesh.
    pub placements: Vec<Placement>,
}

/// A mesh in its place.
#[derive(Clone, Debug, PartialEq)]
pub struct Placement {
    /// Index into [`PlacedMeshes::meshes`].
    pub mesh: u32,
    /// From the space of the mesh to that of the file: three rows, the last column of which is the translation. It may have no
    /// inverse.
    pub transform: [[f64; 4]; 3],
    /// Name of the node, as the file states it; empty without one.
    pub name: Arc<str>,
    /// Index of the node in the file; none where there are no nodes.
    pub node: Option<u32>,
}

impl PlacedMeshes {
    /// Reads a mesh file as [`Mesh::read`] does, but keeps the nodes of glTF, EXT_mesh_gpu_instancing among them, as placements
    /// of meshes. Meshes without triangles are left out. Other formats hold one mesh, placed where it is.
    ///
    /// The limits of vertices and faces hold for the meshes, not for what their placements come to.
    ///
    /// # Errors
    /// Those of [`Mesh::read`].
    pub fn read(path: &Path, limits: &MeshLimits) -> Result<PlacedMeshes> {
        PlacedMeshes::read_monitored(path, limits, &())
    }

    /// The same, until the monitor cancels it.
    ///
    /// # Errors
    /// As [`PlacedMeshes::read`], and [`MeshErrorKind::Cancelled`](super::MeshErrorKind::Cancelled).
    pub fn read_monitored(
        path: &Path,
        limits: &MeshLimits,
        monitor: &dyn Monitor,
    ) -> std::result::Result<PlacedMeshes, MeshError> {
        let watched = Watched { limits, monitor };
        super::open(path, &watched, |format, input| {
            super::placed_input(format, input, path.parent(), &watched)
        })
    }

    /// The same from memory. `folder` is where buffers of glTF files lie; without it there are none.
    ///
    /// # Errors
    /// See [`PlacedMeshes::read`]; the file is called `input`.
    pub fn parse(
        format: MeshFormat,
        bytes: &[u8],
        folder: Option<&Path>,
        limits: &MeshLimits,
    ) -> Result<PlacedMeshes> {
        let watched = Watched { limits, monitor: &() };
        let input = super::Input::of_bytes(bytes, &watched)?;
        super::placed_input(format, input, folder, &watched)
    }

    /// One mesh in its place.
    pub(super) fn of_mesh(mesh: Mesh) -> PlacedMeshes {
        let placement = Placement { mesh: 0, transform: IDENTITY, name: Arc::from(""), node: None };
        PlacedMeshes { meshes: vec![mesh], placements: vec![placement] }
    }

    /// Faces of all placements together.
    pub fn faces(&self) -> usize {
        let faces = |placed: &Placement| self.meshes[placed.mesh as usize].faces.len();
        self.placements.iter().map(faces).fold(0, usize::saturating_add)
    }

    /// All meshes in their places as one: the mesh that [`Mesh::read`] has of the same file, bit for bit, except for vertices
    /// of meshes without triangles. Nothing is allocated before the limits have been looked at, of which those of vertices
    /// and faces count.
    ///
    /// # Errors
    /// [`FlattenError`] if the placements come to more than the limits, or to more vertices than a face can name.
    pub fn flatten(&self, limits: &MeshLimits) -> std::result::Result<Mesh, FlattenError> {
        let count = |of: fn(&Mesh) -> usize| {
            let all = self.placements.iter().map(|placed| of(&self.meshes[placed.mesh as usize]));
            all.fold(0, usize::saturating_add)
        };
        let refuse = |what, found: usize, limit: usize| FlattenError {
            what,
            found,
            limit,
            placements: self.placements.len(),
        };
        let (vertices, most) = (count(|mesh| mesh.vertices.len()), u32::MAX as usize);
        let (faces, limit) = (self.faces(), limits.vertices.min(most));
        if vertices > limit {
            return Err(refuse("vertices", vertices, limit));
        }
        if faces > limits.faces {
            return Err(refuse("triangles", faces, limits.faces));
        }
        let mut flat = Mesh::default();
        flat.vertices.reserve_exact(vertices);
        flat.faces.reserve_exact(faces);
        for Placement { mesh, transform, .. } in &self.placements {
            let mesh = &self.meshes[*mesh as usize];
            let first = flat.vertices.len() as u32;
            if *transform == IDENTITY {
                // What stays where it is keeps the signs of its zeros, which a sum of products would not.
                flat.vertices.extend(&mesh.vertices);
            } else {
                flat.vertices.extend(mesh.vertices.iter().map(|&vertex| moved(transform, vertex)));
            }
            let is_mirrored = is_mirrored(transform);
            flat.faces.extend(mesh.faces.iter().map(|face| {
                let [a, b, c] = face.map(|corner| first + corner);
                if is_mirrored { [a, c, b] } else { [a, b, c] }
            }));
        }
        Ok(flat)
    }
}

/// Why placements were not made one mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("expected {limit} {what} at most, found {found} in {placements} placements")]
pub struct FlattenError {
    /// `vertices` or `triangles`.
    pub what: &'static str,
    /// How many they come to.
    pub found: usize,
    /// How many there may be.
    pub limit: usize,
    /// How many placements there are.
    pub placements: usize,
}

/// A vertex in its place.
#[inline]
pub fn moved(matrix: &Matrix, point: [f64; 3]) -> [f64; 3] {
    matrix.map(|[x, y, z, t]| x * point[0] + y * point[1] + z * point[2] + t)
}

/// True of a transform that turns a mesh inside out, which its faces make up for (glTF 2.0, section 3.7.4).
pub fn is_mirrored(matrix: &Matrix) -> bool {
    let [a, b, c] = matrix;
    let determinant = a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
        + a[2] * (b[0] * c[1] - b[1] * c[0]);
    determinant < 0.0
}
