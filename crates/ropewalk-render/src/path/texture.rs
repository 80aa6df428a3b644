//! Colours and numbers from images.

use glam::Vec3;
use ropewalk_scene::stage::{Image, Texture, Wrap};
use std::sync::LazyLock;

/// sRGB bytes as linear numbers (IEC 61966-2-1).
static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|i| {
        let x = i as f32 / 255.0;
        if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
    })
});

/// What the bytes of an image mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Encoding {
    /// Colours.
    Srgb,
    /// Numbers from 0 to 1.
    Linear,
}

/// The bilinear value at texture coordinates: colour and alpha.
pub(crate) fn sample(
    images: &[Image],
    texture: Texture,
    uv: [f32; 2],
    encoding: Encoding,
) -> (Vec3, f32) {
    let image = &images[texture.image as usize];
    let size = [image.width, image.height];
    let mut cells = [[0u32; 2]; 2];
    let mut parts = [0f32; 2];
    for axis in 0..2 {
        // Pixel centres lie at halves.
        let x = f64::from(uv[axis]) * f64::from(size[axis]) - 0.5;
        let x = if x.is_finite() { x } else { 0.0 };
        let cell = x.floor();
        parts[axis] = (x - cell) as f32;
        let cell = cell as i64;
        cells[axis] =
            [cell, cell.saturating_add(1)].map(|c| wrapped(c, size[axis], texture.wrap[axis]));
    }
    let texel = |i: usize, j: usize| {
        let at = cells[1][j] as usize * image.width as usize + cells[0][i] as usize;
        let [r, g, b, a] = image.pixels[at];
        let color = match encoding {
            Encoding::Srgb => Vec3::from_array([r, g, b].map(|c| LINEAR[usize::from(c)])),
            Encoding::Linear => Vec3::from_array([r, g, b].map(|c| f32::from(c) / 255.0)),
        };
        color.extend(f32::from(a) / 255.0)
    };
    let row = |j: usize| texel(0, j).lerp(texel(1, j), parts[0]);
    let value = row(0).lerp(row(1), parts[1]);
    (value.truncate(), value.w)
}

/// The mean colour of an image.
pub(crate) fn mean(images: &[Image], texture: Texture) -> Vec3 {
    let image = &images[texture.image as usize];
    let linear = |p: &[u8; 4]| {
        glam::DVec3::from_array([p[0], p[1], p[2]].map(|c| f64::from(LINEAR[usize::from(c)])))
    };
    let sum: glam::DVec3 = image.pixels.iter().map(linear).sum();
    (sum / image.pixels.len().max(1) as f64).as_vec3()
}

/// A column or row of an image of `size` for one that may lie outside.
fn wrapped(at: i64, size: u32, wrap: Wrap) -> u32 {
    let n = i64::from(size);
    (match wrap {
        Wrap::Repeat => at.rem_euclid(n),
        Wrap::Clamp => at.clamp(0, n - 1),
        Wrap::Mirror => {
            let at = at.rem_euclid(2 * n);
            if at < n { at } else { 2 * n - 1 - at }
        }
    }) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_lie_between_pixels_and_wrap() {
        let pixels = vec![[0, 0, 0, 255], [255, 0, 0, 255]];
        let images = [Image { width: 2, height: 1, pixels }];
        let red = |u: f32, wrap: Wrap| {
            let texture = Texture { image: 0, wrap: [wrap; 2] };
            sample(&images, texture, [u, 0.5], Encoding::Linear).0.x
        };
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            assert_eq!((red(0.25, wrap), red(0.75, wrap), red(0.5, wrap)), (0.0, 1.0, 0.5));
        }
        assert_eq!(red(1.0, Wrap::Repeat), 0.5);
        assert_eq!(red(1.0, Wrap::Mirror), 1.0);
        assert_eq!(red(-3.0, Wrap::Clamp), 0.0);
        assert_eq!(red(1.25, Wrap::Mirror), 1.0);
        assert_eq!(red(1.25, Wrap::Repeat), 0.0);
        assert!(red(f32::NAN, Wrap::Repeat).is_finite() && red(1e30, Wrap::Mirror).is_finite());
    }

    #[test]
    fn colours_are_decoded() {
        let images = [Image { width: 1, height: 1, pixels: vec![[188, 188, 188, 51]] }];
        let texture = Texture { image: 0, wrap: [Wrap::Repeat; 2] };
        let (color, alpha) = sample(&images, texture, [0.3, 0.9], Encoding::Srgb);
        assert!((color.x - 0.503).abs() < 1e-3 && (alpha - 0.2).abs() < 1e-6, "{color} {alpha}");
        assert!((mean(&images, texture).y - 0.503).abs() < 1e-3);
    }
}
