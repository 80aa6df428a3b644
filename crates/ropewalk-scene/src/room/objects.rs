//! What stands and hangs about: crockery, fruit, vases, lamps, pictures, a plant.

use super::at;
use super::furniture::{SIDEBOARD_TOP, TABLE, TABLE_TOP};
use super::looks::Look;
use super::solid::Solids;
use super::{Chance, SIZE};
use crate::model::{Scene, Surface};
use crate::spd::{self, Spd};
use glam::{DAffine3, DVec3};
use std::f64::consts::TAU;

pub fn make(s: &mut Solids) {
    on_the_table(s);
    on_the_sideboard(s);
    s.within(at(3.34, 0.0, 0.42, 0.0), floor_lamp);
    s.within(at(TABLE[0], 0.0, TABLE[1], 0.0), pendant);
    s.within(at(0.46, 0.0, 2.9, 0.0), plant);
    s.within(at(1.86, 1.72, 0.0, 0.0), |s| framed(s, Look::Hills, [0.3, 0.4]));
    s.within(at(2.72, 1.76, 0.0, 0.0), |s| framed(s, Look::Moons, [0.26, 0.26]));
}

fn on_the_table(s: &mut Solids) {
    let [x, z] = TABLE;
    let top = TABLE_TOP + 1e-4;
    s.within(at(x + 0.02, top, z, 155.0), teapot);
    for (dx, dz, turn) in [(0.38, 0.20, 40.0), (-0.22, 0.32, 200.0)] {
        s.within(at(x + dx, top, z + dz, turn), cup);
    }
    s.within(at(x + 0.32, top, z - 0.22, 0.0), fruit_bowl);
    s.within(at(x - 0.34, top, z - 0.1, 0.0), carafe);
    s.within(at(x - 0.44, top, z + 0.1, 0.0), tumbler);
    s.within(at(x + 0.1, top, z + 0.45, 12.0), |s| {
        s.painted(Look::Cover, [0.30, 0.07, 0.06]).rounded(
            [-0.11, 0.0, -0.08],
            [0.11, 0.004, 0.08],
            0.0015,
        );
        s.look(Look::Paper).block([-0.106, 0.004, -0.077], [0.108, 0.024, 0.077]);
        s.painted(Look::Cover, [0.30, 0.07, 0.06]).rounded(
            [-0.11, 0.024, -0.08],
            [0.11, 0.028, 0.08],
            0.0015,
        );
    });
}

/// Newell's teapot, from the database.
fn teapot(s: &mut Solids) {
    let mut scene = Scene::default();
    let size = 3 * s.segments(1);
    if spd::generate(Spd::Teapot, size, &mut scene).is_err() {
        return;
    }
    s.look(Look::Glazed);
    let scale = 0.052;
    let turned = |p: &[f64; 3]| DVec3::new(p[0], p[2], -p[1]);
    for object in &scene.objects {
        if let Surface::Patch { vertices, normals } = &object.surface
            && let ([a, b, c], [n, o, p]) = (&vertices[..], &normals[..])
        {
            s.triangle([a, b, c].map(|v| scale * turned(v)), [n, o, p].map(turned));
        }
    }
}

fn cup(s: &mut Solids) {
    s.look(Look::White);
    let saucer = [
        [0.0, 0.002],
        [0.03, 0.002],
        [0.045, 0.004],
        [0.07, 0.014],
        [0.074, 0.0165],
        [0.07, 0.0175],
        [0.045, 0.0085],
        [0.03, 0.007],
        [0.0, 0.007],
    ];
    s.turned(&saucer, 12, 10);
    let cup = [
        [0.0, 0.007],
        [0.02, 0.007],
        [0.022, 0.012],
        [0.034, 0.03],
        [0.039, 0.055],
        [0.0405, 0.066],
        [0.039, 0.0675],
        [0.037, 0.055],
        [0.032, 0.032],
        [0.02, 0.015],
        [0.0, 0.013],
    ];
    s.turned(&cup, 10, 12);
    let v = DVec3::new;
    let handle = [
        v(0.037, 0.056, 0.0),
        v(0.055, 0.06, 0.0),
        v(0.062, 0.045, 0.0),
        v(0.052, 0.03, 0.0),
        v(0.034, 0.03, 0.0),
    ];
    s.swept(&handle, DVec3::Z, |_| [0.0035, 0.0035], [5, 6]);
    // Tea.
    s.painted(Look::Cover, [0.16, 0.05, 0.015]);
    s.turned(&[[0.0375, 0.056], [0.0, 0.0561]], 8, 1);
}

