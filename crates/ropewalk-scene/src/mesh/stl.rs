//! STL, ascii or binary: three vertices a triangle.

use super::error::{Place, Result, wrong};
use super::input::Input;
use super::soup::Soup;
use super::text::{Stream, quote};
use super::{HEAD, Watched};

/// Header of a binary file, with the count.
const HEADER: usize = 84;
/// Bytes of a triangle: normal, three vertices, attributes.
const RECORD: usize = 50;

/// The size that a binary file has whose bytes begin so.
pub fn binary_size(head: &[u8]) -> Option<u64> {
    let announced = head.get(80..HEADER).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))?;
    Some(HEADER as u64 + RECORD as u64 * u64::from(announced))
}

/// Vertices and faces. A file is binary if it has the length that its header announces, whatever it begins
/// with: some binary ones begin with `solid` too. Such files are read piece by piece.
pub fn parse(mut input: Input<'_>, soup: Soup, limits: &Watched<'_>) -> Result<Soup> {
    let length = binary_size(input.ahead(HEADER)?);
    if length.is_some() && length == input.size() {
        return binary(input, soup, limits);
    }
    // No text has zero bytes; a binary file that was cut off, or whose size is not known, soon has.
    let head = input.ahead(HEAD)?;
    let is_text = !head.iter().take(4 * HEADER).any(|&b| b == 0);
    if is_text && head.trim_ascii_start().starts_with(b"solid") {
        let mut words = Stream::new(input, 1, None);
        let result = ascii(&mut words, soup, limits);
        return words.checked(result);
    }
    let bytes = input.rest()?;
    if length == Some(bytes.len() as u64) {
        return binary(Input::of_plain(&bytes, limits)?, soup, limits);
    }
    Err(match length {
        Some(length) => {
            let count = (length - HEADER as u64) / RECORD as u64;
            let what = format!("{length} bytes, since the header announces {count} triangles");
            wrong(Place::Byte(80), what, bytes.len())
        }
        _ => wrong(Place::Start, "an STL file of at least 84 bytes, or \"solid\"", bytes.len()),
    })
}

fn binary(mut input: Input<'_>, mut soup: Soup, limits: &Watched<'_>) -> Result<Soup> {
    let count = (input.left() as usize).saturating_sub(HEADER) / RECORD;
    soup.reserve(3 * count, count, limits);
    if input.ahead(HEADER)?[..80].windows(6).any(|w| w == b"COLOR=") {
        soup.skip("the colour of an STL header");
    }
    input.skip(HEADER);
    let mut left = count;
    while left > 0 {
        let at = input.at();
        let ahead = input.ahead(RECORD)?;
        let here = (ahead.len() / RECORD).min(left);
        if here == 0 {
            return Err(wrong(Place::Byte(at), "a triangle", "the end of the file"));
        }
        for (i, record) in ahead.as_chunks::<RECORD>().0[..here].iter().enumerate() {
            let place = || Place::Byte(at + (i * RECORD) as u64);
            for corner in record[12..48].as_chunks::<12>().0 {
                let x = |a: usize| {
                    let b = &corner[4 * a..];
                    f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
                };
                soup.open.push(soup.vertices.len() as u32);
                soup.vertex(place, [x(0), x(1), x(2)], limits)?;
            }
            soup.end_polygon(place, limits)?;
            if record[48..] != [0, 0] {
                soup.skip("attributes of STL triangles, which hold colours in some files");
            }
        }
        input.skip(here * RECORD);
        left -= here;
    }
    Ok(soup)
}

fn ascii(words: &mut Stream<'_>, mut soup: Soup, limits: &Watched<'_>) -> Result<Soup> {
    // Corners of the loop that is open.
    let mut open: Option<usize> = None;
    let mut word = Vec::new();
    while let Some(next) = words.next() {
        word.clear();
        word.extend_from_slice(next);
        let place = words.place();
        match (word.to_ascii_lowercase().as_slice(), open) {
            // Names may hold any words.
            (b"solid" | b"endsolid", None) => words.skip_line(),
            (b"facet", None) => words.skip_line(),
            (b"outer", None) => {
                words.skip_line();
                open = Some(0);
            }
            (b"vertex", Some(corners)) => {
                let point = [words.number("x")?, words.number("y")?, words.number("z")?];
                soup.open.push(soup.vertices.len() as u32);
                soup.vertex(|| place, point, limits)?;
                open = Some(corners + 1);
            }
            (b"endloop", Some(3)) => {
                soup.end_polygon(|| place, limits)?;
                open = None;
            }
            (b"endloop", Some(corners)) => {
                return Err(wrong(place, "a loop of 3 vertices", corners));
            }
            (b"endfacet", None) => {}
            (_, Some(_)) => return Err(wrong(place, "vertex or endloop", quote(&word))),
            (_, None) => {
                return Err(wrong(
                    place,
                    "solid, facet, outer loop, endfacet or endsolid",
                    quote(&word),
                ));
            }
        }
    }
    match open {
        Some(_) => Err(wrong(words.place(), "vertex or endloop", "the end of the file")),
        None => Ok(soup),
    }
}
