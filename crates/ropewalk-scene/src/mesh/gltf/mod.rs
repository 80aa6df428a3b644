//! glTF 2.0, as text with buffers beside it or in it, or binary (GLB).
//!
//! Triangles, strips and fans of all meshes that the scene's nodes name, moved by the nodes' transforms, with their
//! materials, and the nodes' lights and first camera. Indices, strides and sparse accessors are followed with every bound
//! checked.

mod accessor;
mod material;
mod node;

use super::Watched;
use super::beside::Beside;
use super::error::{Place, Result, wrong};
use super::picture::Pictures;
use super::soup::Soup;
use crate::stage::Stage;
use accessor::Kinds;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use material::{Map, Materials};
use serde_json::Value;
use std::borrow::Cow;

/// Deepest nesting of nodes.
const MAX_DEPTH: usize = 256;

/// Extensions without which positions cannot be read.
const COMPRESSED: [&str; 3] =
    ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"];

/// A transform, row by row.
type Matrix = [[f64; 4]; 3];

const IDENTITY: Matrix = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

/// What a file says: a mesh in a stage, with looks if the soup has some.
pub fn parse(bytes: &[u8], soup: Soup, beside: &Beside<'_>, limits: &Watched<'_>) -> Result<Stage> {
    let (json, bin) = if bytes.starts_with(b"glTF") { chunks(bytes)? } else { (bytes, None) };
    let json: Value = serde_json::from_slice(json)
        .map_err(|e| wrong(Place::Line(e.line() as u64), "a glTF file: binary, or JSON text", e))?;
    let version = json["asset"]["version"].as_str().unwrap_or("none");
    if !version.starts_with("2.") {
        return Err(wrong(part("asset.version"), "version 2", version));
    }
    for extension in array(&json, "extensionsRequired") {
        if let Some(name) = extension.as_str().filter(|name| COMPRESSED.contains(name)) {
            return Err(wrong(
                part("extensionsRequired"),
                "a file without compressed meshes",
                name,
            ));
        }
    }
    let names = |key: &str, name: &str| array(&json, key).iter().any(|x| x.as_str() == Some(name));
    let quantized = "KHR_mesh_quantization";
    let mut reader = Reader {
        json: &json,
        buffers: Vec::new(),
        beside,
        is_quantized: names("extensionsUsed", quantized) || names("extensionsRequired", quantized),
        soup,
        materials: Materials::default(),
        stage: Stage::default(),
        limits,
    };
    reader.load_buffers(bin)?;
    reader.visit_scene()?;
    reader.finish()
}

/// The JSON and the binary chunk of a GLB file.
fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>)> {
    let word = |at: usize| {
        let b = bytes.get(at..at + 4)?;
        Some(u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize)
    };
    let version = word(4);
    if version != Some(2) {
        let found = version.map_or("the end of the file".into(), |v| v.to_string());
        return Err(wrong(Place::Byte(4), "version 2", found));
    }
    let (mut json, mut bin, mut at) = (None, None, 12);
    while let (Some(length), Some(kind)) = (word(at), word(at + 4)) {
        let Some(chunk) = bytes.get(at + 8..).and_then(|rest| rest.get(..length)) else {
            let what = format!("a chunk of {length} bytes");
            return Err(wrong(Place::Byte(at as u64), what, bytes.len() - at - 8));
        };
        match &(kind as u32).to_le_bytes() {
            b"JSON" if json.is_none() => json = Some(chunk),
            b"BIN\0" if bin.is_none() => bin = Some(chunk),
            _ => {}
        }
        at += 8 + length;
    }
    if at < bytes.len() {
        let found = format!("{} more bytes", bytes.len() - at);
        return Err(wrong(Place::Byte(at as u64), "the end of the file or a chunk", found));
    }
    Ok((json.ok_or_else(|| wrong(Place::Byte(12), "a JSON chunk", "none"))?, bin))
}

struct Reader<'a> {
    json: &'a Value,
    buffers: Vec<Cow<'a, [u8]>>,
    beside: &'a Beside<'a>,
    /// True if integers may stand for positions, normals and texture coordinates.
    is_quantized: bool,
    soup: Soup,
    materials: Materials,
    /// Lights and the view.
    stage: Stage,
    limits: &'a Watched<'a>,
}

