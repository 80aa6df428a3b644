//! Intersections against exact arithmetic and differently arranged formulas; watertight meshes;
//! sides; degenerate primitives.

use ropewalk::primitive::{
    Cone, Crossing, HIT_ERROR, Patch, Polygon, Primitive, ShapeError, Sphere, Triangle,
};
use ropewalk::ray::PreparedRay;
use ropewalk::{Geometry, GeometryError, Ray, Shape, Sides};
use ropewalk_testkit::primitives::{Kind, Space, random_geometry, sample};
use ropewalk_testkit::rays::Draw;
use std::collections::HashMap;

type V = [f64; 3];

fn sub(p: V, q: V) -> V {
    std::array::from_fn(|a| p[a] - q[a])
}

fn dot(p: V, q: V) -> f64 {
    p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
}

fn wide(p: [f32; 3]) -> V {
    p.map(f64::from)
}

fn hit(shape: &impl Primitive, ray: &Ray, sides: Sides) -> Option<Crossing> {
    shape.intersect(&PreparedRay::new(ray)?, sides)
}

/// The exact crossing of a ray and a triangle of small integers: the numerator and denominator of
/// `t`, and the smallest edge function (0 on the boundary, negative outside).
fn exact_triangle(t: [[i64; 3]; 3], o: [i64; 3], d: [i64; 3]) -> Option<(i64, i64, i64)> {
    let sub = |p: [i64; 3], q: [i64; 3]| [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
    let cross = |p: [i64; 3], q: [i64; 3]| {
        [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
    };
    let dot = |p: [i64; 3], q: [i64; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
    let n = cross(sub(t[1], t[0]), sub(t[2], t[0]));
    let den = dot(n, d);
    if den == 0 {
        return None;
    }
    // Signed volumes of the ray with each edge, positive inside for either orientation.
    let volume = |i: usize, j: usize| dot(d, cross(sub(t[i], o), sub(t[j], o))) * den.signum();
    let least = volume(0, 1).min(volume(1, 2)).min(volume(2, 0));
    Some((dot(n, sub(t[0], o)), den, least))
}

#[test]
fn triangles_of_integers_are_hit_as_exact_arithmetic_says() {
    let mut draw = Draw::new(31);
    let (mut hits, mut edges, mut misses) = (0, 0, 0);
    for _ in 0..400_000 {
        let vertices = [draw.grid_point(6), draw.grid_point(6), draw.grid_point(6)];
        let (origin, dir) = (draw.grid_point(9), draw.grid_point(4));
        let whole = |p: [f32; 3]| p.map(|x| x as i64);
        let ray = Ray::new(origin, dir).with_range(f32::NEG_INFINITY, f32::INFINITY);
        if !ray.is_valid() {
            continue;
        }
        let found = hit(&Triangle { vertices }, &ray, Sides::Both);
        let on_triangle = |found: Crossing| {
            let w = 1.0 - found.u - found.v;
            let at: V = std::array::from_fn(|a| {
                let [p, q, r] = vertices.map(|x| f64::from(x[a]));
                f64::from(w) * p + f64::from(found.u) * q + f64::from(found.v) * r
            });
            let off = sub(at, ray.at(found.t));
            assert!(dot(off, off) < 1e-9, "{vertices:?} {ray:?} {found:?}");
        };
        match exact_triangle(vertices.map(whole), whole(origin), whole(dir)) {
            Some((num, den, least)) if least > 0 => {
                let t = num as f64 / den as f64;
                let found = found.unwrap_or_else(|| panic!("lost {vertices:?} {ray:?}"));
                // Rounded once: the nearest f32, or its neighbour on a near tie.
                let ulp = f64::from((t as f32).abs().next_up()) - f64::from((t as f32).abs());
                let error = (f64::from(found.t) - t).abs();
                assert!(error <= 0.500_001 * ulp + 1e-14, "{vertices:?} {ray:?} {found:?} {t}");
                on_triangle(found);
                hits += 1;
            }
            Some((_, _, 0)) => edges += 1, // a shared edge belongs to one triangle at least
            Some(_) => {
                assert_eq!(found, None, "{vertices:?} {ray:?}");
                misses += 1;
            }
            // Edge-on: a hit is in order only where the ray touches the triangle.
            None => found.into_iter().for_each(on_triangle),
        }
    }
    assert!(hits > 5000 && edges > 1000 && misses > 100_000, "{hits} {edges} {misses}");
}

#[test]
fn scales_do_not_matter() {
    let mut draw = Draw::new(32);
    for scale in [1e-30f32, 1e-12, 1.0, 1e12, 1e19, 1e37] {
        for _ in 0..2000 {
            let vertices: [_; 3] = std::array::from_fn(|_| draw.direction().map(|x| x * scale));
            let origin = draw.direction().map(|x| x * scale);
            let center: [f32; 3] = std::array::from_fn(|a| {
                vertices[0][a] / 3.0 + vertices[1][a] / 3.0 + vertices[2][a] / 3.0
            });
            let dir = std::array::from_fn(|a| (center[a] - origin[a]) / 2.0);
            let triangle = Triangle::new(vertices).unwrap();
            let area = triangle.area() / f64::from(scale).powi(2);
            if area < 1e-2 {
                continue;
            }
            let found = hit(&triangle, &Ray::new(origin, dir), Sides::Both).expect("aimed inside");
            let n = triangle.scaled_normal();
            let t = dot(n, sub(wide(vertices[0]), wide(origin))) / dot(n, wide(dir));
            assert!((f64::from(found.t) - t).abs() < 1e-7 * t, "{vertices:?} {found:?} {t}");
            assert!(!triangle.is_degenerate() && area.is_finite());
        }
    }
}

#[test]
fn degenerate_primitives_are_never_hit() {
    let mut draw = Draw::new(33);
    let mut tried = 0;
    while tried < 20_000 {
        // Three points on one line exactly, or two that coincide.
        let (p, step) = (draw.grid_point(50), draw.grid_point(9));
        let scale = (1 + draw.below(1000)) as f32;
        let at = |k: f32| std::array::from_fn(|a| (p[a] + k * step[a]) * scale);
        let vertices = [at(0.0), at(1.0 + draw.below(3) as f32), at(-3.0 + draw.below(4) as f32)];
        let target = at(0.5);
        let ray = if draw.chance(0.5) {
            Ray::new(draw.grid_point(100), draw.grid_point(100))
        } else {
            let origin = draw.grid_point(100);
            Ray::new(origin, std::array::from_fn(|a| target[a] - origin[a]))
        };
        if !ray.is_valid() {
            continue;
        }
        tried += 1;
        let triangle = Triangle { vertices };
        assert!(triangle.is_degenerate() && triangle.area() == 0.0, "{vertices:?}");
        assert_eq!(hit(&triangle, &ray, Sides::Both), None, "{vertices:?} {ray:?}");
        let through: [f32; 3] = std::array::from_fn(|a| ray.origin[a] + ray.dir[a]);
        let flat = Polygon::new(vec![at(0.0), at(1.0), at(3.0), at(2.0)]).unwrap();
        let point = Sphere { center: through, radius: 0.0 };
        let cone = |base, apex, r| Cone { base, apex, base_radius: r, apex_radius: r };
        let shapes: [Shape; 4] =
            [flat.into(), point.into(), cone(at(0.0), through, 0.0).into(), cone(p, p, 2.0).into()];
        let mut geometry = Geometry::new();
        for shape in shapes {
            let id = geometry.push(shape, Sides::Both).unwrap();
            assert!(geometry.shape(id).is_degenerate());
            assert_eq!(geometry.intersect(id, &PreparedRay::new(&ray).unwrap()), None, "{id}");
        }
        assert_eq!(geometry.degenerate_count(), 4);
    }
}

/// A cube or a subdivided icosahedron, its vertices shared.
fn solid(kind: usize) -> (Vec<V>, Vec<[u32; 3]>) {
    if kind == 0 {
        let vertices = (0..8).map(|i| [0, 1, 2].map(|a| f64::from(i >> a & 1) * 2.0 - 1.0));
        let quads =
            [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let faces = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        return (vertices.collect(), faces);
    }
    let g = (1.0 + 5f64.sqrt()) / 2.0;
    let mut vertices: Vec<V> = Vec::new();
    for i in 0..3 {
        for (x, y) in [(1.0, g), (1.0, -g), (-1.0, g), (-1.0, -g)] {
            let mut p = [0.0; 3];
            (p[i], p[(i + 1) % 3]) = (x, y);
            vertices.push(p);
        }
    }
    let near = |p: V, q: V| (dot(sub(p, q), sub(p, q)) - 4.0).abs() < 1e-9;
    let mut faces = Vec::new();
    for a in 0..12u32 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                let [p, q, r] = [a, b, c].map(|i| vertices[i as usize]);
                if near(p, q) && near(q, r) && near(r, p) {
                    faces.push([a, b, c]);
                }
            }
        }
    }
    assert_eq!(faces.len(), 20);
    for _ in 0..kind - 1 {
        let mut middles = HashMap::new();
        let mut next = Vec::new();
        for &[a, b, c] in &faces {
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(i, j)| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    let (p, q) = (vertices[i as usize], vertices[j as usize]);
                    let sum: V = std::array::from_fn(|a| p[a] + q[a]);
                    vertices.push(sum.map(|x| x * (dot(p, p) / dot(sum, sum)).sqrt()));
                    vertices.len() as u32 - 1
                })
            });
            next.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        faces = next;
    }
    (vertices, faces)
}

