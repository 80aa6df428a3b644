//! The grammar: words become calls of a [`SceneSink`].

use super::error::{NffError, NffErrorKind, NffReadError, quote};
use super::lexer::{Lexeme, Lexer};
use super::limits::NffLimits;
use crate::model::{Camera, Cone, Light, Material, SceneSink, Surface};
use std::fmt::{self, Arguments};
use std::io::BufRead;

/// What a text held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct NffStats {
    /// Bytes of text.
    pub bytes: u64,
    /// Comments.
    pub comments: u64,
    /// Lights (`l`).
    pub lights: u64,
    /// Materials (`f`).
    pub materials: u64,
    /// Spheres (`s`).
    pub spheres: u64,
    /// Cones and cylinders (`c`).
    pub cones: u64,
    /// Polygons (`p`).
    pub polygons: u64,
    /// Patches (`pp`).
    pub patches: u64,
    /// Spheres of radius 0 and cones without length or radius, counted above too.
    pub degenerate: u64,
}

impl NffStats {
    /// Objects of all kinds.
    pub fn objects(&self) -> u64 {
        self.spheres + self.cones + self.polygons + self.patches
    }
}

/// Reads a text of the [grammar](crate::nff) and hands each entity to `sink` as soon as it is
/// complete, comments within an entity before it. Comments are cut at 4,096 bytes; bytes in them
/// that are not UTF-8 become U+FFFD.
///
/// Memory: one entity. Time: 5 to 7 ns a byte on the processors of 2024.
///
/// # Errors
/// [`NffReadError::Input`] at the first fault of the text, a passed limit or a failed read, with
/// line and column; [`NffReadError::Sink`] if `sink` refuses a piece. What was complete before the
/// error has reached the sink.
pub fn read_nff<R: BufRead, S: SceneSink>(
    input: R,
    limits: &NffLimits,
    sink: &mut S,
) -> Result<NffStats, NffReadError<S::Error>> {
    let stats = NffStats::default();
    let mut parser =
        Parser { lexer: Lexer::new(input, limits), peeked: None, limits, sink, stats, after: "" };
    while parser.entity()? {}
    if parser.stats.objects() == 0 {
        return Err(parser.lexer.error(NffErrorKind::NoObjects).into());
    }
    parser.stats.bytes = parser.lexer.offset();
    Ok(parser.stats)
}

/// A word that was looked at or taken.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Token {
    Word,
    End,
}

struct Parser<'a, R, S> {
    lexer: Lexer<R>,
    /// A token that was looked at but not taken; its bytes are the lexer's text.
    peeked: Option<Token>,
    limits: &'a NffLimits,
    sink: &'a mut S,
    stats: NffStats,
    /// For messages: what the last entity consisted of.
    after: &'static str,
}

const POINT: [&str; 3] = ["x", "y", "z"];
const COLOR: [&str; 3] = ["red", "green", "blue"];
const VIEW_FIELDS: [&str; 6] = ["from", "at", "up", "angle", "hither", "resolution"];