fn part(name: impl Into<String>) -> Place {
    Place::Part(name.into())
}

fn array<'a>(json: &'a Value, key: &str) -> &'a [Value] {
    json[key].as_array().map_or(&[], Vec::as_slice)
}

/// An index or a count under a key; `None` if it is absent.
fn integer(json: &Value, key: &str, name: &str) -> Result<Option<usize>> {
    let value = &json[key];
    if value.is_null() {
        return Ok(None);
    }
    let index = value.as_u64().and_then(|x| usize::try_from(x).ok()).filter(|&x| x < 1 << 48);
    index
        .map(Some)
        .ok_or_else(|| wrong(part(format!("{name}.{key}")), "an integer, 0 or more", value))
}

/// What an index of a part names.
fn entry<'a>(json: &'a Value, list: &str, index: usize, name: &str) -> Result<&'a Value> {
    let all = array(json, list);
    all.get(index)
        .ok_or_else(|| wrong(part(name), format!("one of the {} {list}", all.len()), index))
}

impl<'a> Reader<'a> {
    fn load_buffers(&mut self, bin: Option<&'a [u8]>) -> Result<()> {
        for (i, buffer) in array(self.json, "buffers").iter().enumerate() {
            let name = format!("buffers[{i}]");
            let length = integer(buffer, "byteLength", &name)?.unwrap_or(0);
            let bytes: Cow<'a, [u8]> =
                match buffer["uri"].as_str() {
                    None if i == 0 && bin.is_some() => Cow::Borrowed(bin.unwrap_or_default()),
                    None => return Err(wrong(part(name), "a uri or a binary chunk", "neither")),
                    Some(uri) => Cow::Owned(fetch(uri, length, self.beside).map_err(
                        |(expected, found)| wrong(part(format!("{name}.uri")), expected, found),
                    )?),
                };
            if bytes.len() < length {
                let what = format!("{length} bytes, as byteLength says");
                return Err(wrong(part(name), what, bytes.len()));
            }
            self.buffers.push(bytes);
        }
        Ok(())
    }

    /// The stage of what was read.
    fn finish(self) -> Result<Stage> {
        let Reader { json, buffers, beside, soup, materials, stage, limits, .. } = self;
        if soup.looks.is_none() {
            return Ok(Stage { mesh: soup.mesh(limits)?, ..stage });
        }
        let mut soup = soup;
        let (materials, images) = {
            let source = material::Source { json, buffers: &buffers, beside };
            let mut pictures = Pictures::default();
            let looks = soup.looks.get_or_insert_default();
            let all = materials.read(&source, &mut pictures, &mut looks.skipped, limits)?;
            (all, pictures.images)
        };
        node::note_skipped(json, &mut soup);
        let dressed = soup.stage(limits)?;
        let (lights, camera) = (stage.lights, stage.camera);
        Ok(Stage { materials, images, lights, camera, ..dressed })
    }

