//! The header: what elements there are, of which properties, and how numbers are written.

use super::super::error::{Place, Result, wrong};
use super::super::input::Input;
use super::super::soup::Soup;
use super::super::text::{Words, parse as number, quote};

/// A scalar type of a property.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scalar {
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
    pub fn named(name: &[u8], place: &Place) -> Result<Scalar> {
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

    pub fn bytes(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::F64 => 8,
        }
    }

    /// The value at the beginning of some bytes.
    #[inline(always)]
    pub fn value(self, bytes: &[u8], is_big: bool) -> f64 {
        let size = self.bytes();
        let mut b = [0; 8];
        b[..size].copy_from_slice(&bytes[..size]);
        if is_big {
            b[..size].reverse();
        }
        match self {
            Scalar::I8 => f64::from(b[0] as i8),
            Scalar::U8 => f64::from(b[0]),
            Scalar::I16 => f64::from(i16::from_le_bytes([b[0], b[1]])),
            Scalar::U16 => f64::from(u16::from_le_bytes([b[0], b[1]])),
            Scalar::I32 => f64::from(i32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            Scalar::U32 => f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            Scalar::F32 => f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            Scalar::F64 => f64::from_le_bytes(b),
        }
    }

    pub fn is_integer(self) -> bool {
        !matches!(self, Scalar::F32 | Scalar::F64)
    }
}

/// What a property is for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Use {
    /// Coordinate of a vertex.
    Axis(usize),
    /// Corners of a face.
    Corners,
    /// Corners of strips of triangles, with -1 between them.
    Strips,
    /// Component of a vertex's normal.
    Normal(usize),
    /// Component of the colour of a vertex or a face, in sRGB.
    Color(usize),
    /// Texture coordinate of a vertex, v counted from below.
    Uv(usize),
    /// Texture coordinates of a face's corners, in pairs.
    CornerUvs,
    Nothing,
}

/// A property: a number, or a list if it has a type for counts.
pub struct Property {
    pub name: Vec<u8>,
    pub count: Option<Scalar>,
    pub item: Scalar,
    pub role: Use,
}

pub struct Element {
    pub name: Vec<u8>,
    pub count: u64,
    pub place: Place,
    pub properties: Vec<Property>,
}

impl Element {
    /// Notes what is read over.
    pub fn note_skipped(&self, soup: &mut Soup) {
        let name = String::from_utf8_lossy(&self.name);
        if !matches!(&self.name[..], b"vertex" | b"face" | b"tristrips") {
            soup.skip(format!("elements {name}"));
            return;
        }
        for property in self.properties.iter().filter(|p| p.role == Use::Nothing) {
            let property = String::from_utf8_lossy(&property.name);
            soup.skip(format!("property {property} of element {name}"));
        }
    }

    /// Bytes before and behind the corners, if these are the only list, of 32-bit integers behind a byte, and
    /// nothing else is wanted.
    pub fn plain_faces(&self, wants_looks: bool) -> Option<(usize, usize)> {
        let all = &self.properties;
        let corners = all.iter().position(|p| p.role == Use::Corners)?;
        let is_plain = all.iter().enumerate().all(|(i, p)| {
            i == corners || p.count.is_none() && !(wants_looks && p.role != Use::Nothing)
        });
        let Property { count, item, .. } = &all[corners];
        let fits = *count == Some(Scalar::U8) && matches!(item, Scalar::I32 | Scalar::U32);
        let bytes = |all: &[Property]| all.iter().map(|p| p.item.bytes()).sum();
        (is_plain && fits).then(|| (bytes(&all[..corners]), bytes(&all[corners + 1..])))
    }
}

/// How numbers are written.
#[derive(Clone, Copy, PartialEq)]
pub enum Form {
    Ascii,
    Little,
    Big,
}

/// Longest header, in bytes.
const MOST_HEADER: usize = 1 << 24;
/// How often the word that ends a header may stand in it.
const MOST_ENDS: usize = 16;

pub struct Header {
    pub form: Form,
    pub elements: Vec<Element>,
    pub texture: Option<String>,
    /// True if it has lines that are none of a header's.
    pub has_strange_lines: bool,
    /// What ends its lines.
    pub line_end: u8,
    /// Bytes and lines of the header.
    pub length: usize,
    pub lines: u64,
}

