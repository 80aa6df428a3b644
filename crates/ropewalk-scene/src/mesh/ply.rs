//! PLY: ascii, or binary of either byte order.

use super::error::{Place, Result, wrong};
use super::text::{Words, parse as number, quote};
use super::{Soup, Watched};

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
    fn named(name: &[u8], place: &Place) -> Result<Scalar> {
        Ok(match name {
            b"char" | b"int8" => Scalar::I8,
            b"uchar" | b"uint8" => Scalar::U8,
            b"short" | b"int16" => Scalar::I16,
            b"ushort" | b"uint16" => Scalar::U16,
            b"int" | b"int32" => Scalar::I32,
            b"uint" | b"uint32" => Scalar::U32,
            b"float" | b"float32" => Scalar::F32,
            b"double" | b"float64" => Scalar::F64,
            other => {
                return Err(wrong(place.clone(), "a property type such as float", quote(other)));
            }
        })
    }

    fn bytes(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::F64 => 8,
        }
    }

    fn is_integer(self) -> bool {
        !matches!(self, Scalar::F32 | Scalar::F64)
    }
}

/// What a property is for.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Use {
    /// Coordinate of a vertex.
    Axis(usize),
    /// Corners of a face.
    Corners,
    Nothing,
}

/// A property: a number, or a list if it has a type for counts.
struct Property {
    count: Option<Scalar>,
    item: Scalar,
    role: Use,
}

struct Element {
    name: Vec<u8>,
    count: u64,
    place: Place,
    properties: Vec<Property>,
}

/// How numbers are written.
#[derive(Clone, Copy, PartialEq)]
enum Form {
    Ascii,
    Little,
    Big,
}

/// Where values come from, one after the other.
enum Values<'a> {
    Ascii(Words<'a>),
    Binary { bytes: &'a [u8], at: usize, is_big: bool },
}

impl Values<'_> {
    fn place(&self) -> Place {
        match self {
            Values::Ascii(words) => words.place(),
            Values::Binary { at, .. } => Place::Byte(*at as u64),
        }
    }

    fn left(&self) -> usize {
        match self {
            Values::Ascii(words) => words.left(),
            Values::Binary { bytes, at, .. } => bytes.len() - at,
        }
    }

    #[inline]
    fn next(&mut self, kind: Scalar, what: &str) -> Result<f64> {
        match self {
            Values::Ascii(words) => words.number(what),
            Values::Binary { bytes, at, is_big } => {
                let size = kind.bytes();
                let Some(found) = bytes.get(*at..*at + size) else {
                    return Err(wrong(Place::Byte(*at as u64), what, "the end of the file"));
                };
                *at += size;
                let mut b = [0; 8];
                b[..size].copy_from_slice(found);
                if *is_big {
                    b[..size].reverse();
                }
                Ok(match kind {
                    Scalar::I8 => f64::from(b[0] as i8),
                    Scalar::U8 => f64::from(b[0]),
                    Scalar::I16 => f64::from(i16::from_le_bytes([b[0], b[1]])),
                    Scalar::U16 => f64::from(u16::from_le_bytes([b[0], b[1]])),
                    Scalar::I32 => f64::from(i32::from_le_bytes([b[0], b[1], b[2], b[3]])),
                    Scalar::U32 => f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
                    Scalar::F32 => f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])),
                    Scalar::F64 => f64::from_le_bytes(b),
                })
            }
        }
    }
}

/// Vertices and faces.
pub fn parse(bytes: &[u8], limits: &Watched<'_>) -> Result<Soup> {
    let mut words = Words::new(bytes, 1, None);
    let (form, elements) = header(&mut words)?;
    // The data begin behind the line of end_header.
    words.skip_line();
    let start = bytes.len() - words.left();
    let mut values = match form {
        Form::Ascii => Values::Ascii(words),
        _ => Values::Binary { bytes, at: start, is_big: form == Form::Big },
    };
    let vertices = elements.iter().filter(|e| e.name == b"vertex").map(|e| e.count).sum();
    let mut soup = Soup::default();
    for element in &elements {
        // Each number takes a digit and a space, but perhaps for the last one.
        let width = |p: &Property| match (form, p.count) {
            (Form::Ascii, _) => 2,
            (_, Some(count)) => count.bytes() as u64,
            (_, None) => p.item.bytes() as u64,
        };
        let least = element.count.saturating_mul(element.properties.iter().map(width).sum());
        if least > values.left() as u64 + 1 {
            let what =
                format!("{} of element {}", element.count, String::from_utf8_lossy(&element.name));
            return Err(wrong(
                element.place.clone(),
                what,
                format!("{} bytes of data", values.left()),
            ));
        }
        if element.properties.is_empty() {
            continue;
        }
        for _ in 0..element.count {
            read_one(element, &mut values, vertices, &mut soup, limits)?;
        }
    }
    Ok(soup)
}

