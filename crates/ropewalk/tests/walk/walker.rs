//! Particles meet what the definition says, exactly once, whatever the level, the threads and the tree.

use crate::bench::{Bench, coordinates};
use crate::scenes;
use ropewalk::kernel::{Arrival, BatchCaster, Level, Masks, Particle};
use ropewalk::point::{PointQueries, Side};
use ropewalk::primitive::Triangle;
use ropewalk::walker::{
    Crossed, Encounter, Events, Float, Walker, WalkerGeometry, crossings, end_of,
};
use ropewalk::wide::WideTree;
use ropewalk::{Geometry, Ray, Shape, Sides};
use ropewalk_testkit::rays::Draw;
use ropewalk_testkit::trees::{TreeShape, random_tree};

/// Particles with lists of segments.
pub struct Crowd<T> {
    pub positions: Vec<[T; 3]>,
    pub offsets: Vec<usize>,
    pub directions: Vec<[T; 3]>,
    pub lengths: Vec<T>,
}

/// A direction with all digits of an `f64`.
fn direction<T: Float>(draw: &mut Draw) -> [T; 3] {
    draw.direction().map(|x| T::rounded(f64::from(x) * draw.uniform(1.0, 1.0 + 1e-6)))
}

/// Chains of segments: generic ones, others that end at coordinates of the scene, so in faces, edges and
/// vertices, and some that turn there or run along them.
pub fn crowd<G: WalkerGeometry>(
    draw: &mut Draw,
    geometry: &G,
    (low, high): ([f64; 3], [f64; 3]),
    values: &[Vec<G::Float>; 3],
    particles: usize,
) -> Crowd<G::Float> {
    let size = (0..3).map(|a| (high[a] - low[a]).powi(2)).sum::<f64>().sqrt();
    let number = G::Float::rounded;
    let mut crowd = Crowd {
        positions: Vec::new(),
        offsets: vec![0],
        directions: Vec::new(),
        lengths: Vec::new(),
    };
    let snapped = |draw: &mut Draw, share: f64| -> [G::Float; 3] {
        let mut p = std::array::from_fn(|a| number(draw.uniform(low[a], high[a])));
        for (a, x) in p.iter_mut().enumerate() {
            if draw.chance(share) && !values[a].is_empty() {
                *x = values[a][draw.below(values[a].len())];
            }
        }
        p
    };
    for _ in 0..particles {
        let mut at = snapped(draw, 0.5);
        crowd.positions.push(at);
        for _ in 0..draw.below(12) {
            let (direction, length) = match draw.below(8) {
                0..3 => {
                    // To a point of the scene: the difference may be rounded.
                    let to = snapped(draw, 0.9);
                    let go = |a: usize| number(to[a].into() - at[a].into());
                    (std::array::from_fn(go), number(1.0))
                }
                3 => (direction(draw), number(size * draw.uniform(-12.0, 0.0).exp2())),
                4 => {
                    // Back along the last segment.
                    let last =
                        crowd.directions.last().map_or([1.0, 0.0, 0.0], |d| d.map(Into::into));
                    let back = if draw.chance(0.5) { 1.0 } else { draw.uniform(0.0, 2.0) };
                    let length = crowd.lengths.last().map_or(1.0, |&l| l.into() * back);
                    (last.map(|x: f64| number(-x)), number(length))
                }
                5 => {
                    let mut direction = [number(0.0); 3];
                    direction[draw.below(3)] = number(if draw.chance(0.5) { 1.0 } else { -1.0 });
                    (direction, number((size * draw.uniform(-3.0, 0.0).exp2()).round()))
                }
                6 => (direction(draw), number(0.0)),
                _ => {
                    let far: [f64; 3] = direction(draw);
                    (far.map(|x| number(100.0 * x)), number(size * 1e-3))
                }
            };
            crowd.directions.push(direction);
            crowd.lengths.push(length);
            at = end_of(geometry, at, direction, length).unwrap_or(at);
        }
        crowd.offsets.push(crowd.lengths.len());
    }
    crowd
}

/// What a particle meets, by the definition: events, the end, segments begun, and where it was stopped.
type Walked<T> = (Vec<(u32, T, u32, bool)>, [T; 3], u32, u32);