/// Reads the header, however long, without using it up.
pub fn read_header(input: &mut Input<'_>) -> Result<Header> {
    let (mut wanted, mut ends) = (1 << 12, 0);
    loop {
        let ahead = input.ahead(wanted)?;
        let is_all = ahead.len() < wanted || wanted >= MOST_HEADER || !ahead.starts_with(b"ply");
        // Lines may end as on old Macintoshes.
        let is_cr = ahead.starts_with(b"ply\r") && ahead.get(4) != Some(&b'\n');
        let line_end = if is_cr { b'\r' } else { b'\n' };
        let header = |bytes: &[u8]| match is_cr {
            false => header(bytes),
            true => header(
                &bytes.iter().map(|&b| if b == b'\r' { b'\n' } else { b }).collect::<Vec<_>>(),
            ),
        };
        let marks = ahead.windows(10).enumerate().filter(|(_, word)| word == b"end_header");
        for (mark, _) in marks.skip(ends).take(MOST_ENDS - ends) {
            let Some(end) = ahead[mark..].iter().position(|&b| b == line_end) else {
                break;
            };
            // What stands in a comment ends nothing.
            if let Ok(header) = header(&ahead[..mark + end + 1]) {
                return Ok(Header { line_end, ..header });
            }
            ends += 1;
        }
        if is_all || ends >= MOST_ENDS {
            return header(ahead);
        }
        wanted *= 2;
    }
}

fn header(bytes: &[u8]) -> Result<Header> {
    let words = &mut Words::new(bytes, 1, None);
    let head = words.next().unwrap_or_default();
    if head != b"ply" {
        return Err(wrong(words.place(), "ply on the first line", quote(head)));
    }
    let (mut form, mut elements, mut texture) = (None, Vec::<Element>::new(), None);
    let mut has_strange_lines = false;
    loop {
        let Some(word) = words.next() else {
            return Err(wrong(words.place(), "end_header", "the end of the file"));
        };
        let place = words.place();
        match word {
            b"comment" | b"obj_info" => {
                if words.next_on_line() == Some(b"TextureFile") {
                    let name = String::from_utf8_lossy(words.rest_of_line().trim_ascii());
                    texture.get_or_insert(name.into_owned());
                }
                words.skip_line();
            }
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
            // Comments without the word, which some programs wrote; further on they could be misspelt properties.
            other if form.is_some() && elements.is_empty() && other.is_ascii() => {
                has_strange_lines = true;
                words.skip_line();
            }
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
    // The data begin behind the line of end_header.
    words.skip_line();
    let (length, lines) = (bytes.len() - words.left(), words.line() - 1);
    Ok(Header { form, elements, texture, has_strange_lines, line_end: b'\n', length, lines })
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
        (b"vertex", false, b"nx") => Use::Normal(0),
        (b"vertex", false, b"ny") => Use::Normal(1),
        (b"vertex", false, b"nz") => Use::Normal(2),
        (b"vertex", false, b"s" | b"u" | b"texture_u") => Use::Uv(0),
        (b"vertex", false, b"t" | b"v" | b"texture_v") => Use::Uv(1),
        (b"vertex" | b"face", false, b"red" | b"diffuse_red") => Use::Color(0),
        (b"vertex" | b"face", false, b"green" | b"diffuse_green") => Use::Color(1),
        (b"vertex" | b"face", false, b"blue" | b"diffuse_blue") => Use::Color(2),
        (b"face", true, b"vertex_indices" | b"vertex_index") => Use::Corners,
        (b"face", true, b"texcoord") => Use::CornerUvs,
        (b"tristrips", true, b"vertex_indices" | b"vertex_index") => Use::Strips,
        (_, _, b"") => {
            return Err(wrong(place.clone(), "the name of a property", "the end of the line"));
        }
        _ => Use::Nothing,
    };
    if matches!(role, Use::Corners | Use::Strips) && !item.is_integer() {
        return Err(wrong(place.clone(), "an integer type for vertices of faces", "a real one"));
    }
    let name = name.to_vec();
    Ok(Property { name, count, item, role })
}
