//! PLY: ascii, or binary of either byte order.

mod binary;
mod header;

use super::Watched;
use super::beside::Beside;
use super::error::{MeshError, Place, Result, wrong};
use super::input::Input;
use super::picture::{Pictures, load};
use super::skipped::Skipped;
use super::soup::{Soup, linear};
use super::text::Stream;
use crate::stage::{Material, Stage, Texture};
use binary::{Faces, Record, read_faces, read_records};
use header::{Element, Form, Header, Property, Scalar, Use, read_header};

/// Where values come from, one after the other.
enum Values<'a> {
    Ascii(Stream<'a>),
    Binary { input: Input<'a>, is_big: bool },
}

impl Values<'_> {
    fn place(&self) -> Place {
        match self {
            Values::Ascii(words) => words.place(),
            Values::Binary { input, .. } => Place::Byte(input.at()),
        }
    }

    fn left(&self) -> u64 {
        match self {
            Values::Ascii(words) => words.left(),
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

/// Vertices and faces, and the image that the header names.
pub fn parse(
    mut input: Input<'_>,
    mut soup: Soup,
    limits: &Watched<'_>,
) -> Result<(Soup, Option<String>)> {
    let header = read_header(&mut input)?;
    let Header { form, elements, texture, has_strange_lines, line_end, length, lines } = header;
    if has_strange_lines {
        soup.skip("lines of a PLY header that are none of its statements");
    }
    input.skip(length);
    let mut values = match form {
        Form::Ascii => Values::Ascii(Stream::new(input, lines + 1, None).with_line_end(line_end)),
        Form::Little | Form::Big => Values::Binary { input, is_big: form == Form::Big },
    };
    let result = read_elements(&elements, form, &mut values, &mut soup, limits);
    match values {
        Values::Ascii(words) => words.checked(result)?,
        Values::Binary { .. } => result?,
    }
    Ok((soup, texture))
}

/// All elements, in their order.
fn read_elements(
    elements: &[Element],
    form: Form,
    values: &mut Values<'_>,
    soup: &mut Soup,
    limits: &Watched<'_>,
) -> Result<()> {
    let count = |name: &[u8]| {
        let all = elements.iter().filter(|e| e.name == name).map(|e| e.count);
        all.fold(0, u64::saturating_add)
    };
    let (vertices, faces) = (count(b"vertex"), count(b"face"));
    check_counts(elements, form, values)?;
    // A gzipped file's size is not known; what it holds is paid for as it comes.
    let most = if values.left() == u64::MAX { 1 << 20 } else { usize::MAX };
    let reserved = |count: u64| usize::try_from(count).unwrap_or(usize::MAX).min(most);
    soup.reserve(reserved(vertices), reserved(faces), limits);
    for element in elements {
        let wants_looks = soup.looks.is_some();
        if wants_looks {
            element.note_skipped(soup);
        }
        if element.properties.is_empty() {
            continue;
        }
        if let Values::Binary { input, is_big } = values {
            if let Some(plan) = Record::of(element, wants_looks) {
                read_records(&plan, element.count, input, *is_big, soup, limits)?;
                continue;
            }
            if let Some((before, behind)) = element.plain_faces(wants_looks) {
                let is_big = *is_big;
                let plan = Faces { before, behind, is_big, vertices };
                read_faces(&plan, element.count, input, soup, limits)?;
                continue;
            }
        }
        for _ in 0..element.count {
            read_one(element, values, vertices, soup, limits)?;
        }
    }
    Ok(())
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
fn check_counts(elements: &[Element], form: Form, values: &Values<'_>) -> Result<()> {
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

/// A number as a vertex.
fn index(value: f64, vertices: u64, place: impl Fn() -> Place) -> Result<u32> {
    if !(0.0..vertices as f64).contains(&value) || value.fract() != 0.0 {
        return Err(out_of_range(place(), vertices, value));
    }
    Ok(value as u32)
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
            Use::Corners | Use::Strips | Use::CornerUvs | Use::Nothing => {}
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

fn read_one(
    element: &Element,
    values: &mut Values<'_>,
    vertices: u64,
    soup: &mut Soup,
    limits: &Watched<'_>,
) -> Result<()> {
    let (mut row, mut corner_uvs, place) = (Row::default(), Vec::new(), values.place());
    let is_face = element.properties.iter().any(|p| p.role == Use::Corners);
    // The last two corners of a strip, and how many there were.
    let mut strip = ([0; 2], 0usize);
    if let Some(looks) = &mut soup.looks {
        looks.polygon_color = None;
    }
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
                    let index = index(value, vertices, || values.place())?;
                    if i > limits.corners as u64 {
                        let what = format!("a face of at most {} corners", limits.corners);
                        return Err(wrong(values.place(), what, length));
                    }
                    soup.open.push(index);
                }
                Use::Strips if value == -1.0 => strip.1 = 0,
                Use::Strips => {
                    let index = index(value, vertices, || values.place())?;
                    let ([a, b], known) = strip;
                    strip = ([b, index], known + 1);
                    if known >= 2 {
                        // Every other triangle of a strip is turned.
                        let [a, b] = if known.is_multiple_of(2) { [a, b] } else { [b, a] };
                        soup.open.extend([a, b, index]);
                        soup.end_polygon(|| values.place(), limits)?;
                    }
                    limits.at(i as usize)?;
                }
                Use::CornerUvs if soup.looks.is_some() && i < 2 * limits.corners as u64 => {
                    corner_uvs.push(value as f32);
                }
                _ => limits.at(i as usize)?,
            }
        }
    }
    let mut last = place;
    if let Values::Ascii(words) = values {
        // The line on which the last number stands. Each element has its own, on which some programs wrote more.
        last = words.place();
        if words.peek_on_line().is_some() {
            soup.skip("numbers on lines of PLY elements that the header does not name");
        }
        words.skip_line();
    }
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