fn expected<G: WalkerGeometry>(
    geometry: &G,
    crowd: &Crowd<G::Float>,
    i: usize,
    encounter: Encounter,
    filter: impl Fn(usize, &Crossed) -> bool,
) -> Walked<G::Float> {
    let (mut at, mut stopped, mut events) = (crowd.positions[i], u32::MAX, Vec::new());
    let row = crowd.offsets[i]..crowd.offsets[i + 1];
    for (segment, s) in row.clone().enumerate() {
        let end = end_of(geometry, at, crowd.directions[s], crowd.lengths[s]);
        let Some(to) = end else { continue };
        if to == at {
            continue;
        }
        let met = crossings(geometry, at, to);
        let mut met = met.iter().filter(|hit| hit.prim_id != stopped && filter(i, hit));
        let event = |hit: &Crossed| {
            let t = Float::rounded(hit.share * crowd.lengths[s].into());
            (segment as u32, t, hit.prim_id, hit.entering)
        };
        if encounter == Encounter::Stop
            && let Some(hit) = met.next()
        {
            events.push(event(hit));
            let place = |a: usize| {
                let (from, to): (f64, f64) = (at[a].into(), to[a].into());
                Float::rounded(from + hit.share * (to - from))
            };
            return (events, std::array::from_fn(place), segment as u32 + 1, hit.prim_id);
        }
        events.extend(met.map(event));
        (at, stopped) = (to, u32::MAX);
    }
    (events, at, row.len() as u32, stopped)
}

pub fn row<T: Float>(events: &Events<T>, i: usize) -> Vec<(u32, T, u32, bool)> {
    (events.offsets[i]..events.offsets[i + 1])
        .map(|e| (events.segment[e], events.t[e], events.prim_id[e], events.entering[e]))
        .collect()
}

/// One type for all filters, so that the kernels are compiled for it once.
pub type Filter<'a> = &'a (dyn Fn(usize, &Crossed) -> bool + Sync);

/// Runs a crowd at every level and compares with the definition; the number of events.
pub fn check<G: WalkerGeometry>(
    geometry: &G,
    tree: &G::Tree,
    crowd: &Crowd<G::Float>,
    filter: Filter<'_>,
) -> usize {
    let mut met = 0;
    for encounter in [Encounter::Pass, Encounter::Stop] {
        let first: Vec<Walked<G::Float>> = (0..crowd.positions.len())
            .map(|i| expected(geometry, crowd, i, encounter, filter))
            .collect();
        for level in Level::ALL {
            for threads in [0, 1] {
                let walker = Walker::new(tree, geometry, crowd.positions.clone()).unwrap();
                let Some(walker) = walker.with_level(level) else { continue };
                let mut walker = walker.with_filter(filter).with_threads(threads);
                let events =
                    walker.run(&crowd.offsets, &crowd.directions, &crowd.lengths, encounter);
                for (i, (list, end, walked, stopped)) in first.iter().enumerate() {
                    let name = level.name();
                    assert_eq!(row(&events, i), *list, "{name} {encounter:?} particle {i}");
                    assert_eq!(walker.positions()[i], *end, "{name} {encounter:?} particle {i}");
                    assert_eq!(events.walked[i], *walked);
                    assert_eq!(walker.stopped_at()[i], *stopped);
                }
                met += events.prim_id.len();
            }
        }
    }
    met
}

fn each(seed: u64, scene: impl Fn(&mut Draw) -> Geometry) {
    let (mut met, mut filtered) = (0, 0);
    for round in 0..4 {
        let mut draw = Draw::new(seed + round);
        let geometry = scene(&mut draw);
        let shape = TreeShape { max_depth: 6 + draw.below(16), ..TreeShape::default() };
        let tree = random_tree(&mut draw, &geometry, shape).unwrap();
        let wide = WideTree::compile(&tree, &geometry).unwrap();
        let bench = Bench::new(geometry.clone().into(), tree.into());
        let bounds = geometry.bounds();
        let bounds = (bounds.min.map(f64::from), bounds.max.map(f64::from));
        let crowd = crowd(&mut draw, &geometry, bounds, &coordinates(&bench), 80);
        met += check(&geometry, &wide, &crowd, &|_, _| true);
        filtered += check(&geometry, &wide, &crowd, &|particle, hit| {
            hit.entering == (particle % 2 == 0)
                && !(hit.prim_id as usize + particle).is_multiple_of(3)
        });
    }
    assert!(met > 100, "{met} events");
    assert!(0 < filtered && filtered < met, "{filtered} of {met} events");
}

