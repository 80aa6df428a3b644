//! Table and chairs, sideboard, shelves with books, an armchair, a rug.

use super::looks::Look;
use super::solid::Solids;
use super::{Chance, at};
use glam::{DAffine3, DQuat, DVec3};

/// Where the table stands.
pub const TABLE: [f64; 2] = [2.3, 3.0];
pub const TABLE_TOP: f64 = 0.76;

/// The sideboard's place along the back wall, and its top.
pub const SIDEBOARD: [f64; 2] = [1.25, 3.15];
pub const SIDEBOARD_TOP: f64 = 0.82;

pub fn make(s: &mut Solids) {
    let [x, z] = TABLE;
    s.within(at(x, 0.0, z, 0.0), rug);
    s.within(at(x, 0.012, z, 0.0), table);
    for (turn, far) in [(20.0, 0.82), (118.0, 0.80), (205.0, 0.84), (292.0, 0.78)] {
        let place = at(x, 0.012, z, turn) * at(0.0, 0.0, far, 0.0);
        s.within(place, chair);
    }
    sideboard(s);
    s.within(at(3.55, 0.0, 0.0, 0.0), shelves);
    s.within(at(4.3, 0.0, 1.95, -50.0), armchair);
}

fn rug(s: &mut Solids) {
    let (a, b, high) = (1.5, 1.1, 0.012);
    s.look(Look::Rug);
    s.sheet(
        [1, 1],
        |u, v| DVec3::new(a * (2.0 * u - 1.0), high, b * (1.0 - 2.0 * v)),
        |u, v| [u, 1.0 - v],
    );
    s.painted(Look::Cloth, [0.03, 0.04, 0.07]).block([-a, -0.01, -b], [a, high - 1e-4, b]);
}

/// A round table on a turned column with a foot.
fn table(s: &mut Solids) {
    let r = 0.66;
    s.look(Look::Walnut);
    let flat = |u: f64, v: f64, y: f64, r: f64| {
        let (sine, cosine) = (std::f64::consts::TAU * u).sin_cos();
        DVec3::new(r * v * cosine, y, -r * v * sine)
    };
    let around = s.segments(24);
    let grain = |u: f64, v: f64| {
        let p = flat(u, v, 0.0, r);
        [p.x / 1.2, p.z / 1.2]
    };
    // Turned the other way round, so that the front is above.
    s.sheet([around, 2], |u, v| flat(u, 1.0 - v, 0.748, r - 0.012), |u, v| grain(u, 1.0 - v));
    s.sheet([around, 2], |u, v| flat(u, v, 0.712, r - 0.012), grain);
    let edge =
        [[r - 0.012, 0.712], [r - 0.003, 0.716], [r, 0.73], [r - 0.003, 0.744], [r - 0.012, 0.748]];
    s.turned(&edge, 24, 3);
    let column = [
        [0.30, 0.0],
        [0.31, 0.015],
        [0.29, 0.035],
        [0.16, 0.06],
        [0.085, 0.11],
        [0.06, 0.18],
        [0.085, 0.25],
        [0.095, 0.31],
        [0.07, 0.38],
        [0.045, 0.46],
        [0.045, 0.56],
        [0.07, 0.63],
        [0.16, 0.69],
        [0.24, 0.713],
    ];
    s.turned(&column, 12, 14);
}

/// A chair that faces away from its own z axis.
fn chair(s: &mut Solids) {
    let v = DVec3::new;
    s.look(Look::Oak);
    let (half, seat) = (0.2, 0.45);
    for x in [-1.0, 1.0] {
        s.bar(v(x * 0.205, 0.0, -0.205), v(x * 0.175, seat, -0.17), [0.013, 0.02], 5);
        let post = [
            v(x * 0.205, 0.0, 0.24),
            v(x * 0.185, 0.24, 0.195),
            v(x * 0.18, seat, 0.18),
            v(x * 0.182, 0.66, 0.205),
            v(x * 0.19, 0.86, 0.265),
        ];
        s.swept(
            &post,
            DVec3::X,
            |v| [0.013 + 0.02 * v * (1.0 - v), 0.012 + 0.032 * v * (1.0 - v)],
            [6, 6],
        );
        s.bar(v(x * 0.19, 0.2, -0.19), v(x * 0.188, 0.22, 0.195), [0.009; 2], 4);
    }
    s.bar(v(-0.19, 0.21, 0.0), v(0.19, 0.21, 0.0), [0.009; 2], 4);
    // Rails bent around the back.
    for (y, z, high) in [(0.80, 0.245, 0.05), (0.68, 0.212, 0.03), (0.58, 0.196, 0.022)] {
        let bend = 0.045;
        let rail = [
            v(-0.19, y, z),
            v(-0.1, y, z + 0.75 * bend),
            v(0.0, y, z + bend),
            v(0.1, y, z + 0.75 * bend),
            v(0.19, y, z),
        ];
        s.swept(&rail, DVec3::Y, |_| [0.009, high], [6, 6]);
    }
    s.rounded([-half, seat - 0.03, -half], [half, seat + 0.005, half], 0.012);
    s.painted(Look::Cloth, [0.70, 0.66, 0.56]);
    s.rounded([-half + 0.012, seat, -half + 0.012], [half - 0.012, seat + 0.04, half - 0.02], 0.02);
}