    /// Reads the meshes of the default scene, or of all root nodes, or all of them where there are no nodes.
    fn visit_scene(&mut self) -> Result<()> {
        let (json, nodes) = (self.json, array(self.json, "nodes"));
        if nodes.is_empty() {
            for mesh in 0..array(json, "meshes").len() {
                self.read_mesh(mesh, &IDENTITY, "meshes")?;
            }
            return Ok(());
        }
        let roots: Vec<usize> = if array(json, "scenes").is_empty() {
            let mut is_child = vec![false; nodes.len()];
            let children = nodes.iter().flat_map(|node| array(node, "children"));
            for child in children.filter_map(Value::as_u64) {
                if let Some(child) = is_child.get_mut(child as usize) {
                    *child = true;
                }
            }
            (0..nodes.len()).filter(|&i| !is_child[i]).collect()
        } else {
            let scene = integer(json, "scene", "scene")?.unwrap_or(0);
            self.list(entry(json, "scenes", scene, "scene")?, "nodes", &format!("scenes[{scene}]"))?
        };
        let mut seen = vec![false; nodes.len()];
        let mut stack: Vec<(usize, Matrix, usize)> =
            roots.into_iter().rev().map(|root| (root, IDENTITY, 0)).collect();
        while let Some((index, above, depth)) = stack.pop() {
            let name = format!("nodes[{index}]");
            let node = entry(json, "nodes", index, "nodes")?;
            if std::mem::replace(&mut seen[index], true) {
                return Err(wrong(part(name), "a node with one parent", "one that is named twice"));
            }
            if depth > MAX_DEPTH {
                return Err(wrong(part(name), format!("nodes at most {MAX_DEPTH} deep"), "more"));
            }
            let matrix = times(&above, &transform(node, &name)?);
            if let Some(mesh) = integer(node, "mesh", &name)? {
                self.read_mesh(mesh, &matrix, &format!("{name}.mesh"))?;
            }
            if self.soup.looks.is_some() {
                self.read_light(node, &matrix, &name)?;
                self.read_camera(node, &matrix, &name)?;
            }
            let children = self.list(node, "children", &name)?;
            stack.extend(children.into_iter().rev().map(|child| (child, matrix, depth + 1)));
        }
        Ok(())
    }

    /// Indices under a key.
    fn list(&self, json: &Value, key: &str, name: &str) -> Result<Vec<usize>> {
        let index = |value: &Value| {
            let found = value.as_u64().map(|x| x as usize);
            found.ok_or_else(|| wrong(part(format!("{name}.{key}")), "integers, 0 or more", value))
        };
        array(json, key).iter().map(index).collect()
    }

    fn read_mesh(&mut self, index: usize, matrix: &Matrix, named_by: &str) -> Result<()> {
        let mesh = entry(self.json, "meshes", index, named_by)?;
        for (i, primitive) in array(mesh, "primitives").iter().enumerate() {
            self.read_primitive(primitive, matrix, &format!("meshes[{index}].primitives[{i}]"))?;
        }
        Ok(())
    }

    fn read_primitive(&mut self, primitive: &Value, matrix: &Matrix, name: &str) -> Result<()> {
        let mode = integer(primitive, "mode", name)?.unwrap_or(4);
        match mode {
            0..=3 => {
                self.soup.skip("points and lines");
                return Ok(());
            }
            4..=6 => {}
            _ => return Err(wrong(part(format!("{name}.mode")), "a mode from 0 to 6", mode)),
        }
        let attributes = format!("{name}.attributes");
        let Some(positions) = integer(&primitive["attributes"], "POSITION", &attributes)? else {
            return Err(wrong(part(attributes), "POSITION", "none"));
        };
        let base = self.soup.vertices.len();
        let kinds = if self.is_quantized { Kinds::Any } else { Kinds::Float };
        let points = self.accessor(positions, &["VEC3"], kinds, &format!("{name}.POSITION"))?;
        let place = || part(format!("accessors[{positions}]"));
        for point in points.values.as_chunks::<3>().0 {
            let moved = matrix.map(|[x, y, z, t]| x * point[0] + y * point[1] + z * point[2] + t);
            self.soup.vertex(place, moved, self.limits)?;
        }
        let count = points.values.len() / 3;
        drop(points);
        if self.soup.looks.is_some() {
            self.read_looks(primitive, matrix, count, name)?;
        }
        let place = || part(format!("{name}.indices"));
        let indices: Option<Vec<f64>> = match integer(primitive, "indices", name)? {
            None => None,
            Some(indices) => {
                let named_by = format!("{name}.indices");
                Some(self.accessor(indices, &["SCALAR"], Kinds::Index, &named_by)?.values)
            }
        };
        if let Some(wrong_one) = indices.iter().flatten().find(|&&i| i >= count as f64) {
            let what = match count {
                0 => "no vertex, since there are none".to_owned(),
                n => format!("a vertex from 0 to {}", n - 1),
            };
            return Err(wrong(place(), what, wrong_one));
        }
        let n = indices.as_ref().map_or(count, Vec::len);
        if n < 3 && n > 0 || mode == 4 && !n.is_multiple_of(3) {
            return Err(wrong(place(), "three vertices a triangle", n));
        }
        let triangles = if mode == 4 { n / 3 } else { n.saturating_sub(2) };
        // A mirrored mesh is turned inside out, which its faces make up for (glTF 2.0, section 3.7.4).
        let is_mirrored = determinant(matrix) < 0.0;
        for i in 0..triangles {
            let [a, b, c] = match mode {
                4 => [3 * i, 3 * i + 1, 3 * i + 2],
                // Every other triangle of a strip is turned.
                5 if i % 2 == 0 => [i, i + 1, i + 2],
                5 => [i + 1, i, i + 2],
                _ => [0, i + 1, i + 2],
            };
            let corner =
                |i: usize| (base + indices.as_ref().map_or(i, |all| all[i] as usize)) as u32;
            let (b, c) = if is_mirrored { (c, b) } else { (b, c) };
            self.soup.open.extend([corner(a), corner(b), corner(c)]);
            self.soup.end_polygon(place, self.limits)?;
        }
        Ok(())
    }

