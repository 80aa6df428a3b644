//! Particles among triangles in `f64`: the same definition at any scale and distance from the origin.

use crate::scenes;
use crate::walker::{check, crosses_in_integers, crowd, row};
use ropewalk::Shape;
use ropewalk::build::{BuildSettings, Preset};
use ropewalk::double::{DoubleGeometry, DoubleTree};
use ropewalk::kernel::Level;
use ropewalk::point::{PointQueries, Side};
use ropewalk::walker::{Encounter, Walker, crossings};
use ropewalk_testkit::rays::Draw;

type Triangles = Vec<[[f64; 3]; 3]>;

/// Scales and offsets: the usual ones, detail of a thousandth at ten million, and the ends of the numbers.
const PLACES: [(f64, f64); 8] = [
    (1.0, 0.0),
    (1e-6, 0.0),
    (1e6, 3e5),
    (10.0, 1e7),
    (1e-3, 1e7),
    (1e-3, -3e7),
    (1e90, 0.0),
    (1e-60, 0.0),
];

fn geometry_of(triangles: &Triangles, (scale, offset): (f64, f64)) -> DoubleGeometry {
    let vertices: Vec<[f64; 3]> =
        triangles.iter().flatten().map(|p| p.map(|x| x * scale + offset)).collect();
    let faces = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    DoubleGeometry::from_triangles(vertices, faces).unwrap()
}

fn tree_of(geometry: &DoubleGeometry, round: usize) -> DoubleTree {
    let preset = Preset::ALL[round % Preset::ALL.len()];
    let settings = BuildSettings { threads: 1, ..BuildSettings::preset(preset) };
    geometry.build(&settings, &()).unwrap().0
}

/// Triangles of all sizes down to far below the resolution of `f32`.
fn soup(draw: &mut Draw, count: usize) -> Triangles {
    let triangle = |_| {
        let reach = 10f64.powf(draw.uniform(-9.0, 0.0));
        let centre: [f64; 3] = std::array::from_fn(|_| draw.uniform(-1.0, 1.0));
        [0; 3].map(|_| centre.map(|c| c + draw.uniform(-reach, reach)))
    };
    (0..count).map(triangle).collect()
}

/// Between the points of a grid: shared edges, copies, triangles without area.
fn grid(draw: &mut Draw, count: usize, steps: i32) -> Triangles {
    let mut corner = || draw.grid_point(steps).map(|x| f64::from(x) / f64::from(steps));
    (0..count).map(|_| [corner(), corner(), corner()]).collect()
}

fn everywhere(seed: u64, scene: impl Fn(&mut Draw) -> Triangles) {
    for (round, place) in PLACES.into_iter().enumerate() {
        let mut draw = Draw::new(seed + round as u64);
        let geometry = geometry_of(&scene(&mut draw), place);
        let tree = tree_of(&geometry, round);
        let mut values: [Vec<f64>; 3] = Default::default();
        for p in geometry.vertices() {
            (0..3).for_each(|a| values[a].push(p[a]));
        }
        let bounds = geometry.bounds().unwrap();
        let crowd = crowd(&mut draw, &geometry, bounds, &values, 80);
        let met = check(&geometry, &tree, &crowd, &|_, _| true);
        let filtered = check(&geometry, &tree, &crowd, &|particle, hit| {
            hit.entering == (particle % 2 == 0)
                && !(hit.prim_id as usize + particle).is_multiple_of(3)
        });
        assert!(0 < filtered && filtered < met, "{filtered} of {met} events at {place:?}");
    }
}

#[test]
fn particles_meet_what_the_definition_says() {
    everywhere(9000, |draw| soup(draw, 200));
    everywhere(9020, |draw| grid(draw, 100, 4));
    everywhere(9040, |draw| grid(draw, 60, 3));
}

