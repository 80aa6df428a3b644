//! Numbers of accessors, read where they lie in their buffers.

use super::super::error::{Result, wrong};
use super::{Reader, entry, integer, part};
use serde_json::Value;

/// What an accessor is for, and so which numbers it may hold (glTF 2.0, section 3.7.2.1).
#[derive(Clone, Copy, PartialEq)]
pub enum Purpose {
    /// Positions; integers of up to 16 bits with KHR_mesh_quantization.
    Position,
    /// Normals; shares of up to 16 bits with KHR_mesh_quantization.
    Normal,
    /// Texture coordinates; signed and whole numbers with KHR_mesh_quantization.
    Coordinate,
    /// Colours.
    Color,
    /// Vertices of triangles.
    Index,
    /// Translations and scales of instances.
    Length,
    /// Rotations of instances, as quaternions.
    Rotation,
}

/// How a number is stored.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

use Component::{F32, I8, I16, U8, U16, U32};

impl Component {
    fn of_code(code: u64) -> Option<Component> {
        Some(match code {
            5120 => I8,
            5121 => U8,
            5122 => I16,
            5123 => U16,
            5125 => U32,
            5126 => F32,
            _ => return None,
        })
    }

    /// Bytes of a number.
    fn size(self) -> usize {
        match self {
            I8 | U8 => 1,
            I16 | U16 => 2,
            U32 | F32 => 4,
        }
    }
}

impl Purpose {
    /// Types of elements.
    fn shapes(self) -> &'static [&'static str] {
        match self {
            Purpose::Position | Purpose::Normal | Purpose::Length => &["VEC3"],
            Purpose::Coordinate => &["VEC2"],
            Purpose::Color => &["VEC3", "VEC4"],
            Purpose::Rotation => &["VEC4"],
            Purpose::Index => &["SCALAR"],
        }
    }

    /// Whether numbers may be stored so, as shares of the largest one or as they are.
    fn allows(self, component: Component, is_share: bool, is_quantized: bool) -> bool {
        let is_small = matches!(component, I8 | U8 | I16 | U16);
        match (self, component) {
            (Purpose::Index, _) => matches!(component, U8 | U16 | U32),
            (_, F32) => true,
            (Purpose::Position, _) => is_quantized && is_small,
            (Purpose::Normal, I8 | I16) => is_quantized && is_share,
            (Purpose::Coordinate, _) if is_quantized => is_small,
            (Purpose::Coordinate | Purpose::Color, U8 | U16) => is_share,
            (Purpose::Rotation, I8 | I16) => is_share,
            _ => false,
        }
    }

    /// What is allowed, in words.
    fn allowed(self, is_quantized: bool) -> &'static str {
        match (self, is_quantized) {
            (Purpose::Index, _) => "one of [5121, 5123, 5125]",
            (Purpose::Position, true) => "one of [5120, 5121, 5122, 5123, 5126]",
            (Purpose::Position, false) => "5126, or integers with KHR_mesh_quantization",
            (Purpose::Normal, true) => "5126, or 5120 or 5122 normalized",
            (Purpose::Normal, false) => "5126, or normalized integers with KHR_mesh_quantization",
            (Purpose::Coordinate, true) => "one of [5120, 5121, 5122, 5123, 5126]",
            (Purpose::Coordinate, false) => {
                "5126, or 5121 or 5123 normalized, or integers with KHR_mesh_quantization"
            }
            (Purpose::Color, _) => "5126, or 5121 or 5123 normalized",
            (Purpose::Length, _) => "5126",
            (Purpose::Rotation, _) => "5126, or 5120 or 5122 normalized",
        }
    }
}

/// Elements in a buffer, all within it.
#[derive(Clone, Copy)]
struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
    /// Bytes of an element.
    size: usize,
}

impl<'a> Elements<'a> {
    #[inline]
    fn get(&self, i: usize) -> &'a [u8] {
        &self.bytes[i * self.stride..][..self.size]
    }
}

/// Elements that take the place of others.
struct Changes<'a> {
    count: usize,
    /// Which they replace, in rising order.
    indices: Elements<'a>,
    values: Elements<'a>,
}

