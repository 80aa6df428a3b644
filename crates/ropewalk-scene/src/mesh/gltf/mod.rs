//! glTF 2.0, as text with buffers beside it or in it, or binary (GLB).
//!
//! Triangles, strips and fans of all meshes that the scene's nodes name, moved by the nodes' transforms, with their
//! materials, and the nodes' lights and first camera. Indices, strides and sparse accessors are followed with every bound
//! checked.

mod accessor;
mod buffer;
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
use accessor::{Accessor, Purpose};
use buffer::{Buffers, chunks};
use material::{Map, Materials};
use matrix::{cofactors, small};
use placement::{Kept, Target};
use serde_json::Value;
use std::collections::HashSet;

/// Extensions without which positions cannot be read.
const COMPRESSED: [&str; 3] =
    ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"];

/// What a file says: a mesh in a stage, with looks if the soup has some.
pub fn parse(
    bytes: Vec<u8>,
    soup: Soup,
    beside: &Beside<'_>,
    limits: &Watched<'_>,
) -> Result<Stage> {
    let finish = |reader: Reader<'_>| reader.finish(beside);
    let (soup, stage) = with_reader(&bytes, Target::Flat, soup, beside, limits, finish)?;
    // Not needed beside what is made now.
    drop(bytes);
    if soup.looks.is_none() {
        return Ok(Stage { mesh: soup.mesh(limits)?, ..stage });
    }
    let Stage { mesh, normals, uvs, colors, material, skipped, .. } = soup.stage(limits)?;
    Ok(Stage { mesh, normals, uvs, colors, material, skipped, ..stage })
}

/// Meshes that nodes name, each once, and where they are placed.
pub fn parse_placed(
    bytes: &[u8],
    beside: &Beside<'_>,
    limits: &Watched<'_>,
) -> Result<PlacedMeshes> {
    let (target, soup) = (Target::Kept(Kept::default()), Soup::new(false));
    with_reader(bytes, target, soup, beside, limits, |reader| reader.finish_placed())
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
    let buffers = Buffers::load(&json, bin, beside)?;
    let mut reader = Reader {
        json: &json,
        buffers: &buffers,
        is_quantized: names("extensionsUsed", quantized) || names("extensionsRequired", quantized),
        soup,
        materials: Materials::default(),
        stage: Stage::default(),
        target,
        seen: HashSet::new(),
        placements: 0,
        limits,
    };
    reader.visit_scene()?;
    finish(reader)
}