fn fruit_bowl(s: &mut Solids) {
    s.look(Look::Clay);
    let bowl = [
        [0.0, 0.0],
        [0.05, 0.0],
        [0.056, 0.004],
        [0.052, 0.012],
        [0.08, 0.024],
        [0.125, 0.055],
        [0.145, 0.085],
        [0.147, 0.089],
        [0.142, 0.089],
        [0.12, 0.059],
        [0.075, 0.03],
        [0.04, 0.022],
        [0.0, 0.02],
    ];
    s.turned(&bowl, 14, 14);
    let (orange, apple, green) = ([0.86, 0.34, 0.03], [0.55, 0.04, 0.03], [0.42, 0.52, 0.08]);
    let fruit = [
        (0.062, 0.0, 0.062, 0.038, orange),
        (-0.036, 0.058, 0.062, 0.037, apple),
        (-0.034, -0.06, 0.062, 0.038, orange),
        (0.008, 0.004, 0.116, 0.037, green),
    ];
    for (x, z, y, r, color) in fruit {
        s.within(at(x, y, z, 40.0 * x), |s| {
            s.painted(Look::White, color);
            let ball: Vec<[f64; 2]> = (0..=12)
                .map(|i| {
                    let theta = std::f64::consts::PI * f64::from(i) / 12.0;
                    // Dented at both ends.
                    let dent = 1.0 - 0.22 * (-8.0 * theta.sin().powi(2)).exp();
                    [r * theta.sin(), -r * dent * theta.cos()]
                })
                .collect();
            s.turned(&ball, 10, 10);
            s.painted(Look::Cover, [0.1, 0.06, 0.03]);
            s.bar(
                DVec3::new(0.0, 0.75 * r, 0.0),
                DVec3::new(0.004, 1.05 * r, 0.0),
                [0.0015, 0.002],
                3,
            );
        });
    }
}

/// Glass has an inside: the profile goes down there.
fn carafe(s: &mut Solids) {
    s.look(Look::Glass);
    let glass = [
        [0.0, 0.0],
        [0.05, 0.0],
        [0.062, 0.008],
        [0.068, 0.04],
        [0.066, 0.08],
        [0.045, 0.135],
        [0.027, 0.175],
        [0.025, 0.20],
        [0.034, 0.235],
        [0.0355, 0.237],
        [0.034, 0.236],
        [0.0225, 0.20],
        [0.0245, 0.175],
        [0.042, 0.135],
        [0.063, 0.08],
        [0.065, 0.04],
        [0.058, 0.012],
        [0.045, 0.008],
        [0.0, 0.008],
    ];
    s.turned(&glass, 14, 20);
}

fn tumbler(s: &mut Solids) {
    s.look(Look::Glass);
    let glass = [
        [0.0, 0.0],
        [0.026, 0.0],
        [0.0295, 0.003],
        [0.032, 0.04],
        [0.035, 0.09],
        [0.0345, 0.0915],
        [0.0335, 0.09],
        [0.0305, 0.04],
        [0.028, 0.012],
        [0.024, 0.009],
        [0.0, 0.009],
    ];
    s.turned(&glass, 12, 12);
}

fn on_the_sideboard(s: &mut Solids) {
    let top = SIDEBOARD_TOP;
    s.within(at(2.88, top, 0.22, 0.0), |s| {
        s.look(Look::Glazed);
        let vase = [
            [0.0, 0.001],
            [0.055, 0.001],
            [0.062, 0.01],
            [0.085, 0.08],
            [0.095, 0.16],
            [0.075, 0.25],
            [0.038, 0.30],
            [0.032, 0.33],
            [0.045, 0.36],
            [0.043, 0.362],
            [0.028, 0.33],
            [0.034, 0.30],
            [0.06, 0.24],
        ];
        s.turned(&vase, 14, 16);
        twigs(s);
    });
    s.within(at(2.64, top, 0.27, 0.0), |s| {
        s.look(Look::White);
        let vase = [
            [0.0, 0.001],
            [0.04, 0.001],
            [0.075, 0.035],
            [0.09, 0.085],
            [0.07, 0.135],
            [0.03, 0.155],
            [0.024, 0.17],
            [0.028, 0.18],
            [0.026, 0.181],
            [0.018, 0.168],
            [0.025, 0.15],
            [0.06, 0.13],
        ];
        s.turned(&vase, 14, 14);
    });
    s.within(at(1.5, top, 0.22, 0.0), table_lamp);
    s.within(at(2.0, top, 0.24, 8.0), |s| {
        let pile = [
            (0.22, 0.16, 0.032, [0.06, 0.12, 0.24]),
            (0.2, 0.15, 0.026, [0.62, 0.50, 0.30]),
            (0.17, 0.12, 0.022, [0.36, 0.06, 0.05]),
        ];
        let mut y = 0.0;
        for (k, (a, b, high, color)) in pile.into_iter().enumerate() {
            s.within(at(0.0, y, 0.0, 9.0 * k as f64), |s| {
                let (a, b) = (0.5 * a, 0.5 * b);
                s.painted(Look::Cover, color);
                s.rounded([-a, 0.0, -b], [a, 0.003, b], 0.001);
                s.rounded([-a, high - 0.003, -b], [a, high, b], 0.001);
                s.rounded([-a, 0.0, b - 0.006], [a, high, b], 0.003);
                s.look(Look::Paper)
                    .block([-a + 0.003, 0.003, -b + 0.003], [a - 0.003, high - 0.003, b - 0.005]);
            });
            y += high;
        }
        s.within(at(0.0, y, 0.0, 0.0), |s| {
            s.look(Look::Steel);
            let ball: Vec<[f64; 2]> = (0..=10)
                .map(|i| (std::f64::consts::PI * f64::from(i) / 10.0).sin_cos())
                .map(|(sine, cosine)| [0.035 * sine, 0.035 - 0.035 * cosine])
                .collect();
            s.turned(&ball, 10, 10);
        });
    });
}

