//! PNG and EXR files, written whole or not at all.

use crate::aov::{AovBuffers, AovKind};
use crate::heat_map::{HeatRange, heat_map};
use crate::image::Image;
use crate::renderer::Render;
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image as ExrImage, Layer, LayerAttributes,
    WritableImage,
};
use image::ImageEncoder;
use ropewalk_scene::write_atomically;
use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};

/// Why a picture file could not be written. No file is left behind in any case, and a file that
/// was there before is untouched.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImageFileError {
    /// The extension says no known format.
    #[error("{}: unknown picture format; expected a name that ends in .png or .exr", .path.display())]
    UnknownExtension {
        /// The path as given.
        path: PathBuf,
    },
    /// The folder to write into is not there.
    #[error("{}: the folder {} does not exist", .path.display(), .folder.display())]
    MissingFolder {
        /// The path as given.
        path: PathBuf,
        /// Its folder.
        folder: PathBuf,
    },
    /// The operating system refused.
    #[error("cannot write {}: {source}", .path.display())]
    Io {
        /// The path as given.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The picture does not fit the format.
    #[error("cannot encode {}: {reason}", .path.display())]
    Encode {
        /// The path as given.
        path: PathBuf,
        /// The encoder's reason.
        reason: String,
    },
    /// The render was stopped before its end.
    #[error("{}: not written, since the render was stopped", .path.display())]
    Cancelled {
        /// The path as given.
        path: PathBuf,
    },
}

/// The format of a picture file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageFormat {
    /// 8 bits a channel, display-referred (see [`Image::to_display_rgb8`]).
    Png,
    /// `f32` channels, unclamped.
    Exr,
}

impl ImageFormat {
    /// The format that a path's extension asks for, in any case of letters.
    ///
    /// # Errors
    /// [`ImageFileError::UnknownExtension`] for anything but `.png` and `.exr`.
    pub fn of(path: &Path) -> Result<Self, ImageFileError> {
        match path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
            Some("png") => Ok(ImageFormat::Png),
            Some("exr") => Ok(ImageFormat::Exr),
            _ => Err(ImageFileError::UnknownExtension { path: path.into() }),
        }
    }
}

/// Checks, before the work of a render, that `path` has a known extension and an existing folder.
///
/// # Errors
/// [`ImageFileError::UnknownExtension`], [`ImageFileError::MissingFolder`].
pub fn check_image_path(path: &Path) -> Result<ImageFormat, ImageFileError> {
    let format = ImageFormat::of(path)?;
    let folder = folder_of(path);
    if !folder.is_dir() {
        return Err(ImageFileError::MissingFolder { path: path.into(), folder: folder.into() });
    }
    Ok(format)
}

/// Writes a picture in the format of the extension, whole or not at all: into a temporary file in
/// the same folder, which then takes the name.
///
/// # Errors
/// [`ImageFileError`]; nothing is left behind.
pub fn write_image(path: &Path, image: &Image) -> Result<(), ImageFileError> {
    write_picture(path, image, None)
}

impl Render {
    /// Writes the picture in the format of the extension. An EXR file also gets the auxiliary
    /// pictures, if there are any, as the channels `Z` (infinite where nothing is hit), `N.X`,
    /// `N.Y`, `N.Z`, `steps` and `tests`.
    ///
    /// # Errors
    /// [`ImageFileError`], among them [`ImageFileError::Cancelled`] after a stopped render; nothing
    /// is left behind.
    pub fn write(&self, path: &Path) -> Result<(), ImageFileError> {
        self.check_complete(path)?;
        write_picture(path, &self.image, self.aov.as_ref())
    }