    /// Normals, texture coordinates, colours and the material of a primitive whose vertices were added last.
    fn read_looks(
        &mut self,
        primitive: &Value,
        matrix: &Matrix,
        count: usize,
        name: &str,
    ) -> Result<()> {
        let attributes = &primitive["attributes"];
        let named = integer(primitive, "material", name)?;
        let (material, map) = self.materials.of_primitive(self.json, named, name)?;
        let fits = |found: usize, key: &str| {
            let what = format!("{count} of them, as there are positions");
            if found == count {
                Ok(())
            } else {
                Err(wrong(part(format!("{name}.{key}")), what, found))
            }
        };
        let mut normals = Vec::new();
        if let Some(index) = integer(attributes, "NORMAL", name)? {
            let rows =
                self.accessor(index, &["VEC3"], Kinds::Any, &format!("{name}.NORMAL"))?.values;
            fits(rows.len() / 3, "NORMAL")?;
            let cofactors = cofactors(matrix);
            let turn =
                |n: &[f64; 3]| cofactors.map(|row| (0..3).map(|a| row[a] * n[a]).sum::<f64>());
            normals = rows.as_chunks::<3>().0.iter().map(|n| small(turn(n))).collect();
        }
        let (mut uvs, Map { set, transform }) = (Vec::new(), map);
        let key = format!("TEXCOORD_{set}");
        if let Some(index) = integer(attributes, &key, name)? {
            let rows =
                self.accessor(index, &["VEC2"], Kinds::Any, &format!("{name}.{key}"))?.values;
            fits(rows.len() / 2, &key)?;
            let place =
                |&[u, v]: &[f64; 2]| transform.map(|row| (row[0] * u + row[1] * v + row[2]) as f32);
            let sound = |uv: [f32; 2]| if uv.iter().all(|x| x.is_finite()) { uv } else { [0.0; 2] };
            uvs = rows.as_chunks::<2>().0.iter().map(|uv| sound(place(uv))).collect();
        }
        let mut colors = Vec::new();
        if let Some(index) = integer(attributes, "COLOR_0", name)? {
            let rows =
                self.accessor(index, &["VEC3", "VEC4"], Kinds::Any, &format!("{name}.COLOR_0"))?;
            fits(rows.values.len() / rows.width, "COLOR_0")?;
            let share = |x: f64| if x.is_nan() { 1.0 } else { x.clamp(0.0, 1.0) as f32 };
            let color = |row: &[f64]| [share(row[0]), share(row[1]), share(row[2])];
            colors = rows.values.chunks_exact(rows.width).map(color).collect();
        }
        let after = self.soup.vertices.len();
        let before = after - count;
        let Some(looks) = &mut self.soup.looks else {
            return Ok(());
        };
        looks.material = material;
        // Primitives that lack what others have get what stands for nothing.
        if !normals.is_empty() {
            looks.normals.resize(before, [0.0; 3]);
            looks.normals.extend(normals);
        }
        if !uvs.is_empty() {
            looks.uvs.resize(before, [0.0; 2]);
            looks.uvs.extend(uvs);
        }
        if !colors.is_empty() {
            looks.colors.resize(before, [1.0; 3]);
            looks.colors.extend(colors);
        }
        if array(primitive, "targets").iter().any(|_| true) {
            looks.skipped.note("morph targets");
        }
        Ok(())
    }
}