/// Dry twigs with buds.
fn twigs(s: &mut Solids) {
    let mut chance = Chance(7);
    for k in 0..7 {
        let turn = TAU * f64::from(k) / 7.0 + chance.within(-0.3, 0.3);
        let (out, high) = (chance.within(0.08, 0.2), chance.within(0.5, 0.68));
        let way = DVec3::new(turn.cos(), 0.0, 0.6 * turn.sin());
        let p = |f: f64, y: f64| way * (out * f) + DVec3::new(0.0, y, 0.0);
        let path = [p(0.05, 0.1), p(0.1, 0.32), p(0.5, 0.32 + 0.55 * (high - 0.32)), p(1.0, high)];
        s.painted(Look::Cover, [0.17, 0.10, 0.06]);
        s.swept(&path, DVec3::new(-way.z, 0.0, way.x), |v| [0.003 - 0.0015 * v; 2], [3, 4]);
        for b in 0..5 {
            let f = 0.5 + 0.12 * f64::from(b);
            let side = if b % 2 == 0 { 0.012 } else { -0.012 };
            let place = p(f, 0.32 + (high - 0.32) * (0.55 + 0.9 * (f - 0.5)));
            let place = place + side * DVec3::new(-way.z, 0.6, way.x);
            s.within(DAffine3::from_translation(place), |s| {
                s.painted(Look::Cloth, [0.80, 0.74, 0.66]);
                s.turned(&[[0.0, -0.009], [0.007, -0.003], [0.006, 0.005], [0.0, 0.011]], 4, 3);
            });
        }
    }
}

/// A shade that glows, open above and below. A bulb inside would light little but the shade, and cost samples everywhere.
fn shade(s: &mut Solids, [low, high]: [[f64; 2]; 2]) {
    let middle = [0.5 * (low[0] + high[0]) - 0.06 * low[0], 0.5 * (low[1] + high[1])];
    s.look(Look::Shade).turned(&[low, middle, high], 14, 4);
}

fn floor_lamp(s: &mut Solids) {
    s.look(Look::Brass);
    let foot =
        [[0.0, 0.0], [0.135, 0.0], [0.14, 0.006], [0.13, 0.016], [0.03, 0.028], [0.012, 0.05]];
    s.turned(&foot, 14, 8);
    s.bar(DVec3::new(0.0, 0.04, 0.0), DVec3::new(0.0, 1.5, 0.0), [0.011; 2], 6);
    shade(s, [[0.22, 1.36], [0.15, 1.66]]);
}

fn table_lamp(s: &mut Solids) {
    s.look(Look::White);
    let foot = [
        [0.0, 0.0],
        [0.06, 0.0],
        [0.064, 0.008],
        [0.05, 0.02],
        [0.04, 0.05],
        [0.07, 0.12],
        [0.075, 0.17],
        [0.045, 0.23],
        [0.018, 0.26],
        [0.012, 0.29],
    ];
    s.turned(&foot, 12, 12);
    s.look(Look::Brass).bar(DVec3::new(0.0, 0.27, 0.0), DVec3::new(0.0, 0.36, 0.0), [0.008; 2], 5);
    shade(s, [[0.145, 0.30], [0.095, 0.48]]);
}