fn sideboard(s: &mut Solids) {
    let [x0, x1] = SIDEBOARD;
    let (foot, top, deep) = (0.16, SIDEBOARD_TOP, 0.44);
    s.look(Look::Oak);
    s.rounded([x0, top - 0.035, 0.02], [x1, top, deep + 0.015], 0.008);
    s.rounded([x0 + 0.01, foot, 0.02], [x1 - 0.01, top - 0.03, deep - 0.02], 0.004);
    for x in [x0 + 0.12, x1 - 0.12] {
        for z in [0.1, deep - 0.1] {
            s.bar(DVec3::new(x, 0.0, z), DVec3::new(x, foot + 0.01, z), [0.013, 0.022], 5);
        }
    }
    let (doors, gap) = (4, 0.006);
    let wide = (x1 - x0 - 0.04) / f64::from(doors);
    for k in 0..doors {
        let from = x0 + 0.02 + wide * f64::from(k);
        s.look(Look::Oak);
        let (low, high) =
            ([from + gap, foot + 0.02, deep - 0.03], [from + wide - gap, top - 0.045, deep]);
        s.rounded(low, high, 0.005);
        s.look(Look::Brass);
        let knob = if k % 2 == 0 { from + wide - 0.05 } else { from + 0.05 };
        let turn = DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2);
        let place = DAffine3::from_rotation_translation(turn, DVec3::new(knob, 0.56, deep));
        s.within(place, |s| {
            s.turned(
                &[[0.006, -0.005], [0.006, 0.012], [0.015, 0.02], [0.014, 0.03], [0.0, 0.034]],
                6,
                4,
            );
        });
    }
}

/// Colours of bindings.
const BINDINGS: [[f32; 3]; 10] = [
    [0.36, 0.06, 0.05],
    [0.06, 0.12, 0.24],
    [0.08, 0.20, 0.13],
    [0.62, 0.50, 0.30],
    [0.70, 0.66, 0.58],
    [0.12, 0.11, 0.11],
    [0.52, 0.24, 0.08],
    [0.20, 0.27, 0.33],
    [0.44, 0.40, 0.16],
    [0.30, 0.13, 0.20],
];

/// Shelves in two bays with books.
fn shelves(s: &mut Solids) {
    let (wide, high, deep, board) = (1.7, 2.25, 0.31, 0.028);
    s.look(Look::Walnut);
    let r = 0.004;
    for x in [0.0, 0.5 * (wide - board), wide - board] {
        s.rounded([x, 0.0, 0.02], [x + board, high, deep], r);
    }
    s.rounded([-0.02, high - 0.005, 0.0], [wide + 0.02, high + 0.04, deep + 0.025], 0.008);
    s.rounded([0.01, 0.08, 0.015], [wide - 0.01, high, 0.03], r);
    s.block([0.01, 0.0, 0.05], [wide - 0.01, 0.08, deep - 0.02]);
    let rows = 6;
    let step = (high - 0.08) / f64::from(rows);
    let mut chance = Chance(1997);
    for row in 0..rows {
        let y = 0.08 + step * f64::from(row);
        for x in [board, 0.5 * (wide + board)] {
            s.look(Look::Walnut).rounded(
                [x - 0.005, y, 0.025],
                [x + 0.5 * wide - 1.5 * board + 0.005, y + board, deep - 0.005],
                r,
            );
            let bay = [x + 0.01, x + 0.5 * wide - 1.5 * board - 0.01];
            books(s, bay, y + board, [step - board - 0.03, deep - 0.03], &mut chance);
        }
    }
}

