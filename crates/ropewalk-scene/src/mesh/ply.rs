//! PLY: ascii, or binary of either byte order.

use super::Watched;
use super::beside::Beside;
use super::error::{MeshError, Place, Result, wrong};
use super::input::Input;
use super::picture::{Pictures, load};
use super::skipped::Skipped;
use super::soup::{Soup, linear};
use super::text::{Words, parse as number, quote};
use crate::stage::{Material, Stage, Texture};

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

    /// The value at the beginning of some bytes.
    #[inline(always)]
    fn value(self, bytes: &[u8], is_big: bool) -> f64 {
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
struct Property {
    name: Vec<u8>,
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

impl Element {
    /// Notes what is read over.
    fn note_skipped(&self, soup: &mut Soup) {
        let name = String::from_utf8_lossy(&self.name);
        if !matches!(&self.name[..], b"vertex" | b"face") {
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
    fn plain_faces(&self, wants_looks: bool) -> Option<(usize, usize)> {
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
enum Form {
    Ascii,
    Little,
    Big,
}

/// Where values come from, one after the other.
enum Values<'a, 'b> {
    Ascii(Words<'a>),
    Binary { input: Input<'b>, is_big: bool },
}

impl Values<'_, '_> {
    fn place(&self) -> Place {
        match self {
            Values::Ascii(words) => words.place(),
            Values::Binary { input, .. } => Place::Byte(input.at()),
        }
    }

    fn left(&self) -> u64 {
        match self {
            Values::Ascii(words) => words.left() as u64,
            Values::Binary { input, .. } => input.left(),
        }
    }

    #[inline]
    fn next(&mut self, kind: Scalar, what: &str) -> Result<f64> {
        match self {
            Values::Ascii(words) => words.number(what),
            Values::Binary { input, is_big } => {
                let size = kind.bytes();
                let ahead = input.ahead(size)?;
                if ahead.len() < size {
                    return Err(cut_off(input, what));
                }
                let value = kind.value(ahead, *is_big);
                input.skip(size);
                Ok(value)
            }
        }
    }
}

fn cut_off(input: &Input<'_>, what: &str) -> MeshError {
    wrong(Place::Byte(input.at()), what, "the end of the file")
}

/// Longest header, in bytes.
const MOST_HEADER: usize = 1 << 24;
/// How often the word that ends a header may stand in it.
const MOST_ENDS: usize = 16;

/// Vertices and faces, and the image that the header names. Binary files are read piece by piece.
pub fn parse(
    mut input: Input<'_>,
    mut soup: Soup,
    limits: &Watched<'_>,
) -> Result<(Soup, Option<String>)> {
    let Header { form, elements, texture, length, lines } = read_header(&mut input)?;
    input.skip(length);
    let text;
    let mut values = if form == Form::Ascii {
        text = input.rest()?;
        Values::Ascii(Words::new(&text, lines + 1, None))
    } else {
        Values::Binary { input, is_big: form == Form::Big }
    };
    let count = |name: &[u8]| {
        let all = elements.iter().filter(|e| e.name == name).map(|e| e.count);
        all.fold(0, u64::saturating_add)
    };
    let (vertices, faces) = (count(b"vertex"), count(b"face"));
    check_counts(&elements, form, &values)?;
    // A gzipped file's size is not known; what it holds is paid for as it comes.
    let most = if values.left() == u64::MAX { 1 << 20 } else { usize::MAX };
    let reserved = |count: u64| usize::try_from(count).unwrap_or(usize::MAX).min(most);
    soup.reserve(reserved(vertices), reserved(faces), limits);
    for element in &elements {
        let wants_looks = soup.looks.is_some();
        if wants_looks {
            element.note_skipped(&mut soup);
        }
        if element.properties.is_empty() {
            continue;
        }
        if let Values::Binary { input, is_big } = &mut values {
            if let Some(plan) = Record::of(element, wants_looks) {
                read_records(&plan, element.count, input, *is_big, &mut soup, limits)?;
                continue;
            }
            if let Some((before, behind)) = element.plain_faces(wants_looks) {
                let is_big = *is_big;
                let plan = Faces { before, behind, is_big, vertices };
                read_faces(&plan, element.count, input, &mut soup, limits)?;
                continue;
            }
        }
        for _ in 0..element.count {
            read_one(element, &mut values, vertices, &mut soup, limits)?;
        }
    }
    Ok((soup, texture))
}

/// Gives a stage the image that a header names.
pub fn dress(
    stage: &mut Stage,
    name: &str,
    beside: &Beside<'_>,
    limits: &Watched<'_>,
) -> Result<()> {
    let (mut pictures, mut skipped) = (Pictures::default(), Skipped::default());
    let image = pictures.get(name, || load(beside, name), &mut skipped, limits)?;
    let base_color_texture = image.map(|image| Texture { image, wrap: Default::default() });
    // White under the image.
    let base_color = if image.is_some() { [1.0; 3] } else { Material::default().base_color };
    stage.materials = vec![Material { base_color, base_color_texture, ..Material::default() }];
    stage.images = pictures.images;
    stage.skipped.extend(skipped.sentences());
    Ok(())
}

/// Refuses counts that the data cannot hold.
fn check_counts(elements: &[Element], form: Form, values: &Values<'_, '_>) -> Result<()> {
    let mut left = values.left();
    for element in elements {
        // Each number takes a digit and a space, but perhaps for the last one.
        let width = |p: &Property| match (form, p.count) {
            (Form::Ascii, _) => 2,
            (_, Some(count)) => count.bytes() as u64,
            (_, None) => p.item.bytes() as u64,
        };
        let least = element.count.saturating_mul(element.properties.iter().map(width).sum());
        if left != u64::MAX && least > left + 1 {
            let name = String::from_utf8_lossy(&element.name);
            let what = format!("{} of element {name}", element.count);
            return Err(wrong(element.place.clone(), what, format!("{left} bytes of data")));
        }
        if left != u64::MAX {
            left = left.saturating_sub(least);
        }
    }
    Ok(())
}

/// Elements of numbers alone: where in each record what stands.
struct Record {
    size: usize,
    fields: Vec<(usize, Scalar, Use)>,
}

impl Record {
    /// `None` if the element has lists.
    fn of(element: &Element, wants_looks: bool) -> Option<Record> {
        let (mut size, mut fields) = (0, Vec::new());
        for Property { count, item, role, .. } in &element.properties {
            if count.is_some() {
                return None;
            }
            if matches!(role, Use::Axis(_)) || wants_looks && *role != Use::Nothing {
                fields.push((size, *item, *role));
            }
            size += item.bytes();
        }
        Some(Record { size, fields })
    }
}

fn read_records(
    plan: &Record,
    count: u64,
    input: &mut Input<'_>,
    is_big: bool,
    soup: &mut Soup,
    limits: &Watched<'_>,
) -> Result<()> {
    let (size, mut left) = (plan.size, count);
    while left > 0 {
        let at = input.at();
        let ahead = input.ahead(size)?;
        let here = ((ahead.len() / size) as u64).min(left) as usize;
        if here == 0 {
            return Err(cut_off(input, "a number"));
        }
        for (i, record) in ahead[..here * size].chunks_exact(size).enumerate() {
            let mut row = Row::default();
            for &(offset, kind, role) in &plan.fields {
                row.set(role, kind, kind.value(&record[offset..], is_big));
            }
            row.push(|| Place::Byte(at + (i * size) as u64), soup, limits)?;
        }
        input.skip(here * size);
        left -= here as u64;
    }
    Ok(())
}

/// Faces with a list of 32-bit integers behind a byte, and numbers before and behind that are passed over.
struct Faces {
    before: usize,
    behind: usize,
    is_big: bool,
    vertices: u64,
}

fn read_faces(
    plan: &Faces,
    count: u64,
    input: &mut Input<'_>,
    soup: &mut Soup,
    limits: &Watched<'_>,
) -> Result<()> {
    let &Faces { before, behind, is_big, vertices } = plan;
    let mut left = count;
    while left > 0 {
        let start = input.at();
        let ahead = input.ahead(before + 1 + 4 * 255 + behind)?;
        let mut at = 0;
        while left > 0 {
            let Some(&corners) = ahead.get(at + before) else {
                break;
            };
            let list = at + before + 1;
            let end = list + 4 * usize::from(corners);
            let Some(indices) = ahead.get(list..end).filter(|_| end + behind <= ahead.len()) else {
                break;
            };
            for (i, &bytes) in indices.as_chunks::<4>().0.iter().enumerate() {
                // Negative ones are beyond every count.
                let index =
                    if is_big { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) };
                if u64::from(index) >= vertices {
                    let place = Place::Byte(start + (list + 4 * i + 4) as u64);
                    return Err(out_of_range(place, vertices, index));
                }
                soup.open.push(index);
            }
            soup.end_polygon(|| Place::Byte(start + end as u64), limits)?;
            at = end + behind;
            left -= 1;
        }
        if at == 0 && left > 0 {
            return Err(cut_off(input, "a number of a list"));
        }
        input.skip(at);
    }
    Ok(())
}

fn out_of_range(place: Place, vertices: u64, index: impl std::fmt::Display) -> MeshError {
    wrong(place, format!("a vertex from 0 to {}", vertices.saturating_sub(1)), index)
}

/// What is known of one vertex or face.
#[derive(Default)]
struct Row {
    point: Option<[f64; 3]>,
    normal: Option<[f32; 3]>,
    color: Option<[f32; 3]>,
    uv: Option<[f32; 2]>,
}

impl Row {
    #[inline]
    fn set(&mut self, role: Use, kind: Scalar, value: f64) {
        match role {
            Use::Axis(axis) => self.point.get_or_insert_default()[axis] = value,
            Use::Normal(axis) => self.normal.get_or_insert_default()[axis] = value as f32,
            Use::Color(channel) => {
                let share = match kind {
                    Scalar::U8 | Scalar::I8 => value / 255.0,
                    Scalar::U16 | Scalar::I16 => value / 65535.0,
                    _ => value,
                };
                self.color.get_or_insert_default()[channel] = share as f32;
            }
            Use::Uv(0) => self.uv.get_or_insert_default()[0] = value as f32,
            Use::Uv(_) => self.uv.get_or_insert_default()[1] = 1.0 - value as f32,
            Use::Corners | Use::CornerUvs | Use::Nothing => {}
        }
    }

    /// Adds the vertex, if it is one.
    #[inline]
    fn push(
        self,
        place: impl FnOnce() -> Place,
        soup: &mut Soup,
        limits: &Watched<'_>,
    ) -> Result<()> {
        let Some(point) = self.point else {
            return Ok(());
        };
        soup.vertex(place, point, limits)?;
        let Some(looks) = &mut soup.looks else {
            return Ok(());
        };
        let before = soup.vertices.len() - 1;
        let is_sound = |row: &[f32]| row.iter().all(|x| x.is_finite());
        if let Some(normal) = self.normal {
            looks.normals.resize(before, [0.0; 3]);
            looks.normals.push(if is_sound(&normal) { normal } else { [0.0; 3] });
        }
        if let Some(color) = self.color {
            looks.colors.resize(before, [1.0; 3]);
            looks.colors.push(if is_sound(&color) { color.map(linear) } else { [1.0; 3] });
        }
        if let Some(uv) = self.uv.filter(|_| !looks.has_corner_uvs) {
            looks.uvs.resize(before, [0.0; 2]);
            looks.uvs.push(if is_sound(&uv) { uv } else { [0.0; 2] });
        }
        Ok(())
    }
}

struct Header {
    form: Form,
    elements: Vec<Element>,
    texture: Option<String>,
    /// Bytes and lines of the header.
    length: usize,
    lines: u64,
}

/// Reads the header, however long, without using it up.
fn read_header(input: &mut Input<'_>) -> Result<Header> {
    let (mut wanted, mut ends) = (1 << 12, 0);
    loop {
        let ahead = input.ahead(wanted)?;
        let is_all = ahead.len() < wanted || wanted >= MOST_HEADER || !ahead.starts_with(b"ply");
        let marks = ahead.windows(10).enumerate().filter(|(_, word)| word == b"end_header");
        for (mark, _) in marks.skip(ends).take(MOST_ENDS - ends) {
            let Some(line_end) = ahead[mark..].iter().position(|&b| b == b'\n') else {
                break;
            };
            // What stands in a comment ends nothing.
            if let Ok(header) = header(&ahead[..mark + line_end + 1]) {
                return Ok(header);
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
    Ok(Header { form, elements, texture, length, lines })
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
        (_, _, b"") => {
            return Err(wrong(place.clone(), "the name of a property", "the end of the line"));
        }
        _ => Use::Nothing,
    };
    if role == Use::Corners && !item.is_integer() {
        return Err(wrong(place.clone(), "an integer type for vertices of faces", "a real one"));
    }
    let name = name.to_vec();
    Ok(Property { name, count, item, role })
}

fn read_one(
    element: &Element,
    values: &mut Values<'_, '_>,
    vertices: u64,
    soup: &mut Soup,
    limits: &Watched<'_>,
) -> Result<()> {
    let (mut row, mut corner_uvs, place) = (Row::default(), Vec::new(), values.place());
    let is_face = element.properties.iter().any(|p| p.role == Use::Corners);
    for property in &element.properties {
        let Some(count) = property.count else {
            let value = values.next(property.item, "a number")?;
            row.set(property.role, property.item, value);
            continue;
        };
        let length = values.next(count, "the length of a list")?;
        // Of text each number takes two bytes, the last one perhaps one.
        let most = values.left() as f64 + 1.0;
        if !(0.0..=most).contains(&length) || length.fract() != 0.0 {
            return Err(wrong(values.place(), "the length of a list, within the file", length));
        }
        for i in 0..length as u64 {
            let value = values.next(property.item, "a number of a list")?;
            match property.role {
                Use::Corners => {
                    if !(0.0..vertices as f64).contains(&value) || value.fract() != 0.0 {
                        return Err(out_of_range(values.place(), vertices, value));
                    }
                    if i > limits.corners as u64 {
                        let what = format!("a face of at most {} corners", limits.corners);
                        return Err(wrong(values.place(), what, length));
                    }
                    soup.open.push(value as u32);
                }
                Use::CornerUvs if soup.looks.is_some() && i < 2 * limits.corners as u64 => {
                    corner_uvs.push(value as f32);
                }
                _ => limits.at(i as usize)?,
            }
        }
    }
    // Of text the line on which the last number stands.
    let last = if let Values::Ascii(words) = values { words.place() } else { place };
    if !is_face {
        return row.push(|| last, soup, limits);
    }
    let has_uvs = element.properties.iter().any(|p| p.role == Use::CornerUvs);
    if let Some(looks) = &mut soup.looks {
        looks.polygon_color = row.color.map(|color| color.map(linear));
        if has_uvs {
            looks.name_corners(&soup.open, &corner_uvs);
        }
    }
    soup.end_polygon(|| last, limits)
}
