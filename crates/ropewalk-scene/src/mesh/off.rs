//! OFF, ascii; also COFF, NOFF, STOFF and their like, of which positions are read.

use super::Watched;
use super::error::{Place, Result, wrong};
use super::input::Input;
use super::soup::Soup;
use super::text::{Stream, quote};

/// Vertices and faces.
pub fn parse(input: Input<'_>, soup: Soup, limits: &Watched<'_>) -> Result<Soup> {
    let mut words = Stream::new(input, 1, Some(b'#'));
    let result = read(&mut words, soup, limits);
    words.checked(result)
}

fn read(words: &mut Stream<'_>, mut soup: Soup, limits: &Watched<'_>) -> Result<Soup> {
    let head = words.next().unwrap_or_default().to_vec();
    let is_known = matches!(
        &head[..],
        b"OFF" | b"COFF" | b"NOFF" | b"CNOFF" | b"STOFF" | b"STCOFF" | b"STNOFF" | b"STCNOFF"
    );
    if !is_known {
        return Err(wrong(words.place(), "OFF, or COFF, NOFF or STOFF", quote(&head)));
    }
    if words.peek_on_line() == Some(b"BINARY") {
        return Err(wrong(words.place(), "an ascii OFF file", "BINARY"));
    }
    let vertices = words.count("the number of vertices")?;
    let place = words.place();
    let faces = words.count("the number of faces")?;
    // Often absent, never of use.
    words.skip_line();
    // A vertex takes 6 bytes at least, a face 8.
    let needed = vertices.saturating_mul(6).saturating_add(faces.saturating_mul(8));
    if needed > words.left().saturating_add(1) {
        let what = format!("{vertices} vertices and {faces} faces");
        return Err(wrong(place, what, format!("{} bytes of text", words.left())));
    }
    if head != b"OFF" {
        soup.skip("colours, normals and texture coordinates of OFF vertices");
    }
    // A gzipped file's size is not known; what it holds is paid for as it comes.
    let most = if words.left() == u64::MAX { 1 << 20 } else { u64::MAX };
    soup.reserve(vertices.min(most) as usize, faces.min(most) as usize, limits);
    for _ in 0..vertices {
        let x = words.number("x of a vertex")?;
        let (y, z) = (words.number("y of a vertex")?, words.number("z of a vertex")?);
        soup.vertex(|| words.place(), [x, y, z], limits)?;
        words.skip_line();
    }
    for _ in 0..faces {
        let corners = words.count("the number of corners of a face")?;
        if corners > limits.corners as u64 {
            return Err(wrong(
                words.place(),
                format!("at most {} corners", limits.corners),
                corners,
            ));
        }
        for _ in 0..corners {
            let index = words.count("a vertex")?;
            if index >= vertices {
                return Err(out_of_range(words.place(), vertices, index));
            }
            soup.open.push(index as u32);
        }
        let place = words.place();
        if words.next_on_line().is_some() {
            soup.skip("colours of OFF faces");
        }
        words.skip_line();
        soup.end_polygon(|| place, limits)?;
    }
    Ok(soup)
}

fn out_of_range(place: Place, vertices: u64, index: u64) -> super::MeshError {
    let what = match vertices {
        0 => "no face, since there are no vertices".to_owned(),
        n => format!("a vertex from 0 to {}", n - 1),
    };
    wrong(place, what, index)
}