/// The elements of an accessor.
pub struct Accessor<'a> {
    /// Elements.
    pub count: usize,
    /// Elements in a buffer, or zeros.
    base: Elements<'a>,
    changes: Option<Changes<'a>>,
    component: Component,
    /// True if integers are shares of the largest one.
    is_share: bool,
}

impl<'a> Accessor<'a> {
    /// The first `N` components of each element in turn, until one is refused.
    pub fn rows<const N: usize>(&self, each: impl FnMut([f64; N]) -> Result<()>) -> Result<()> {
        match (self.component, self.is_share) {
            (I8, false) => self.decoded(|b| f64::from(i8::from_le_bytes(b)), each),
            (U8, false) => self.decoded(|b| f64::from(u8::from_le_bytes(b)), each),
            (I16, false) => self.decoded(|b| f64::from(i16::from_le_bytes(b)), each),
            (U16, false) => self.decoded(|b| f64::from(u16::from_le_bytes(b)), each),
            // Section 3.6.2.2: the lowest integer stands for -1 too.
            (I8, true) => {
                self.decoded(|b| (f64::from(i8::from_le_bytes(b)) / 127.0).max(-1.0), each)
            }
            (U8, true) => self.decoded(|b| f64::from(u8::from_le_bytes(b)) / 255.0, each),
            (I16, true) => {
                self.decoded(|b| (f64::from(i16::from_le_bytes(b)) / 32767.0).max(-1.0), each)
            }
            (U16, true) => self.decoded(|b| f64::from(u16::from_le_bytes(b)) / 65535.0, each),
            (U32, _) => self.decoded(|b| f64::from(u32::from_le_bytes(b)), each),
            (F32, _) => self.decoded(|b| f64::from(f32::from_le_bytes(b)), each),
        }
    }

    /// The integers of scalars in turn, until one is refused.
    pub fn indices(&self, mut each: impl FnMut(u32) -> Result<()>) -> Result<()> {
        let mut one = |element: &[u8]| each(whole(element));
        self.elements(|element| one(element))
    }

    fn decoded<const N: usize, const S: usize>(
        &self,
        decode: impl Fn([u8; S]) -> f64,
        mut each: impl FnMut([f64; N]) -> Result<()>,
    ) -> Result<()> {
        self.elements(|element| {
            let numbers = element.as_chunks::<S>().0;
            each(std::array::from_fn(|i| decode(numbers[i])))
        })
    }

    #[inline(always)]
    fn elements(&self, mut each: impl FnMut(&[u8]) -> Result<()>) -> Result<()> {
        let base = &self.base;
        let mut next = 0;
        for change in 0..self.changes.as_ref().map_or(0, |changes| changes.count) {
            let Some(changes) = &self.changes else { break };
            let at = whole(changes.indices.get(change)) as usize;
            (next..at).try_for_each(|i| each(base.get(i)))?;
            each(changes.values.get(change))?;
            next = at + 1;
        }
        (next..self.count).try_for_each(|i| each(base.get(i)))
    }
}

/// An unsigned integer of 1, 2 or 4 bytes.
#[inline]
fn whole(bytes: &[u8]) -> u32 {
    match *bytes {
        [x] => x.into(),
        [x, y] => u16::from_le_bytes([x, y]).into(),
        [x, y, z, w] => u32::from_le_bytes([x, y, z, w]),
        _ => u32::MAX,
    }
}

