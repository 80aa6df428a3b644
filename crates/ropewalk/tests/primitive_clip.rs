//! Bounds and clips of every primitive: conservative, inside cell and bounds, tight.

use glam::DVec3;
use ropewalk::primitive::{Cone, HIT_ERROR, Primitive, Sphere, Triangle};
use ropewalk::ray::PreparedRay;
use ropewalk::{Aabb, Ray, Shape, Sides};
use ropewalk_testkit::primitives::{Kind, Sample, Space, cell_around, sample};
use ropewalk_testkit::rays::Draw;

/// How far outside `b` a point lies on its worst axis.
fn outside(b: &Aabb, p: [f64; 3]) -> f64 {
    (0..3).fold(0.0, |far: f64, a| {
        far.max(f64::from(b.min[a]) - p[a]).max(p[a] - f64::from(b.max[a]))
    })
}

fn magnitude(b: &Aabb) -> f64 {
    b.min.iter().chain(&b.max).fold(0.0, |m, x| m.max(f64::from(x.abs())))
}

/// How far a sampled point may be off the surface: rounding, and what a polygon's vertices miss
/// its plane, for which half an ulp of `f32` per coordinate is a bound on the sampled ones.
fn sampling_error(s: &Sample, exact: bool) -> f64 {
    let planar = !matches!(s.shape, Shape::Polygon(_) | Shape::Patch(_));
    let share = if exact {
        0.0
    } else if planar {
        16.0 * f64::EPSILON
    } else {
        2f64.powi(-21)
    };
    share * magnitude(&s.shape.bounds())
}

#[test]
fn clips_hold_every_surface_point_of_the_cell() {
    for (i, kind) in Kind::ALL.into_iter().enumerate() {
        for space in Space::ALL {
            let mut draw = Draw::new(i as u64);
            for _ in 0..4000 {
                let s = sample(&mut draw, kind, space);
                let bounds = s.shape.bounds();
                let point = s.point(&mut draw);
                let planar = matches!(kind, Kind::Triangle | Kind::Polygon | Kind::Patch);
                // On the grid, points with short weights are exact.
                let short = point.iter().all(|x| (x * 64.0).fract() == 0.0);
                let error = sampling_error(&s, planar && space == Space::Grid && short);
                assert!(outside(&bounds, point) <= error, "{kind:?} {space:?} {point:?}");
                // The cell holds the point with its error, so that the surface is in it.
                let mut cell = cell_around(&mut draw, point, bounds.diagonal());
                if error > 0.0 {
                    for a in 0..3 {
                        cell.min[a] = cell.min[a].min((point[a] - 2.0 * error) as f32).next_down();
                        cell.max[a] = cell.max[a].max((point[a] + 2.0 * error) as f32).next_up();
                    }
                }
                let clip = s.shape.clipped_bounds(&cell);
                let clip = clip.unwrap_or_else(|| panic!("{kind:?} {space:?} {cell:?} {point:?}"));
                assert!(
                    outside(&clip, point) <= error,
                    "{kind:?} {space:?} {clip:?} {point:?} {cell:?}"
                );
                assert!(cell.contains(&clip) && bounds.contains(&clip) && !clip.is_empty());
            }
        }
    }
}

