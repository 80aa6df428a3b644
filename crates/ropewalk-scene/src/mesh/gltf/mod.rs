//! glTF 2.0, as text with buffers beside it or in it, or binary (GLB).
//!
//! Triangles, strips and fans of all meshes that the scene's nodes name, moved by the nodes' transforms, with their
//! materials, and the nodes' lights and first camera. Indices, strides and sparse accessors are followed with every bound
//! checked.

mod accessor;
mod material;
mod matrix;
mod node;
mod placement;

use super::Watched;
use super::beside::Beside;
use super::error::{Place, Result, wrong};
use super::picture::Pictures;
use super::placed::{IDENTITY, Matrix, PlacedMeshes, is_mirrored, moved};
use super::soup::Soup;
use crate::stage::Stage;
use accessor::Kinds;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use material::{Map, Materials};
use matrix::{cofactors, small};
use placement::{Kept, Target};
use serde_json::Value;
use std::borrow::Cow;
use std::collections::HashSet;

/// Extensions without which positions cannot be read.
const COMPRESSED: [&str; 3] =
    ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"];

/// What a file says: a mesh in a stage, with looks if the soup has some.
pub fn parse(bytes: &[u8], soup: Soup, beside: &Beside<'_>, limits: &Watched<'_>) -> Result<Stage> {
    with_reader(bytes, Target::Flat, soup, beside, limits, |reader| reader.finish())
}

/// Meshes that nodes name, each once, and where they are placed.
pub fn parse_placed(
    bytes: &[u8],
    beside: &Beside<'_>,
    limits: &Watched<'_>,
) -> Result<PlacedMeshes> {
    let target = Target::Kept(Kept::default());
    with_reader(bytes, target, Soup::new(false), beside, limits, |reader| reader.finish_placed())
}

/// Follows the nodes of a file; what was read goes to `finish`.
fn with_reader<T>(
    bytes: &[u8],
    target: Target,
    soup: Soup,
    beside: &Beside<'_>,
    limits: &Watched<'_>,
    finish: impl FnOnce(Reader<'_>) -> Result<T>,
) -> Result<T> {
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
        target,
        seen: HashSet::new(),
        placements: 0,
        limits,
    };
    reader.load_buffers(bin)?;
    reader.visit_scene()?;
    finish(reader)
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
    /// Lights, the view, and how many meshes have been placed.
    stage: Stage,
    target: Target,
    /// Meshes with triangles that have been placed.
    seen: HashSet<usize>,
    /// Placements so far, those of meshes without triangles too.
    placements: usize,
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
        let Stage { lights, camera, meshes, placements, .. } = stage;
        Ok(Stage { materials, images, lights, camera, meshes, placements, ..dressed })
    }

    /// Adds the primitives of a mesh, moved by the matrix, or where they are.
    fn read_mesh(&mut self, index: usize, matrix: Option<&Matrix>, named_by: &str) -> Result<()> {
        let mesh = entry(self.json, "meshes", index, named_by)?;
        for (i, primitive) in array(mesh, "primitives").iter().enumerate() {
            self.read_primitive(primitive, matrix, &format!("meshes[{index}].primitives[{i}]"))?;
        }
        Ok(())
    }

    fn read_primitive(
        &mut self,
        primitive: &Value,
        matrix: Option<&Matrix>,
        name: &str,
    ) -> Result<()> {
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
            let point = matrix.map_or(*point, |matrix| moved(matrix, *point));
            self.soup.vertex(place, point, self.limits)?;
        }
        let count = points.values.len() / 3;
        drop(points);
        if self.soup.looks.is_some() {
            self.read_looks(primitive, matrix.unwrap_or(&IDENTITY), count, name)?;
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
        let is_mirrored = matrix.is_some_and(is_mirrored);
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