impl<'a> Reader<'a> {
    /// The accessor `index`, with all of its elements within their buffers.
    pub(super) fn accessor(
        &self,
        index: usize,
        purpose: Purpose,
        named_by: &str,
    ) -> Result<Accessor<'a>> {
        let accessor = entry(self.json, "accessors", index, named_by)?;
        let name = format!("accessors[{index}]");
        let (shapes, shape) = (purpose.shapes(), accessor["type"].as_str().unwrap_or_default());
        if !shapes.contains(&shape) {
            let place = part(format!("{name}.type"));
            return Err(wrong(place, shapes.join(" or "), &accessor["type"]));
        }
        // Integers alone can be shares; of floats the word says nothing.
        let is_share = accessor["normalized"].as_bool() == Some(true);
        let component = component(accessor)
            .filter(|&component| purpose.allows(component, is_share, self.is_quantized))
            .ok_or_else(|| {
                let what = purpose.allowed(self.is_quantized);
                let found = match is_share {
                    true => format!("{} normalized", accessor["componentType"]),
                    false => accessor["componentType"].to_string(),
                };
                wrong(part(format!("{name}.componentType")), what, found)
            })?;
        let width = match shape {
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 1,
        };
        let size = width * component.size();
        let count = integer(accessor, "count", &name)?.unwrap_or(0);
        let base = match integer(accessor, "bufferView", &name)? {
            Some(view) => {
                let offset = integer(accessor, "byteOffset", &name)?.unwrap_or(0);
                self.elements(view, offset, count, size, &name)?
            }
            None => {
                // Zeros; not more of them than what changes some could be told of.
                let most = self.buffers.bytes().max(1 << 16);
                if count > most.min(self.limits.vertices) {
                    let place = part(format!("{name}.count"));
                    return Err(wrong(place, format!("at most {most}"), count));
                }
                // One of the largest elements, again and again.
                Elements { bytes: &[0; 16], stride: 0, size }
            }
        };
        let changes = self.changes(&accessor["sparse"], count, size, &name)?;
        Ok(Accessor { count, base, changes, component, is_share })
    }

    /// The sparse elements of an accessor.
    fn changes(
        &self,
        sparse: &Value,
        count: usize,
        size: usize,
        name: &str,
    ) -> Result<Option<Changes<'a>>> {
        if sparse.is_null() {
            return Ok(None);
        }
        let changed = integer(sparse, "count", &format!("{name}.sparse"))?.unwrap_or(0);
        let rows = |key: &str, size: usize| {
            let (part, name) = (&sparse[key], format!("{name}.sparse.{key}"));
            let view = integer(part, "bufferView", &name)?.unwrap_or(usize::MAX);
            let offset = integer(part, "byteOffset", &name)?.unwrap_or(0);
            self.elements(view, offset, changed, size, &name)
        };
        let place = || part(format!("{name}.sparse.indices"));
        let kind = component(&sparse["indices"])
            .filter(|&kind| Purpose::Index.allows(kind, false, false))
            .ok_or_else(|| {
                let place = part(format!("{name}.sparse.indices.componentType"));
                wrong(place, Purpose::Index.allowed(false), &sparse["indices"]["componentType"])
            })?;
        let (indices, values) = (rows("indices", kind.size())?, rows("values", size)?);
        let mut next = 0;
        for i in 0..changed {
            let at = whole(indices.get(i)) as usize;
            if at >= count {
                return Err(wrong(place(), format!("elements below {count}"), at));
            }
            if at < next {
                let what = format!("rising numbers of elements, {next} or more");
                return Err(wrong(place(), what, at));
            }
            next = at + 1;
        }
        Ok(Some(Changes { count: changed, indices, values }))
    }

    /// Elements of `size` bytes in a buffer view.
    fn elements(
        &self,
        view: usize,
        offset: usize,
        count: usize,
        size: usize,
        name: &str,
    ) -> Result<Elements<'a>> {
        let json = entry(self.json, "bufferViews", view, &format!("{name}.bufferView"))?;
        let view_name = format!("bufferViews[{view}]");
        let bytes = self.buffers.view(json, &view_name)?;
        let stride = integer(json, "byteStride", &view_name)?.unwrap_or(size);
        if stride < size {
            let place = part(format!("{view_name}.byteStride"));
            return Err(wrong(place, format!("at least {size}"), stride));
        }
        // All are below 2^48.
        let end = match count {
            0 => offset as u128,
            n => offset as u128 + (n - 1) as u128 * stride as u128 + size as u128,
        };
        if end > bytes.len() as u128 {
            let length = bytes.len();
            let what = format!("{count} elements within the {length} bytes of {view_name}");
            return Err(wrong(part(name), what, format!("{end} bytes needed")));
        }
        Ok(Elements { bytes: &bytes[offset..], stride, size })
    }
}

fn component(json: &Value) -> Option<Component> {
    json["componentType"].as_u64().and_then(Component::of_code)
}