    /// An auxiliary picture as colours: normals as `(n + 1) / 2`, all others as a
    /// [`heat_map`] over their whole range. `None` unless auxiliary pictures were asked for.
    pub fn aov_image(&self, kind: AovKind) -> Option<Image> {
        let aov = self.aov.as_ref()?;
        let width = self.image.width();
        let heat = |values: &[f32]| heat_map(values, width, HeatRange::of(values));
        Some(match kind {
            AovKind::Depth => heat(&aov.depth),
            AovKind::Steps => heat(&aov.steps),
            AovKind::Tests => heat(&aov.tests),
            AovKind::Normal => {
                let mut image = Image::filled(width, self.image.height(), [0.0; 3]);
                for (pixel, n) in image.pixels_mut().iter_mut().zip(&aov.normal) {
                    *pixel = n.map(|x| 0.5 * (x + 1.0));
                }
                image
            }
        })
    }

    fn check_complete(&self, path: &Path) -> Result<(), ImageFileError> {
        if self.cancelled {
            return Err(ImageFileError::Cancelled { path: path.into() });
        }
        Ok(())
    }
}

fn write_picture(
    path: &Path,
    image: &Image,
    aov: Option<&AovBuffers>,
) -> Result<(), ImageFileError> {
    let bytes = match check_image_path(path)? {
        ImageFormat::Png => png_bytes(image),
        ImageFormat::Exr => exr_bytes(image, aov),
    }
    .map_err(|reason| ImageFileError::Encode { path: path.into(), reason })?;
    write_atomically(path, |out| out.write_all(&bytes))
        .map_err(|source| ImageFileError::Io { path: path.into(), source })
}

fn png_bytes(image: &Image) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    image::codecs::png::PngEncoder::new(&mut bytes)
        .write_image(
            &image.to_display_rgb8(),
            image.width(),
            image.height(),
            image::ExtendedColorType::Rgb8,
        )
        .map_err(|e| e.to_string())?;
    Ok(bytes)
}

/// The values of one channel, row by row.
pub(crate) enum Plane {
    /// Numbers.
    Float(Vec<f32>),
    /// Whole numbers.
    Whole(Vec<u32>),
}

/// Writes channels as an EXR file, whole or not at all.
pub(crate) fn write_planes(
    path: &Path,
    size: [u32; 2],
    planes: Vec<(&str, Plane)>,
) -> Result<(), ImageFileError> {
    let bytes = plane_bytes(size, planes)
        .map_err(|reason| ImageFileError::Encode { path: path.into(), reason })?;
    write_atomically(path, |out| out.write_all(&bytes))
        .map_err(|source| ImageFileError::Io { path: path.into(), source })
}

fn exr_bytes(image: &Image, aov: Option<&AovBuffers>) -> Result<Vec<u8>, String> {
    let plane = |pixels: &[[f32; 3]], c: usize| Plane::Float(pixels.iter().map(|p| p[c]).collect());
    let mut planes: Vec<(&str, Plane)> = ["R", "G", "B"]
        .into_iter()
        .enumerate()
        .map(|(c, name)| (name, plane(image.pixels(), c)))
        .collect();
    if let Some(aov) = aov {
        planes.push(("Z", Plane::Float(aov.depth.clone())));
        planes.extend(["N.X", "N.Y", "N.Z"].into_iter().zip((0..3).map(|c| plane(&aov.normal, c))));
        planes.push(("steps", Plane::Float(aov.steps.clone())));
        planes.push(("tests", Plane::Float(aov.tests.clone())));
    }
    plane_bytes([image.width(), image.height()], planes)
}

fn plane_bytes(size: [u32; 2], planes: Vec<(&str, Plane)>) -> Result<Vec<u8>, String> {
    let samples = |plane| match plane {
        Plane::Float(values) => FlatSamples::F32(values),
        Plane::Whole(values) => FlatSamples::U32(values),
    };
    let channels = planes.into_iter().map(|(name, plane)| AnyChannel::new(name, samples(plane)));
    let layer = Layer::new(
        (size[0] as usize, size[1] as usize),
        LayerAttributes::default(),
        Encoding::FAST_LOSSLESS,
        AnyChannels::sort(channels.collect()),
    );
    let mut bytes = Cursor::new(Vec::new());
    let exr = ExrImage::from_layer(layer);
    exr.write().non_parallel().to_buffered(&mut bytes).map_err(|e| e.to_string())?;
    Ok(bytes.into_inner())
}

/// The folder that a file lies in; `.` for a bare name.
fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}