#[test]
fn closed_meshes_lose_no_ray_through_edges_and_vertices() {
    let mut draw = Draw::new(34);
    let mut rays = 0;
    for round in 0..24 {
        let kind = round % 4;
        let (vertices, faces) = solid(kind);
        // Turned and moved at random, but for the first of each kind.
        let (e, f) = (wide(draw.direction()), wide(draw.direction()));
        let offset = if round < 4 { [0.0; 3] } else { wide(draw.grid_point(20)) };
        let reflect = |p: V, n: V| -> V { std::array::from_fn(|a| p[a] - 2.0 * dot(p, n) * n[a]) };
        let turned = |p: V| if round < 4 { p } else { reflect(reflect(p, e), f) };
        let place = |p: V| -> [f32; 3] {
            let p = turned(p);
            std::array::from_fn(|a| (p[a] + offset[a]) as f32)
        };
        let vertices: Vec<[f32; 3]> = vertices.into_iter().map(place).collect();
        let geometry = Geometry::from_triangles(&vertices, &faces).unwrap();
        for _ in 0..5000 {
            // From inside, whatever the direction, something is hit.
            let inside: [f32; 3] = std::array::from_fn(|a| {
                let x = if round < 4 {
                    draw.grid_point(2)[a] / 4.0
                } else {
                    draw.uniform(-0.5, 0.5) as f32
                };
                x + offset[a] as f32
            });
            let face = faces[draw.below(faces.len())].map(|i| vertices[i as usize]);
            let [p, q, _] = face;
            let target =
                if draw.chance(0.5) { p } else { std::array::from_fn(|a| (p[a] + q[a]) / 2.0) };
            let dir: [f32; 3] = std::array::from_fn(|a| target[a] - inside[a]);
            let ray = Ray::new(inside, dir);
            // And from outside, along the same line, backwards: it enters before it leaves.
            let outside: [f32; 3] = std::array::from_fn(|a| inside[a] + 64.0 * dir[a]);
            let back = Ray::new(outside, dir.map(|x| -x));
            for ray in [ray, back] {
                let prepared = PreparedRay::new(&ray).unwrap();
                let found =
                    (0..geometry.len() as u32).any(|i| geometry.intersect(i, &prepared).is_some());
                assert!(found, "lost {round} {ray:?}");
                rays += 1;
            }
        }
    }
    assert!(rays >= 100_000, "{rays}");
}

