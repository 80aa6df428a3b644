//! Floor, walls, ceiling, windows and their curtains.

use super::SIZE;
use super::looks::Look;
use super::solid::Solids;
use glam::DVec3;
use std::f64::consts::TAU;

const WALL: f64 = 0.28;

/// The windows along z, and their sills and lintels.
const WINDOWS: [[f64; 2]; 2] = [[0.95, 2.45], [3.35, 4.85]];
const SILL: f64 = 0.42;
const LINTEL: f64 = 2.5;

pub fn make(s: &mut Solids) {
    let [width, height, depth] = SIZE;
    let (w, out) = (WALL, [width + WALL, height + WALL, depth + WALL]);
    s.look(Look::Floor).block([-w, -w, -w], [out[0], 0.0, out[2]]);
    s.look(Look::Ceiling).block([-w, height, -w], out);
    s.look(Look::Plaster);
    s.block([-w, -0.1, -w], [out[0], height + 0.1, 0.0]);
    s.block([-w, -0.1, depth], [out[0], height + 0.1, out[2]]);
    s.block([width, -0.1, -w], [out[0], height + 0.1, out[2]]);
    s.block([-w, -0.1, -w], [0.0, SILL, out[2]]);
    s.block([-w, LINTEL, -w], [0.0, height + 0.1, out[2]]);
    let mut start = -w;
    for [from, to] in WINDOWS {
        s.block([-w, SILL, start], [0.0, LINTEL, from]);
        start = to;
    }
    s.block([-w, SILL, start], [0.0, LINTEL, out[2]]);
    boards(s);
    garden(s);
    for [from, to] in WINDOWS {
        window(s, from, to);
        curtain(s, from - 0.42, from + 0.02, 5.0);
        curtain(s, to - 0.02, to + 0.42, 5.0);
        s.look(Look::Brass);
        let rod = |z: f64| DVec3::new(0.12, 2.66, z);
        s.bar(rod(from - 0.5), rod(to + 0.5), [0.012; 2], 6);
        for z in [from - 0.5, to + 0.5] {
            s.within(super::at(0.12, 2.66, z, 0.0), |s| {
                s.turned(
                    &[[0.0, -0.028], [0.02, -0.02], [0.028, 0.0], [0.02, 0.02], [0.0, 0.028]],
                    6,
                    4,
                );
            });
        }
    }
}

/// What is seen through the windows: a bright backdrop, so low that the sun shines over it to every sill.
fn garden(s: &mut Solids) {
    let ([x, low, top], [z0, z1]) = ([-1.5, -0.2, 2.78], [-1.2, 6.0]);
    let at = |u: f64, v: f64| DVec3::new(x, low + v * (top - low), z1 + u * (z0 - z1));
    s.look(Look::Garden).sheet([8, 4], at, |u, v| [u, 1.0 - v]);
}

/// Skirting and cornice.
fn boards(s: &mut Solids) {
    let [width, height, depth] = SIZE;
    s.look(Look::Trim);
    for (high, out, level) in [(0.12, 0.018, 0.0), (0.07, 0.07, height - 0.07)] {
        let r = 0.3 * out;
        s.rounded([-0.01, level - 0.01, -0.01], [width + 0.01, level + high, out], r);
        s.rounded(
            [-0.01, level - 0.01, depth - out],
            [width + 0.01, level + high, depth + 0.01],
            r,
        );
        s.rounded([-0.01, level - 0.01, -0.01], [out, level + high, depth + 0.01], r);
        s.rounded(
            [width - out, level - 0.01, -0.01],
            [width + 0.01, level + high, depth + 0.01],
            r,
        );
    }
}

/// Frame, bars, sill and casing.
fn window(s: &mut Solids, from: f64, to: f64) {
    s.look(Look::Trim);
    let r = 0.006;
    let (x0, x1, f) = (-0.2, -0.12, 0.07);
    s.rounded([x0, SILL, from], [x1, SILL + f, to], r);
    s.rounded([x0, LINTEL - f, from], [x1, LINTEL, to], r);
    s.rounded([x0, SILL, from], [x1, LINTEL, from + f], r);
    s.rounded([x0, SILL, to - f], [x1, LINTEL, to], r);
    let middle = 0.5 * (from + to);
    s.rounded([x0, SILL, middle - 0.04], [x1, LINTEL, middle + 0.04], r);
    for k in [1.0, 2.0] {
        let y = SILL + k * (LINTEL - SILL) / 3.0;
        s.rounded([x0 + 0.02, y - 0.016, from], [x1 - 0.02, y + 0.016, to], r);
    }
    s.rounded([-0.13, SILL - 0.02, from - 0.06], [0.07, SILL + 0.02, to + 0.06], 0.012);
    let c = 0.09;
    s.rounded([-0.01, SILL, from - c], [0.02, LINTEL + c, from], r);
    s.rounded([-0.01, SILL, to], [0.02, LINTEL + c, to + c], r);
    s.rounded([-0.01, LINTEL, from - c], [0.025, LINTEL + c, to + c], r);
}

/// A curtain in folds, from the rod to the floor.
fn curtain(s: &mut Solids, from: f64, to: f64, folds: f64) {
    s.look(Look::Linen);
    let at = |u: f64, v: f64| {
        // Folds are deeper and less even towards the floor.
        let fall = 1.0 - v;
        let phase = TAU * folds * (u + 0.03 * fall * (TAU * 1.3 * u + from).sin());
        let deep = 0.034 + 0.014 * fall;
        let z = from + u * (to - from) * (1.0 + 0.1 * fall);
        DVec3::new(0.12 + deep * phase.sin(), 0.03 + 2.65 * v, z + 0.012 * (2.0 * phase).sin())
    };
    let size = [s.segments(24), s.segments(4)];
    s.sheet(size, at, |u, v| [u, v]);
}
