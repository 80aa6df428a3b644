//! Wavefront OBJ: vertices with colours, faces, texture coordinates, normals and materials; other statements are
//! passed over.

use super::Watched;
use super::error::{Place, Result, wrong};
use super::input::{Input, goes_on};
use super::soup::{NONE, Soup, linear};
use super::text::{Words, parse as number, quote};
use std::collections::HashMap;

/// What an OBJ file names besides its faces.
#[derive(Default)]
pub struct Named {
    /// What stands behind each `mtllib`.
    pub libraries: Vec<String>,
    /// Materials in the order of their first use; faces name them by their place here. An empty name is that of faces before
    /// any `usemtl`.
    pub materials: Vec<String>,
    /// Their places by name.
    places: HashMap<String, u32>,
}

/// What is known between lines.
#[derive(Default)]
struct State {
    named: Named,
    /// True if there are smoothing groups.
    smooths: bool,
    /// The largest index, and where it stands: vertices may come later.
    largest: (i64, u64),
}

/// Vertices and faces; negative indices count back from the last vertex so far. Without looks, texture and normal
/// indices are not even read.
pub fn parse(mut input: Input<'_>, mut soup: Soup, limits: &Watched<'_>) -> Result<(Soup, Named)> {
    if matches!(input.ahead(2)?, [0xff, 0xfe, ..] | [0xfe, 0xff, ..]) {
        return Err(wrong(Place::Start, "text in ASCII or UTF-8", "text in UTF-16"));
    }
    let (mut state, mut line) = (State::default(), 1);
    loop {
        let lines = input.lines()?;
        if lines.is_empty() {
            break;
        }
        let joined: Vec<u8>;
        let is_joined =
            lines.contains(&b'\\') && lines.split_inclusive(|&b| b == b'\n').any(goes_on);
        let text = if is_joined {
            joined = join(lines);
            &joined[..]
        } else {
            lines
        };
        let length = lines.len();
        let mut words = Words::new(text, line, Some(b'#'));
        read(&mut words, &mut soup, &mut state, limits)?;
        line = words.line();
        input.skip(length);
    }
    let State { named, smooths, largest } = state;
    if soup.faces() > 0 && largest.0 >= soup.vertices.len() as i64 {
        let what = format!("a vertex from 1 to {}", soup.vertices.len());
        return Err(wrong(Place::Line(largest.1), what, largest.0 + 1));
    }
    if smooths && soup.looks.as_ref().is_some_and(|looks| looks.normals.is_empty()) {
        soup.skip("smoothing groups, since the file has no normals");
    }
    Ok((soup, named))
}

/// Reads whole lines.
fn read(
    words: &mut Words<'_>,
    soup: &mut Soup,
    state: &mut State,
    limits: &Watched<'_>,
) -> Result<()> {
    while let Some(word) = words.next() {
        let line = words.line();
        let place = || Place::Line(line);
        match word {
            b"v" => {
                let mut coordinate = |what| number(words.next_on_line(), what, &place());
                let point = [
                    coordinate("x of a vertex")?,
                    coordinate("y of a vertex")?,
                    coordinate("z of a vertex")?,
                ];
                soup.vertex(place, point, limits)?;
                if soup.looks.is_some() {
                    read_color(words, soup);
                }
            }
            b"f" => {
                if soup.looks.is_some() {
                    use_material(soup, &mut state.named, None);
                }
                while let Some(corner) = words.next_on_line() {
                    let mut parts = corner.split(|&b| b == b'/');
                    let index: i64 = number(parts.next(), "a vertex", &place())?;
                    let count = soup.vertices.len() as i64;
                    let index = match index {
                        0 => {
                            return Err(wrong(place(), "a vertex from 1 on, or from -1 down", "0"));
                        }
                        i if i > 0 => i - 1,
                        i if i.checked_add(count).is_some_and(|i| i >= 0) => i + count,
                        i if count == 0 => {
                            return Err(wrong(place(), "a vertex, of which there are none yet", i));
                        }
                        i => return Err(wrong(place(), format!("a vertex from -{count} on"), i)),
                    };
                    if index >= limits.vertices.min(NONE as usize) as i64 {
                        let what = format!("at most {} vertices", limits.vertices);
                        return Err(wrong(place(), what, quote(corner)));
                    }
                    if index >= state.largest.0 {
                        state.largest = (index, line);
                    }
                    soup.open.push(index as u32);
                    if let Some(looks) = &mut soup.looks {
                        let counts = [looks.uvs.len(), looks.normals.len()];
                        looks.open.push(counts.map(|count| reference(parts.next(), count)));
                    }
                }
                if let Some(looks) = &mut soup.looks
                    && looks.open.iter().all(|&named| named == [NONE; 2])
                {
                    // Nothing to remember of corners that name nothing.
                    looks.open.clear();
                }
                soup.end_polygon(place, limits)?;
            }
            // Text files have no other control characters; so is a binary file found out.
            _ if word.iter().any(|b| b.is_ascii_control()) => {
                return Err(wrong(place(), "text", quote(word)));
            }
            _ if soup.looks.is_none() => {}
            b"vt" | b"vn" => read_row(words, word == b"vt", soup, &place(), limits)?,
            b"usemtl" => {
                let name = rest(words);
                use_material(soup, &mut state.named, Some(name));
            }
            b"mtllib" if state.named.libraries.len() < 1000 => {
                state.named.libraries.push(rest(words))
            }
            b"s" => {
                let group = words.next_on_line().unwrap_or_default();
                state.smooths |= !matches!(group, b"off" | b"0" | b"");
            }
            b"l" | b"p" => soup.skip(format!("{} elements", String::from_utf8_lossy(word))),
            b"curv" | b"curv2" | b"surf" | b"vp" | b"bzp" | b"bsp" => {
                soup.skip("curves and free-form surfaces");
            }
            _ => {}
        }
        words.skip_line();
    }
    Ok(())
}