fn header(words: &mut Words<'_>) -> Result<(Form, Vec<Element>)> {
    let head = words.next().unwrap_or_default();
    if head != b"ply" {
        return Err(wrong(words.place(), "ply on the first line", quote(head)));
    }
    let (mut form, mut elements) = (None, Vec::<Element>::new());
    loop {
        let Some(word) = words.next() else {
            return Err(wrong(words.place(), "end_header", "the end of the file"));
        };
        let place = words.place();
        match word {
            b"comment" | b"obj_info" => words.skip_line(),
            b"format" => {
                form = Some(match words.next_on_line().unwrap_or_default() {
                    b"ascii" => Form::Ascii,
                    b"binary_little_endian" => Form::Little,
                    b"binary_big_endian" => Form::Big,
                    other => {
                        let what = "ascii, binary_little_endian or binary_big_endian";
                        return Err(wrong(place, what, quote(other)));
                    }
                });
                words.skip_line();
            }
            b"element" => {
                let name = words.next_on_line().unwrap_or_default().to_vec();
                let count = number(words.next_on_line(), "the number of elements", &place)?;
                if !name.is_empty() && elements.len() < 1000 {
                    elements.push(Element { name, count, place, properties: Vec::new() });
                } else {
                    return Err(wrong(place, "at most 1,000 elements with names", quote(&name)));
                }
            }
            b"property" => {
                let Some(element) = elements.last_mut() else {
                    return Err(wrong(place, "an element before its properties", "property"));
                };
                let property = property(words, &element.name, &place)?;
                element.properties.push(property);
            }
            b"end_header" => break,
            other => {
                return Err(wrong(place, "element, property, comment or end_header", quote(other)));
            }
        }
    }
    let Some(form) = form else {
        return Err(wrong(words.place(), "a format line before end_header", "none"));
    };
    if let Some(vertex) = elements.iter().find(|e| e.name == b"vertex") {
        for axis in 0..3 {
            let count = vertex.properties.iter().filter(|p| p.role == Use::Axis(axis)).count();
            if count != 1 {
                let what = format!("one property {} of vertices", ["x", "y", "z"][axis]);
                return Err(wrong(vertex.place.clone(), what, count));
            }
        }
    }
    Ok((form, elements))
}

fn property(words: &mut Words<'_>, element: &[u8], place: &Place) -> Result<Property> {
    let mut next = || words.next_on_line().unwrap_or_default();
    let kind = next();
    let is_list = kind == b"list";
    let count = if is_list { Some(Scalar::named(next(), place)?) } else { None };
    if count.is_some_and(|count| !count.is_integer()) {
        return Err(wrong(place.clone(), "an integer type for the length of a list", "a real one"));
    }
    let item = Scalar::named(if is_list { next() } else { kind }, place)?;
    let name = next();
    let role = match (element, is_list, name) {
        (b"vertex", false, b"x") => Use::Axis(0),
        (b"vertex", false, b"y") => Use::Axis(1),
        (b"vertex", false, b"z") => Use::Axis(2),
        (b"face", true, b"vertex_indices" | b"vertex_index") => Use::Corners,
        (_, _, b"") => {
            return Err(wrong(place.clone(), "the name of a property", "the end of the line"));
        }
        _ => Use::Nothing,
    };
    if role == Use::Corners && !item.is_integer() {
        return Err(wrong(place.clone(), "an integer type for vertices of faces", "a real one"));
    }
    Ok(Property { count, item, role })
}

fn read_one(
    element: &Element,
    values: &mut Values<'_>,
    vertices: u64,
    soup: &mut Soup,
    limits: &Watched<'_>,
) -> Result<()> {
    let (mut point, mut is_vertex, place) = ([0.0; 3], false, values.place());
    for property in &element.properties {
        let Some(count) = property.count else {
            let value = values.next(property.item, "a number")?;
            if let Use::Axis(axis) = property.role {
                point[axis] = value;
                is_vertex = true;
            }
            continue;
        };
        let length = values.next(count, "the length of a list")?;
        // Of text each number takes two bytes, the last one perhaps one.
        let most = values.left() as f64 + 1.0;
        if !(0.0..=most).contains(&length) || length.fract() != 0.0 {
            return Err(wrong(values.place(), "the length of a list, within the file", length));
        }
        for _ in 0..length as u64 {
            let index = values.next(property.item, "a number of a list")?;
            if property.role != Use::Corners {
                continue;
            }
            if !(0.0..vertices as f64).contains(&index) || index.fract() != 0.0 {
                let what = format!("a vertex from 0 to {}", vertices.saturating_sub(1));
                return Err(wrong(values.place(), what, index));
            }
            soup.corners.push(index as u32);
        }
        if property.role == Use::Corners {
            let place = values.place();
            soup.end_polygon(place, limits)?;
        }
    }
    if is_vertex {
        // Of text the line on which the last number stands.
        let place = if let Values::Ascii(words) = values { words.place() } else { place };
        soup.vertex(place, point, limits)?;
    }
    Ok(())
}