/// What lies beside the axis is roundings there, and which way they point must not matter.
#[test]
fn cells_with_their_middle_on_the_axis_of_a_cone() {
    let mut draw = Draw::new(12);
    let mut inside = 0;
    for _ in 0..3000 {
        let eighth = |draw: &mut Draw, n: usize| (1 + draw.below(n)) as f32 / 8.0;
        let (base, apex) = (draw.grid_point(3), draw.grid_point(3));
        let (base_radius, apex_radius) = (eighth(&mut draw, 8), eighth(&mut draw, 8));
        let cone = Cone { base, apex, base_radius, apex_radius };
        if cone.is_degenerate() {
            continue;
        }
        let point = |share: f32| {
            DVec3::from_array(std::array::from_fn(|a| {
                f64::from(base[a]) + f64::from(share) * (f64::from(apex[a]) - f64::from(base[a]))
            }))
        };
        let (middle, half) = (point(eighth(&mut draw, 7)), [0; 3].map(|_| eighth(&mut draw, 8)));
        let at = middle.to_array().map(|x| x as f32);
        let cell = Aabb {
            min: std::array::from_fn(|a| at[a] - half[a]),
            max: std::array::from_fn(|a| at[a] + half[a]),
        };
        let clip = cone.clipped_bounds(&cell);
        let axis = (point(1.0) - point(0.0)).normalize();
        let (u, v) = axis.any_orthonormal_pair();
        for _ in 0..20 {
            let (share, angle) = (draw.uniform(0.0, 1.0), draw.uniform(0.0, std::f64::consts::TAU));
            let radius =
                f64::from(base_radius) + share * (f64::from(apex_radius) - f64::from(base_radius));
            let p = point(0.0) + share * (point(1.0) - point(0.0));
            let p = (p + radius * (u * angle.cos() + v * angle.sin())).to_array();
            let margin =
                |a: usize| (p[a] - f64::from(cell.min[a])).min(f64::from(cell.max[a]) - p[a]);
            if (0..3).all(|a| margin(a) > 1e-9) {
                inside += 1;
                let clip = clip.unwrap_or_else(|| panic!("lost {cone:?} in {cell:?} at {p:?}"));
                assert!(outside(&clip, p) <= 1e-12, "{cone:?} in {cell:?}: {clip:?}, {p:?}");
            }
        }
    }
    assert!(inside > 5000, "{inside}");
}

#[test]
fn clips_of_any_cell_lie_in_cell_and_bounds() {
    let mut draw = Draw::new(7);
    for kind in Kind::ALL {
        for _ in 0..4000 {
            let s = sample(&mut draw, kind, Space::Grid);
            let (p, q) = (draw.grid_point(5), draw.grid_point(5));
            let cell = Aabb::from_points([p, q]);
            if let Some(clip) = s.shape.clipped_bounds(&cell) {
                assert!(cell.contains(&clip) && s.shape.bounds().contains(&clip));
                assert!(!clip.is_empty());
            }
        }
    }
}

#[test]
fn reported_hits_lie_in_the_bounds() {
    let mut hits = 0;
    for kind in Kind::ALL {
        for space in Space::ALL {
            let mut draw = Draw::new(11);
            for _ in 0..4000 {
                let s = sample(&mut draw, kind, space);
                let (b, target) = (s.shape.bounds(), s.point(&mut draw));
                let away = draw.direction().map(|x| f64::from(x) * b.diagonal() * 2.0);
                let origin: [f32; 3] = std::array::from_fn(|a| (target[a] + away[a]) as f32);
                let dir = std::array::from_fn(|a| (target[a] - f64::from(origin[a])) as f32);
                let ray = Ray::new(origin, dir);
                let Some(prepared) = PreparedRay::new(&ray) else { continue };
                let Some(hit) = s.shape.intersect(&prepared, Sides::Both) else { continue };
                hits += 1;
                let largest = |v: [f32; 3]| v.iter().fold(0.0, |m: f64, x| m.max(x.abs().into()));
                let rounding = 2f64.powi(-24) * f64::from(hit.t) * largest(dir);
                let error = rounding + HIT_ERROR * magnitude(&b).max(largest(origin));
                let off = outside(&b, ray.at(hit.t));
                assert!(off <= error, "{kind:?} {space:?} {ray:?} {hit:?} {b:?} {off:e} {error:e}");
            }
        }
    }
    assert!(hits > 20_000, "{hits}");
}