/// The bytes that a URI holds or names: data in base64, or a file in the folder of this one or below. The error is what was
/// expected and what was found.
fn fetch(
    uri: &str,
    least: usize,
    beside: &Beside<'_>,
) -> std::result::Result<Vec<u8>, (String, String)> {
    let Some(data) = uri.strip_prefix("data:") else {
        let read = beside.read(&decode_percent(uri), least as u64);
        return read.map_err(|why| (why.expected, why.found));
    };
    let Some((_, text)) = data.split_once(";base64,") else {
        return Err(("data in base64".into(), uri.into()));
    };
    // No longer than the text, which is within the limits.
    STANDARD.decode(text).map_err(|e| ("data in base64".into(), e.to_string()))
}

/// Rounded, after it is scaled to a length that `f32` holds.
fn small(v: [f64; 3]) -> [f32; 3] {
    let most = v.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    if most > 0.0 && most.is_finite() { v.map(|x| (x / most) as f32) } else { [0.0; 3] }
}

/// The matrix that moves normals, up to a factor: of cofactors, with the sign of the determinant, since faces of mirrored
/// meshes are turned.
fn cofactors(m: &Matrix) -> [[f64; 3]; 3] {
    let sign = if determinant(m) < 0.0 { -1.0 } else { 1.0 };
    std::array::from_fn(|i| {
        let (p, q) = (m[(i + 1) % 3], m[(i + 2) % 3]);
        std::array::from_fn(|j| {
            let (k, l) = ((j + 1) % 3, (j + 2) % 3);
            sign * (p[k] * q[l] - p[l] * q[k])
        })
    })
}

fn determinant(m: &Matrix) -> f64 {
    let [a, b, c] = m;
    a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
}

/// The transform of a node: its matrix, or translation times rotation times scale.
fn transform(node: &Value, name: &str) -> Result<Matrix> {
    let numbers = |key: &str, default: &[f64]| -> Result<Vec<f64>> {
        let place = || part(format!("{name}.{key}"));
        if node[key].is_null() {
            return Ok(default.to_vec());
        }
        let values: Vec<f64> = array(node, key).iter().filter_map(Value::as_f64).collect();
        if values.len() != default.len() {
            return Err(wrong(place(), format!("{} numbers", default.len()), &node[key]));
        }
        Ok(values)
    };
    if !node["matrix"].is_null() {
        let m = numbers("matrix", &[0.0; 16])?;
        // Column by column.
        return Ok([0, 1, 2].map(|i| [m[i], m[4 + i], m[8 + i], m[12 + i]]));
    }
    let (t, s) = (numbers("translation", &[0.0; 3])?, numbers("scale", &[1.0; 3])?);
    let q = numbers("rotation", &[0.0, 0.0, 0.0, 1.0])?;
    let [x, y, z, w] = [q[0], q[1], q[2], q[3]];
    let r = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ];
    Ok([0, 1, 2].map(|i| [r[i][0] * s[0], r[i][1] * s[1], r[i][2] * s[2], t[i]]))
}

/// One transform behind another; `a` is done last.
fn times(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let last = if j == 3 { a[i][3] } else { 0.0 };
            a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j] + last
        })
    })
}

/// `%20` and its like; what is none stays.
fn decode_percent(uri: &str) -> String {
    let (bytes, mut out, mut i) = (uri.as_bytes(), Vec::new(), 0);
    while i < bytes.len() {
        let code = bytes.get(i + 1..i + 3).and_then(|b| std::str::from_utf8(b).ok());
        match code.and_then(|code| u8::from_str_radix(code, 16).ok()) {
            Some(byte) if bytes[i] == b'%' => {
                out.push(byte);
                i += 3;
            }
            _ => {
                out.push(bytes[i]);
                i += 1;
            }
        }
    }
    String::from_utf8_lossy(&out).into_owned()
}