/// A lamp above the table: a dome of brass, white inside.
fn pendant(s: &mut Solids) {
    let ceiling = SIZE[1];
    s.look(Look::Iron);
    s.bar(DVec3::new(0.0, 1.83, 0.0), DVec3::new(0.0, ceiling, 0.0), [0.004; 2], 4);
    s.turned(&[[0.05, ceiling - 0.02], [0.05, ceiling]], 8, 1);
    s.turned(&[[0.0, ceiling - 0.02], [0.05, ceiling - 0.02]], 8, 1);
    let dome = [
        [0.21, 1.60],
        [0.195, 1.66],
        [0.15, 1.735],
        [0.08, 1.785],
        [0.03, 1.80],
        [0.02, 1.83],
        [0.006, 1.845],
    ];
    s.look(Look::Brass).turned(&dome, 16, 12);
    let inside: Vec<[f64; 2]> =
        dome.iter().rev().map(|&[r, y]| [(r - 0.003).max(0.0), y - 0.002]).collect();
    s.look(Look::Trim).turned(&inside, 16, 12);
    s.look(Look::Bulb);
    let ball: Vec<[f64; 2]> = (0..=8)
        .map(|i| (std::f64::consts::PI * f64::from(i) / 8.0).sin_cos())
        .map(|(sine, cosine)| [0.05 * sine, 1.67 - 0.05 * cosine])
        .collect();
    s.turned(&ball, 5, 4);
}

/// A pot with long leaves.
fn plant(s: &mut Solids) {
    s.look(Look::Clay);
    let pot = [
        [0.0, 0.0],
        [0.13, 0.0],
        [0.14, 0.01],
        [0.165, 0.15],
        [0.185, 0.29],
        [0.195, 0.30],
        [0.197, 0.33],
        [0.185, 0.335],
        [0.178, 0.32],
        [0.172, 0.28],
    ];
    s.turned(&pot, 14, 12);
    s.look(Look::Soil).turned(&[[0.176, 0.30], [0.0, 0.305]], 12, 1);
    let mut chance = Chance(11);
    let leaves = 44;
    for k in 0..leaves {
        // The golden angle spreads them evenly.
        let turn = 2.399_963 * f64::from(k);
        let age = 1.0 - f64::from(k) / f64::from(leaves);
        let (long, wide) =
            (chance.within(0.55, 0.75) * (0.75 + 0.35 * age), chance.within(0.022, 0.03));
        let (rise, droop) = (1.5 - 0.75 * age, 0.35 + 0.75 * age);
        let way = DVec3::new(turn.cos(), 0.0, turn.sin());
        let side = DVec3::new(-way.z, 0.0, way.x);
        let base = DVec3::new(0.0, 0.28, 0.0) + 0.02 * way;
        let middle = |v: f64| {
            let out = long * (0.18 * v + 0.62 * age.max(0.25) * v * v);
            // Against the wall leaves stay upright.
            let out = if way.x < -0.5 { 0.45 * out } else { out };
            base + out * way + DVec3::new(0.0, long * (rise * v - droop * v * v * v), 0.0)
        };
        let tone = chance.within(0.7, 1.3) as f32;
        s.painted(Look::Leaf, [tone, 1.0, tone]);
        let at = |u: f64, v: f64| {
            let a = 2.0 * u - 1.0;
            let half = wide * (1.6 * v.powf(0.6) * (1.0 - v.powi(3))).min(1.0);
            middle(v) + a * half * side + DVec3::new(0.0, 0.35 * half * a * a, 0.0)
        };
        let size = [s.segments(1), s.segments(5)];
        s.sheet(size, at, |u, v| [u, v]);
    }
}

/// A picture in a frame with a mount, on the wall behind.
fn framed(s: &mut Solids, look: Look, [a, b]: [f64; 2]) {
    let (mount, bar) = (0.06, 0.022);
    let (w, h) = (a + mount, b + mount);
    s.look(look).sheet(
        [1, 1],
        |u, v| DVec3::new(a * (2.0 * u - 1.0), b * (2.0 * v - 1.0), 0.0135),
        |u, v| [u, 1.0 - v],
    );
    s.look(Look::Paper).block([-w, -h, 0.004], [w, h, 0.013]);
    s.look(Look::Iron);
    let (low, high) = (0.001, 0.032);
    s.rounded([-w - bar, h - 0.003, low], [w + bar, h + bar, high], 0.004);
    s.rounded([-w - bar, -h - bar, low], [w + bar, -h + 0.003, high], 0.004);
    s.rounded([-w - bar, -h, low], [-w + 0.003, h, high], 0.004);
    s.rounded([w - 0.003, -h, low], [w + bar, h, high], 0.004);
}
