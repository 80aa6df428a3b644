//! Images of textures: PNG, JPEG and WebP, with their size checked before they are decoded.

use super::beside::Beside;
use super::skipped::Skipped;
use super::{Cancelled, Watched};
use crate::stage::Image;
use image::{ImageFormat, ImageReader, Limits};
use std::collections::HashMap;
use std::io::Cursor;

/// Decoded images, each once.
#[derive(Default)]
pub struct Pictures {
    /// All of them, in the order in which they were first asked for.
    pub images: Vec<Image>,
    /// By what names them in the file; `None` where it was left out.
    known: HashMap<String, Option<u32>>,
    pixels: u64,
}

/// An image that is decoded.
struct Decoded {
    image: Image,
    /// True if the file has a channel of opacity.
    has_alpha: bool,
}

impl Pictures {
    /// The image `name`, whose bytes `load` brings; `None`, with a sentence, if it cannot be had.
    pub fn get(
        &mut self,
        name: &str,
        load: impl FnOnce() -> std::result::Result<Vec<u8>, String>,
        skipped: &mut Skipped,
        limits: &Watched<'_>,
    ) -> Result<Option<u32>, Cancelled> {
        if let Some(&known) = self.known.get(name) {
            return Ok(known);
        }
        let decoded = self.decode(load, limits)?;
        Ok(self.keep(name.to_owned(), name, decoded.map(|decoded| decoded.image), skipped))
    }

    /// The image `mask` worked into the image `base` as its opacity, or into white: the mask's channel of opacity if it has
    /// one, else its red.
    pub fn masked(
        &mut self,
        base: Option<u32>,
        mask: &str,
        load: impl FnOnce() -> std::result::Result<Vec<u8>, String>,
        skipped: &mut Skipped,
        limits: &Watched<'_>,
    ) -> Result<Option<u32>, Cancelled> {
        // No name of a file holds a line end.
        let key = format!("{mask}\n{base:?}");
        if let Some(&known) = self.known.get(&key) {
            return Ok(known);
        }
        let composed = self.decode(load, limits)?.and_then(|decoded| {
            let base = base.map(|base| &self.images[base as usize]);
            let count = base.map_or(0, |base| base.pixels.len() as u64);
            if self.pixels.saturating_add(count) > limits.pixels {
                return Err(format!(
                    "expected at most {} pixels of images, found more",
                    limits.pixels
                ));
            }
            Ok(compose(base, &decoded))
        });
        Ok(self.keep(key, mask, composed, skipped))
    }

    fn keep(
        &mut self,
        key: String,
        name: &str,
        image: std::result::Result<Image, String>,
        skipped: &mut Skipped,
    ) -> Option<u32> {
        let index = match image {
            Ok(image) => {
                self.pixels += image.pixels.len() as u64;
                self.images.push(image);
                Some(self.images.len() as u32 - 1)
            }
            Err(why) => {
                skipped.note_named(&format!("textures, {why}"), name);
                None
            }
        };
        self.known.insert(key, index);
        index
    }

    /// Decodes an image within the limits of all images; the error is a part of a sentence.
    fn decode(
        &self,
        load: impl FnOnce() -> std::result::Result<Vec<u8>, String>,
        limits: &Watched<'_>,
    ) -> Result<std::result::Result<Decoded, String>, Cancelled> {
        if limits.monitor.is_cancelled() {
            return Err(Cancelled);
        }
        if self.images.len() >= limits.images {
            return Ok(Err(format!("expected at most {} images, found more", limits.images)));
        }
        let left = limits.pixels.saturating_sub(self.pixels);
        Ok(load().and_then(|bytes| decode(&bytes, left)))
    }
}

fn compose(base: Option<&Image>, mask: &Decoded) -> Image {
    let (mask, channel) = (&mask.image, if mask.has_alpha { 3 } else { 0 });
    let (width, height) = base.map_or((mask.width, mask.height), |base| (base.width, base.height));
    // The pixel of the mask that lies at the same place.
    let at = |i: u32, from: u32, to: u32| (u64::from(i) * u64::from(to) / u64::from(from)) as usize;
    let mut pixels = Vec::with_capacity(base.map_or(mask.pixels.len(), |base| base.pixels.len()));
    for y in 0..height {
        for x in 0..width {
            let color = base.map_or([255; 4], |base| base.pixels[pixels.len()]);
            let (mx, my) = (at(x, width, mask.width), at(y, height, mask.height));
            let opacity = mask.pixels[my * mask.width as usize + mx][channel];
            pixels.push([color[0], color[1], color[2], opacity]);
        }
    }
    Image { width, height, pixels }
}

fn decode(bytes: &[u8], pixels: u64) -> std::result::Result<Decoded, String> {
    let format = match bytes {
        [0x89, b'P', b'N', b'G', ..] => ImageFormat::Png,
        [0xff, 0xd8, ..] => ImageFormat::Jpeg,
        [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => ImageFormat::WebP,
        _ => return Err("expected a PNG, JPEG or WebP image, found something else".to_owned()),
    };
    let wrong = |e: image::ImageError| {
        format!("expected a sound image, found one of which the decoder says: {e}")
    };
    let reader = || {
        let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
        let mut limits = Limits::default();
        // Sixteen bits in four channels, and room for the decoder.
        limits.max_alloc = Some(pixels.saturating_mul(8).saturating_add(1 << 24));
        reader.limits(limits);
        reader
    };
    let (width, height) = reader().into_dimensions().map_err(wrong)?;
    if width == 0 || height == 0 || u64::from(width) * u64::from(height) > pixels {
        return Err(format!("expected an image of 1 to {pixels} pixels, found {width} x {height}"));
    }
    if format == ImageFormat::WebP {
        check_webp(bytes, [width, height])?;
    }
    let image = reader().decode().map_err(wrong)?;
    let has_alpha = image.color().has_alpha();
    let pixels = image.into_rgba8().into_raw().as_chunks::<4>().0.to_vec();
    Ok(Decoded { image: Image { width, height, pixels }, has_alpha })
}

/// Whether the picture within a WebP container is as large as that says: the decoder takes memory by what the picture says of
/// itself, and compares afterwards.
fn check_webp(bytes: &[u8], size: [u32; 2]) -> std::result::Result<(), String> {
    let mut rest = &bytes[12..];
    while let Some((head, body)) = rest.split_first_chunk::<8>() {
        let length = u32::from_le_bytes([head[4], head[5], head[6], head[7]]) as usize;
        let found = match (&head[..4], body) {
            (b"VP8 ", &[_, _, _, _, _, _, a, b, c, d, ..]) => {
                Some([[a, b], [c, d]].map(|n| u32::from(u16::from_le_bytes(n) & 0x3fff)))
            }
            (b"VP8L", &[_, a, b, c, d, ..]) => {
                let bits = u32::from_le_bytes([a, b, c, d]);
                Some([bits, bits >> 14].map(|n| (n & 0x3fff) + 1))
            }
            (b"ANMF", _) => return Err("expected one image, found an animation".to_owned()),
            _ => None,
        };
        if let Some([width, height]) = found.filter(|found| *found != size) {
            let [outer, down] = size;
            return Err(format!(
                "expected an image of {outer} x {down}, as its container says, found {width} x {height}"
            ));
        }
        let next = length.checked_next_multiple_of(2).and_then(|length| body.get(length..));
        rest = next.unwrap_or_default();
    }
    Ok(())
}

/// The file `name` beside the scene, for [`Pictures::get`].
pub fn load(beside: &Beside<'_>, name: &str) -> std::result::Result<Vec<u8>, String> {
    beside.read(name, 0).map_err(|why| why.sentence(name))
}
