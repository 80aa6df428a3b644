//! Surfaces and points around them.

use ropewalk::build::{BuildSettings, Preset};
use ropewalk::double::{DoubleGeometry, DoubleTree};
use ropewalk::kernel::Level;
use ropewalk::point::{PointBruteForce, PointQueries, Triangles as PointTriangles};
use ropewalk::primitive::{Primitive, Triangle};
use ropewalk::wide::WideTree;
use ropewalk::{Geometry, Shape, Sides};
use ropewalk_testkit::rays::Draw;
use ropewalk_testkit::trees::{TreeShape, random_tree};

pub type Triangles = Vec<[[f64; 3]; 3]>;

/// Scale and offset of each test scene.
pub const PLACES: [(f64, f64); 4] = [(1e-6, 0.0), (1.0, 0.0), (1e6, 0.0), (1e4, 1e7)];

/// Triangles as a geometry, scaled and moved; equal points stay equal.
pub fn geometry(triangles: &Triangles, (scale, offset): (f64, f64)) -> Geometry {
    let mut geometry = Geometry::new();
    for triangle in triangles {
        let vertices = triangle.map(|p| p.map(|x| (x * scale + offset) as f32));
        geometry.push(Triangle { vertices }, Sides::Both).unwrap();
    }
    geometry
}

/// A built tree, and a random one.
pub fn trees(draw: &mut Draw, geometry: &Geometry) -> [WideTree; 2] {
    let (built, _) =
        WideTree::build(geometry, &BuildSettings::preset(Preset::Balanced), &()).unwrap();
    let shape = TreeShape { max_depth: 6 + draw.below(16), ..TreeShape::default() };
    let random = random_tree(draw, geometry, shape).unwrap();
    [built, WideTree::compile(&random, geometry).unwrap()]
}

/// Queries at each level of this machine, on one thread and on all.
pub fn queries<'a, G: PointTriangles>(
    tree: &'a G::Tree,
    geometry: &'a G,
) -> Vec<PointQueries<'a, G>> {
    let queries = PointQueries::new(tree, geometry).unwrap();
    let levels = Level::ALL.into_iter().filter_map(|level| queries.with_level(level));
    levels.flat_map(|queries| [queries, queries.with_threads(1)]).collect()
}

/// Triangles in `f64`, scaled and moved; equal points stay equal.
pub fn double_geometry(triangles: &Triangles, (scale, offset): (f64, f64)) -> DoubleGeometry {
    let place = |p: [f64; 3]| p.map(|x| x * scale + offset);
    let vertices = triangles.iter().flatten().map(|&p| place(p)).collect();
    let faces = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    DoubleGeometry::from_triangles(vertices, faces).unwrap()
}

/// Trees of two presets.
pub fn double_trees(geometry: &DoubleGeometry) -> [DoubleTree; 2] {
    [Preset::Balanced, Preset::Fast]
        .map(|preset| geometry.build(&BuildSettings::preset(preset), &()).unwrap().0)
}

/// All queries against brute force.
pub fn check(draw: &mut Draw, geometry: &Geometry, points: &[[f64; 3]]) {
    check_trees(&trees(draw, geometry), geometry, points);
}

/// The same over given trees.
pub fn check_trees<G: PointTriangles>(trees: &[G::Tree], geometry: &G, points: &[[f64; 3]]) {
    let oracle = PointBruteForce { geometry };
    let closest: Vec<_> = points.iter().map(|&p| oracle.closest_point(p)).collect();
    let sides: Vec<_> = points.iter().map(|&p| oracle.side(p)).collect();
    for tree in trees {
        for queries in queries(tree, geometry) {
            let (found, distance) = (queries.closest_point(points), queries.distance(points));
            let (is, signed) = (queries.sides(points), queries.signed_distance(points));
            for (i, point) in points.iter().enumerate() {
                let level = queries.level().name();
                match closest[i] {
                    Some(nearest) => {
                        let same = (found.distance[i], found.prim_id[i], found.point[i]);
                        let expected = (nearest.distance, nearest.prim_id, nearest.point);
                        assert_eq!(same, expected, "{level} {point:?}");
                        assert_eq!(distance[i], nearest.distance, "{level} {point:?}");
                        assert!(signed[i].abs() == distance[i] || signed[i] == 0.0);
                    }
                    None => assert_eq!(found.prim_id[i], u32::MAX, "{level} {point:?}"),
                }
                assert_eq!(is[i], sides[i], "{level} {point:?}");
            }
        }
    }
}

/// Points in and around a scene: anywhere, far away, on and beside vertices, edges and faces, and made
/// of the coordinates of vertices.
pub fn points(draw: &mut Draw, geometry: &Geometry, count: usize) -> Vec<[f64; 3]> {
    let triangles: Triangles = (0..geometry.len() as u32)
        .filter_map(|id| match geometry.shape(id) {
            Shape::Triangle(t) => Some(t.vertices.map(|v| v.map(f64::from))),
            _ => None,
        })
        .collect();
    points_around(draw, &triangles, count)
}

