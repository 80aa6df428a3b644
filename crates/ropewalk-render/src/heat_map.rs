//! Numbers as colours.

use crate::image::Image;

/// Height of the legend strip under a heat map, in pixels.
const LEGEND_HEIGHT: u32 = 16;

/// Polynomial coefficients of the colour map "inferno" (S. van der Walt and N. Smith, public
/// domain), from the constant term up, as fitted by M. Zucker (public domain): perceptually uniform
/// from black over red to pale yellow, largest error below 0.03.
const INFERNO: [[f32; 3]; 7] = [
    [0.000_218_94, 0.001_651_00, -0.019_480_9],
    [0.106_513_42, 0.563_956_44, 3.932_712_4],
    [11.602_493, -3.972_854, -15.942_394],
    [-41.703_996, 17.436_398, 44.354_145],
    [77.162_94, -33.402_36, -81.807_31],
    [-71.319_43, 32.626_064, 73.209_52],
    [25.131_126, -12.242_669, -23.070_325],
];

/// The colour of `x` on the map "inferno", display-referred; `x` is clamped to 0..=1.
pub fn inferno(x: f32) -> [f32; 3] {
    let x = x.clamp(0.0, 1.0);
    let horner = |channel: usize| INFERNO.iter().rev().fold(0.0, |sum, c| sum * x + c[channel]);
    std::array::from_fn(|channel| horner(channel).clamp(0.0, 1.0))
}

/// The values that a heat map spreads its colours over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeatRange {
    /// Value of the darkest colour.
    pub min: f32,
    /// Value of the brightest colour.
    pub max: f32,
}

impl HeatRange {
    /// From the least to the greatest finite value; 0..=1 if there is none, and never empty.
    pub fn of(values: &[f32]) -> Self {
        let finite = || values.iter().copied().filter(|x| x.is_finite());
        let (min, max) = (finite().reduce(f32::min), finite().reduce(f32::max));
        match (min, max) {
            (Some(min), Some(max)) if max > min => HeatRange { min, max },
            (Some(min), _) => HeatRange { min, max: min + min.abs().max(1.0) },
            _ => HeatRange { min: 0.0, max: 1.0 },
        }
    }

    fn place(&self, x: f32) -> f32 {
        (x - self.min) / (self.max - self.min)
    }
}

/// A heat map of `values` (row by row, `width` a row) over `range`, with a legend strip below that
/// runs from `range.min` at the left to `range.max` at the right. Values that are not finite are
/// grey.
///
/// # Panics
/// If `values` is not a whole number of rows.
pub fn heat_map(values: &[f32], width: u32, range: HeatRange) -> Image {
    assert!(
        width > 0 && values.len().is_multiple_of(width as usize),
        "values must fill whole rows"
    );
    let height = (values.len() / width as usize) as u32;
    let mut image = Image::filled(width, height + LEGEND_HEIGHT, [0.0; 3]);
    let (map, legend) = image.pixels_mut().split_at_mut(values.len());
    for (pixel, &x) in map.iter_mut().zip(values) {
        *pixel = if x.is_finite() { inferno(range.place(x)) } else { [0.25; 3] };
    }
    for (i, pixel) in legend.iter_mut().enumerate() {
        *pixel = inferno((i % width as usize) as f32 / (width.max(2) - 1) as f32);
    }
    // A black line parts the two.
    legend[..width as usize].fill([0.0; 3]);
    image
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Anchors of the published 256-entry table, which the polynomial meets to 0.03.
    #[test]
    fn inferno_meets_the_published_table() {
        let anchors = [
            (0.0, [0.0015, 0.0005, 0.0139]),
            (0.25, [0.3415, 0.0625, 0.4294]),
            (0.5, [0.7357, 0.2159, 0.3302]),
            (0.75, [0.9781, 0.5579, 0.0349]),
            (1.0, [0.9884, 0.9984, 0.6449]),
        ];
        for (x, want) in anchors {
            let got = inferno(x);
            for c in 0..3 {
                assert!((got[c] - want[c]).abs() < 0.03, "{x}: {got:?} {want:?}");
            }
        }
    }

    #[test]
    fn brightness_rises_with_the_value() {
        let luma = |x: f32| {
            let [r, g, b] = inferno(x);
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        for i in 0..64 {
            assert!(luma((i + 1) as f32 / 64.0) > luma(i as f32 / 64.0), "{i}");
        }
    }

    #[test]
    fn heat_map_has_a_legend_and_greys_out_infinity() {
        let values = [0.0, 4.0, f32::INFINITY, 2.0];
        let map = heat_map(&values, 2, HeatRange::of(&values));
        assert_eq!((map.width(), map.height()), (2, 2 + LEGEND_HEIGHT));
        assert_eq!(map.pixel(1, 0), inferno(1.0));
        assert_eq!(map.pixel(0, 1), [0.25; 3]);
        assert_eq!(map.pixel(1, 17), inferno(1.0));
    }
}
