//! A triangle mesh with a view, and its reader for PLY and GLB files, gzipped or plain.

use super::{glb, ply};
use crate::workload::{Surface, View, triangle_normal};
use flate2::read::GzDecoder;
use ropewalk::{Aabb, Ray};
use std::io::Read;
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

/// Vertices and faces as a file states them.
pub(super) type Parts = (Vec<[f32; 3]>, Vec<[u32; 3]>);

/// Why a mesh could not be read.
pub type MeshError = anyhow::Error;

const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];
const GLB_MAGIC: &[u8; 4] = b"glTF";

impl Mesh {
    /// Reads a PLY (ascii or binary little-endian) or GLB file; gzip is recognised by its magic.
    ///
    /// # Errors
    /// Says what was found where: I/O, an unknown format, a malformed file, an index out of range
    /// or a vertex that is not finite.
    pub fn read(name: &str, path: &Path) -> Result<Mesh, MeshError> {
        let bytes = std::fs::read(path)
            .map_err(|e| anyhow::anyhow!("{}: cannot be read: {e}", path.display()))?;
        Mesh::parse(name, &bytes).map_err(|e| anyhow::anyhow!("{}: {e}", path.display()))
    }

    /// As [`Mesh::read`], from memory.
    ///
    /// # Errors
    /// See [`Mesh::read`].
    pub fn parse(name: &str, bytes: &[u8]) -> Result<Mesh, MeshError> {
        let mut plain = Vec::new();
        let bytes = if bytes.starts_with(&GZIP_MAGIC) {
            GzDecoder::new(bytes).read_to_end(&mut plain)?;
            &plain[..]
        } else {
            bytes
        };
        let (vertices, faces) =
            if bytes.starts_with(GLB_MAGIC) { glb::parse(bytes)? } else { ply::parse(bytes)? };
        Mesh { name: name.to_owned(), vertices, faces }.checked()
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
    use flate2::{Compression, write::GzEncoder};
    use std::io::Write;

    const ASCII: &str = "ply\nformat ascii 1.0\ncomment x\nelement vertex 4\nproperty float x\n\
        property float y\nproperty float z\nproperty float confidence\nelement face 2\n\
        property list uchar int vertex_indices\nend_header\n0 0 0 1\n1 0 0 1\n1 1 0 1\n0 1 0.5 1\n\
        3 0 1 2\n4 0 1 2 3\n";

    #[test]
    fn ascii_ply_skips_other_properties_and_fans_polygons() {
        let m = Mesh::parse("a", ASCII.as_bytes()).unwrap();
        assert_eq!(m.vertices[3], [0.0, 1.0, 0.5]);
        assert_eq!(m.faces, [[0, 1, 2], [0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn binary_ply_equals_ascii_ply_and_gzip_changes_nothing() {
        let mut bytes = ASCII.split_inclusive("end_header\n").next().unwrap().to_owned();
        bytes = bytes.replace("ascii", "binary_little_endian");
        let mut bytes = bytes.into_bytes();
        for v in [[0f32, 0., 0., 1.], [1., 0., 0., 1.], [1., 1., 0., 1.], [0., 1., 0.5, 1.]] {
            bytes.extend(v.iter().flat_map(|x| x.to_le_bytes()));
        }
        for f in [&[0i32, 1, 2][..], &[0, 1, 2, 3]] {
            bytes.push(f.len() as u8);
            bytes.extend(f.iter().flat_map(|x| x.to_le_bytes()));
        }
        let ascii = Mesh::parse("a", ASCII.as_bytes()).unwrap();
        assert_eq!(Mesh::parse("a", &bytes).unwrap(), ascii);
        let mut gz = GzEncoder::new(Vec::new(), Compression::fast());
        gz.write_all(&bytes).unwrap();
        assert_eq!(Mesh::parse("a", &gz.finish().unwrap()).unwrap(), ascii);
        assert!(Mesh::parse("a", &bytes[..bytes.len() - 1]).is_err());
    }

    #[test]
    fn glb_reads_positions_and_indices() {
        let json = r#"{"accessors":[
            {"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},
            {"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}],
            "bufferViews":[{"byteLength":36},{"byteOffset":36,"byteLength":6}],
            "meshes":[{"primitives":[{"indices":1,"attributes":{"POSITION":0}}]}],
            "nodes":[{"mesh":0}]}"#;
        let mut bin: Vec<u8> =
            [0f32, 0., 0., 1., 0., 0., 0., 1., 0.].iter().flat_map(|x| x.to_le_bytes()).collect();
        bin.extend([0u16, 1, 2].iter().flat_map(|x| x.to_le_bytes()));
        let mut bytes = b"glTF".to_vec();
        bytes.extend(2u32.to_le_bytes());
        bytes.extend(((12 + 16 + json.len() + bin.len()) as u32).to_le_bytes());
        for (kind, chunk) in [(*b"JSON", json.as_bytes()), (*b"BIN\0", &bin)] {
            bytes.extend((chunk.len() as u32).to_le_bytes());
            bytes.extend(kind);
            bytes.extend(chunk);
        }
        let m = Mesh::parse("g", &bytes).unwrap();
        assert_eq!((m.vertices[1], &m.faces[..]), ([1.0, 0.0, 0.0], &[[0, 1, 2]][..]));
        assert!(Mesh::parse("g", &bytes[..bytes.len() - 1]).is_err());
    }

    #[test]
    fn unsound_meshes_are_refused() {
        for (from, to) in [("3 0 1 2", "3 0 1 9"), ("0 1 0.5", "0 nan 0.5"), ("ply\n", "plx\n")] {
            assert!(Mesh::parse("a", ASCII.replace(from, to).as_bytes()).is_err(), "{to}");
        }
    }
}