/// The extent of a triangle in a box, by its edges in the box and the box's edges through it.
fn reference_clip(t: [[f64; 3]; 3], cell: &Aabb) -> Option<([f64; 3], [f64; 3])> {
    let (lo, hi) = (cell.min.map(f64::from), cell.max.map(f64::from));
    let mut points = Vec::new();
    let segment = |p: [f64; 3], q: [f64; 3], lo: [f64; 3], hi: [f64; 3], out: &mut Vec<_>| {
        let (mut s, mut e) = (0.0f64, 1.0f64);
        for a in 0..3 {
            let d = q[a] - p[a];
            if d == 0.0 && (p[a] < lo[a] || p[a] > hi[a]) {
                return;
            }
            if d != 0.0 {
                let (x, y) = ((lo[a] - p[a]) / d, (hi[a] - p[a]) / d);
                (s, e) = (s.max(x.min(y)), e.min(x.max(y)));
            }
        }
        if s <= e {
            for u in [s, e] {
                out.push(std::array::from_fn(|a| p[a] + u * (q[a] - p[a])));
            }
        }
    };
    for i in 0..3 {
        segment(t[i], t[(i + 1) % 3], lo, hi, &mut points);
    }
    let sub = |p: [f64; 3], q: [f64; 3]| -> [f64; 3] { std::array::from_fn(|a| p[a] - q[a]) };
    let cross = |p: [f64; 3], q: [f64; 3]| {
        [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
    };
    let dot = |p: [f64; 3], q: [f64; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
    let n = cross(sub(t[1], t[0]), sub(t[2], t[0]));
    for axis in 0..3 {
        for corner in 0..4 {
            let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
            let mut p = lo;
            p[b] = if corner & 1 == 0 { lo[b] } else { hi[b] };
            p[c] = if corner & 2 == 0 { lo[c] } else { hi[c] };
            if n[axis] != 0.0 {
                p[axis] += dot(n, sub(t[0], p)) / n[axis];
                let side = |i: usize| dot(n, cross(sub(t[(i + 1) % 3], t[i]), sub(p, t[i])));
                let inside = (0..3).all(|i| side(i) >= 0.0);
                if inside && lo[axis] <= p[axis] && p[axis] <= hi[axis] {
                    points.push(p);
                }
            }
        }
    }
    let min = std::array::from_fn(|a| points.iter().map(|p| p[a]).fold(f64::INFINITY, f64::min));
    let max =
        points.iter().fold([f64::NEG_INFINITY; 3], |m, p| std::array::from_fn(|a| m[a].max(p[a])));
    (!points.is_empty()).then_some((min, max))
}

#[test]
fn triangle_clips_equal_an_independent_reference() {
    let (mut both, mut none) = (0, 0);
    for space in [Space::Unit, Space::Grid] {
        let mut draw = Draw::new(3);
        for _ in 0..30_000 {
            let s = sample(&mut draw, Kind::Triangle, space);
            let n = 2.0;
            let corner = |draw: &mut Draw| match space {
                Space::Grid => draw.grid_point(4),
                _ => std::array::from_fn(|_| draw.uniform(-n, n) as f32),
            };
            let cell = Aabb::from_points([corner(&mut draw), corner(&mut draw)]);
            let reference = reference_clip(s.pieces[0].map(|p| p.map(f64::from)), &cell);
            match (s.shape.clipped_bounds(&cell), reference) {
                (Some(clip), Some((min, max))) => {
                    both += 1;
                    for a in 0..3 {
                        // One ulp outward, and what the slack moves along a flat edge.
                        let (x, y) = (f64::from(clip.min[a]), f64::from(clip.max[a]));
                        assert!(
                            (x - min[a]).abs() < 1e-6 && (y - max[a]).abs() < 1e-6,
                            "{s:?}",
                            s = (s.pieces[0], cell, clip, min, max)
                        );
                    }
                }
                (None, None) => none += 1,
                (Some(clip), None) => panic!("not touching: {:?} {cell:?} {clip:?}", s.pieces[0]),
                (None, Some(_)) => panic!("lost: {:?} {cell:?}", s.pieces[0]),
            }
        }
    }
    assert!(both > 10_000 && none > 10_000, "{both} {none}");
}

#[test]
fn polygon_clips_equal_those_of_their_triangles() {
    let mut clipped = 0;
    for space in [Space::Unit, Space::Grid] {
        let mut draw = Draw::new(4);
        for _ in 0..6000 {
            let s = sample(&mut draw, Kind::Polygon, space);
            let middle = s.point(&mut draw);
            let cell = cell_around(&mut draw, middle, s.shape.bounds().diagonal());
            let clips = |by: f32| {
                let cell = Aabb::new(cell.min.map(|x| x - by), cell.max.map(|x| x + by));
                let pieces = s.pieces.iter();
                pieces
                    .filter_map(|&vertices| Triangle { vertices }.clipped_bounds(&cell))
                    .fold(Aabb::EMPTY, |sum, b| sum.union(&b))
            };
            let union = clips(0.0);
            let Some(clip) = s.shape.clipped_bounds(&cell) else {
                // A cell that is only touched may be missed by a polygon moved to its plane.
                assert!(space == Space::Unit, "{cell:?}");
                continue;
            };
            clipped += 1;
            if space == Space::Grid {
                for a in 0..3 {
                    let off =
                        (clip.min[a] - union.min[a]).abs().max((clip.max[a] - union.max[a]).abs());
                    assert!(off < 2e-6, "{:?} {cell:?} {clip:?} {union:?}", s.pieces);
                }
            } else {
                // Rounded vertices miss their plane: between the clips of a smaller and a larger
                // cell.
                let grow = |b: &Aabb| Aabb::new(b.min.map(|x| x - 1e-6), b.max.map(|x| x + 1e-6));
                assert!(grow(&clips(5e-6)).contains(&clip), "{:?} {cell:?} {clip:?}", s.pieces);
                assert!(grow(&clip).contains(&clips(-5e-6)), "{:?} {cell:?} {clip:?}", s.pieces);
            }
        }
    }
    assert!(clipped > 8000, "{clipped}");
}

#[test]
fn curved_clips_are_tight() {
    // Against the hull of many points of the surface in the cell.
    for (kind, share) in [(Kind::Sphere, 0.05), (Kind::Cone, 0.12)] {
        let mut draw = Draw::new(5);
        let (mut excess, mut cases) = (0.0, 0);
        for _ in 0..300 {
            let s = sample(&mut draw, kind, Space::Unit);
            if s.shape.is_degenerate() {
                continue;
            }
            let middle = s.point(&mut draw);
            let size = s.shape.bounds().diagonal() * draw.uniform(0.1, 0.6);
            let cell = cell_around(&mut draw, middle, size);
            let clip = s.shape.clipped_bounds(&cell).expect("holds a point of the surface");
            let mut hull = Aabb::EMPTY;
            let mut inside = 0;
            for _ in 0..20_000 {
                let p = s.point(&mut draw).map(|x| x as f32);
                if cell.contains_point(p) {
                    hull = hull.extended(p);
                    inside += 1;
                }
            }
            // Touched rims are drawn often but have no extent.
            if inside > 2000 && hull.diagonal() > 0.02 * s.shape.bounds().diagonal() {
                excess += clip.diagonal() / hull.diagonal() - 1.0;
                cases += 1;
            }
        }
        let mean = excess / f64::from(cases);
        assert!(cases > 30 && mean < share, "{kind:?}: {mean} over {cases}");
    }
}

#[test]
fn hollow_solids_are_not_in_the_cells_that_they_enclose() {
    let ball: Shape = Sphere { center: [0.0; 3], radius: 5.0 }.into();
    let cube = |r: f32| Aabb::new([-r; 3], [r; 3]);
    assert_eq!(ball.clipped_bounds(&cube(2.8)), None);
    assert_eq!(ball.clipped_bounds(&cube(5.0)), Some(cube(5.0)));
    // The corner (0, 3, 4) lies on the sphere: touched from inside and from outside.
    let inside = Aabb::new([0.0, 0.0, 0.0], [0.0, 3.0, 4.0]);
    assert!(ball.clipped_bounds(&inside).is_some_and(|b| b.contains_point([0.0, 3.0, 4.0])));
    let outside = Aabb::new([0.0, 3.0, 4.0], [9.0, 9.0, 9.0]);
    let touch = Aabb::new([0.0, 3.0, 4.0], [0.0, 3.0, 4.0]);
    let clip = ball.clipped_bounds(&outside).expect("touched");
    assert!(clip.contains(&touch) && clip.diagonal() < 1e-2);
    assert_eq!(ball.clipped_bounds(&Aabb::new([3.0; 3], [9.0; 3])), None);

    let tube: Shape = ropewalk::primitive::Cone {
        base: [0.0, 0.0, -10.0],
        apex: [0.0, 0.0, 10.0],
        base_radius: 5.0,
        apex_radius: 5.0,
    }
    .into();
    assert_eq!(tube.clipped_bounds(&cube(3.5)), None);
    assert_eq!(tube.clipped_bounds(&Aabb::new([4.0, 4.0, -1.0], [9.0, 9.0, 1.0])), None);
    let side = tube.clipped_bounds(&Aabb::new([4.0, -3.0, -1.0], [9.0, 3.0, 1.0])).expect("cut");
    assert_eq!((side.min, side.max), ([4.0, -3.0, -1.0], [5.0, 3.0, 1.0]));
    let corner = Aabb::new([3.0, 4.0, 0.0], [9.0, 9.0, 1.0]);
    assert!(tube.clipped_bounds(&corner).is_some_and(|b| b.contains_point([3.0, 4.0, 0.5])));
}
