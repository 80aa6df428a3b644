//! Writers of meshes: positions and faces.

use super::Mesh;
use super::format::extension;
use std::io::{self, Write};
use std::path::Path;

/// A format that is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshOutput {
    /// Wavefront OBJ; numbers as short as they can be read back exactly.
    Obj,
    /// PLY, binary, little-endian; `float` where that is exact for all vertices, else `double`.
    Ply,
    /// STL, binary, in `f32`.
    Stl,
    /// Object File Format, ascii; numbers as for OBJ.
    Off,
    /// glTF 2.0, binary, in `f32`.
    Glb,
}

impl MeshOutput {
    /// The format that a file's name stands for.
    pub fn of_name(path: &Path) -> Option<MeshOutput> {
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz")) {
            return None;
        }
        Some(match extension(path)?.as_str() {
            "obj" => MeshOutput::Obj,
            "ply" => MeshOutput::Ply,
            "stl" => MeshOutput::Stl,
            "off" => MeshOutput::Off,
            "glb" => MeshOutput::Glb,
            _ => return None,
        })
    }

    /// True if positions are rounded to `f32`.
    pub fn rounds(self) -> bool {
        matches!(self, MeshOutput::Stl | MeshOutput::Glb)
    }
}

impl Mesh {
    /// True if every coordinate is an `f32`.
    pub fn is_single(&self) -> bool {
        self.vertices.iter().flatten().all(|&x| f64::from(x as f32) == x)
    }

    /// Writes positions and faces.
    ///
    /// # Errors
    /// Those of `out`, and [`io::ErrorKind::InvalidInput`] if the format cannot hold so much.
    pub fn write(&self, format: MeshOutput, out: &mut impl Write) -> io::Result<()> {
        match format {
            MeshOutput::Obj => self.write_obj(out),
            MeshOutput::Ply => self.write_ply(out),
            MeshOutput::Stl => self.write_stl(out),
            MeshOutput::Off => self.write_off(out),
            MeshOutput::Glb => self.write_glb(out),
        }
    }

    fn write_obj(&self, out: &mut impl Write) -> io::Result<()> {
        for [x, y, z] in &self.vertices {
            writeln!(out, "v {x} {y} {z}")?;
        }
        for [a, b, c] in self.faces.iter().map(|face| face.map(|i| u64::from(i) + 1)) {
            writeln!(out, "f {a} {b} {c}")?;
        }
        Ok(())
    }

    fn write_off(&self, out: &mut impl Write) -> io::Result<()> {
        writeln!(out, "OFF\n{} {} 0", self.vertices.len(), self.faces.len())?;
        for [x, y, z] in &self.vertices {
            writeln!(out, "{x} {y} {z}")?;
        }
        for [a, b, c] in &self.faces {
            writeln!(out, "3 {a} {b} {c}")?;
        }
        Ok(())
    }

    fn write_ply(&self, out: &mut impl Write) -> io::Result<()> {
        let is_single = self.is_single();
        let kind = if is_single { "float" } else { "double" };
        // Signed ones where they fit: some readers know no others.
        let index = if self.vertices.len() <= i32::MAX as usize { "int" } else { "uint" };
        write!(
            out,
            "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty {kind} x\nproperty {kind} y\n\
             property {kind} z\nelement face {}\nproperty list uchar {index} vertex_indices\nend_header\n",
            self.vertices.len(),
            self.faces.len()
        )?;
        for &x in self.vertices.as_flattened() {
            if is_single {
                out.write_all(&(x as f32).to_le_bytes())?;
            } else {
                out.write_all(&x.to_le_bytes())?;
            }
        }
        for face in &self.faces {
            out.write_all(&[3])?;
            face.iter().try_for_each(|i| out.write_all(&i.to_le_bytes()))?;
        }
        Ok(())
    }

    fn write_stl(&self, out: &mut impl Write) -> io::Result<()> {
        let count = u32::try_from(self.faces.len()).map_err(|_| too_much("STL"))?;
        let mut header = [b' '; 80];
        header[..8].copy_from_slice(b"ropewalk");
        out.write_all(&header)?;
        out.write_all(&count.to_le_bytes())?;
        for face in &self.faces {
            let corners = face.map(|i| self.vertices[i as usize]);
            let rows = [normal(corners)].into_iter().chain(corners);
            for x in rows.flatten() {
                out.write_all(&(x as f32).to_le_bytes())?;
            }
            out.write_all(&[0; 2])?;
        }
        Ok(())
    }

