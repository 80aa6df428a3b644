//! Pictures of paths as files.

use super::film::Film;
use super::tone::{Tone, automatic_exposure, developed};
use crate::image_file::{
    ImageFileError, ImageFormat, Plane, check_image_path, write_image, write_planes,
};
use std::path::Path;

/// How a picture is made fit for a display; EXR files do not need it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Development {
    /// Stops by which the picture is brightened; `None` makes its geometric mean mid-grey.
    pub exposure: Option<f32>,
    /// The tone curve.
    pub tone: Tone,
}

/// Writes the picture in the format of the extension, whole or not at all: a PNG for displays, or an EXR of linear
/// radiance with the layers `albedo` and `normal` and the channels `Z` (distance, infinite where nothing is hit), `id`
/// (face, [`NO_FACE`](super::NO_FACE) where none is) and `samples`, and `steps` and `blocks` if the film has [`Film::walks`].
///
/// # Errors
/// [`ImageFileError`]; [`ImageFileError::Cancelled`] if no pass is complete. Nothing is left behind.
pub fn write_film(path: &Path, film: &Film, how: &Development) -> Result<(), ImageFileError> {
    if film.samples() == 0 {
        return Err(ImageFileError::Cancelled { path: path.into() });
    }
    if check_image_path(path)? == ImageFormat::Png {
        let exposure = how.exposure.unwrap_or_else(|| automatic_exposure(film));
        return write_image(path, &developed(film, exposure, how.tone));
    }
    let plane = |pixels: &[[f32; 3]], c: usize| pixels.iter().map(|p| p[c]).collect();
    let mut planes = Vec::new();
    let colors = [
        (["R", "G", "B"], film.radiance()),
        (["albedo.R", "albedo.G", "albedo.B"], film.albedo()),
        (["normal.X", "normal.Y", "normal.Z"], film.normal()),
    ];
    for (names, pixels) in colors {
        for (c, name) in names.into_iter().enumerate() {
            planes.push((name, Plane::Float(plane(&pixels, c))));
        }
    }
    planes.push(("Z", Plane::Float(film.depth().to_vec())));
    planes.push(("id", Plane::Whole(film.face().to_vec())));
    planes.push(("samples", Plane::Whole(vec![film.samples(); film.depth().len()])));
    let walks = film.walks();
    if !walks.is_empty() {
        planes.push(("steps", Plane::Whole(walks.iter().map(|w| w.steps).collect())));
        planes.push(("blocks", Plane::Whole(walks.iter().map(|w| w.blocks).collect())));
    }
    write_planes(path, film.size(), planes)
}

/// True if a file holds a whole picture of `size` pixels, in the format of its extension.
pub fn is_whole_picture(path: &Path, size: [u32; 2]) -> bool {
    let format = match ImageFormat::of(path) {
        Ok(ImageFormat::Png) => image::ImageFormat::Png,
        Ok(ImageFormat::Exr) => image::ImageFormat::OpenExr,
        Err(_) => return false,
    };
    let Ok(file) = std::fs::File::open(path) else { return false };
    let reader = image::ImageReader::with_format(std::io::BufReader::new(file), format);
    reader.decode().is_ok_and(|picture| [picture.width(), picture.height()] == size)
}