impl<R: BufRead, S: SceneSink> Parser<'_, R, S> {
    /// Reads one entity; false at the end of the text.
    fn entity(&mut self) -> Result<bool, NffReadError<S::Error>> {
        if self.take()? == Token::End {
            return Ok(false);
        }
        match self.lexer.text() {
            b"s" => self.sphere()?,
            b"c" => self.cone()?,
            b"p" => self.polygon()?,
            b"pp" => self.patch()?,
            b"f" => self.material()?,
            b"l" => self.light()?,
            b"b" => self.background()?,
            b"v" => self.view()?,
            other => {
                let (found, after) = (quote(other), self.after);
                return Err(self.lexer.error(NffErrorKind::UnknownEntity { after, found }).into());
            }
        }
        Ok(true)
    }

    fn sphere(&mut self) -> Result<(), NffReadError<S::Error>> {
        let center = self.vector("the sphere's centre", POINT)?;
        let radius = self.number(format_args!("the sphere's radius"))?;
        self.stats.spheres += 1;
        self.stats.degenerate += u64::from(radius == 0.0);
        self.after = " after the 4 numbers of s";
        self.surface(&Surface::Sphere { center, radius })
    }

    fn cone(&mut self) -> Result<(), NffReadError<S::Error>> {
        let base = self.vector("the cone's base", POINT)?;
        let base_radius = self.number(format_args!("the cone's base radius"))?;
        let apex = self.vector("the cone's apex", POINT)?;
        let apex_radius = self.number(format_args!("the cone's apex radius"))?;
        if (base_radius < 0.0 && apex_radius > 0.0) || (base_radius > 0.0 && apex_radius < 0.0) {
            let sign = if base_radius < 0.0 { "negative" } else { "positive" };
            return Err(self.unexpected(format_args!(
                "the cone's apex radius to be {sign} or zero, like its base radius"
            )));
        }
        self.stats.cones += 1;
        self.stats.degenerate +=
            u64::from(base == apex || (base_radius == 0.0 && apex_radius == 0.0));
        self.after = " after the 8 numbers of c";
        self.surface(&Surface::Cone(Cone { base, base_radius, apex, apex_radius }))
    }

    fn polygon(&mut self) -> Result<(), NffReadError<S::Error>> {
        let count = self.vertex_count("polygon")?;
        let mut vertices = Vec::new();
        for i in 1..=count {
            vertices.push(self.vector(Item { name: "vertex", i, count }, POINT)?);
        }
        self.stats.polygons += 1;
        self.after = " after the announced vertices of p";
        self.surface(&Surface::Polygon(vertices))
    }

    fn patch(&mut self) -> Result<(), NffReadError<S::Error>> {
        let count = self.vertex_count("patch")?;
        let (mut vertices, mut normals) = (Vec::new(), Vec::new());
        for i in 1..=count {
            vertices.push(self.vector(Item { name: "vertex", i, count }, POINT)?);
            normals.push(self.vector(Item { name: "normal", i, count }, POINT)?);
        }
        self.stats.patches += 1;
        self.after = " after the announced vertices and normals of pp";
        self.surface(&Surface::Patch { vertices, normals })
    }

    fn material(&mut self) -> Result<(), NffReadError<S::Error>> {
        let found = self.stats.materials + 1;
        self.check_limit("materials (f)", self.limits.materials.into(), found)?;
        let material = Material {
            color: self.vector("the material's colour", COLOR)?,
            kd: self.number(format_args!("Kd of the material"))?,
            ks: self.number(format_args!("Ks of the material"))?,
            shine: self.number(format_args!("the material's shine"))?,
            transmittance: self.number(format_args!("the material's transmittance"))?,
            index_of_refraction: self.number(format_args!("the material's index of refraction"))?,
        };
        self.stats.materials = found;
        self.after = " after the 8 numbers of f";
        self.sink.material(&material).map_err(NffReadError::Sink)
    }

    fn light(&mut self) -> Result<(), NffReadError<S::Error>> {
        let found = self.stats.lights + 1;
        self.check_limit("lights (l)", self.limits.lights.into(), found)?;
        let position = self.vector("the light's position", POINT)?;
        self.after = " or a colour after the 3 numbers of l";
        let mut color = None;
        if self.peek()? == Token::Word && begins_number(self.lexer.text()) {
            color = Some(self.vector("the light's colour", COLOR)?);
            self.after = " after the 6 numbers of l";
        }
        self.stats.lights = found;
        self.sink.light(&Light { position, color }).map_err(NffReadError::Sink)
    }

    fn background(&mut self) -> Result<(), NffReadError<S::Error>> {
        let color = self.vector("the background's colour", COLOR)?;
        self.after = " after the 3 numbers of b";
        self.sink.background(color).map_err(NffReadError::Sink)
    }

    fn view(&mut self) -> Result<(), NffReadError<S::Error>> {
        let mut given = [false; 6];
        let zero = [0.0; 3];
        let mut camera =
            Camera { from: zero, at: zero, up: zero, angle: 0.0, hither: 0.0, resolution: [0; 2] };
        while given.contains(&false) {
            let token = self.take()?;
            let word = self.lexer.text();
            let field = VIEW_FIELDS.iter().position(|f| f.as_bytes() == word);
            let Some(field) = field.filter(|&f| token == Token::Word && !given[f]) else {
                return Err(self.unexpected(format_args!("{}", MissingFields(given))));
            };
            given[field] = true;
            match VIEW_FIELDS[field] {
                "from" => camera.from = self.vector("the view's from", POINT)?,
                "at" => camera.at = self.vector("the view's at", POINT)?,
                "up" => camera.up = self.vector("the view's up", POINT)?,
                "angle" => camera.angle = self.angle()?,
                "hither" => camera.hither = self.number(format_args!("the view's hither"))?,
                _ => camera.resolution = [self.pixels("width")?, self.pixels("height")?],
            }
        }
        self.after = " after the six fields of v";
        self.sink.camera(&camera).map_err(NffReadError::Sink)
    }

    fn angle(&mut self) -> Result<f64, NffReadError<S::Error>> {
        let angle = self.number(format_args!("the view's angle"))?;
        if angle <= 0.0 || angle >= 180.0 {
            return Err(self.unexpected(format_args!("a view angle between 0 and 180 degrees")));
        }
        Ok(angle)
    }

    fn pixels(&mut self, what: &str) -> Result<u32, NffReadError<S::Error>> {
        let expected = format_args!("a whole number from 1 for the resolution's {what}");
        match self.whole_number(expected)? {
            pixels @ 1.. => u32::try_from(pixels).map_err(|_| {
                let (what, limit) = ("pixels a side", u32::MAX.into());
                let found = quote(self.lexer.text());
                self.lexer.error(NffErrorKind::Limit { what, limit, found }).into()
            }),
            0 => Err(self.unexpected(expected)),
        }
    }

    fn vertex_count(&mut self, what: &str) -> Result<u64, NffReadError<S::Error>> {
        let expected = format_args!("a whole number from 3 for the {what}'s vertex count");
        let count = self.whole_number(expected)?;
        if count < 3 {
            return Err(self.unexpected(expected));
        }
        let limit = self.limits.vertices_per_polygon;
        if count > limit {
            let (what, found) = ("vertices in a polygon", quote(self.lexer.text()));
            return Err(self.lexer.error(NffErrorKind::Limit { what, limit, found }).into());
        }
        Ok(count)
    }

    /// Hands an object over.
    fn surface(&mut self, surface: &Surface) -> Result<(), NffReadError<S::Error>> {
        self.check_limit("objects", self.limits.objects, self.stats.objects())?;
        self.sink.surface(surface).map_err(NffReadError::Sink)
    }

    /// Three numbers, called `axes` of `what` in messages.
    fn vector(
        &mut self,
        what: impl fmt::Display,
        axes: [&str; 3],
    ) -> Result<[f64; 3], NffReadError<S::Error>> {
        let mut vector = [0.0; 3];
        for (number, axis) in vector.iter_mut().zip(axes) {
            *number = self.number(format_args!("{axis} of {what}"))?;
        }
        Ok(vector)
    }

    /// A finite number that `f32` can hold.
    fn number(&mut self, what: Arguments<'_>) -> Result<f64, NffReadError<S::Error>> {
        self.take()?;
        match parse_f64(self.lexer.text()) {
            Some(number) if (number as f32).is_finite() => Ok(number),
            Some(number) if number.is_finite() => {
                Err(self.unexpected(format_args!("a number of at most 3.4e38 for {what}")))
            }
            Some(_) => Err(self.unexpected(format_args!("a finite number for {what}"))),
            None => Err(self.unexpected(format_args!("a number for {what}"))),
        }
    }

    /// Digits only; a number beyond `u64` becomes `u64::MAX`, which exceeds every limit.
    fn whole_number(&mut self, expected: Arguments<'_>) -> Result<u64, NffReadError<S::Error>> {
        self.take()?;
        let text = self.lexer.text();
        if text.is_empty() || !text.iter().all(u8::is_ascii_digit) {
            return Err(self.unexpected(expected));
        }
        let digits = text.iter().map(|digit| u64::from(digit - b'0'));
        Ok(digits.fold(0, |n: u64, digit| n.saturating_mul(10).saturating_add(digit)))
    }

    /// The next word or the end, not yet taken. Comments go to the sink.
    fn peek(&mut self) -> Result<Token, NffReadError<S::Error>> {
        if let Some(token) = self.peeked {
            return Ok(token);
        }
        let token = loop {
            match self.lexer.next()? {
                Lexeme::Word => break Token::Word,
                Lexeme::End => break Token::End,
                Lexeme::Comment => {
                    self.stats.comments += 1;
                    let text = String::from_utf8_lossy(self.lexer.text());
                    self.sink.comment(&text).map_err(NffReadError::Sink)?;
                }
            }
        };
        self.peeked = Some(token);
        Ok(token)
    }

    /// Takes the next word; its bytes stay in the lexer, empty at the end of the text.
    fn take(&mut self) -> Result<Token, NffReadError<S::Error>> {
        let token = self.peek()?;
        self.peeked = None;
        Ok(token)
    }

    /// The error that the last word, or the end of the text, is not what the grammar asks for.
    #[cold]
    fn unexpected(&self, expected: Arguments<'_>) -> NffReadError<S::Error> {
        let expected = expected.to_string();
        let kind = match self.lexer.text() {
            b"" => NffErrorKind::Truncated { expected },
            word => NffErrorKind::Unexpected { expected, found: quote(word) },
        };
        self.lexer.error(kind).into()
    }

    fn check_limit(&self, what: &'static str, limit: u64, found: u64) -> Result<(), NffError> {
        if found <= limit {
            return Ok(());
        }
        let found = found.to_string();
        Err(self.lexer.error(NffErrorKind::Limit { what, limit, found }))
    }
}

/// A numbered part of a polygon, for messages.
#[derive(Clone, Copy)]
struct Item {
    name: &'static str,
    i: u64,
    count: u64,
}

impl fmt::Display for Item {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} of {}", self.name, self.i, self.count)
    }
}

/// The fields that a view still lacks, for messages.
struct MissingFields([bool; 6]);

impl fmt::Display for MissingFields {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let missing = VIEW_FIELDS.iter().zip(self.0).filter(|(_, given)| !given);
        for (i, (field, _)) in missing.enumerate() {
            write!(f, "{}{field}", if i == 0 { "the view's " } else { " or " })?;
        }
        Ok(())
    }
}

fn parse_f64(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// True for every word that is meant as a number, so that a bad one is reported as such.
fn begins_number(word: &[u8]) -> bool {
    matches!(word.first(), Some(b'0'..=b'9' | b'+' | b'-' | b'.')) || parse_f64(word).is_some()
}
