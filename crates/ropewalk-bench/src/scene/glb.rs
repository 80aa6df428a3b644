//! GLB (binary glTF 2.0): the triangles of all meshes. Nodes with a transform are refused, since
//! no scene of the benchmark has one.

use super::mesh::{MeshError, Parts};
use anyhow::{Context, bail};
use serde_json::Value;

const JSON: [u8; 4] = *b"JSON";
const BIN: [u8; 4] = *b"BIN\0";
/// glTF component types.
const U8: u64 = 5121;
const U16: u64 = 5123;
const U32: u64 = 5125;
const F32: u64 = 5126;
/// glTF primitive mode of plain triangles, and the default.
const TRIANGLES: u64 = 4;

/// Vertices and faces of a GLB file.
pub(super) fn parse(bytes: &[u8]) -> Result<Parts, MeshError> {
    let (mut json, mut bin) = (None, &[][..]);
    let mut rest = bytes.get(12..).context("the GLB header is cut short")?;
    while let Some((head, tail)) = rest.split_first_chunk::<8>() {
        let length = u32::from_le_bytes([head[0], head[1], head[2], head[3]]) as usize;
        let chunk = tail.get(..length).context("a GLB chunk is cut short")?;
        match [head[4], head[5], head[6], head[7]] {
            JSON => json = Some(serde_json::from_slice::<Value>(chunk)?),
            BIN => bin = chunk,
            _ => {}
        }
        rest = &tail[length..];
    }
    let json = json.context("the GLB file has no JSON chunk")?;
    for node in json["nodes"].as_array().into_iter().flatten() {
        if ["matrix", "translation", "rotation", "scale"].iter().any(|k| !node[k].is_null()) {
            bail!("nodes with a transform are not supported");
        }
    }
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    for mesh in json["meshes"].as_array().into_iter().flatten() {
        for primitive in mesh["primitives"].as_array().into_iter().flatten() {
            read_primitive(&json, bin, primitive, &mut vertices, &mut faces)?;
        }
    }
    Ok((vertices, faces))
}

fn read_primitive(
    json: &Value,
    bin: &[u8],
    primitive: &Value,
    vertices: &mut Vec<[f32; 3]>,
    faces: &mut Vec<[u32; 3]>,
) -> Result<(), MeshError> {
    if primitive["mode"].as_u64().unwrap_or(TRIANGLES) != TRIANGLES {
        bail!("only plain triangles are supported");
    }
    let base = u32::try_from(vertices.len())?;
    let (kind, positions) = accessor(json, bin, &primitive["attributes"]["POSITION"], 3)?;
    if kind != F32 {
        bail!("positions must be floats");
    }
    let floats: Vec<f32> =
        positions.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    vertices.extend(floats.chunks_exact(3).map(|v| [v[0], v[1], v[2]]));

    let (kind, raw) = accessor(json, bin, &primitive["indices"], 1)?;
    let indices: Vec<u32> = match kind {
        U8 => raw.iter().map(|&b| u32::from(b)).collect(),
        U16 => raw.chunks_exact(2).map(|b| u32::from(u16::from_le_bytes([b[0], b[1]]))).collect(),
        U32 => raw.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect(),
        other => bail!("unsupported index type {other}"),
    };
    faces.extend(indices.chunks_exact(3).map(|f| [base + f[0], base + f[1], base + f[2]]));
    Ok(())
}

/// Component type and tightly packed bytes of an accessor with `width` components an element.
fn accessor<'a>(
    json: &Value,
    bin: &'a [u8],
    index: &Value,
    width: usize,
) -> Result<(u64, &'a [u8]), MeshError> {
    let index = index.as_u64().context("a primitive lacks POSITION or indices")? as usize;
    let accessor = &json["accessors"][index];
    let kind = accessor["componentType"].as_u64().context("accessor without componentType")?;
    let size = match kind {
        U8 => 1,
        U16 => 2,
        U32 | F32 => 4,
        other => bail!("unsupported component type {other}"),
    };
    let count = accessor["count"].as_u64().context("accessor without count")? as usize;
    let view =
        &json["bufferViews"][accessor["bufferView"].as_u64().context("sparse accessor")? as usize];
    if view["byteStride"].as_u64().is_some_and(|s| s != (size * width) as u64) {
        bail!("interleaved buffers are not supported");
    }
    let offset = |v: &Value| v["byteOffset"].as_u64().unwrap_or(0) as usize;
    let start = offset(view) + offset(accessor);
    let bytes = bin.get(start..start + count * size * width);
    Ok((kind, bytes.context("an accessor reaches beyond the binary chunk")?))
}
