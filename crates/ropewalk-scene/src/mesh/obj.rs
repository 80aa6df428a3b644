//! Wavefront OBJ: `v` and `f`, everything else is passed over.

use super::error::{Result, wrong};
use super::text::{Words, parse as number, quote};
use super::{Soup, Watched};

/// Vertices and faces. Colours and weights behind positions are ignored, as are texture and normal indices;
/// negative indices count back from the last vertex so far.
pub fn parse(bytes: &[u8], limits: &Watched<'_>) -> Result<Soup> {
    // A backslash at the end of a line goes on with the next one.
    let joined: Vec<u8>;
    let is_joined =
        bytes.windows(2).any(|w| w == b"\\\n") || bytes.windows(3).any(|w| w == b"\\\r\n");
    let bytes = if is_joined {
        joined = join(bytes);
        &joined[..]
    } else {
        bytes
    };
    let (mut soup, mut words) = (Soup::default(), Words::new(bytes, 1, Some(b'#')));
    // The largest index, and where it stands: vertices may come later.
    let mut largest = (0, words.place());
    while let Some(word) = words.next() {
        let place = words.place();
        match word {
            b"v" => {
                let mut coordinate = |what| number(words.next_on_line(), what, &place);
                let point = [
                    coordinate("x of a vertex")?,
                    coordinate("y of a vertex")?,
                    coordinate("z of a vertex")?,
                ];
                soup.vertex(place, point, limits)?;
            }
            b"f" => {
                while let Some(corner) = words.next_on_line() {
                    let first = corner.split(|&b| b == b'/').next();
                    let index: i64 = number(first, "a vertex", &place)?;
                    let count = soup.vertices.len() as i64;
                    let index = match index {
                        0 => return Err(wrong(place, "a vertex from 1 on, or from -1 down", "0")),
                        i if i > 0 => i - 1,
                        i if i.checked_add(count).is_some_and(|i| i >= 0) => i + count,
                        i => return Err(wrong(place, format!("a vertex from -{count} on"), i)),
                    };
                    if index >= limits.vertices.min(u32::MAX as usize) as i64 {
                        return Err(wrong(
                            place,
                            format!("at most {} vertices", limits.vertices),
                            quote(corner),
                        ));
                    }
                    if index >= largest.0 {
                        largest = (index, place.clone());
                    }
                    soup.corners.push(index as u32);
                }
                soup.end_polygon(place, limits)?;
            }
            // Text files have no other control characters; so is a binary file found out.
            _ if word.iter().any(|b| b.is_ascii_control()) => {
                return Err(wrong(place, "text", quote(word)));
            }
            _ => {}
        }
        words.skip_line();
    }
    if !soup.ends.is_empty() && largest.0 >= soup.vertices.len() as i64 {
        let what = format!("a vertex from 1 to {}", soup.vertices.len());
        return Err(wrong(largest.1, what, largest.0 + 1));
    }
    Ok(soup)
}

/// The text with line ends behind a backslash moved to the end of the logical line, so that line numbers
/// stay.
fn join(bytes: &[u8]) -> Vec<u8> {
    let (mut out, mut owed) = (Vec::with_capacity(bytes.len()), 0);
    for line in bytes.split_inclusive(|&b| b == b'\n') {
        let end = line.trim_ascii_end();
        if end.last() == Some(&b'\\') && line.last() == Some(&b'\n') {
            out.extend_from_slice(&end[..end.len() - 1]);
            out.push(b' ');
            owed += 1;
        } else {
            out.extend_from_slice(line);
            if line.last() == Some(&b'\n') {
                out.resize(out.len() + owed, b'\n');
                owed = 0;
            }
        }
    }
    out
}