/// The material of faces that follow: one by name, or the nameless one if there is none yet.
fn use_material(soup: &mut Soup, named: &mut Named, name: Option<String>) {
    let Some(looks) = &mut soup.looks else {
        return;
    };
    let name = match name {
        Some(name) => name,
        None if named.materials.is_empty() => String::new(),
        None => return,
    };
    looks.material = *named.places.entry(name).or_insert_with_key(|name| {
        named.materials.push(name.clone());
        named.materials.len() as u32 - 1
    });
}

/// The colour behind a position, in sRGB; a single number there is a weight.
fn read_color(words: &mut Words<'_>, soup: &mut Soup) {
    let mut next = || -> Option<f32> { words.next_on_line().and_then(maybe) };
    let (Some(r), Some(g), Some(b)) = (next(), next(), next()) else {
        return;
    };
    let Some(looks) = &mut soup.looks else {
        return;
    };
    if [r, g, b].iter().any(|x| !x.is_finite()) {
        looks.skipped.note("colours of vertices that are not numbers");
        return;
    }
    looks.colors.resize(soup.vertices.len() - 1, [1.0; 3]);
    looks.colors.push([r, g, b].map(linear));
}

/// Texture coordinates, with v counted from the top, or a normal.
fn read_row(
    words: &mut Words<'_>,
    is_uv: bool,
    soup: &mut Soup,
    place: &Place,
    limits: &Watched<'_>,
) -> Result<()> {
    let Some(looks) = &mut soup.looks else {
        return Ok(());
    };
    let what = if is_uv { "texture coordinates" } else { "a normal" };
    let count = if is_uv { looks.uvs.len() } else { looks.normals.len() };
    if count >= 3 * limits.faces.max(limits.vertices).min(u32::MAX as usize / 3) {
        return Err(wrong(place.clone(), format!("at most {count} of these"), what));
    }
    // Those that are no numbers count as absent: what counts is that the mesh opens.
    let mut next = |absent: f32| match words.next_on_line() {
        None => absent,
        Some(word) => maybe::<f32>(word).filter(|x| x.is_finite()).unwrap_or(f32::NAN),
    };
    let row = [
        next(f32::NAN),
        next(if is_uv { 0.0 } else { f32::NAN }),
        if is_uv { 0.0 } else { next(f32::NAN) },
    ];
    let is_sound = row.iter().all(|x| x.is_finite());
    if !is_sound {
        looks.skipped.note(format!("{what} that are not numbers"));
    }
    let row = if is_sound { row } else { [0.0; 3] };
    if is_uv {
        looks.uvs.push([row[0], 1.0 - row[1]]);
    } else {
        looks.normals.push(row);
    }
    Ok(())
}

/// The index of a texture coordinate or a normal; what is no index names none.
fn reference(text: Option<&[u8]>, count: usize) -> u32 {
    let Some(index) = text.filter(|text| !text.is_empty()).and_then(maybe::<i64>) else {
        return NONE;
    };
    let index = if index > 0 { index - 1 } else { index.saturating_add(count as i64) };
    match index {
        // 0 counts as the one behind the last and is counted as absent, as is whatever lies below.
        0.. => u32::try_from(index).unwrap_or(NONE - 1),
        _ => NONE - 1,
    }
}

/// A number, where there need be none.
fn maybe<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// The rest of a line, trimmed.
fn rest(words: &mut Words<'_>) -> String {
    String::from_utf8_lossy(words.rest_of_line().trim_ascii()).into_owned()
}

/// The text with line ends behind a backslash moved to the end of the logical line, so that line numbers
/// stay.
fn join(bytes: &[u8]) -> Vec<u8> {
    let (mut out, mut owed) = (Vec::with_capacity(bytes.len()), 0);
    for line in bytes.split_inclusive(|&b| b == b'\n') {
        if goes_on(line) {
            let end = line.trim_ascii_end();
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