#[test]
fn particles_meet_what_the_definition_says() {
    each(1, |d| scenes::soup(d, 200, 1.0));
    each(2, |d| scenes::exponent_soup(d, 100, -6.0, 6.0));
    each(3, |d| scenes::grid_soup(d, 100, 4));
    each(4, |d| scenes::grid_quads(d, 40, 4));
    each(5, |d| scenes::offset(&scenes::soup(d, 200, 1.0), [1e6, 0.0, -1e6]));
    each(6, |d| scenes::offset(&scenes::grid_quads(d, 40, 4), [1e7, 3.0, -1e7]));
    each(7, |d| scenes::exponent_soup(d, 60, -17.0, 17.0));
    each(8, |d| scenes::exponent_soup(d, 60, -20.0, -16.0));
}

/// A box of twelve triangles, fronts outwards.
/// Long lists, so that segments are looked at in packets and answered out of order: short ones between long ones.
#[test]
fn long_lists_come_in_order() {
    let mut met = 0;
    for round in 0..3 {
        let mut draw = Draw::new(900 + round);
        let geometry = scenes::soup(&mut draw, 200, 0.3);
        let tree = random_tree(&mut draw, &geometry, TreeShape::default()).unwrap();
        let wide = WideTree::compile(&tree, &geometry).unwrap();
        let bounds = geometry.bounds();
        let low = bounds.min.map(f64::from);
        let size: [f64; 3] = std::array::from_fn(|a| f64::from(bounds.max[a]) - low[a]);
        let (mut positions, mut offsets) = (Vec::new(), vec![0]);
        let (mut directions, mut lengths) = (Vec::new(), Vec::new());
        for _ in 0..5 {
            let point = |draw: &mut Draw| {
                std::array::from_fn(|a| low[a] + size[a] * draw.uniform(0.1, 0.9))
            };
            let mut at: [f64; 3] = point(&mut draw);
            positions.push(at.map(|x| x as f32));
            for _ in 0..draw.below(1500) {
                let share = if draw.chance(0.05) { 0.5 } else { 0.004 };
                let to: [f64; 3] = point(&mut draw);
                let step: [f64; 3] = std::array::from_fn(|a| share * (to[a] - at[a]));
                at = std::array::from_fn(|a| at[a] + step[a]);
                directions.push(step.map(|x| x as f32));
                lengths.push(1.0);
            }
            offsets.push(lengths.len());
        }
        met +=
            check(&geometry, &wide, &Crowd { positions, offsets, directions, lengths }, &|_, _| {
                true
            });
    }
    assert!(met > 1000, "{met} events");
}

fn push_box(geometry: &mut Geometry, low: [f32; 3], high: [f32; 3]) {
    let corner = |i: usize| std::array::from_fn(|a| if i >> a & 1 == 1 { high[a] } else { low[a] });
    for [a, b, c, d] in
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
    {
        for face in [[a, b, c], [a, c, d]] {
            let vertices = face.map(corner);
            geometry.push(Triangle { vertices }, Sides::Both).unwrap();
        }
    }
}