#[test]
fn coplanar_polygons_do_not_both_miss_their_common_edge() {
    let mut draw = Draw::new(35);
    for _ in 0..30_000 {
        // Two halves of a square in an exact plane, cut along a crooked line.
        let (e, f, o) = (draw.grid_point(3), draw.grid_point(3), draw.grid_point(20));
        let at =
            |x: f32, y: f32| -> [f32; 3] { std::array::from_fn(|a| o[a] + x * e[a] + y * f[a]) };
        let line = [[2.0, 0.0], [1.0, 1.0], [3.0, 2.0], [2.0, 4.0]];
        let mut left: Vec<_> = line.iter().map(|p| at(p[0], p[1])).collect();
        let mut right: Vec<_> = left.iter().rev().copied().collect();
        left.extend([at(0.0, 4.0), at(0.0, 0.0)]);
        right.extend([at(4.0, 0.0), at(4.0, 4.0)]);
        let (left, right) = (Polygon::new(left).unwrap(), Polygon::new(right).unwrap());
        if left.is_degenerate() {
            continue;
        }
        let i = draw.below(3);
        // Exactly on the line, corners included.
        let s = draw.below(9) as f32 / 8.0;
        let [x, y] = [0, 1].map(|k| line[i][k] + s * (line[i + 1][k] - line[i][k]));
        let target = at(x, y);
        let origin = draw.grid_point(30);
        let dir = std::array::from_fn(|a| target[a] - origin[a]);
        let ray = Ray::new(origin, dir);
        let both = [hit(&left, &ray, Sides::Both), hit(&right, &ray, Sides::Both)];
        let cosine = dot(left.normal(), wide(dir)) / dot(wide(dir), wide(dir)).sqrt();
        let steep = cosine.abs() > 1.0 / 64.0;
        assert!(!steep || both.iter().any(Option::is_some), "{left:?} {ray:?}");
    }
}

