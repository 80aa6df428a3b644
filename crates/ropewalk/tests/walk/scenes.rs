//! Scenes of triangles and spheres, small enough for brute force.

use ropewalk::primitive::{Sphere, Triangle};
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

/// Triangles and spheres.
pub fn mixed(draw: &mut Draw, count: usize) -> Geometry {
    let mut geometry = soup(draw, count / 2, 1.0);
    for _ in 0..count - count / 2 {
        let center = std::array::from_fn(|_| draw.uniform(0.0, 1.0) as f32);
        let radius = draw.uniform(-7.0, -2.0).exp2() as f32;
        let sides = any_sides(draw);
        push(&mut geometry, Sphere { center, radius }, sides);
    }
    geometry
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