/// Segments that begin and end at vertices and on edges, one `f64` beside them, and from one point of a triangle to
/// another.
#[test]
fn ends_at_vertices_and_beside_them() {
    for (round, place) in PLACES.into_iter().enumerate() {
        let mut draw = Draw::new(9100 + round as u64);
        let geometry = geometry_of(&grid(&mut draw, 80, 3), place);
        let tree = tree_of(&geometry, round);
        let point = |draw: &mut Draw| -> [f64; 3] {
            let t = geometry.triangle(draw.below(geometry.len()) as u32).unwrap();
            let (i, w) = (draw.below(3), draw.uniform(0.0, 1.0));
            let (a, b) = (t[i], t[(i + 1) % 3]);
            let p: [f64; 3] = match draw.below(3) {
                0 => a,
                1 => std::array::from_fn(|k| 0.5 * a[k] + 0.5 * b[k]),
                _ => std::array::from_fn(|k| a[k] + w * (b[k] - a[k])),
            };
            p.map(|x| [x, x, x.next_up(), x.next_down()][draw.below(4)])
        };
        let mut positions: Vec<[f64; 3]> = (0..200).map(|_| point(&mut draw)).collect();
        let walkers: Vec<_> = Level::ALL
            .into_iter()
            .filter_map(|level| {
                Walker::new(&tree, &geometry, positions.clone()).unwrap().with_level(level)
            })
            .collect();
        let mut walkers = walkers;
        let mut met = 0;
        for _ in 0..6 {
            let go: Vec<[f64; 3]> = positions
                .iter()
                .map(|from| {
                    let to = point(&mut draw);
                    std::array::from_fn(|a| to[a] - from[a])
                })
                .collect();
            let lengths = vec![1.0; go.len()];
            let ends: Vec<[f64; 3]> = (0..go.len())
                .map(|i| std::array::from_fn(|a| positions[i][a] + go[i][a]))
                .collect();
            for walker in &mut walkers {
                let events = walker.advance(&go, &lengths, Encounter::Pass);
                for (i, (&from, &to)) in positions.iter().zip(&ends).enumerate() {
                    let found: Vec<(f64, u32, bool)> =
                        row(&events, i).iter().map(|e| (e.1, e.2, e.3)).collect();
                    let expected: Vec<(f64, u32, bool)> = crossings(&geometry, from, to)
                        .iter()
                        .map(|hit| (hit.share, hit.prim_id, hit.entering))
                        .collect();
                    assert_eq!(found, expected, "{from:?} {to:?}");
                }
                assert_eq!(walker.positions(), ends);
                met += events.prim_id.len();
            }
            positions = ends;
        }
        assert!(met > 1000, "{met} events at {place:?}");
    }
}

/// A box of twelve triangles, fronts outwards.
fn push_box(triangles: &mut Triangles, low: [f64; 3], high: [f64; 3]) {
    let corner = |i: usize| std::array::from_fn(|a| if i >> a & 1 == 1 { high[a] } else { low[a] });
    for [a, b, c, d] in
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
    {
        triangles.push([a, b, c].map(corner));
        triangles.push([a, c, d].map(corner));
    }
}

/// Where a thousandth at ten million is a step, ends lie in faces, edges and vertices of boxes exactly: what has been
/// entered and left says where a particle is.
#[test]
fn closed_bodies_are_left_as_often_as_entered() {
    let step = 1.0 / 1024.0;
    for (round, offset) in [0.0, 1e7, -3e7].into_iter().enumerate() {
        let mut draw = Draw::new(9200 + round as u64);
        let mut boxes = Triangles::new();
        push_box(&mut boxes, [0.0; 3], [2.0, 2.0, 4.0]);
        // A neighbour wall to wall, which has faces of its own there.
        push_box(&mut boxes, [2.0, 0.0, 0.0], [4.0, 2.0, 2.0]);
        push_box(&mut boxes, [-3.0, -3.0, -3.0], [-1.0, -2.0, 0.0]);
        let geometry = geometry_of(&boxes, (step, offset));
        let tree = tree_of(&geometry, round);
        let points = PointQueries::new(&tree, &geometry).unwrap();
        // Outside of everything at first.
        let positions = vec![[offset - 5.0 * step; 3]; 200];
        let mut walker = Walker::new(&tree, &geometry, positions).unwrap();
        let mut inside = vec![[0; 3]; 200];
        for _ in 0..20 {
            let ends: Vec<[f64; 3]> = (0..200)
                .map(|_| draw.grid_point(5).map(|x| offset + f64::from(x) * step))
                .collect();
            let go: Vec<[f64; 3]> = walker
                .positions()
                .iter()
                .zip(&ends)
                .map(|(from, to)| std::array::from_fn(|a| to[a] - from[a]))
                .collect();
            let events = walker.advance(&go, &[1.0; 200], Encounter::Pass);
            assert_eq!(walker.positions(), ends);
            let sides = points.sides(&ends);
            for i in 0..200 {
                for (_, _, prim, entering) in row(&events, i) {
                    inside[i][prim as usize / 12] += if entering { 1 } else { -1 };
                }
                assert!(inside[i].iter().all(|times| [0, 1].contains(times)), "{:?}", inside[i]);
                if sides[i] != Side::On {
                    let within = inside[i].contains(&1);
                    assert_eq!(within, sides[i] == Side::Inside, "{:?}", ends[i]);
                }
            }
        }
    }
}

/// Moved by whole steps that `f64` holds exactly, decisions are those of the integers that were moved.
#[test]
fn decisions_are_those_of_integers() {
    let (step, offset) = (1.0 / 1024.0, 1e7);
    let mut draw = Draw::new(9300);
    let scene = scenes::grid_soup(&mut draw, 60, 3);
    let triangles: Triangles = (0..scene.len() as u32)
        .map(|id| {
            let Shape::Triangle(triangle) = scene.shape(id) else { unreachable!() };
            triangle.vertices.map(|p| p.map(f64::from))
        })
        .collect();
    let geometry = geometry_of(&triangles, (step, offset));
    let (mut crossed, exact) = (0, |p: [f64; 3]| p.map(|x| x as i128));
    for _ in 0..3000 {
        let ends = [draw.grid_point(4), draw.grid_point(4)].map(|p| p.map(f64::from));
        let [p, q] = ends.map(exact);
        let mut expected = Vec::new();
        for (id, triangle) in triangles.iter().enumerate() {
            if let Some(entering) = crosses_in_integers(p, q, triangle.map(exact)) {
                expected.push((id as u32, entering));
            }
        }
        let [from, to] = ends.map(|p| p.map(|x| offset + step * x));
        let mut found: Vec<_> =
            crossings(&geometry, from, to).iter().map(|hit| (hit.prim_id, hit.entering)).collect();
        found.sort_unstable();
        assert_eq!(found, expected, "{p:?} {q:?}");
        crossed += found.len();
    }
    assert!(crossed > 3000, "{crossed}");
}