#[test]
fn polygons_are_hit_where_their_triangles_are() {
    let mut draw = Draw::new(36);
    let (mut hits, mut misses) = (0, 0);
    for space in [Space::Unit, Space::Grid] {
        for _ in 0..20_000 {
            let s = sample(&mut draw, Kind::Polygon, space);
            let b = s.shape.bounds();
            let target = draw.point_in(&b);
            let (origin, away) = (draw.point_in(&b), draw.direction());
            let origin: [f32; 3] = std::array::from_fn(|a| origin[a] + 3.0 * away[a]);
            let ray = Ray::new(origin, std::array::from_fn(|a| target[a] - origin[a]));
            let Some(prepared) = PreparedRay::new(&ray) else { continue };
            let found = s.shape.intersect(&prepared, Sides::Both);
            // The triangles of the fan, larger and smaller by rounding: compare away from edges.
            let piece = |vertices: &[[f32; 3]; 3]| {
                let triangle = Triangle { vertices: *vertices };
                triangle.intersect(&prepared, Sides::Both)
            };
            let pieces: Vec<_> = s.pieces.iter().filter_map(piece).collect();
            // Distance from the outline, as the weight of the fan's centre.
            let margin = pieces.iter().map(|c| 1.0 - c.u - c.v).fold(f32::INFINITY, f32::min);
            match (found, pieces.first()) {
                (Some(found), Some(c)) => {
                    hits += 1;
                    assert!((found.t - c.t).abs() <= 1e-4 * (1.0 + c.t.abs()) || margin < 1e-3);
                }
                (None, Some(_)) => assert!(margin < 1e-3, "lost {:?} {ray:?}", s.pieces),
                (Some(_), None) => {
                    let wider = s.pieces.iter().any(|&[o, p, q]| {
                        let grow =
                            |x: [f32; 3]| std::array::from_fn(|a| o[a] + (x[a] - o[a]) * 1.001);
                        piece(&[o, grow(p), grow(q)]).is_some()
                    });
                    assert!(wider, "invented {:?} {ray:?} {found:?}", s.pieces);
                }
                (None, None) => misses += 1,
            }
        }
    }
    assert!(hits > 8000 && misses > 8000, "{hits} {misses}");
}

