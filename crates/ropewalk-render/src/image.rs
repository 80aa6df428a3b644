//! Pictures in memory.

/// An RGB picture in `f32`, rows from the top, with values as the scene's colours imply: 0 is black
/// and 1 is full, values above 1 may occur.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    width: u32,
    height: u32,
    pixels: Vec<[f32; 3]>,
}

impl Image {
    /// A picture of `width * height` pixels of one colour.
    pub fn filled(width: u32, height: u32, color: [f32; 3]) -> Self {
        Image { width, height, pixels: vec![color; width as usize * height as usize] }
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// All pixels, row by row from the top left.
    pub fn pixels(&self) -> &[[f32; 3]] {
        &self.pixels
    }

    /// The pixel in column `x` and row `y`.
    ///
    /// # Panics
    /// If the position lies outside the picture.
    pub fn pixel(&self, x: u32, y: u32) -> [f32; 3] {
        assert!(x < self.width, "column {x} of a picture {} wide", self.width);
        self.pixels[y as usize * self.width as usize + x as usize]
    }

    /// The pixels, to be changed in place.
    pub fn pixels_mut(&mut self) -> &mut [[f32; 3]] {
        &mut self.pixels
    }

    /// Bytes for a display: each value clamped to 0..=1 and scaled to 0..=255, without gamma.
    ///
    /// SPD colours are display-referred: the published pictures show the background `.078 .361
    /// .753` as the bytes 20, 92, 192, which is this mapping. NaN becomes 0.
    pub fn to_display_rgb8(&self) -> Vec<u8> {
        self.pixels.iter().flatten().map(|&x| (x.clamp(0.0, 1.0) * 255.0).round() as u8).collect()
    }
}