/// The same around some triangles.
pub fn points_around(draw: &mut Draw, triangles: &Triangles, count: usize) -> Vec<[f64; 3]> {
    if triangles.is_empty() {
        return vec![[0.0; 3], [1.0, 2.0, 3.0]];
    }
    let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for p in triangles.iter().flatten() {
        for a in 0..3 {
            (min[a], max[a]) = (min[a].min(p[a]), max[a].max(p[a]));
        }
    }
    let size = (0..3).map(|a| (max[a] - min[a]).powi(2)).sum::<f64>().sqrt();
    let mut points = Vec::new();
    for _ in 0..count {
        let [a, b, c] = triangles[draw.below(triangles.len())];
        let spread = size * draw.uniform(-40.0, 1.0).exp2();
        let near = |d: &mut Draw, p: [f64; 3]| p.map(|x| x + d.uniform(-spread, spread));
        let mix =
            |u: f64, v: f64| std::array::from_fn(|i| a[i] * (1.0 - u - v) + b[i] * u + c[i] * v);
        let inside: [f64; 3] =
            std::array::from_fn(|a| min[a] + draw.uniform(0.0, 1.0) * (max[a] - min[a]));
        let far = inside.map(|x| x + size * draw.uniform(-20.0, 20.0));
        let picked =
            std::array::from_fn(|i| triangles[draw.below(triangles.len())][draw.below(3)][i]);
        let centre = mix(0.25, 0.25);
        points.extend([
            inside,
            far,
            a,
            mix(0.5, 0.0),
            centre,
            picked,
            near(draw, a),
            near(draw, mix(0.5, 0.0)),
            near(draw, centre),
        ]);
    }
    points
}

/// The triangles of a geometry in `f64`.
pub fn triangles_of(geometry: &DoubleGeometry) -> Triangles {
    (0..geometry.len() as u32).filter_map(|id| geometry.triangle(id)).collect()
}

/// True if all triangles of a scene have an area.
pub fn is_proper(geometry: &Geometry) -> bool {
    (0..geometry.len() as u32).all(|id| !geometry.shape(id).is_degenerate())
}

/// The triangles of a grid of quads that closes on itself, `point(i, j)` its corners; fronts outside if
/// `i` runs to the left of `j` as seen from there.
fn closed_grid(n: usize, m: usize, point: impl Fn(usize, usize) -> [f64; 3]) -> Triangles {
    let quad = |k: usize| {
        let (i, j) = (k / m, k % m);
        let (p, q) = (point(i, j), point((i + 1) % n, j));
        let (r, s) = (point((i + 1) % n, (j + 1) % m), point(i, (j + 1) % m));
        [[p, q, r], [p, r, s]]
    };
    (0..n * m).flat_map(quad).collect()
}

/// A torus around the z axis.
pub fn torus(n: usize, m: usize) -> Triangles {
    closed_grid(n, m, |i, j| {
        let (u, v) = (i as f64 / n as f64, j as f64 / m as f64);
        let ((su, cu), (sv, cv)) =
            ((u * std::f64::consts::TAU).sin_cos(), (v * std::f64::consts::TAU).sin_cos());
        let r = 1.0 + 0.4 * cv;
        [r * cu, r * su, 0.4 * sv]
    })
}

/// An octahedron, each face cut into four `levels` times, its vertices moved to distance `radius(p)`.
pub fn ball(levels: usize, radius: impl Fn([f64; 3]) -> f64) -> Triangles {
    let mut triangles = Triangles::new();
    for signs in 0..8 {
        let s = |bit: usize| if signs >> bit & 1 == 1 { -1.0 } else { 1.0 };
        let [x, y, z] = [[s(0), 0.0, 0.0], [0.0, s(1), 0.0], [0.0, 0.0, s(2)]];
        triangles.push(if s(0) * s(1) * s(2) > 0.0 { [x, y, z] } else { [x, z, y] });
    }
    for _ in 0..levels {
        let cut = |[a, b, c]: [[f64; 3]; 3]| {
            let middle = |p: [f64; 3], q: [f64; 3]| std::array::from_fn(|i| 0.5 * (p[i] + q[i]));
            let (d, e, f) = (middle(a, b), middle(b, c), middle(c, a));
            [[a, d, f], [d, b, e], [f, e, c], [d, e, f]]
        };
        triangles = triangles.into_iter().flat_map(cut).collect();
    }
    let round = |p: [f64; 3]| {
        let length = p.iter().map(|x| x * x).sum::<f64>().sqrt();
        let r = radius(p.map(|x| x / length));
        p.map(|x| x / length * r)
    };
    triangles.into_iter().map(|t| t.map(round)).collect()
}

/// A shell with a core in its cavity: inside, outside, inside.
pub fn nested() -> Triangles {
    let (outer, cavity, core) = (ball(3, |_| 1.0), ball(3, |_| 0.7), ball(2, |_| 0.4));
    let turned = cavity.into_iter().map(|[a, b, c]| [a, c, b]);
    outer.into_iter().chain(turned).chain(core).collect()
}

/// A ball with deep furrows.
pub fn rough(draw: &mut Draw) -> Triangles {
    let [f, g] = [draw.uniform(4.0, 9.0), draw.uniform(4.0, 9.0)];
    ball(4, move |p| 1.0 + 0.4 * (f * p[0]).sin() * (g * p[1]).cos())
}