#[test]
fn a_gear_of_144_vertices_is_hit_between_and_on_its_teeth() {
    let tooth = |i: usize| if i % 4 < 2 { 1.0 } else { 0.8 };
    let outline = |i: usize| {
        let angle = i as f64 / 144.0 * std::f64::consts::TAU;
        [angle.cos() * tooth(i), angle.sin() * tooth(i)]
    };
    let vertices = (0..144).map(|i| outline(i).map(|x| x as f32)).map(|[x, y]| [x, y, 2.0]);
    let gear = Polygon::new(vertices.collect()).unwrap();
    assert_eq!((gear.bounds().min[2], gear.bounds().max[2]), (2.0, 2.0));
    assert_eq!(gear.normal(), [0.0, 0.0, 1.0]);
    let mut draw = Draw::new(37);
    let mut inside = 0;
    for _ in 0..50_000 {
        let [x, y] = [0, 1].map(|_| draw.uniform(-1.1, 1.1) as f32);
        let found = hit(&gear, &Ray::new([x, y, 5.0], [0.0, 0.0, -1.0]), Sides::Front);
        // By the edge of the sector that holds the point.
        let (px, py) = (f64::from(x), f64::from(y));
        let sector = (py.atan2(px).rem_euclid(std::f64::consts::TAU) / std::f64::consts::TAU
            * 144.0) as usize
            % 144;
        let (p, q) = (outline(sector), outline((sector + 1) % 144));
        let side = (q[0] - p[0]) * (py - p[1]) - (q[1] - p[1]) * (px - p[0]);
        if side.abs() > 1e-6 {
            assert_eq!(found.is_some(), side > 0.0, "{x} {y}");
            inside += usize::from(side > 0.0);
        }
        assert!(found.is_none_or(|c| c.t == 3.0));
    }
    assert!(inside > 20_000);
}

#[test]
fn spheres_and_cones_are_hit_as_their_equations_say() {
    let mut draw = Draw::new(38);
    let mut hits = [0, 0];
    for _ in 0..40_000 {
        for kind in [Kind::Sphere, Kind::Cone] {
            let s = sample(&mut draw, kind, Space::Unit);
            if s.shape.is_degenerate() {
                continue;
            }
            let b = s.shape.bounds();
            let away = draw.direction().map(|x| x * 2.0);
            let (p, target) = (draw.point_in(&b), draw.point_in(&b));
            let origin: [f32; 3] = std::array::from_fn(|a| p[a] + away[a]);
            let ray = Ray::new(origin, std::array::from_fn(|a| target[a] - origin[a]));
            let (roots, discriminant) = roots(&s.shape, &ray);
            if discriminant.abs() < 1e-6 || roots.iter().any(|r| r.1 < 1e-6 || r.0.abs() < 1e-6) {
                continue; // undecided
            }
            let expected =
                roots.iter().filter(|r| r.0 > 0.0).map(|r| r.0).fold(f64::INFINITY, f64::min);
            let found = hit(&s.shape, &ray, Sides::Both);
            match found {
                Some(c) => {
                    hits[usize::from(kind == Kind::Cone)] += 1;
                    let error = (f64::from(c.t) - expected).abs();
                    assert!(error <= 2e-7 * expected.max(1e-3), "{ray:?} {c:?} {expected}");
                    let n = s.shape.normals(ray.at(c.t), c);
                    assert!((dot(n.geometric, n.geometric) - 1.0).abs() < 1e-9);
                    // The side is the one that the normal says.
                    let side = if dot(n.geometric, wide(ray.dir)) < 0.0 {
                        Sides::Front
                    } else {
                        Sides::Back
                    };
                    assert_eq!(hit(&s.shape, &ray, side), Some(c), "{ray:?}");
                }
                None => assert!(expected == f64::INFINITY, "lost {ray:?} {expected}"),
            }
        }
    }
    assert!(hits[0] > 10_000 && hits[1] > 10_000, "{hits:?}");
}