/// Segments from and to far away, tiny ones, and such as have no end.
#[test]
fn from_afar_and_without_an_end() {
    let mut draw = Draw::new(9400);
    for (round, place) in PLACES.into_iter().enumerate() {
        let (scale, offset) = place;
        let geometry = geometry_of(&soup(&mut draw, 150), place);
        let tree = tree_of(&geometry, round);
        let mut walks: Vec<([f64; 3], [f64; 3])> = Vec::new();
        for i in 0..400 {
            let t = geometry.triangle(draw.below(geometry.len()) as u32).unwrap();
            let on = |a: usize| t[0][a] + 0.25 * (t[1][a] - t[0][a]) + 0.25 * (t[2][a] - t[0][a]);
            let mut ray: [f64; 3] = std::array::from_fn(|_| draw.uniform(-1.0, 1.0));
            let size = [1.0, 3.0, 1e3, 1e7, 1e9, 1e30, 1e-15, 1e-200][i % 8] * scale;
            if i % 3 == 0 {
                ray[draw.below(3)] = 0.0;
            }
            let from = std::array::from_fn(|a| on(a) - size * ray[a]);
            walks.push((from, ray.map(|x| 2.0 * size * x)));
        }
        let mut met = 0;
        for level in Level::ALL {
            let (positions, go): (Vec<_>, Vec<_>) = walks.iter().copied().unzip();
            let walker = Walker::new(&tree, &geometry, positions.clone()).unwrap();
            let Some(mut walker) = walker.with_level(level) else { continue };
            let events = walker.advance(&go, &vec![1.0; go.len()], Encounter::Pass);
            assert_eq!(events.invalid, 0);
            for (i, &from) in positions.iter().enumerate() {
                let to = std::array::from_fn(|a| from[a] + go[i][a]);
                let expected: Vec<(f64, u32)> =
                    crossings(&geometry, from, to).iter().map(|h| (h.share, h.prim_id)).collect();
                let found: Vec<(f64, u32)> = row(&events, i).iter().map(|e| (e.1, e.2)).collect();
                assert_eq!(found, expected, "{from:?} {to:?}");
            }
            met += events.prim_id.len();
        }
        assert!(met > 100, "{met} events at {place:?}");
        let unit = [scale, 0.0, 0.0];
        let here = [offset; 3];
        let positions = vec![here, [f64::NAN, 0.0, 0.0], [f64::MAX; 3]];
        let mut walker = Walker::new(&tree, &geometry, positions).unwrap();
        let directions = [unit, [f64::NAN, 0.0, 0.0], unit, unit, [0.0; 3], unit, unit, unit];
        let lengths = [-1.0, 1.0, f64::INFINITY, f64::NAN, 1.0, 0.0, 2.0, 1.0];
        let events = walker.run(&[0, 7, 7, 8], &directions, &lengths, Encounter::Pass);
        assert_eq!((events.invalid, &events.walked[..]), (5, &[7, 0, 1][..]));
        assert_eq!(walker.positions()[0], [offset + 2.0 * scale, offset, offset]);
        assert_eq!(walker.cells().len(), 3);
    }
}

/// Detail far below the resolution of `f32`: walls a thousandth apart at ten million, and a particle between them.
#[test]
fn a_particle_between_two_walls() {
    let wall = |z: f64| [[1e7, 1e7, z], [1e7 + 1e3, 1e7, z], [1e7, 1e7 + 1e3, z]];
    let geometry = geometry_of(&vec![wall(5e6), wall(5e6 + 1e-3)], (1.0, 0.0));
    let tree = tree_of(&geometry, 1);
    let middle = [1e7 + 10.0, 1e7 + 10.0, 5e6 + 5e-4];
    let mut walker = Walker::new(&tree, &geometry, vec![middle]).unwrap();
    let (up, down) = ([0.0, 0.0, 1.0], [0.0, 0.0, -1.0]);
    let events = walker.run(&[0, 3], &[up, down, up], &[4e-4, 8e-4, 1.0], Encounter::Stop);
    assert_eq!((&events.prim_id[..], &events.entering[..]), (&[1][..], &[false][..]));
    assert!((events.t[0] - 9e-4).abs() < 1e-8, "{}", events.t[0]);
    assert_eq!((walker.positions()[0][2], walker.stopped_at()), (5e6 + 1e-3, &[1][..]));
    let events = walker.advance(&[down], &[2e-3], Encounter::Pass);
    assert_eq!((&events.prim_id[..], &events.entering[..]), (&[0][..], &[true][..]));
}
