//! PLY, ascii or binary little-endian: vertex positions and faces, polygons fanned.

use super::mesh::{MeshError, Parts};
use anyhow::{Context, bail};

/// A scalar type of a property.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn named(name: &str) -> Result<Scalar, MeshError> {
        Ok(match name {
            "char" | "int8" => Scalar::I8,
            "uchar" | "uint8" => Scalar::U8,
            "short" | "int16" => Scalar::I16,
            "ushort" | "uint16" => Scalar::U16,
            "int" | "int32" => Scalar::I32,
            "uint" | "uint32" => Scalar::U32,
            "float" | "float32" => Scalar::F32,
            "double" | "float64" => Scalar::F64,
            other => bail!("unknown property type {other}"),
        })
    }
}

/// A property of an element.
enum Property {
    One(Scalar, String),
    List { count: Scalar, item: Scalar },
}

struct Element {
    name: String,
    count: usize,
    properties: Vec<Property>,
}

/// Where values come from, one after the other.
enum Values<'a> {
    Ascii(std::str::SplitAsciiWhitespace<'a>),
    Binary(&'a [u8]),
}

impl Values<'_> {
    fn next(&mut self, kind: Scalar) -> Result<f64, MeshError> {
        match self {
            Values::Ascii(words) => {
                let word = words.next().context("the file ends too early")?;
                word.parse().with_context(|| format!("expected a number, found {word}"))
            }
            Values::Binary(bytes) => Ok(match kind {
                Scalar::I8 => f64::from(i8::from_le_bytes(take(bytes)?)),
                Scalar::U8 => f64::from(u8::from_le_bytes(take(bytes)?)),
                Scalar::I16 => f64::from(i16::from_le_bytes(take(bytes)?)),
                Scalar::U16 => f64::from(u16::from_le_bytes(take(bytes)?)),
                Scalar::I32 => f64::from(i32::from_le_bytes(take(bytes)?)),
                Scalar::U32 => f64::from(u32::from_le_bytes(take(bytes)?)),
                Scalar::F32 => f64::from(f32::from_le_bytes(take(bytes)?)),
                Scalar::F64 => f64::from_le_bytes(take(bytes)?),
            }),
        }
    }
}

fn take<const N: usize>(bytes: &mut &[u8]) -> Result<[u8; N], MeshError> {
    let (head, tail) = bytes.split_first_chunk().context("the file ends too early")?;
    *bytes = tail;
    Ok(*head)
}

/// Vertices and faces of a PLY file.
pub(super) fn parse(bytes: &[u8]) -> Result<Parts, MeshError> {
    const END: &[u8] = b"end_header";
    let end = bytes.windows(END.len()).position(|w| w == END).context("no PLY header found")?;
    let line = end + bytes[end..].iter().position(|&b| b == b'\n').context("no data")? + 1;
    let (binary, elements) = header(std::str::from_utf8(&bytes[..end])?)?;
    let mut values = if binary {
        Values::Binary(&bytes[line..])
    } else {
        Values::Ascii(std::str::from_utf8(&bytes[line..])?.split_ascii_whitespace())
    };
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    for element in &elements {
        for _ in 0..element.count {
            read_one(element, &mut values, &mut vertices, &mut faces)?;
        }
    }
    Ok((vertices, faces))
}

fn header(text: &str) -> Result<(bool, Vec<Element>), MeshError> {
    let mut lines = text.lines();
    if lines.next().map(str::trim) != Some("ply") {
        bail!("expected `ply` on the first line");
    }
    let (mut binary, mut elements) = (false, Vec::<Element>::new());
    for line in lines {
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        match words[..] {
            ["format", "ascii", _] => binary = false,
            ["format", "binary_little_endian", _] => binary = true,
            ["format", other, ..] => bail!("unsupported PLY format {other}"),
            ["element", name, count] => elements.push(Element {
                name: name.to_owned(),
                count: count.parse().with_context(|| format!("bad count in `{line}`"))?,
                properties: Vec::new(),
            }),
            ["property", "list", count, item, _] => {
                let list =
                    Property::List { count: Scalar::named(count)?, item: Scalar::named(item)? };
                elements.last_mut().context("property before element")?.properties.push(list);
            }
            ["property", kind, name] => {
                let one = Property::One(Scalar::named(kind)?, name.to_owned());
                elements.last_mut().context("property before element")?.properties.push(one);
            }
            _ => {}
        }
    }
    Ok((binary, elements))
}

fn read_one(
    element: &Element,
    values: &mut Values,
    vertices: &mut Vec<[f32; 3]>,
    faces: &mut Vec<[u32; 3]>,
) -> Result<(), MeshError> {
    let (is_vertex, is_face) = (element.name == "vertex", element.name == "face");
    let mut position = [0f32; 3];
    for property in &element.properties {
        match property {
            Property::One(kind, name) => {
                let value = values.next(*kind)?;
                if let Some(axis) = ["x", "y", "z"].iter().position(|a| a == name) {
                    position[axis] = value as f32;
                }
            }
            Property::List { count, item } => {
                let n = values.next(*count)? as usize;
                let (mut first, mut last) = (0, 0);
                for k in 0..n {
                    let index = values.next(*item)?;
                    if !(0.0..=f64::from(u32::MAX)).contains(&index) {
                        bail!("vertex index {index} is out of range");
                    }
                    let index = index as u32;
                    match k {
                        0 => first = index,
                        1 => {}
                        _ if is_face => faces.push([first, last, index]),
                        _ => {}
                    }
                    last = index;
                }
            }
        }
    }
    if is_vertex {
        vertices.push(position);
    }
    Ok(())
}
