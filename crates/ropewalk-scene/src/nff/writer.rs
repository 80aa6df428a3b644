//! Writes NFF in the layout of the Standard Procedural Databases.

use super::number_format::{NumberFormat, push_number};
use crate::model::{Camera, Light, Material, SceneSink, Surface};
use std::io::{self, Write};

/// Writes each entity as it arrives, as the original generators do: one entity a line, a vertex
/// (and its normal) a line, a field of the view a line, a cone on one line, numbers as by `%g`
/// with 6 digits or as [`NffWriter::number_format`] says.
///
/// Give it a buffered writer; it writes once for each line. The last lines are written when that
/// writer is flushed.
///
/// Errors are those of the writer, and [`io::ErrorKind::InvalidInput`] for what the reader would
/// not read back: a number that is not finite, a polygon of fewer than three vertices, a patch with
/// more or fewer normals than vertices.
pub struct NffWriter<W> {
    output: W,
    format: NumberFormat,
    line: String,
    scratch: String,
}

impl<W: Write> NffWriter<W> {
    /// A writer of numbers with 6 significant digits.
    pub fn new(output: W) -> Self {
        let (line, scratch) = (String::new(), String::new());
        NffWriter { output, format: NumberFormat::default(), line, scratch }
    }

    /// The same writer with another number format.
    pub fn number_format(mut self, format: NumberFormat) -> Self {
        self.format = format;
        self
    }

    /// Gives the output back.
    pub fn into_inner(self) -> W {
        self.output
    }

    /// Writes one line: a keyword (empty on a line of numbers alone) and numbers.
    fn line<'n>(
        &mut self,
        keyword: &str,
        numbers: impl IntoIterator<Item = &'n f64>,
    ) -> io::Result<()> {
        self.line.clear();
        self.line.push_str(keyword);
        for &number in numbers {
            if !number.is_finite() {
                return Err(invalid(format!("cannot write {number}: NFF numbers are finite")));
            }
            if !self.line.is_empty() {
                self.line.push(' ');
            }
            push_number(&mut self.line, &mut self.scratch, number, self.format);
        }
        self.line.push('\n');
        self.output.write_all(self.line.as_bytes())
    }

    fn count_line(&mut self, keyword: &str, count: usize) -> io::Result<()> {
        if count < 3 {
            return Err(invalid(format!(
                "cannot write a polygon of {count} vertices: NFF polygons have at least 3"
            )));
        }
        writeln!(self.output, "{keyword} {count}")
    }
}

fn invalid(message: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, message)
}

impl<W: Write> SceneSink for NffWriter<W> {
    type Error = io::Error;

    fn comment(&mut self, text: &str) -> io::Result<()> {
        // Both line ends end a comment, so each piece needs its own `#`.
        text.split(['\n', '\r']).try_for_each(|line| writeln!(self.output, "#{line}"))
    }

    fn background(&mut self, color: [f64; 3]) -> io::Result<()> {
        self.line("b", &color)
    }

    fn camera(&mut self, camera: &Camera) -> io::Result<()> {
        self.line("v", [])?;
        self.line("from", &camera.from)?;
        self.line("at", &camera.at)?;
        self.line("up", &camera.up)?;
        self.line("angle", [&camera.angle])?;
        self.line("hither", [&camera.hither])?;
        let [width, height] = camera.resolution;
        writeln!(self.output, "resolution {width} {height}")
    }

    fn light(&mut self, light: &Light) -> io::Result<()> {
        self.line("l", light.position.iter().chain(light.color.iter().flatten()))
    }

    fn material(&mut self, material: &Material) -> io::Result<()> {
        let Material { color, kd, ks, shine, transmittance, index_of_refraction } = material;
        self.line("f", color.iter().chain([kd, ks, shine, transmittance, index_of_refraction]))
    }

    fn surface(&mut self, surface: &Surface) -> io::Result<()> {
        match surface {
            Surface::Sphere { center, radius } => self.line("s", center.iter().chain([radius])),
            Surface::Cone(cone) => {
                let base = cone.base.iter().chain([&cone.base_radius]);
                self.line("c", base.chain(&cone.apex).chain([&cone.apex_radius]))
            }
            Surface::Polygon(vertices) => {
                self.count_line("p", vertices.len())?;
                vertices.iter().try_for_each(|vertex| self.line("", vertex))
            }
            Surface::Patch { vertices, normals } => {
                if vertices.len() != normals.len() {
                    let (v, n) = (vertices.len(), normals.len());
                    return Err(invalid(format!(
                        "cannot write a patch of {v} vertices and {n} normals: \
                         each vertex has one normal"
                    )));
                }
                self.count_line("pp", vertices.len())?;
                let mut lines = vertices.iter().zip(normals);
                lines.try_for_each(|(vertex, normal)| self.line("", vertex.iter().chain(normal)))
            }
        }
    }
}
