//! glTF 2.0, as text with buffers beside it or in it, or binary (GLB).
//!
//! Triangles, strips and fans of all meshes that the scene's nodes name, moved by the nodes' transforms; points,
//! lines, skins, morphs and cameras are passed over. Indices, strides and sparse accessors are followed with every
//! bound checked.

use super::error::{Place, Result, wrong};
use super::{MeshError, Soup, Watched};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::Value;
use std::borrow::Cow;
use std::path::{Component, Path, PathBuf};

/// Deepest nesting of nodes.
const MAX_DEPTH: usize = 256;

/// Extensions without which positions cannot be read.
const COMPRESSED: [&str; 3] =
    ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_mesh_quantization"];

/// A transform, row by row.
type Matrix = [[f64; 4]; 3];

const IDENTITY: Matrix = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

/// Vertices and faces.
pub fn parse(bytes: &[u8], folder: Option<&Path>, limits: &Watched<'_>) -> Result<Soup> {
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
    let mut reader = Reader {
        json: &json,
        buffers: Vec::new(),
        left: limits.bytes.saturating_sub(bytes.len() as u64),
        soup: Soup::default(),
        limits,
    };
    reader.load_buffers(bin, folder)?;
    reader.visit_scene()?;
    Ok(reader.soup)
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
    /// Bytes that buffers may still take.
    left: u64,
    soup: Soup,
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
    fn load_buffers(&mut self, bin: Option<&'a [u8]>, folder: Option<&Path>) -> Result<()> {
        for (i, buffer) in array(self.json, "buffers").iter().enumerate() {
            let name = format!("buffers[{i}]");
            let length = integer(buffer, "byteLength", &name)?.unwrap_or(0);
            let bytes: Cow<'a, [u8]> = match buffer["uri"].as_str() {
                None if i == 0 && bin.is_some() => Cow::Borrowed(bin.unwrap_or_default()),
                None => return Err(wrong(part(name), "a uri or a binary chunk", "neither")),
                Some(uri) => Cow::Owned(self.fetch(uri, length, &name, folder)?),
            };
            if bytes.len() < length {
                let what = format!("{length} bytes, as byteLength says");
                return Err(wrong(part(name), what, bytes.len()));
            }
            self.buffers.push(bytes);
        }
        Ok(())
    }

    /// The bytes that a URI holds or names: data in base64, or a file in the folder of this one or below.
    fn fetch(
        &mut self,
        uri: &str,
        length: usize,
        name: &str,
        folder: Option<&Path>,
    ) -> Result<Vec<u8>> {
        let place = || part(format!("{name}.uri"));
        if let Some(data) = uri.strip_prefix("data:") {
            let Some((_, text)) = data.split_once(";base64,") else {
                return Err(wrong(place(), "data in base64", uri));
            };
            return STANDARD.decode(text).map_err(|e| wrong(place(), "data in base64", e));
        }
        let relative = PathBuf::from(decode_percent(uri));
        let is_plain = relative.components().all(|c| matches!(c, Component::Normal(_)));
        if uri.contains("://") || uri.contains('\\') || !is_plain || uri.is_empty() {
            let what = "a file in this folder or below, without \"..\"";
            return Err(wrong(place(), what, uri));
        }
        let Some(folder) = folder else {
            return Err(wrong(place(), "data in the file itself, since it has no folder", uri));
        };
        let path = folder.join(relative);
        let cannot = |e: std::io::Error| wrong(place(), format!("to read {uri}"), e);
        let size = std::fs::metadata(&path).map_err(cannot)?.len();
        if size < length as u64 || size > self.left {
            let what = format!("a file of {length} to {} bytes", self.left);
            return Err(wrong(place(), what, format!("{uri} of {size}")));
        }
        self.left -= size;
        std::fs::read(&path).map_err(cannot)
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
            // Points and lines.
            0..=3 => return Ok(()),
            4..=6 => {}
            _ => return Err(wrong(part(format!("{name}.mode")), "a mode from 0 to 6", mode)),
        }
        let attributes = format!("{name}.attributes");
        let Some(positions) = integer(&primitive["attributes"], "POSITION", &attributes)? else {
            return Err(wrong(part(attributes), "POSITION", "none"));
        };
        let base = self.soup.vertices.len();
        let points = self.accessor(positions, "VEC3", &[5126], &format!("{name}.POSITION"))?;
        for point in points.as_chunks::<3>().0 {
            let moved = matrix.map(|[x, y, z, t]| x * point[0] + y * point[1] + z * point[2] + t);
            self.soup.vertex(part(format!("accessors[{positions}]")), moved, self.limits)?;
        }
        let count = points.len() / 3;
        let place = part(format!("{name}.indices"));
        let indices: Vec<f64> = match integer(primitive, "indices", name)? {
            None => (0..count).map(|i| i as f64).collect(),
            Some(indices) => {
                self.accessor(indices, "SCALAR", &[5121, 5123, 5125], &format!("{name}.indices"))?
            }
        };
        if let Some(wrong_one) = indices.iter().find(|&&i| i >= count as f64) {
            let what = match count {
                0 => "no vertex, since there are none".to_owned(),
                n => format!("a vertex from 0 to {}", n - 1),
            };
            return Err(wrong(place, what, wrong_one));
        }
        let n = indices.len();
        if n < 3 && n > 0 || mode == 4 && !n.is_multiple_of(3) {
            return Err(wrong(place, "three vertices a triangle", n));
        }
        let triangles = if mode == 4 { n / 3 } else { n.saturating_sub(2) };
        for i in 0..triangles {
            let [a, b, c] = match mode {
                4 => [3 * i, 3 * i + 1, 3 * i + 2],
                // Every other triangle of a strip is turned.
                5 if i % 2 == 0 => [i, i + 1, i + 2],
                5 => [i + 1, i, i + 2],
                _ => [0, i + 1, i + 2],
            };
            let corner = |i: usize| (base + indices[i] as usize) as u32;
            self.soup.corners.extend([corner(a), corner(b), corner(c)]);
            self.soup.end_polygon(place.clone(), self.limits)?;
        }
        Ok(())
    }

    /// The numbers of an accessor, all components in turn.
    fn accessor(
        &self,
        index: usize,
        shape: &str,
        kinds: &[u64],
        named_by: &str,
    ) -> Result<Vec<f64>> {
        let accessor = entry(self.json, "accessors", index, named_by)?;
        let name = format!("accessors[{index}]");
        if accessor["type"].as_str() != Some(shape) {
            return Err(wrong(part(format!("{name}.type")), shape, &accessor["type"]));
        }
        let kind = component(accessor, kinds, &name)?;
        let width = if shape == "VEC3" { 3 } else { 1 };
        let count = integer(accessor, "count", &name)?.unwrap_or(0);
        let sparse = &accessor["sparse"];
        let mut numbers = match integer(accessor, "bufferView", &name)? {
            Some(view) => {
                let offset = integer(accessor, "byteOffset", &name)?.unwrap_or(0);
                self.elements(view, offset, count, width, kind, &name)?
            }
            None => {
                // Zeros; not more of them than what changes some could be told of.
                let most = self.buffers.iter().map(|b| b.len()).sum::<usize>().max(1 << 16);
                if count > most.min(self.limits.vertices) {
                    return Err(wrong(
                        part(format!("{name}.count")),
                        format!("at most {most}"),
                        count,
                    ));
                }
                vec![0.0; count * width]
            }
        };
        if !sparse.is_null() {
            let changes = integer(sparse, "count", &format!("{name}.sparse"))?.unwrap_or(0);
            let rows = |key: &str, width: usize, kinds: &[u64]| {
                let (part, name) = (&sparse[key], format!("{name}.sparse.{key}"));
                let kind = if key == "values" { kind } else { component(part, kinds, &name)? };
                let view = integer(part, "bufferView", &name)?.unwrap_or(usize::MAX);
                let offset = integer(part, "byteOffset", &name)?.unwrap_or(0);
                self.elements(view, offset, changes, width, kind, &name)
            };
            let (at, values) =
                (rows("indices", 1, &[5121, 5123, 5125])?, rows("values", width, &[])?);
            for (at, value) in at.into_iter().zip(values.chunks_exact(width)) {
                let at = at as usize;
                let Some(row) = numbers.get_mut(at * width..(at + 1) * width) else {
                    let place = part(format!("{name}.sparse.indices"));
                    return Err(wrong(place, format!("elements below {count}"), at));
                };
                row.copy_from_slice(value);
            }
        }
        Ok(numbers)
    }

    /// Elements of a buffer view.
    fn elements(
        &self,
        view: usize,
        offset: usize,
        count: usize,
        width: usize,
        kind: u64,
        name: &str,
    ) -> Result<Vec<f64>> {
        let json = entry(self.json, "bufferViews", view, &format!("{name}.bufferView"))?;
        let view_name = format!("bufferViews[{view}]");
        let size = match kind {
            5121 => 1,
            5123 => 2,
            _ => 4,
        };
        let buffer = integer(json, "buffer", &view_name)?.unwrap_or(usize::MAX);
        let Some(bytes) = self.buffers.get(buffer) else {
            let what = format!("one of the {} buffers", self.buffers.len());
            return Err(wrong(part(format!("{view_name}.buffer")), what, &json["buffer"]));
        };
        let start = integer(json, "byteOffset", &view_name)?.unwrap_or(0);
        let length = integer(json, "byteLength", &view_name)?.unwrap_or(0);
        let Some(bytes) = bytes.get(start..).and_then(|rest| rest.get(..length)) else {
            let what =
                format!("{length} bytes from {start} on within the buffer's {}", bytes.len());
            return Err(wrong(part(view_name), what, "fewer"));
        };
        let stride = integer(json, "byteStride", &view_name)?.unwrap_or(size * width);
        if stride < size * width {
            let place = part(format!("{view_name}.byteStride"));
            return Err(wrong(place, format!("at least {}", size * width), stride));
        }
        // All are below 2^48.
        let end = match count {
            0 => offset as u128,
            n => offset as u128 + (n - 1) as u128 * stride as u128 + (size * width) as u128,
        };
        if end > length as u128 {
            let what = format!("{count} elements within the {length} bytes of {view_name}");
            return Err(wrong(part(name), what, format!("{end} bytes needed")));
        }
        let mut numbers = Vec::with_capacity(count * width);
        for i in 0..count {
            let element = &bytes[offset + i * stride..][..size * width];
            numbers.extend(element.chunks_exact(size).map(|b| match (kind, b) {
                (5121, &[x]) => f64::from(x),
                (5123, &[x, y]) => f64::from(u16::from_le_bytes([x, y])),
                (5125, &[x, y, z, w]) => f64::from(u32::from_le_bytes([x, y, z, w])),
                (_, &[x, y, z, w]) => f64::from(f32::from_le_bytes([x, y, z, w])),
                _ => f64::NAN,
            }));
        }
        Ok(numbers)
    }
}

fn component(json: &Value, kinds: &[u64], name: &str) -> Result<u64> {
    let kind = json["componentType"].as_u64().filter(|kind| kinds.contains(kind));
    kind.ok_or_else(|| -> MeshError {
        let what = format!("one of {kinds:?}");
        wrong(part(format!("{name}.componentType")), what, &json["componentType"])
    })
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