/// Rays along generators and near tips, where the quadratic has half of the digits: what is hit lies on the surface as closely as the
/// walks rely on. Origins lie near the hits, so that `t` has digits enough to tell.
#[test]
fn hits_on_cones_lie_on_the_surface() {
    let mut draw = Draw::new(39);
    let (mut hits, mut worst) = (0, 0.0f64);
    for _ in 0..200_000 {
        let point = |draw: &mut Draw| -> [f32; 3] {
            std::array::from_fn(|_| draw.uniform(-1.0, 1.0) as f32)
        };
        let (base, apex) = (point(&mut draw), point(&mut draw));
        let base_radius = draw.uniform(-10.0, 2.0).exp2() as f32;
        let apex_radius = if draw.chance(0.7) {
            0.0
        } else {
            base_radius * draw.uniform(-20.0, 1.0).exp2() as f32
        };
        let cone = Cone { base, apex, base_radius, apex_radius };
        let (b, axis) = (wide(base), sub(wide(apex), wide(base)));
        let length = dot(axis, axis).sqrt();
        let n = axis.map(|x| x / length);
        // A generator, from any point beside the axis.
        let beside = wide(draw.direction());
        let along = dot(beside, n);
        let across: V = std::array::from_fn(|a| beside[a] - along * n[a]);
        let size = dot(across, across).sqrt();
        let (ra, rb) = (f64::from(base_radius), f64::from(apex_radius));
        let share = if draw.chance(0.5) { 1.0 } else { draw.uniform(0.0, 1.0) };
        let off = draw.uniform(-40.0, -17.0).exp2();
        let turn = draw.uniform(-26.0, 0.0).exp2();
        let origin: [f32; 3] = std::array::from_fn(|a| {
            let at = b[a] + share * axis[a] + (ra + share * (rb - ra)) * across[a] / size;
            (at + off * draw.uniform(-1.0, 1.0)) as f32
        });
        let dir: [f32; 3] = std::array::from_fn(|a| {
            let generator = axis[a] + (rb - ra) * across[a] / size;
            (generator + turn * draw.uniform(-1.0, 1.0)) as f32
        });
        let ray = Ray::new(origin, dir).with_range(-1e-5, 1e-5);
        let Some(found) = hit(&cone, &ray, Sides::Both) else { continue };
        hits += 1;
        // The distance from the line between the rims, in the plane through axis and point.
        let p = sub(ray.at(found.t), b);
        let height = dot(p, n);
        let square = sub(p, n.map(|x| x * height));
        let radius = dot(square, square).sqrt();
        let slant = length.hypot(rb - ra);
        let at = (height * length + (radius - ra) * (rb - ra)) / slant.powi(2);
        let at = at.clamp(0.0, 1.0);
        let distance = (height - at * length).hypot(radius - ra - at * (rb - ra));
        let reach = wide(origin).into_iter().chain([1.0, ra]).fold(0.0f64, |m, x| m.max(x.abs()));
        let rounded = f64::from(found.t.abs()) * dot(wide(dir), wide(dir)).sqrt();
        let error = (distance - rounded * f64::from(f32::EPSILON)) / reach;
        worst = worst.max(error);
    }
    assert!(hits > 20_000, "{hits}");
    assert!(worst <= HIT_ERROR, "{:e} of {HIT_ERROR:e}", worst);
}

/// The roots on a sphere or frustum, each with its distance from the nearest rim in shares of the
/// axis, and the discriminant over its terms; by the textbook's quadratic.
fn roots(shape: &Shape, ray: &Ray) -> (Vec<(f64, f64)>, f64) {
    let (o, d) = (wide(ray.origin), wide(ray.dir));
    let solve = |a: f64, b: f64, c: f64| {
        let discriminant = b * b - 4.0 * a * c;
        let root = discriminant.sqrt();
        let both = vec![(-b - root) / (2.0 * a), (-b + root) / (2.0 * a)];
        let share = discriminant / (b * b + (4.0 * a * c).abs());
        (if discriminant > 0.0 { both } else { Vec::new() }, share)
    };
    match shape {
        Shape::Sphere(s) => {
            let l = sub(o, wide(s.center));
            let r = f64::from(s.radius);
            let (both, share) = solve(dot(d, d), 2.0 * dot(l, d), dot(l, l) - r * r);
            (both.into_iter().map(|t| (t, 1.0)).collect(), share)
        }
        Shape::Cone(c) => {
            let (base, axis) = (wide(c.base), sub(wide(c.apex), wide(c.base)));
            let h = dot(axis, axis);
            let l = sub(o, base);
            let (r0, k) =
                (f64::from(c.base_radius), f64::from(c.apex_radius) - f64::from(c.base_radius));
            // |x|^2 - (x.h)^2 / |h|^2 = (r0 + k x.h / |h|^2)^2 with x = l + t d.
            let (lh, dh) = (dot(l, axis) / h, dot(d, axis) / h);
            let a = dot(d, d) - dh * dh * h - k * k * dh * dh;
            let b = 2.0 * (dot(l, d) - lh * dh * h - (r0 + k * lh) * k * dh);
            let c = dot(l, l) - lh * lh * h - (r0 + k * lh).powi(2);
            let (both, share) = solve(a, b, c);
            let rim = |t: f64| {
                let s = lh + t * dh;
                (s, s.abs().min((1.0 - s).abs()))
            };
            let near = both.iter().map(|&t| (t, rim(t)));
            let kept = near.filter(|(_, (s, rim))| (0.0..=1.0).contains(s) || *rim < 1e-6);
            (kept.map(|(t, (_, rim))| (t, rim)).collect(), if a.abs() < 1e-6 { 0.0 } else { share })
        }
        _ => unreachable!("planar"),
    }
}