/// On a grid of integers nearly every end lies in a face, an edge or a vertex, and many segments run in
/// them: a particle is still in each body once or not at all after each segment, and where it is inside is
/// known from its crossings alone. (Where it enters and leaves in one point, through an edge, the order
/// is that of primitives.)
#[test]
fn closed_bodies_are_left_as_often_as_entered() {
    for seed in 0..6 {
        let mut draw = Draw::new(100 + seed);
        let mut geometry = Geometry::new();
        push_box(&mut geometry, [0.0; 3], [2.0, 2.0, 4.0]);
        // A neighbour wall to wall, which has faces of its own there.
        push_box(&mut geometry, [2.0, 0.0, 0.0], [4.0, 2.0, 2.0]);
        push_box(&mut geometry, [-3.0, -3.0, -3.0], [-1.0, -2.0, 0.0]);
        let tree = random_tree(&mut draw, &geometry, TreeShape::default()).unwrap();
        let wide = WideTree::compile(&tree, &geometry).unwrap();
        let points = PointQueries::new(&wide, &geometry).unwrap();
        // Outside of everything at first.
        let positions = vec![[-5.0, -5.0, -5.0]; 200];
        let mut walker = Walker::new(&wide, &geometry, positions).unwrap();
        let mut inside = vec![[0; 3]; 200];
        for _ in 0..20 {
            let ends: Vec<[f32; 3]> = (0..200).map(|_| draw.grid_point(5)).collect();
            let go: Vec<[f32; 3]> = walker
                .positions()
                .iter()
                .zip(&ends)
                .map(|(from, to)| std::array::from_fn(|a| to[a] - from[a]))
                .collect();
            let events = walker.advance(&go, &[1.0; 200], Encounter::Pass);
            assert_eq!(walker.positions(), ends);
            let sides = points.sides(&ends.iter().map(|p| p.map(f64::from)).collect::<Vec<_>>());
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

/// The same decisions in integers, written without regard to the library's.
pub fn crosses_in_integers(p: [i128; 3], q: [i128; 3], triangle: [[i128; 3]; 3]) -> Option<bool> {
    type V = [i128; 3];
    // Enough for numbers up to 8: a step is smaller than any product of those before it.
    const STEPS: V = [1 << 60, 1 << 30, 1];
    const SCALE: i128 = 1 << 90;
    let moved = |p: V| std::array::from_fn(|a| p[a] * SCALE + STEPS[a]);
    let still = |p: V| p.map(|x| x * SCALE);
    let minus = |a: V, b: V| -> V { std::array::from_fn(|i| a[i] - b[i]) };
    let cross = |a: V, b: V| -> V {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    let dot = |a: V, b: V| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let [a, b, c] = triangle;
    let normal = cross(minus(b, a), minus(c, a));
    let side = |p: V| dot(normal, minus(moved(p), still(a))).signum();
    if side(p) == side(q) {
        return None;
    }
    let d = minus(q, p);
    // det(q - p, a - p', b - p') is (a - p') x (b - a) times d.
    let turn = |a: V, b: V| dot(d, cross(minus(b, a), minus(moved(p), still(a)))).signum();
    let turns = [turn(a, b), turn(b, c), turn(c, a)];
    (turns[0] == turns[1] && turns[1] == turns[2] && turns[0] != 0).then(|| side(p) > side(q))
}

#[test]
fn decisions_are_those_of_integers() {
    let mut draw = Draw::new(7);
    let geometry = scenes::grid_soup(&mut draw, 60, 3);
    let exact = |p: [f32; 3]| p.map(|x| x as i128);
    let mut crossed = 0;
    for _ in 0..3000 {
        let (p, q) = (draw.grid_point(4), draw.grid_point(4));
        let mut expected = Vec::new();
        for id in 0..geometry.len() as u32 {
            let Shape::Triangle(triangle) = geometry.shape(id) else { unreachable!() };
            if let Some(entering) =
                crosses_in_integers(exact(p), exact(q), triangle.vertices.map(exact))
            {
                expected.push((id, entering));
            }
        }
        let mut found: Vec<_> =
            crossings(&geometry, p, q).iter().map(|hit| (hit.prim_id, hit.entering)).collect();
        found.sort_unstable();
        assert_eq!(found, expected, "{p:?} {q:?}");
        crossed += found.len();
    }
    assert!(crossed > 3000, "{crossed}");
}

#[test]
fn what_has_no_end_is_left_out_and_counted() {
    let mut draw = Draw::new(9);
    let geometry = scenes::soup(&mut draw, 50, 1.0);
    let tree = random_tree(&mut draw, &geometry, TreeShape::default()).unwrap();
    let wide = WideTree::compile(&tree, &geometry).unwrap();
    let positions = vec![[0.5; 3], [f32::NAN, 0.0, 0.0]];
    let mut walker = Walker::new(&wide, &geometry, positions).unwrap();
    let x = [1.0, 0.0, 0.0];
    let directions = [x, [f32::NAN, 0.0, 0.0], x, x, [0.0; 3], x, x];
    let lengths = [-1.0, 1.0, f32::INFINITY, f32::NAN, 1.0, 0.0, 0.25];
    let events = walker.run(&[0, 7, 7], &directions, &lengths, Encounter::Pass);
    assert_eq!((events.invalid, &events.walked[..]), (4, &[7, 0][..]));
    assert_eq!(walker.positions()[0], [0.75, 0.5, 0.5]);
    assert_eq!(events.report.segments, 1);
    let empty = Geometry::new();
    let (none, _) = WideTree::build(&empty, &Default::default(), &()).unwrap();
    let mut walker = Walker::new(&none, &empty, vec![[0.0; 3]; 3]).unwrap();
    let events = walker.advance(&[x; 3], &[1.0; 3], Encounter::Stop);
    assert_eq!(events.offsets, [0; 4]);
    assert_eq!(walker.positions(), [x; 3]);
}

#[test]
fn masks_are_those_of_each_particle_in_any_task() {
    let mut geometry = Geometry::new();
    push_box(&mut geometry, [0.0; 3], [1.0; 3]);
    push_box(&mut geometry, [2.0, 0.0, 0.0], [3.0, 1.0, 1.0]);
    let (wide, _) = WideTree::build(&geometry, &Default::default(), &()).unwrap();
    let primitive: Vec<u32> = (0..24).map(|prim| 1 << (prim / 12)).collect();
    let ray: Vec<u32> = (0..5000).collect();
    let masks = Masks { primitive: &primitive, ray: &ray };
    let walker = Walker::new(&wide, &geometry, vec![[-1.0, 0.25, 0.5]; 5000]).unwrap();
    let mut walker = walker.with_filter(masks);
    let events = walker.advance(&[[5.0, 0.0, 0.0]; 5000], &[1.0; 5000], Encounter::Stop);
    for (i, at) in walker.positions().iter().enumerate() {
        let (x, count) = [(4.0, 0), (0.0, 1), (2.0, 1), (0.0, 1)][i % 4];
        assert_eq!((at[0], row(&events, i).len()), (x, count), "particle {i}");
    }
}

/// A walk whose next segment depends on what the last one hit.
#[derive(Clone, PartialEq, Debug)]
struct Wanderer {
    at: [f32; 3],
    seed: u64,
    length: f64,
    left: usize,
    ray: Option<Ray>,
    met: Vec<(u32, u32)>,
}

impl Particle for Wanderer {
    fn next(&mut self, before: Option<Arrival>) -> Option<Ray> {
        assert_eq!(before.is_some(), self.ray.is_some());
        if let (Some(ray), Some(arrival)) = (self.ray, before) {
            self.met.push((arrival.t.to_bits(), arrival.prim_id));
            let t = if arrival.is_hit() { 0.99 * arrival.t } else { ray.t_max };
            self.at = ray.at(t).map(|x| x as f32);
            self.seed ^= u64::from(arrival.prim_id);
        }
        self.left = self.left.checked_sub(1)?;
        let mut draw = Draw::new(self.seed);
        self.seed = draw.bits();
        let length = self.length * draw.uniform(-2.0, 2.0).exp2();
        let ray = Ray::new(self.at, draw.direction()).with_range(0.0, length as f32);
        self.ray = Some(ray);
        self.ray
    }
}

#[test]
fn walks_see_what_single_rays_see() {
    for (seed, size) in [(1, 0.01), (2, 0.1), (3, 1.0)] {
        let mut draw = Draw::new(seed);
        let geometry = scenes::soup(&mut draw, 300, 1.0);
        let tree = random_tree(&mut draw, &geometry, TreeShape::default()).unwrap();
        let wide = WideTree::compile(&tree, &geometry).unwrap();
        let caster = BatchCaster::new(&wide, &geometry);
        let start: Vec<Wanderer> = (0..700)
            .map(|i| Wanderer {
                at: draw.point_in(&geometry.bounds()),
                seed: i,
                length: size,
                left: draw.below(40),
                ray: None,
                met: Vec::new(),
            })
            .collect();
        let mut expected = start.clone();
        for particle in &mut expected {
            let mut before = None;
            while let Some(ray) = particle.next(before) {
                let hit = caster.closest_hit_one(&ray);
                before =
                    Some(hit.map_or(Arrival::MISS, |h| Arrival { t: h.t, prim_id: h.prim_id }));
            }
        }
        for level in Level::ALL {
            let Some(caster) = caster.with_level(level) else { continue };
            for threads in [0, 1] {
                let mut particles = start.clone();
                let report = caster.with_threads(threads).walk(&mut particles);
                assert_eq!(particles, expected, "{}", level.name());
                let segments: usize = particles.iter().map(|p| p.met.len()).sum();
                assert_eq!(report.segments, segments as u64);
            }
        }
    }
}
