//! Numbers of accessors.

use super::super::MeshError;
use super::super::error::{Result, wrong};
use super::{Reader, entry, integer, part};
use serde_json::Value;

/// Component types that an accessor may have.
#[derive(Clone, Copy, PartialEq)]
pub enum Kinds {
    /// Floating-point numbers alone.
    Float,
    /// Unsigned integers.
    Index,
    /// All; integers as they are, or as shares where the accessor is normalized.
    Any,
}

impl Kinds {
    /// Their codes.
    fn codes(self) -> &'static [u64] {
        match self {
            Kinds::Float => &[5126],
            Kinds::Index => &[5121, 5123, 5125],
            Kinds::Any => &[5120, 5121, 5122, 5123, 5125, 5126],
        }
    }
}

/// Rows of numbers.
pub struct Rows {
    /// All components in turn.
    pub values: Vec<f64>,
    /// Components of a row.
    pub width: usize,
}

impl Reader<'_> {
    /// The numbers of an accessor, all components in turn.
    pub(super) fn accessor(
        &self,
        index: usize,
        shapes: &[&str],
        kinds: Kinds,
        named_by: &str,
    ) -> Result<Rows> {
        let accessor = entry(self.json, "accessors", index, named_by)?;
        let name = format!("accessors[{index}]");
        let shape = accessor["type"].as_str().unwrap_or_default();
        if !shapes.contains(&shape) {
            let place = part(format!("{name}.type"));
            return Err(wrong(place, shapes.join(" or "), &accessor["type"]));
        }
        let kind = component(accessor, kinds.codes(), &name)?;
        let width = match shape {
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 1,
        };
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
        if accessor["normalized"].as_bool() == Some(true) {
            let most = match kind {
                5120 => 127.0,
                5121 => 255.0,
                5122 => 32767.0,
                5123 => 65535.0,
                _ => 1.0,
            };
            numbers.iter_mut().for_each(|x| *x = (*x / most).max(-1.0));
        }
        Ok(Rows { values: numbers, width })
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
            5120 | 5121 => 1,
            5122 | 5123 => 2,
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
                (5120, &[x]) => f64::from(x as i8),
                (5121, &[x]) => f64::from(x),
                (5122, &[x, y]) => f64::from(i16::from_le_bytes([x, y])),
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