    fn write_glb(&self, out: &mut impl Write) -> io::Result<()> {
        let (points, indices) = (12 * self.vertices.len(), 12 * self.faces.len());
        let single = || self.vertices.iter().map(|p| p.map(|x| x as f32));
        let mut low = [f32::INFINITY; 3];
        let mut high = [f32::NEG_INFINITY; 3];
        for point in single() {
            (0..3).for_each(|a| low[a] = low[a].min(point[a]));
            (0..3).for_each(|a| high[a] = high[a].max(point[a]));
        }
        let mut json = serde_json::json!({
            "asset": {"version": "2.0", "generator": "ropewalk"},
            "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
            "accessors": [
                {"bufferView": 0, "componentType": 5126, "count": self.vertices.len(), "type": "VEC3", "min": low, "max": high},
                {"bufferView": 1, "componentType": 5125, "count": 3 * self.faces.len(), "type": "SCALAR"},
            ],
            "bufferViews": [
                {"buffer": 0, "byteLength": points, "target": 34962},
                {"buffer": 0, "byteOffset": points, "byteLength": indices, "target": 34963},
            ],
            "buffers": [{"byteLength": points + indices}],
        })
        .to_string();
        // Chunks begin at multiples of four bytes.
        json.extend(std::iter::repeat_n(' ', json.len().next_multiple_of(4) - json.len()));
        let total = 28 + json.len() + points + indices;
        let word = |x: usize| u32::try_from(x).map(u32::to_le_bytes).map_err(|_| too_much("GLB"));
        out.write_all(b"glTF\x02\0\0\0")?;
        out.write_all(&word(total)?)?;
        out.write_all(&word(json.len())?)?;
        out.write_all(b"JSON")?;
        out.write_all(json.as_bytes())?;
        out.write_all(&word(points + indices)?)?;
        out.write_all(b"BIN\0")?;
        for x in single().flatten() {
            out.write_all(&x.to_le_bytes())?;
        }
        for i in self.faces.as_flattened() {
            out.write_all(&i.to_le_bytes())?;
        }
        Ok(())
    }
}

fn too_much(format: &str) -> io::Error {
    let what = format!("the mesh is too large for {format}, which counts with 32 bits");
    io::Error::new(io::ErrorKind::InvalidInput, what)
}

/// The unit normal of a triangle, or zeros.
fn normal([a, b, c]: [[f64; 3]; 3]) -> [f64; 3] {
    let edge = |p: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| p[i] - a[i]) };
    let (e, f) = (edge(b), edge(c));
    let most = e.iter().chain(&f).fold(f64::MIN_POSITIVE, |most: f64, x| most.max(x.abs()));
    let (e, f) = (e.map(|x| x / most), f.map(|x| x / most));
    let n: [f64; 3] =
        std::array::from_fn(|i| e[(i + 1) % 3] * f[(i + 2) % 3] - e[(i + 2) % 3] * f[(i + 1) % 3]);
    let length = n.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length > 0.0 { n.map(|x| x / length) } else { [0.0; 3] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{MeshFormat, MeshLimits};

    const ALL: [(MeshOutput, MeshFormat); 5] = [
        (MeshOutput::Obj, MeshFormat::Obj),
        (MeshOutput::Ply, MeshFormat::Ply),
        (MeshOutput::Stl, MeshFormat::Stl),
        (MeshOutput::Off, MeshFormat::Off),
        (MeshOutput::Glb, MeshFormat::Gltf),
    ];

    #[test]
    fn what_is_written_is_read_back() {
        let corners = |mesh: &Mesh| -> Vec<[[f64; 3]; 3]> {
            mesh.faces.iter().map(|f| f.map(|i| mesh.vertices[i as usize])).collect()
        };
        for third in [0.25, 1.0 / 3.0, 1e-40, -0.0] {
            let vertices = vec![[0.0, third, 0.0], [1.0, 0.0, 5e8], [0.0, 1e30, -7.0], [2.0; 3]];
            let mesh = Mesh { vertices, faces: vec![[0, 1, 2], [3, 2, 1], [1, 1, 1]] };
            let rounded = mesh.vertices.iter().map(|p| p.map(|x| f64::from(x as f32))).collect();
            let rounded = Mesh { vertices: rounded, faces: mesh.faces.clone() };
            for (output, format) in ALL {
                let mut bytes = Vec::new();
                mesh.write(output, &mut bytes).unwrap();
                let read = Mesh::parse(format, &bytes, None, &MeshLimits::DEFAULT).unwrap();
                let expected = if output.rounds() { &rounded } else { &mesh };
                assert_eq!(corners(&read), corners(expected), "{output:?}");
                assert!(output == MeshOutput::Stl || read == *expected, "{output:?}");
                assert_eq!(
                    crate::mesh::recognise(Path::new("x"), &bytes, Some(bytes.len() as u64)),
                    crate::mesh::Recognised::Mesh(format),
                    "{output:?}"
                );
            }
        }
    }

    #[test]
    fn an_stl_file_has_unit_normals() {
        let vertices = vec![[0.0; 3], [1e-20, 0.0, 0.0], [0.0, 1e-20, 0.0]];
        let mut bytes = Vec::new();
        Mesh { vertices, faces: vec![[0, 1, 2]] }.write(MeshOutput::Stl, &mut bytes).unwrap();
        assert_eq!((bytes.len(), &bytes[92..96]), (134, &1f32.to_le_bytes()[..]));
    }
}
