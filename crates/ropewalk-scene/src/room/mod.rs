//! A generated interior: a furnished room by day, with looks, lamps and a view.
//!
//! Lengths are metres, `y` is up. The room is 5.4 wide, 2.9 high and 6.6 deep, from the origin on; two windows in the wall at `x = 0` are
//! open to the sky. There is nothing random in it: the same size gives the same triangles.

mod furniture;
mod looks;
mod objects;
mod pattern;
mod shell;
mod solid;

use crate::Stage;
use crate::model::Camera;
use glam::{DAffine3, DQuat, DVec3};
use solid::Solids;
use std::ops::RangeInclusive;

/// Sizes of [`room`]: 21 thousand to 1.5 million triangles.
pub const SIZES: RangeInclusive<u32> = 1..=16;

/// The size if none is asked for: 417 thousand triangles.
pub const STANDARD_SIZE: u32 = 8;

/// Width, height and depth.
const SIZE: [f64; 3] = [5.4, 2.9, 6.6];

/// The room with curves of so many segments; triangles grow by the square of the size. `None` if it is not one of [`SIZES`].
pub fn room(size: u32) -> Option<Stage> {
    if !SIZES.contains(&size) {
        return None;
    }
    let mut solids = Solids::new(size);
    shell::make(&mut solids);
    furniture::make(&mut solids);
    objects::make(&mut solids);
    let camera = Camera {
        from: [4.75, 1.5, 6.35],
        at: [1.95, 1.02, 1.4],
        up: [0.0, 1.0, 0.0],
        angle: 62.0,
        hither: 0.0,
        resolution: [768, 576],
    };
    Some(Stage {
        name: format!("stage:room:{size}"),
        materials: looks::materials(),
        images: looks::images(),
        camera: Some(camera),
        daylight: true,
        ..solids.stage
    })
}

/// A frame at a point of the floor, or above it, turned to the left by degrees.
fn at(x: f64, y: f64, z: f64, degrees: f64) -> DAffine3 {
    let turn = DQuat::from_rotation_y(degrees.to_radians());
    DAffine3::from_rotation_translation(turn, DVec3::new(x, y, z))
}

/// Numbers from 0 to 1 that look random (G. Steele et al., "Fast Splittable Pseudorandom Number Generators", 2014).
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}