#[test]
fn sides_follow_the_normal() {
    let vertices = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let square = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let from_above = Ray::new([0.25, 0.25, 2.0], [0.0, 0.0, -1.0]);
    let from_below = Ray::new([0.25, 0.25, -2.0], [0.0, 0.0, 1.0]);
    let shapes: [Shape; 2] = [Triangle { vertices }.into(), Shape::polygon(square).unwrap()];
    for shape in shapes {
        assert!(hit(&shape, &from_above, Sides::Front).is_some_and(|c| c.t == 2.0));
        assert!(hit(&shape, &from_below, Sides::Back).is_some_and(|c| c.t == 2.0));
        assert_eq!(hit(&shape, &from_above, Sides::Back), None);
        assert_eq!(hit(&shape, &from_below, Sides::Front), None);
        let c = hit(&shape, &from_above, Sides::Both).unwrap();
        assert_eq!(shape.normals([0.25, 0.25, 0.0], c).geometric, [0.0, 0.0, 1.0]);
    }
    let ball = Sphere { center: [0.0; 3], radius: 1.0 };
    let through = Ray::new([0.0, 0.0, 3.0], [0.0, 0.0, -1.0]);
    assert_eq!(hit(&ball, &through, Sides::Front).map(|c| c.t), Some(2.0));
    assert_eq!(hit(&ball, &through, Sides::Back).map(|c| c.t), Some(4.0));
    assert_eq!(hit(&ball, &through.with_range(2.5, 9.0), Sides::Both).map(|c| c.t), Some(4.0));
    let tube =
        Cone { base: [0.0, -1.0, 0.0], apex: [0.0, 1.0, 0.0], base_radius: 1.0, apex_radius: 1.0 };
    assert_eq!(hit(&tube, &through, Sides::Front).map(|c| c.t), Some(2.0));
    assert_eq!(hit(&tube, &through, Sides::Back).map(|c| c.t), Some(4.0));
    // Along the axis nothing is in the way: there are no caps.
    assert_eq!(hit(&tube, &Ray::new([0.5, 3.0, 0.0], [0.0, -1.0, 0.0]), Sides::Both), None);
    // A full cone has no mirror image beyond its tip.
    let tip = Cone { base: [0.0; 3], apex: [0.0, 1.0, 0.0], base_radius: 1.0, apex_radius: 0.0 };
    let level = |y: f32| hit(&tip, &Ray::new([0.0, y, 3.0], [0.0, 0.0, -1.0]), Sides::Front);
    assert_eq!(level(0.5).map(|c| c.t), Some(2.5));
    assert_eq!((level(1.5), level(-0.5)), (None, None));
    // Parallel to the side: one crossing.
    let parallel = Ray::new([0.5, 0.0, -3.0], [0.0, -1.0, 1.0]).with_range(-9.0, 9.0);
    assert!(hit(&tip, &parallel, Sides::Both).is_none_or(|c| c.t.is_finite()));
}

