//! The area functions of the sweep, against areas that are clipped or sampled directly.

use ropewalk::Aabb;
use ropewalk::primitive::{AreaRamp, Polygon, Primitive, Sphere, Triangle};
use ropewalk_testkit::primitives::{Kind, Sample, Space, cell_around, sample};
use ropewalk_testkit::rays::Draw;

type V = [f64; 3];

/// Share of the cell along the axis within which a thin piece may lie elsewhere.
const THIN: f64 = 1e-3;

fn swept(ramps: &[AreaRamp], t: f64) -> f64 {
    ramps.iter().map(|ramp| ramp.area_until(t)).sum()
}

/// Area of a triangle's part in a box, by clipping and cross products.
fn direct_area(piece: [[f32; 3]; 3], lo: V, hi: V) -> f64 {
    let mut points: Vec<V> = piece.map(|p| p.map(f64::from)).to_vec();
    for a in 0..3 {
        for (bound, sign) in [(lo[a], 1.0), (hi[a], -1.0)] {
            let mut next = Vec::new();
            for i in 0..points.len() {
                let (p, q) = (points[i], points[(i + 1) % points.len()]);
                let (dp, dq) = (sign * (p[a] - bound), sign * (q[a] - bound));
                if dp >= 0.0 {
                    next.push(p);
                }
                if dp * dq < 0.0 {
                    let s = dp / (dp - dq);
                    let mut x: V = std::array::from_fn(|k| p[k] + s * (q[k] - p[k]));
                    x[a] = bound;
                    next.push(x);
                }
            }
            points = next;
        }
    }
    let mut sum = [0.0; 3];
    for i in 2..points.len() {
        let e: V = std::array::from_fn(|k| points[i - 1][k] - points[0][k]);
        let f: V = std::array::from_fn(|k| points[i][k] - points[0][k]);
        for k in 0..3 {
            let (b, c) = ((k + 1) % 3, (k + 2) % 3);
            sum[k] += 0.5 * (e[b] * f[c] - e[c] * f[b]);
        }
    }
    sum.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Area of a planar sample in the cell left of a plane at `t`, local to the cell.
fn direct_sweep(s: &Sample, cell: &Aabb, axis: usize, t: f64) -> f64 {
    let (lo, mut hi) = (cell.min.map(f64::from), cell.max.map(f64::from));
    hi[axis] = hi[axis].min(lo[axis] + t);
    if hi[axis] < lo[axis] {
        return 0.0;
    }
    s.pieces.iter().map(|&piece| direct_area(piece, lo, hi)).sum()
}

/// Compares at the breakpoints and between them. A thin piece may be shifted by `THIN` of the cell;
/// where there is none near, the two agree to `tolerance` of the cell's area.
fn check_planar(s: &Sample, cell: &Aabb, axis: usize, tolerance: f64) -> bool {
    let mut ramps = Vec::new();
    s.shape.area_ramps(cell, axis, &mut ramps);
    let (extent, share) = (cell.extent(axis), tolerance * cell.area());
    let mut stops: Vec<f64> = ramps.iter().map(|ramp| ramp.x).collect();
    assert!(stops.iter().all(|x| (0.0..=extent).contains(x)), "{ramps:?} {extent}");
    stops.extend((0..=8).map(|i| extent * f64::from(i) / 8.0));
    stops.sort_by(f64::total_cmp);
    let middles: Vec<f64> = stops.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect();
    let bends: Vec<f64> = ramps.iter().map(|ramp| ramp.x).collect();
    let mut compared = 0;
    for t in stops.into_iter().chain(middles) {
        let value = swept(&ramps, t);
        let low = direct_sweep(s, cell, axis, t - THIN * extent);
        let high = direct_sweep(s, cell, axis, t + THIN * extent);
        assert!(
            low - share <= value && value <= high + share,
            "{:?} {cell:?} {axis} {t}: {value} not in {low}..{high} {ramps:?}",
            s.pieces
        );
        if bends.iter().all(|x| (x - t).abs() > THIN * extent) {
            let exact = direct_sweep(s, cell, axis, t);
            assert!(
                (value - exact).abs() <= share,
                "{:?} {cell:?} {axis} {t}: {value} {exact} {ramps:?}",
                s.pieces
            );
            compared += 1;
        }
    }
    let inside = direct_sweep(s, cell, axis, extent);
    assert!((s.shape.area_in(cell) - inside).abs() <= share, "{:?} {cell:?}", s.pieces);
    compared > 0 && inside > share
}

#[test]
fn planar_sweeps_equal_direct_clipping_to_a_millionth_of_the_cell() {
    for kind in [Kind::Triangle, Kind::Polygon] {
        for space in [Space::Unit, Space::Grid, Space::Exponent] {
            // Rounded vertices miss the polygon's plane by 1e-7 of the coordinates, which small
            // cells show.
            let inexact = kind == Kind::Polygon && space != Space::Grid;
            if inexact && space == Space::Exponent {
                continue;
            }
            let mut draw = Draw::new(21);
            let mut compared = 0;
            for _ in 0..2500 {
                let s = sample(&mut draw, kind, space);
                let middle = s.point(&mut draw);
                let cell = cell_around(&mut draw, middle, s.shape.bounds().diagonal());
                if inexact && (0..3).any(|a| cell.extent(a) < 0.3) {
                    continue;
                }
                for axis in 0..3 {
                    compared += usize::from(check_planar(&s, &cell, axis, 1e-6));
                }
            }
            assert!(compared > 500, "{kind:?} {space:?} {compared}");
        }
    }
}

#[test]
fn slivers_and_flat_pieces_stay_bounded() {
    let mut draw = Draw::new(22);
    let cell = Aabb::new([0.0; 3], [1.0; 3]);
    for _ in 0..8000 {
        // Corners that nearly coincide on one axis or all, over ten orders of magnitude.
        let p = draw.point_in(&cell);
        let vertices = std::array::from_fn(|_| {
            let thin = draw.below(3);
            std::array::from_fn(|a| {
                let step = draw.exponent(if a == thin { -35.0 } else { -10.0 }, -1.0);
                let step = if a == thin && draw.chance(0.5) { 0.0 } else { step };
                (f64::from(p[a]) + step).clamp(0.0, 1.0) as f32
            })
        });
        let s = Sample { shape: Triangle { vertices }.into(), pieces: vec![vertices] };
        for axis in 0..3 {
            check_planar(&s, &cell, axis, 1e-6);
            // A running quadratic in absolute coordinates must not drift either.
            let mut ramps = Vec::new();
            s.shape.area_ramps(&cell, axis, &mut ramps);
            let (mut c0, mut c1, mut c2) = (0.0, 0.0, 0.0);
            for r in &ramps {
                c0 += r.step - r.width * r.x + 0.5 * r.slope * r.x * r.x;
                c1 += r.width - r.slope * r.x;
                c2 += 0.5 * r.slope;
            }
            let at_end = c0 + c1 + c2;
            let tolerance = 1e-6 * cell.area();
            assert!((at_end - s.shape.area()).abs() < tolerance, "{vertices:?} {at_end} {ramps:?}");
        }
    }
}

#[test]
fn a_concave_polygon_has_the_area_of_its_shape() {
    // An L of area 3, tilted: (x, y, x).
    let outline = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
    let polygon = Polygon::new(outline.map(|[x, y]| [x, y, x]).to_vec()).unwrap();
    let tilt = 2f64.sqrt();
    assert!((polygon.area() - 3.0 * tilt).abs() < 1e-14);
    let cell = Aabb::new([0.0; 3], [2.0; 3]);
    let mut ramps = Vec::new();
    polygon.area_ramps(&cell, 0, &mut ramps);
    for (t, area) in [(0.5, 1.0), (1.0, 2.0), (1.5, 2.5), (2.0, 3.0)] {
        assert!((swept(&ramps, t) - area * tilt).abs() < 1e-12, "{t}");
    }
    // The notch is empty: its corner is only touched.
    let notch = Aabb::new([1.25, 1.25, 0.0], [2.0, 2.0, 2.0]);
    assert_eq!(polygon.clipped_bounds(&notch), None);
    assert_eq!(polygon.area_in(&notch), 0.0);
}

#[test]
fn spheres_sweep_exactly_where_no_other_face_cuts_them() {
    let sphere = Sphere { center: [1.0, 2.0, 3.0], radius: 2.0 };
    let cell = Aabb::new([-2.0, -2.0, 2.0], [4.0, 5.0, 9.0]);
    let mut ramps = Vec::new();
    sphere.area_ramps(&cell, 2, &mut ramps);
    let rate = std::f64::consts::TAU * 2.0;
    for (t, height) in [(0.0, 0.0), (1.0, 1.0), (2.5, 2.5), (3.0, 3.0), (7.0, 3.0)] {
        assert!((swept(&ramps, t) - rate * height).abs() < 1e-12, "{t}");
    }
}

/// A point uniform by area on a curved sample.
fn uniform_point(draw: &mut Draw, s: &Sample) -> V {
    match &s.shape {
        ropewalk::Shape::Sphere(b) => {
            let (z, turn) = (draw.uniform(-1.0, 1.0), draw.uniform(0.0, std::f64::consts::TAU));
            let r = (1.0 - z * z).sqrt();
            let d = [r * turn.cos(), r * turn.sin(), z];
            std::array::from_fn(|a| f64::from(b.center[a]) + f64::from(b.radius) * d[a])
        }
        ropewalk::Shape::Cone(c) => {
            let (r0, r1) = (f64::from(c.base_radius), f64::from(c.apex_radius));
            let share = loop {
                let share = draw.uniform(0.0, 1.0);
                if draw.uniform(0.0, r0.max(r1)) <= r0 + share * (r1 - r0) {
                    break share;
                }
            };
            let (base, apex) = (c.base.map(f64::from), c.apex.map(f64::from));
            let axis: V = std::array::from_fn(|a| apex[a] - base[a]);
            let h = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
            let n = axis.map(|x| x / h);
            let k = (0..3).fold(0, |k, a| if n[a].abs() < n[k].abs() { a } else { k });
            let mut e: V = std::array::from_fn(|a| if a == k { 1.0 } else { 0.0 } - n[k] * n[a]);
            let len = e.iter().map(|x| x * x).sum::<f64>().sqrt();
            e = e.map(|x| x / len);
            let f =
                [n[1] * e[2] - n[2] * e[1], n[2] * e[0] - n[0] * e[2], n[0] * e[1] - n[1] * e[0]];
            let (sin, cos) = draw.uniform(0.0, std::f64::consts::TAU).sin_cos();
            let r = r0 + share * (r1 - r0);
            std::array::from_fn(|a| base[a] + share * axis[a] + r * (cos * e[a] + sin * f[a]))
        }
        _ => unreachable!("planar"),
    }
}

#[test]
fn curved_sweeps_are_right_to_a_percent_of_the_cell() {
    const POINTS: usize = 20_000;
    for kind in [Kind::Sphere, Kind::Cone] {
        let mut draw = Draw::new(23);
        let mut cases = 0;
        for _ in 0..300 {
            let s = sample(&mut draw, kind, Space::Unit);
            if s.shape.is_degenerate() {
                continue;
            }
            let middle = s.point(&mut draw);
            let size = s.shape.bounds().diagonal() * draw.uniform(0.1, 1.0);
            let cell = cell_around(&mut draw, middle, size);
            let roomy = (0..3).all(|a| cell.extent(a) > 0.05 * s.shape.bounds().diagonal());
            if !roomy {
                continue;
            }
            cases += 1;
            let points: Vec<V> = (0..POINTS).map(|_| uniform_point(&mut draw, &s)).collect();
            for axis in 0..3 {
                let mut ramps = Vec::new();
                s.shape.area_ramps(&cell, axis, &mut ramps);
                let (lo, hi) = (cell.min.map(f64::from), cell.max.map(f64::from));
                for i in 1..=8 {
                    let t = cell.extent(axis) * f64::from(i) / 8.0;
                    let inside = points.iter().filter(|p| {
                        (0..3).all(|a| lo[a] <= p[a] && p[a] <= hi[a]) && p[axis] - lo[axis] <= t
                    });
                    let count = inside.count() as f64;
                    let one = s.shape.area() / POINTS as f64;
                    // Four standard deviations of the count, and one point.
                    let noise = one * (4.0 * count.sqrt() + 1.0);
                    let error = (swept(&ramps, t) - one * count).abs();
                    assert!(
                        error <= 0.01 * cell.area() + noise,
                        "{kind:?} {:?} {cell:?} {axis} {t}: {} {}",
                        s.shape.bounds(),
                        swept(&ramps, t),
                        one * count
                    );
                }
            }
        }
        assert!(cases > 50, "{cases}");
    }
}
