//! STL, ascii or binary: three vertices a triangle.

use super::error::{Place, Result, wrong};
use super::text::{Words, quote};
use super::{Soup, Watched};

/// Header of a binary file, with the count.
const HEADER: usize = 84;
/// Bytes of a triangle: normal, three vertices, attributes.
const RECORD: usize = 50;

/// Vertices and faces. A file is binary if it has the length that its header announces, whatever it begins
/// with: some binary ones begin with `solid` too.
pub fn parse(bytes: &[u8], limits: &Watched<'_>) -> Result<Soup> {
    let announced = bytes.get(80..HEADER).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let length = announced.map(|count| HEADER as u64 + RECORD as u64 * u64::from(count));
    if length == Some(bytes.len() as u64) {
        return binary(bytes, limits);
    }
    // No text has zero bytes; a binary file that was cut off soon has.
    let is_text = !bytes.iter().take(4 * HEADER).any(|&b| b == 0);
    if is_text && bytes.trim_ascii_start().starts_with(b"solid") {
        return ascii(bytes, limits);
    }
    Err(match (announced, length) {
        (Some(count), Some(length)) => {
            let what = format!("{length} bytes, since the header announces {count} triangles");
            wrong(Place::Byte(80), what, bytes.len())
        }
        _ => wrong(Place::Start, "an STL file of at least 84 bytes, or \"solid\"", bytes.len()),
    })
}

fn binary(bytes: &[u8], limits: &Watched<'_>) -> Result<Soup> {
    let mut soup = Soup::default();
    for (i, record) in bytes[HEADER..].chunks_exact(RECORD).enumerate() {
        let place = Place::Byte((HEADER + i * RECORD) as u64);
        for corner in record[12..48].chunks_exact(12) {
            let x = |a: usize| {
                let b = &corner[4 * a..];
                f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
            };
            soup.corners.push(soup.vertices.len() as u32);
            soup.vertex(place.clone(), [x(0), x(1), x(2)], limits)?;
        }
        soup.end_polygon(place, limits)?;
    }
    Ok(soup)
}

fn ascii(bytes: &[u8], limits: &Watched<'_>) -> Result<Soup> {
    let (mut soup, mut words) = (Soup::default(), Words::new(bytes, 1, None));
    // Corners of the loop that is open.
    let mut open: Option<usize> = None;
    while let Some(word) = words.next() {
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
                soup.corners.push(soup.vertices.len() as u32);
                soup.vertex(place, point, limits)?;
                open = Some(corners + 1);
            }
            (b"endloop", Some(3)) => {
                soup.end_polygon(place, limits)?;
                open = None;
            }
            (b"endloop", Some(corners)) => {
                return Err(wrong(place, "a loop of 3 vertices", corners));
            }
            (b"endfacet", None) => {}
            (_, Some(_)) => return Err(wrong(place, "vertex or endloop", quote(word))),
            (_, None) => {
                return Err(wrong(
                    place,
                    "solid, facet, outer loop, endfacet or endsolid",
                    quote(word),
                ));
            }
        }
    }
    match open {
        Some(_) => Err(wrong(words.place(), "vertex or endloop", "the end of the file")),
        None => Ok(soup),
    }
}