#[test]
fn patches_blend_their_normals_on_the_side_of_the_face() {
    let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let normals = vec![[-1.0, 0.0, 1.0], [3.0, 0.0, 3.0], [1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]];
    let patch = Patch::new(corners.clone(), normals).unwrap();
    let down = |x: f32, y: f32| Ray::new([x, y, 1.0], [0.0, 0.0, -1.0]);
    let shading = |patch: &Patch, x: f32, y: f32| {
        let c = hit(patch, &down(x, y), Sides::Both).unwrap();
        patch.normals([f64::from(x), f64::from(y), 0.0], c).shading
    };
    let near = |n: V, x: f64, z: f64| {
        let len = x.hypot(z);
        assert!((n[0] - x / len).abs() < 1e-6 && (n[2] - z / len).abs() < 1e-6, "{n:?}");
    };
    near(shading(&patch, 0.5, 0.5), 0.0, 1.0);
    near(shading(&patch, 0.75, 0.25), 0.5, 1.0);
    near(shading(&patch, 1.0, 0.5), 1.0, 1.0);
    near(shading(&patch, 0.0, 1.0), -1.0, 1.0);
    // Normals that point to the back are turned, zero ones leave the face's own.
    let back = Patch::new(corners.clone(), vec![[0.0, 0.0, -1.0]; 4]).unwrap();
    near(shading(&back, 0.3, 0.6), 0.0, 1.0);
    let none = Patch::new(corners[..3].to_vec(), vec![[0.0; 3]; 3]).unwrap();
    near(shading(&none, 0.6, 0.3), 0.0, 1.0);
    // A triangle blends linearly.
    let tilted = vec![[-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, 1.0]];
    let triangle = Patch::new(corners[..3].to_vec(), tilted).unwrap();
    near(shading(&triangle, 0.5, 0.25), 0.0, 1.0);
}

#[test]
fn bad_input_is_refused_with_its_place() {
    let nan = [0.0, f32::NAN, 0.0];
    let text = |e: ShapeError| e.to_string();
    assert_eq!(
        text(Triangle::new([[0.0; 3], [1.0; 3], nan]).unwrap_err()),
        "vertex 2 is (0, NaN, 0); every coordinate must be a finite f32"
    );
    assert_eq!(
        text(Polygon::new(vec![[0.0; 3]; 2]).unwrap_err()),
        "polygon has 2 vertices; it needs at least 3"
    );
    assert_eq!(
        text(Sphere::new([0.0; 3], -1.0).unwrap_err()),
        "radius is -1; it must be finite and at least 0"
    );
    assert!(matches!(
        Cone::new([0.0; 3], 1.0, [1.0; 3], f32::INFINITY),
        Err(ShapeError::BadRadius { what: "apex radius", .. })
    ));
    assert!(matches!(
        Patch::new(vec![[0.0; 3]; 3], vec![[1.0; 3]; 4]),
        Err(ShapeError::NormalCount { vertices: 3, found: 4 })
    ));

    let vertices = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let text = |v: &[[f32; 3]], f: &[[u32; 3]]| match Geometry::from_triangles(v, f) {
        Ok(_) => panic!("accepted"),
        Err(e) => e.to_string(),
    };
    assert_eq!(
        text(&vertices, &[[0, 1, 2], [0, 1, 3]]),
        "face 1 names vertex 3; there are 3 vertices, numbered from 0"
    );
    assert_eq!(
        text(&[[0.0; 3], nan], &[[0, 0, 0]]),
        "vertex 1 is (0, NaN, 0); every coordinate must be a finite f32"
    );
    assert_eq!(text(&vertices, &[]), "the mesh has no faces; at least one is needed");
    let mut geometry = Geometry::new();
    let bad = geometry.push(Sphere { center: [0.0; 3], radius: f32::NAN }, Sides::Both);
    assert!(matches!(bad, Err(GeometryError::Shape { index: 0, .. })));
    let huge = geometry.push(Sphere { center: [f32::MAX; 3], radius: f32::MAX }, Sides::Both);
    assert!(matches!(huge, Err(GeometryError::NotFinite { index: 0, .. })));
    assert!(geometry.is_empty());
}

#[test]
fn random_geometries_hold_all_kinds() {
    let geometry = random_geometry(None, 200, 1);
    let kinds = (0..200).map(|i| std::mem::discriminant(geometry.shape(i)));
    assert_eq!(kinds.collect::<std::collections::HashSet<_>>().len(), 5);
    assert_eq!(geometry.len(), 200);
}
