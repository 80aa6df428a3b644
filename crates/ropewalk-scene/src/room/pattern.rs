//! Images of wood, weave and paint, computed.

use crate::stage::Image;
use std::f64::consts::{PI, TAU};

type Color = [f64; 3];

/// An image of a function of the place, 0 to 1 each way, that gives sRGB values.
fn drawn(width: u32, height: u32, color: impl Fn(f64, f64) -> Color) -> Image {
    let pixel = |i: u32| {
        let u = (f64::from(i % width) + 0.5) / f64::from(width);
        let v = (f64::from(i / width) + 0.5) / f64::from(height);
        let [r, g, b] = color(u, v).map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8);
        [r, g, b, 255]
    };
    Image { width, height, pixels: (0..width * height).map(pixel).collect() }
}

/// A number from 0 to 1 for a cell of a grid.
fn cell(x: i64, y: i64) -> f64 {
    let mut h = (x as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)
        ^ (y as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f);
    h = (h ^ (h >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    h = (h ^ (h >> 32)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((h ^ (h >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// Smooth noise from 0 to 1 that repeats after `period` cells each way.
fn noise(x: f64, y: f64, period: [i64; 2]) -> f64 {
    let (i, j) = (x.floor(), y.floor());
    let smooth = |t: f64| t * t * (3.0 - 2.0 * t);
    let (s, t) = (smooth(x - i), smooth(y - j));
    let at = |a: i64, b: i64| {
        cell((i as i64 + a).rem_euclid(period[0]), (j as i64 + b).rem_euclid(period[1]))
    };
    let row = |b: i64| at(0, b) + s * (at(1, b) - at(0, b));
    row(0) + t * (row(1) - row(0))
}

fn mixed(a: Color, b: Color, t: f64) -> Color {
    let t = t.clamp(0.0, 1.0);
    std::array::from_fn(|k| a[k] + t * (b[k] - a[k]))
}

fn scaled(a: Color, s: f64) -> Color {
    a.map(|x| x * s)
}

/// Grain along `u`, 0 to 1: slow bands and fine pores.
fn grain(u: f64, v: f64, lines: i64) -> f64 {
    let bend = noise(3.0 * u, 5.0 * v, [3, 5]);
    let rings = 0.5 + 0.5 * (TAU * (v * lines as f64 * 0.5 + 1.6 * bend)).sin();
    let pores = noise(24.0 * u, v * 8.0 * lines as f64, [24, 8 * lines]);
    let veins = noise(6.0 * u, v * 3.0 * lines as f64, [6, 3 * lines]);
    0.35 * rings + 0.35 * veins + 0.3 * pores
}

/// Oak.
pub fn wood() -> Image {
    drawn(1024, 1024, |u, v| mixed([0.80, 0.62, 0.42], [0.58, 0.40, 0.23], grain(u, v, 14)))
}

/// Boards, sixteen across, each of its own tone, their joints shifted.
pub fn planks() -> Image {
    const ROWS: f64 = 16.0;
    drawn(2048, 2048, |u, v| {
        let row = (v * ROWS).floor();
        let shift = cell(row as i64, 7);
        let along = (u + shift).fract() * 2.0;
        let board = row as i64 * 2 + along as i64;
        let tone = cell(board, 3);
        let g = grain((u + cell(board, 5)).fract(), (v + cell(board, 9)).fract(), 48);
        let light = mixed([0.84, 0.67, 0.47], [0.75, 0.56, 0.37], tone);
        let color = mixed(light, scaled(light, 0.66), g);
        let across = (v * ROWS).fract();
        // Metres to the nearest joint: a board is 15 cm wide and 120 cm long.
        let gap =
            (0.15 * across.min(1.0 - across)).min(1.2 * along.fract().min(1.0 - along.fract()));
        let joint = ((gap - 0.0006) / 0.0015).clamp(0.0, 1.0);
        scaled(color, 0.35 + 0.65 * joint)
    })
}

/// A rug of diamonds between borders.
pub fn rug() -> Image {
    const RED: Color = [0.52, 0.13, 0.11];
    const NAVY: Color = [0.13, 0.17, 0.30];
    const CREAM: Color = [0.84, 0.77, 0.63];
    const GOLD: Color = [0.74, 0.54, 0.25];
    // Metres; the rug is 3 by 2.2.
    const SIZE: [f64; 2] = [3.0, 2.2];
    drawn(1500, 1100, |u, v| {
        let (x, y) = (u * SIZE[0], v * SIZE[1]);
        let edge = x.min(SIZE[0] - x).min(y).min(SIZE[1] - y);
        let along = if x.min(SIZE[0] - x) < y.min(SIZE[1] - y) { y } else { x };
        let wave = |period: f64| ((along / period).fract() - 0.5).abs() * 2.0;
        let diamond = |w: f64, h: f64| {
            let (a, b) = ((x / w).fract() - 0.5, (y / h).fract() - 0.5);
            2.0 * (a.abs() + b.abs())
        };
        let color = if edge < 0.05 {
            NAVY
        } else if edge < 0.08 {
            CREAM
        } else if edge < 0.26 {
            let height = ((edge - 0.08) / 0.18 - 0.5).abs() * 2.0;
            let inside = wave(0.2) + height;
            if inside < 0.45 {
                GOLD
            } else if inside < 0.9 {
                CREAM
            } else {
                NAVY
            }
        } else if edge < 0.29 {
            CREAM
        } else {
            match diamond(SIZE[0] / 10.0, SIZE[1] / 6.0) {
                d if d < 0.28 => GOLD,
                d if d < 0.52 => NAVY,
                d if d < 0.64 => CREAM,
                d if (0.93..1.07).contains(&d) => CREAM,
                _ => RED,
            }
        };
        let thread = noise(u * 500.0, v * 1100.0, [500, 1100]) - 0.5;
        let worn = noise(u * 9.0, v * 7.0, [9, 7]) - 0.5;
        scaled(color, 1.0 + 0.28 * thread + 0.14 * worn)
    })
}

/// A picture: ridges in haze under a low sun.
pub fn hills() -> Image {
    drawn(600, 800, |u, v| {
        let disc = ((u - 0.64) * 0.75).hypot(v - 0.33);
        let mut color = mixed([0.94, 0.80, 0.62], [0.86, 0.52, 0.38], (v - 0.1) * 1.4);
        if disc < 0.1 {
            color = [0.93, 0.36, 0.22];
        }
        for k in 0..5 {
            let depth = f64::from(k);
            let ridge = 0.44
                + 0.115 * depth
                + 0.05 * (TAU * (u * (0.8 + 0.35 * depth) + 0.37 * depth)).sin()
                + 0.05 * (noise(u * (4.0 + 2.0 * depth) + 11.0 * depth, depth, [97, 97]) - 0.5);
            if v > ridge {
                color = mixed([0.66, 0.50, 0.50], [0.10, 0.17, 0.24], depth / 4.0);
                color = mixed(
                    color,
                    [0.90, 0.70, 0.58],
                    0.35 * ((v - ridge) * 6.0).min(1.0) * (1.0 - depth / 5.0),
                );
            }
        }
        scaled(color, 0.94 + 0.12 * noise(u * 240.0, v * 320.0, [240, 320]))
    })
}

/// A picture: discs and bars.
pub fn moons() -> Image {
    drawn(600, 600, |u, v| {
        let mut color = [0.90, 0.86, 0.77];
        let discs: [([f64; 3], Color); 5] = [
            ([0.38, 0.40, 0.24], [0.16, 0.27, 0.38]),
            ([0.63, 0.56, 0.19], [0.84, 0.56, 0.20]),
            ([0.44, 0.70, 0.12], [0.68, 0.22, 0.16]),
            ([0.70, 0.27, 0.07], [0.10, 0.10, 0.12]),
            ([0.26, 0.62, 0.05], [0.35, 0.48, 0.40]),
        ];
        for ([x, y, r], paint) in discs {
            let inside = (u - x).hypot(v - y) / r;
            if inside < 1.0 {
                color = mixed(paint, scaled(paint, 0.8), inside * inside);
            }
        }
        for (k, x) in [0.14, 0.17, 0.86].into_iter().enumerate() {
            if (u - x).abs() < 0.006 && v > 0.1 + 0.1 * k as f64 && v < 0.9 {
                color = [0.12, 0.12, 0.13];
            }
        }
        scaled(color, 0.95 + 0.1 * noise(u * 200.0, v * 200.0, [200, 200]))
    })
}

/// How a lamp's shade glows, from one rim to the other.
pub fn glow() -> Image {
    drawn(1, 64, |_, v| [0.42 + 0.58 * (PI * v).sin().powf(1.5); 3])
}

/// A hazy garden: sky, trees, a hedge and a lawn, all out of focus.
pub fn garden() -> Image {
    drawn(512, 160, |u, v| {
        let leaves = noise(u * 60.0, v * 20.0, [60, 20]);
        let crowns =
            0.40 - 0.22 * noise(u * 9.0, 0.5, [9, 1]) - 0.10 * noise(u * 26.0, 3.0, [26, 9]);
        let soft = |edge: f64, blur: f64| ((v - edge) / blur + 0.5).clamp(0.0, 1.0);
        let sky = mixed([0.86, 0.92, 1.0], [0.98, 0.98, 0.97], v * 2.5);
        let trees = mixed([0.50, 0.60, 0.38], [0.70, 0.76, 0.52], leaves);
        let hedge = mixed([0.36, 0.48, 0.27], [0.50, 0.60, 0.36], leaves);
        let color = mixed(sky, mixed(trees, sky, 0.35), soft(crowns, 0.05));
        let color = mixed(color, hedge, soft(0.56 - 0.03 * noise(u * 14.0, 5.0, [14, 9]), 0.025));
        mixed(color, [0.66, 0.74, 0.42], soft(0.68, 0.02))
    })
}