/// Books side by side, the last one leaning.
fn books(
    s: &mut Solids,
    [from, to]: [f64; 2],
    level: f64,
    [most, front]: [f64; 2],
    chance: &mut Chance,
) {
    let end = from + (to - from) * chance.within(0.62, 0.97);
    let (mut x, mut last, mut series) = (from, most, 0);
    let (mut thick, mut high, mut color) = (0.0, 0.0, [0.0; 3]);
    while x < end - 0.06 {
        if series == 0 {
            series = if chance.next() < 0.25 { 4 } else { 1 };
            thick = chance.within(0.018, 0.045);
            high = most * chance.within(0.66, 0.97);
            let shade = chance.within(0.75, 1.25) as f32;
            color = BINDINGS[(chance.next() * 10.0) as usize % 10].map(|c| c * shade);
        }
        series -= 1;
        let deep = (0.72 * high).min(front - 0.05);
        let set_back = chance.within(0.0, 0.02);
        s.within(at(x, level, front - set_back, 0.0), |s| book(s, [thick, high, deep], color));
        x += thick + 0.0015;
        last = high;
    }
    let (thick, high) = (0.03, 0.8 * most);
    let lean: f64 = 0.22;
    let foot = x + last.min(high * lean.cos()) * lean.tan() + 0.001;
    if foot + thick * lean.cos() < to {
        let turn = DQuat::from_rotation_z(lean);
        let place =
            DAffine3::from_rotation_translation(turn, DVec3::new(foot, level, front - 0.01));
        let color = BINDINGS[(chance.next() * 10.0) as usize % 10];
        s.within(place, |s| book(s, [thick, high, 0.16], color));
    }
}

/// A book whose spine is in front.
fn book(s: &mut Solids, [thick, high, deep]: [f64; 3], color: [f32; 3]) {
    s.painted(Look::Cover, color);
    let board = 0.0025;
    s.rounded([0.0, 0.0, -deep], [board, high, -0.003], 0.001);
    s.rounded([thick - board, 0.0, -deep], [thick, high, -0.003], 0.001);
    s.rounded([0.0, 0.0, -0.008], [thick, high, 0.0], 0.0035);
    for y in [0.12, 0.8] {
        let gilt = [0.75, 0.58, 0.30];
        s.painted(Look::Cover, gilt)
            .block([0.002, y * high, -0.002], [thick - 0.002, y * high + 0.004, 0.0004]);
    }
    s.look(Look::Paper).block([board, 0.003, -deep + 0.003], [thick - board, high - 0.004, -0.006]);
}

fn armchair(s: &mut Solids) {
    let cloth = [0.07, 0.19, 0.20];
    s.painted(Look::Cloth, cloth);
    s.rounded([-0.40, 0.18, -0.38], [0.40, 0.34, 0.36], 0.05);
    for x in [-1.0, 1.0f64] {
        let (low, high) = ((0.30 * x).min(0.43 * x), (0.30 * x).max(0.43 * x));
        s.rounded([low, 0.18, -0.40], [high, 0.60, 0.36], 0.06);
    }
    let lean = DAffine3::from_translation(DVec3::new(0.0, 0.30, -0.34))
        * DAffine3::from_rotation_x((-11f64).to_radians());
    s.within(lean, |s| {
        s.rounded([-0.42, -0.1, -0.09], [0.42, 0.62, 0.07], 0.07);
        s.rounded([-0.29, 0.08, 0.02], [0.29, 0.56, 0.17], 0.07);
    });
    s.rounded([-0.295, 0.31, -0.26], [0.295, 0.47, 0.39], 0.06);
    s.painted(Look::Cloth, [0.72, 0.42, 0.10]);
    let cushion = DAffine3::from_translation(DVec3::new(0.05, 0.62, -0.17))
        * DAffine3::from_rotation_x((-20f64).to_radians())
        * DAffine3::from_rotation_z(0.12);
    s.within(cushion, |s| pillow(s, 0.2, 0.07));
    s.look(Look::Walnut);
    for x in [-0.33, 0.33] {
        for z in [-0.30, 0.28] {
            s.bar(DVec3::new(x, 0.0, z), DVec3::new(x, 0.19, z), [0.014, 0.024], 5);
        }
    }
}

/// A square cushion with drawn-out corners.
fn pillow(s: &mut Solids, half: f64, thick: f64) {
    for side in [-1.0, 1.0] {
        let at = |u: f64, v: f64| {
            let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
            let full = ((1.0 - a.powi(4)) * (1.0 - b.powi(4))).max(0.0).sqrt();
            let pinch = 1.0 - 0.10 * (1.0 - a * a) * b * b;
            let pinch_b = 1.0 - 0.10 * (1.0 - b * b) * a * a;
            DVec3::new(side * half * a * pinch_b, half * b * pinch, side * thick * full)
        };
        let size = [s.segments(6), s.segments(6)];
        s.sheet(size, at, |u, v| [u, v]);
    }
}