struct Reader<'a> {
    json: &'a Value,
    buffers: &'a Buffers<'a>,
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
    /// The triangles, and a stage of materials, images, lights and the view.
    fn finish(self, beside: &Beside<'_>) -> Result<(Soup, Stage)> {
        let Reader { json, buffers, mut soup, materials, mut stage, limits, .. } = self;
        if let Some(looks) = &mut soup.looks {
            let source = material::Source { json, buffers, beside };
            let mut pictures = Pictures::default();
            stage.materials = materials.read(&source, &mut pictures, &mut looks.skipped, limits)?;
            stage.images = pictures.images;
            node::note_skipped(json, &mut soup);
        }
        Ok((soup, stage))
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
        let points = self.accessor(positions, Purpose::Position, &format!("{name}.POSITION"))?;
        let indices = match integer(primitive, "indices", name)? {
            None => None,
            Some(indices) => {
                Some(self.accessor(indices, Purpose::Index, &format!("{name}.indices"))?)
            }
        };
        let count = points.count;
        let n = indices.as_ref().map_or(count, |indices| indices.count);
        let triangles = if mode == 4 { n / 3 } else { n.saturating_sub(2) };
        let (soup, limits) = (&mut self.soup, self.limits);
        soup.expect(count, triangles, limits);
        let place = || part(format!("accessors[{positions}]"));
        // What stays where it is keeps the signs of its zeros: see `PlacedMeshes::flatten`.
        let mover = matrix.filter(|matrix| **matrix != IDENTITY);
        points.rows(|point| {
            let point = mover.map_or(point, |matrix| moved(matrix, point));
            soup.vertex(place, point, limits)
        })?;
        if self.soup.looks.is_some() {
            self.read_looks(primitive, matrix.unwrap_or(&IDENTITY), count, name)?;
        }
        let place = || part(format!("{name}.indices"));
        if n < 3 && n > 0 || mode == 4 && !n.is_multiple_of(3) {
            return Err(wrong(place(), "three vertices a triangle", n));
        }
        let is_mirrored = matrix.is_some_and(is_mirrored);
        let soup = &mut self.soup;
        let (mut at, mut corners) = (0usize, [0u32; 3]);
        let mut corner = |index: u32| -> Result<()> {
            if index as usize >= count {
                let what = match count {
                    0 => "no vertex, since there are none".to_owned(),
                    n => format!("a vertex from 0 to {}", n - 1),
                };
                return Err(wrong(place(), what, index));
            }
            corners[at.min(2)] = base as u32 + index;
            at += 1;
            if at < 3 {
                return Ok(());
            }
            let [a, b, c] = corners;
            // Every other triangle of a strip is turned.
            let [a, b, c] = if mode == 5 && at.is_multiple_of(2) { [b, a, c] } else { [a, b, c] };
            let [b, c] = if is_mirrored { [c, b] } else { [b, c] };
            soup.open.extend([a, b, c]);
            soup.end_polygon(place, limits)?;
            match mode {
                4 => at = 0,
                5 => corners = [corners[1], corners[2], corners[2]],
                _ => corners[1] = corners[2],
            }
            Ok(())
        };
        match indices {
            Some(indices) => indices.indices(corner),
            None => (0..count as u32).try_for_each(&mut corner),
        }
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
        let all = |key: &str, purpose: Purpose| -> Result<Option<Accessor<'a>>> {
            let Some(index) = integer(attributes, key, name)? else { return Ok(None) };
            let accessor = self.accessor(index, purpose, &format!("{name}.{key}"))?;
            if accessor.count != count {
                let what = format!("{count} of them, as there are positions");
                return Err(wrong(part(format!("{name}.{key}")), what, accessor.count));
            }
            Ok(Some(accessor))
        };
        let Map { set, transform } = map;
        let normals = all("NORMAL", Purpose::Normal)?;
        let uvs = all(&format!("TEXCOORD_{set}"), Purpose::Coordinate)?;
        let colors = all("COLOR_0", Purpose::Color)?;
        let before = self.soup.vertices.len() - count;
        let Some(looks) = &mut self.soup.looks else {
            return Ok(());
        };
        looks.material = material;
        // Primitives that lack what others have get what stands for nothing.
        if let Some(normals) = normals {
            let cofactors = cofactors(matrix);
            looks.normals.resize(before, [0.0; 3]);
            normals.rows(|n: [f64; 3]| {
                let turned = cofactors.map(|row| (0..3).map(|a| row[a] * n[a]).sum::<f64>());
                looks.normals.push(small(turned));
                Ok(())
            })?;
        }
        if let Some(uvs) = uvs {
            looks.uvs.resize(before, [0.0; 2]);
            uvs.rows(|[u, v]| {
                let uv = transform.map(|row| (row[0] * u + row[1] * v + row[2]) as f32);
                let is_sound = uv.iter().all(|x| x.is_finite());
                looks.uvs.push(if is_sound { uv } else { [0.0; 2] });
                Ok(())
            })?;
        }
        if let Some(colors) = colors {
            looks.colors.resize(before, [1.0; 3]);
            colors.rows(|color: [f64; 3]| {
                let share = |x: f64| if x.is_nan() { 1.0 } else { x.clamp(0.0, 1.0) as f32 };
                looks.colors.push(color.map(share));
                Ok(())
            })?;
        }
        if array(primitive, "targets").iter().any(|_| true) {
            looks.skipped.note("morph targets");
        }
        Ok(())
    }
}
