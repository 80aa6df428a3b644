//! Scenes of all primitives, small enough for brute force.

use ropewalk::primitive::{Cone, Patch, Polygon, Sphere, Triangle};
use ropewalk::{Geometry, Shape, Sides};
use ropewalk_testkit::rays::Draw;

fn any_sides(draw: &mut Draw) -> Sides {
    [Sides::Both, Sides::Both, Sides::Front, Sides::Back][draw.below(4)]
}

fn push(geometry: &mut Geometry, shape: impl Into<Shape>, sides: Sides) {
    geometry.push(shape, sides).unwrap();
}

/// Triangles around uniform centres in a cube of the given size.
pub fn soup(draw: &mut Draw, count: usize, size: f64) -> Geometry {
    let mut geometry = Geometry::new();
    for _ in 0..count {
        let reach = size * draw.uniform(-5.0, -0.5).exp2();
        let center: [f64; 3] = std::array::from_fn(|_| draw.uniform(0.0, size));
        let vertices =
            std::array::from_fn(|_| center.map(|c| (c + draw.uniform(-reach, reach)) as f32));
        let sides = any_sides(draw);
        push(&mut geometry, Triangle { vertices }, sides);
    }
    geometry
}

/// Triangles whose coordinates are drawn in exponent space, so that sizes differ by orders.
pub fn exponent_soup(draw: &mut Draw, count: usize, low: f64, high: f64) -> Geometry {
    let mut geometry = Geometry::new();
    for _ in 0..count {
        let point = |d: &mut Draw| std::array::from_fn(|_| d.exponent(low, high) as f32);
        let a: [f32; 3] = point(draw);
        let near = |d: &mut Draw| a.map(|x| (f64::from(x) * d.uniform(0.3, 1.7)) as f32);
        let (b, c) =
            if draw.chance(0.7) { (near(draw), near(draw)) } else { (point(draw), point(draw)) };
        let sides = any_sides(draw);
        push(&mut geometry, Triangle { vertices: [a, b, c] }, sides);
    }
    geometry
}

/// All kinds of primitives in the unit cube. On a grid, coordinates and radii are multiples of 1/8.
pub fn mixed(draw: &mut Draw, count: usize, grid: bool) -> Geometry {
    let snap = move |x: f64| if grid { (8.0 * x).round() / 8.0 } else { x } as f32;
    let mut geometry = Geometry::new();
    for kind in 0..count {
        let sides = any_sides(draw);
        let reach = if grid { 0.5 } else { draw.uniform(-5.0, -1.0).exp2() };
        let center: [f64; 3] = std::array::from_fn(|_| draw.uniform(0.0, 1.0));
        let around = |d: &mut Draw| center.map(|c| snap(c + d.uniform(-reach, reach)));
        let radius = snap(reach * draw.uniform(0.25, 0.5)).max(1e-3);
        match kind % 5 {
            0 => {
                let vertices = std::array::from_fn(|_| around(draw));
                push(&mut geometry, Triangle { vertices }, sides);
            }
            1 => push(&mut geometry, Sphere { center: center.map(snap), radius }, sides),
            2 => {
                let (base, apex) = (around(draw), around(draw));
                let other = if draw.chance(0.5) { radius } else { 0.0 };
                push(&mut geometry, Cone::new(base, radius, apex, other).unwrap(), sides);
            }
            3 => push(&mut geometry, Polygon::new(star(draw, center, reach, snap)).unwrap(), sides),
            _ => {
                let vertices = star(draw, center, reach, snap);
                let normals = vertices.iter().map(|_| draw.direction()).collect();
                push(&mut geometry, Patch::new(vertices, normals).unwrap(), sides);
            }
        }
    }
    geometry
}

/// The corners of a star-shaped polygon, mostly concave, in a plane of one constant coordinate or
/// in one at 45 degrees to two axes; exactly planar on a grid.
fn star(draw: &mut Draw, center: [f64; 3], reach: f64, snap: impl Fn(f64) -> f32) -> Vec<[f32; 3]> {
    let (axis, corners, oblique) = (draw.below(3), 3 + draw.below(6), draw.chance(0.5));
    let corner = |i: usize| {
        let angle = std::f64::consts::TAU * i as f64 / corners as f64;
        let r = reach * draw.uniform(0.2, 1.0);
        let mut p = center;
        p[(axis + 1) % 3] += r * angle.cos();
        p[(axis + 2) % 3] += r * angle.sin();
        let mut p = p.map(&snap);
        if oblique {
            p[axis] += p[(axis + 1) % 3];
        }
        p
    };
    (0..corners).map(corner).collect()
}

/// Triangles with integer vertices in `-n ..= n`, degenerate ones and copies included.
pub fn grid_soup(draw: &mut Draw, count: usize, n: i32) -> Geometry {
    let mut geometry = Geometry::new();
    for _ in 0..count {
        let vertices = std::array::from_fn(|_| draw.grid_point(n));
        let sides = any_sides(draw);
        push(&mut geometry, Triangle { vertices }, sides);
        if draw.chance(0.1) {
            push(&mut geometry, Triangle { vertices }, Sides::Both);
        }
    }
    geometry
}

/// Axis-parallel rectangles of two triangles on an integer grid: coplanar, coincident, and in the
/// cutting planes.
pub fn grid_quads(draw: &mut Draw, count: usize, n: i32) -> Geometry {
    let mut geometry = Geometry::new();
    for _ in 0..count {
        let (axis, p, q) = (draw.below(3), draw.grid_point(n), draw.grid_point(n));
        let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
        let corner = |x: f32, y: f32| {
            let mut v = p;
            (v[b], v[c]) = (x, y);
            v
        };
        let [v0, v1, v2, v3] =
            [corner(p[b], p[c]), corner(q[b], p[c]), corner(q[b], q[c]), corner(p[b], q[c])];
        let sides = any_sides(draw);
        push(&mut geometry, Triangle { vertices: [v0, v1, v2] }, sides);
        push(&mut geometry, Triangle { vertices: [v0, v2, v3] }, sides);
    }
    geometry
}

/// Integer triangles in one plane perpendicular to `axis`.
pub fn flat(draw: &mut Draw, count: usize, axis: usize) -> Geometry {
    let mut geometry = Geometry::new();
    for _ in 0..count {
        let vertices = std::array::from_fn(|_| {
            let mut p = draw.grid_point(4);
            p[axis] = 2.0;
            p
        });
        push(&mut geometry, Triangle { vertices }, Sides::Both);
    }
    geometry
}

/// The triangles of a scene moved by an offset, rounded to `f32`.
pub fn offset(scene: &Geometry, by: [f32; 3]) -> Geometry {
    let mut geometry = Geometry::new();
    for id in 0..scene.len() as u32 {
        if let Shape::Triangle(t) = scene.shape(id) {
            let vertices = t.vertices.map(|p| std::array::from_fn(|a| p[a] + by[a]));
            push(&mut geometry, Triangle { vertices }, scene.sides(id));
        }
    }
    geometry
}
