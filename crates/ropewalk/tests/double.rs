//! Triangles and rays in `f64`: every level answers bit for bit as brute force does, at any scale and
//! distance from the origin.

use ropewalk::build::{BuildSettings, Preset};
use ropewalk::double::{
    DoubleBruteForce, DoubleCaster, DoubleGeometry, DoubleGeometryError, DoubleRay, DoubleTree,
};
use ropewalk::kernel::Level;
use ropewalk_testkit::rays::Draw;

type Mesh = (Vec<[f64; 3]>, Vec<[u32; 3]>);

fn uniform(draw: &mut Draw) -> [f64; 3] {
    std::array::from_fn(|_| draw.uniform(-1.0, 1.0))
}

/// Loose triangles of all sizes down to far below the resolution of `f32`.
fn soup(draw: &mut Draw, n: u32) -> Mesh {
    let mut vertices = Vec::new();
    for _ in 0..n {
        let (centre, size) = (uniform(draw), 10f64.powf(draw.uniform(-9.0, 0.0)));
        for _ in 0..3 {
            let offset = uniform(draw);
            vertices.push(std::array::from_fn(|a| centre[a] + size * offset[a]));
        }
    }
    (vertices, (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
}

/// Triangles between the points of a small grid: shared edges, coincident faces, degenerate ones.
fn grid(draw: &mut Draw, n: u32, steps: u32) -> Mesh {
    let points = steps + 1;
    let mut vertices = Vec::new();
    for i in 0..points.pow(3) {
        let at = |i: u32| f64::from(i % points) * 2.0 / f64::from(steps) - 1.0;
        vertices.push([at(i), at(i / points), at(i / points / points)]);
    }
    let mut corner = || draw.below(points.pow(3) as usize) as u32;
    let faces = (0..n).map(|_| [corner(), corner(), corner()]).collect();
    (vertices, faces)
}

/// A closed surface: a sphere by longitude and latitude with dents.
fn sphere(draw: &mut Draw, steps: u32) -> Mesh {
    let mut vertices = vec![[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]];
    for i in 1..steps {
        for j in 0..2 * steps {
            let polar = std::f64::consts::PI * f64::from(i) / f64::from(steps);
            let turn = std::f64::consts::PI * f64::from(j) / f64::from(steps);
            let r = draw.uniform(0.8, 1.0);
            let (s, z) = (polar.sin(), -polar.cos());
            vertices.push([r * s * turn.cos(), r * s * turn.sin(), r * z]);
        }
    }
    let at = |i: u32, j: u32| 2 + (i - 1) * 2 * steps + j % (2 * steps);
    let mut faces = Vec::new();
    for j in 0..2 * steps {
        faces.push([0, at(1, j + 1), at(1, j)]);
        faces.push([1, at(steps - 1, j), at(steps - 1, j + 1)]);
        for i in 1..steps - 1 {
            faces.push([at(i, j), at(i, j + 1), at(i + 1, j)]);
            faces.push([at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)]);
        }
    }
    (vertices, faces)
}

fn moved((vertices, faces): Mesh, scale: f64, offset: [f64; 3]) -> Mesh {
    let place = |p: [f64; 3]| std::array::from_fn(|a| p[a] * scale + offset[a]);
    (vertices.into_iter().map(place).collect(), faces)
}

/// Rays of all kinds about a scene of the given half size around `offset`.
fn rays(
    draw: &mut Draw,
    geometry: &DoubleGeometry,
    scale: f64,
    offset: [f64; 3],
) -> Vec<DoubleRay> {
    let oracle = DoubleBruteForce { geometry };
    let mut rays = Vec::new();
    for i in 0..500 {
        let triangle = geometry.triangle(draw.below(geometry.len()) as u32).unwrap();
        let inside = uniform(draw);
        let mut origin: [f64; 3] = std::array::from_fn(|a| offset[a] + scale * 1.5 * inside[a]);
        let mut dir = uniform(draw);
        match i % 8 {
            // At a vertex, at an edge, at a point of a triangle, from a vertex.
            0 => dir = std::array::from_fn(|a| triangle[0][a] - origin[a]),
            1 => {
                let w = draw.uniform(0.0, 1.0);
                let edge = |a: usize| w * triangle[0][a] + (1.0 - w) * triangle[1][a];
                dir = std::array::from_fn(|a| edge(a) - origin[a]);
            }
            2 => {
                let centre = |a: usize| (triangle[0][a] + triangle[1][a] + triangle[2][a]) / 3.0;
                dir = std::array::from_fn(|a| centre(a) - origin[a]);
            }
            3 => origin = triangle[2],
            // Along an axis through a vertex.
            4 => {
                let axis = draw.below(3);
                origin = triangle[1];
                origin[axis] = offset[axis] - scale * 2.0;
                dir = [0.0; 3];
                dir[axis] = 1.0;
            }
            // From afar.
            5 => {
                let distance = 10f64.powf(draw.uniform(0.0, 11.0));
                origin = std::array::from_fn(|a| triangle[0][a] + scale * distance * dir[a]);
                dir = dir.map(|x| -x);
            }
            // Along one component almost.
            6 => dir[draw.below(3)] *= 1e-20,
            _ => {}
        }
        let length = 10f64.powf(draw.uniform(-3.0, 3.0)) * if i % 31 == 0 { 1e-300 } else { 1.0 };
        let ray = DoubleRay::new(origin, dir.map(|x| x * length));
        rays.push(ray);
        rays.push(ray.with_range(f64::NEG_INFINITY, 0.0));
        if let Some(hit) = oracle.closest_hit(&ray) {
            let next = |t: f64, up: i64| f64::from_bits((t.to_bits() as i64 + up) as u64);
            rays.push(ray.with_range(0.0, hit.t));
            rays.push(ray.with_range(hit.t, f64::INFINITY));
            if hit.t > 0.0 {
                rays.push(ray.with_range(0.0, next(hit.t, -1)));
                rays.push(ray.with_range(next(hit.t, 1), f64::INFINITY));
            }
        }
    }
    let whole = |x: f64| [x; 3];
    rays.push(DoubleRay::new(whole(f64::NAN), whole(1.0)));
    rays.push(DoubleRay::new(whole(0.0), whole(0.0)));
    rays.push(DoubleRay::new(whole(0.0), whole(f64::INFINITY)));
    rays.push(DoubleRay::new(offset, whole(1.0)).with_range(1.0, 0.0));
    rays.push(DoubleRay::new(offset, whole(1.0)).with_range(f64::NAN, 1.0));
    rays.push(DoubleRay::new(whole(1e300), whole(-1.0)));
    rays.push(DoubleRay::new(offset, whole(1e300)));
    rays.push(DoubleRay::new(offset, whole(5e-324)));
    rays
}

fn build((vertices, faces): Mesh, preset: Preset) -> (DoubleGeometry, DoubleTree) {
    let geometry = DoubleGeometry::from_triangles(vertices, faces).unwrap();
    let settings = BuildSettings { threads: 1, ..BuildSettings::preset(preset) };
    let (tree, report) = geometry.build(&settings, &()).unwrap();
    assert_eq!(report.degenerate, geometry.degenerate_count());
    (geometry, tree)
}

fn check(geometry: &DoubleGeometry, tree: &DoubleTree, rays: &[DoubleRay]) -> usize {
    let oracle = DoubleBruteForce { geometry };
    let every: Vec<Vec<(f64, u32)>> = rays
        .iter()
        .map(|ray| oracle.all_hits(ray).iter().map(|hit| (hit.t, hit.prim_id)).collect())
        .collect();
    for level in Level::ALL {
        let Some(caster) = DoubleCaster::new(tree, geometry).with_level(level) else { continue };
        let (hits, occluded) = (caster.closest_hit(rays), caster.occluded(rays));
        let (all, first, counts) =
            (caster.all_hits(rays), caster.first_hits(rays, 2), caster.count_hits(rays));
        for (i, ray) in rays.iter().enumerate() {
            let name = level.name();
            let best = oracle.closest_hit(ray).map(|hit| (hit.t, hit.prim_id));
            assert_eq!(best, every[i].first().copied(), "oracles, {ray:?}");
            let expected = best.unwrap_or((f64::INFINITY, u32::MAX));
            assert_eq!((hits.t[i], hits.prim_id[i]), expected, "{name} closest {i}, {ray:?}");
            assert_eq!(occluded[i], best.is_some(), "{name} occluded {i}, {ray:?}");
            let row = |of: &ropewalk::double::DoubleAllHits| -> Vec<(f64, u32)> {
                (of.offsets[i]..of.offsets[i + 1]).map(|j| (of.t[j], of.prim_id[j])).collect()
            };
            assert_eq!(row(&all), every[i], "{name} all hits {i}, {ray:?}");
            assert_eq!(counts[i] as usize, every[i].len(), "{name} count {i}, {ray:?}");
            let two = &every[i][..every[i].len().min(2)];
            assert_eq!(row(&first), two, "{name} first hits {i}, {ray:?}");
        }
    }
    every.iter().filter(|hits| !hits.is_empty()).count()
}

const PLACES: [(f64, [f64; 3]); 7] = [
    (1.0, [0.0; 3]),
    (1e-6, [0.0; 3]),
    (1e6, [3e5, -2e5, 1e4]),
    (10.0, [1e7, -2e7, 3e7]),
    (1e-3, [1e7, 1e7, 0.0]),
    (1e90, [0.0; 3]),
    (1e-60, [0.0; 3]),
];

fn everywhere(seed: u64, scene: impl Fn(&mut Draw) -> Mesh) {
    for (round, (scale, offset)) in PLACES.into_iter().enumerate() {
        let mut draw = Draw::new(seed + round as u64);
        let mesh = moved(scene(&mut draw), scale, offset);
        let preset = Preset::ALL[round % Preset::ALL.len()];
        let (geometry, tree) = build(mesh, preset);
        let rays = rays(&mut draw, &geometry, scale, offset);
        let hit = check(&geometry, &tree, &rays);
        assert!(hit > rays.len() / 20, "{hit} of {} rays hit at {scale:e}", rays.len());
    }
}

#[test]
fn loose_triangles_of_all_sizes() {
    everywhere(1, |draw| soup(draw, 200));
}

#[test]
fn triangles_of_a_grid_with_exact_ties() {
    everywhere(20, |draw| grid(draw, 300, 4));
    everywhere(40, |draw| grid(draw, 100, 2));
}

#[test]
fn closed_surfaces() {
    everywhere(60, |draw| sphere(draw, 9));
}

/// From inside of a closed surface every ray hits, whichever vertex or edge it aims at, and crosses it an
/// odd number of times.
#[test]
fn no_ray_leaves_a_closed_surface() {
    for (round, (scale, offset)) in PLACES.into_iter().enumerate() {
        let mut draw = Draw::new(80 + round as u64);
        let mesh = moved(sphere(&mut draw, 24), scale, offset);
        let (geometry, tree) = build(mesh, Preset::Balanced);
        let rays: Vec<DoubleRay> = (0..20_000)
            .map(|i| {
                let triangle = geometry.triangle(draw.below(geometry.len()) as u32).unwrap();
                let w = if i % 2 == 0 { 0.0 } else { draw.uniform(0.0, 1.0) };
                let jitter = uniform(&mut draw);
                let origin: [f64; 3] = std::array::from_fn(|a| offset[a] + scale * 0.3 * jitter[a]);
                let at = |a: usize| w * triangle[0][a] + (1.0 - w) * triangle[1][a];
                DoubleRay::new(origin, std::array::from_fn(|a| at(a) - origin[a]))
            })
            .collect();
        let caster = DoubleCaster::new(&tree, &geometry).with_threads(1);
        let lost = caster.occluded(&rays).iter().filter(|hit| !**hit).count();
        assert_eq!(lost, 0, "at {scale:e}");
    }
}

#[test]
fn threads_change_nothing() {
    let mut draw = Draw::new(100);
    let (geometry, tree) = build(moved(sphere(&mut draw, 16), 5.0, [1e6; 3]), Preset::Fast);
    let rays: Vec<DoubleRay> = (0..20_000)
        .map(|_| {
            let (from, dir) = (uniform(&mut draw), uniform(&mut draw));
            DoubleRay::new(from.map(|x| 1e6 + 8.0 * x), dir)
        })
        .collect();
    let one = DoubleCaster::new(&tree, &geometry).with_threads(1);
    let all = DoubleCaster::new(&tree, &geometry);
    assert_eq!(one.closest_hit(&rays), all.closest_hit(&rays));
    assert_eq!(one.occluded(&rays), all.occluded(&rays));
    assert_eq!(one.all_hits(&rays), all.all_hits(&rays));
    assert_eq!(one.count_hits(&rays), all.count_hits(&rays));
}

/// Detail far below the resolution of `f32` at the scene's size is told apart.
#[test]
fn two_walls_a_thousandth_apart_at_ten_million() {
    let wall = |z: f64| [[1e7, 1e7, z], [1e7 + 1e3, 1e7, z], [1e7, 1e7 + 1e3, z]];
    let vertices = [wall(5e6 + 1e-3), wall(5e6)].concat();
    let (geometry, tree) = build((vertices, vec![[0, 1, 2], [3, 4, 5]]), Preset::Balanced);
    let ray = DoubleRay::new([1e7 + 10.0, 1e7 + 10.0, 0.0], [0.0, 0.0, 1.0]);
    let hits = DoubleCaster::new(&tree, &geometry).all_hits(&[ray]);
    assert_eq!((hits.t, hits.prim_id), (vec![5e6, 5e6 + 1e-3], vec![1, 0]));
}

#[test]
fn a_filter_sees_hits_in_double_precision() {
    let mut draw = Draw::new(120);
    let (geometry, tree) = build(grid(&mut draw, 200, 3), Preset::Balanced);
    let rays = rays(&mut draw, &geometry, 1.0, [0.0; 3]);
    let odd = |ray: usize, hit: &ropewalk::double::DoubleHit| (ray as u32 + hit.prim_id) % 2 == 1;
    let hits = DoubleCaster::new(&tree, &geometry).with_filter(odd).closest_hit(&rays);
    for (i, ray) in rays.iter().enumerate() {
        let all = (0..geometry.len() as u32).filter_map(|id| geometry.intersect(id, ray));
        let accepted = all.filter(|hit| odd(i, hit));
        let expected = accepted.reduce(|best, hit| if hit.is_before(&best) { hit } else { best });
        let expected = expected.map_or((f64::INFINITY, u32::MAX), |hit| (hit.t, hit.prim_id));
        assert_eq!((hits.t[i], hits.prim_id[i]), expected, "{ray:?}");
    }
}

#[test]
fn bad_meshes_are_refused() {
    let face = vec![[0, 1, 2]];
    let mesh = |x: f64| vec![[0.0; 3], [1.0, x, 0.0], [0.0, 1.0, 0.0]];
    for bad in [f64::NAN, f64::INFINITY, 1e101, -1e200] {
        let Err(DoubleGeometryError::Vertex { vertex: 1, .. }) =
            DoubleGeometry::from_triangles(mesh(bad), face.clone())
        else {
            panic!("{bad} was taken")
        };
    }
    let error = DoubleGeometry::from_triangles(mesh(0.0), vec![[0, 1, 3]]).err().unwrap();
    assert_eq!(error.to_string(), "face 0 names vertex 3; there are 3 vertices, numbered from 0");
    assert!(DoubleGeometry::from_triangles(mesh(0.0), Vec::new()).is_err());
}

/// Triangles without area in `f64` are never hit; those that rounding to `f32` flattens are.
#[test]
fn degenerate_triangles_are_judged_in_double_precision() {
    let thin = 1e-12;
    let vertices = vec![
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [2.0, 0.0, 0.0],
        [0.5, thin, 0.0],
        [0.1, 0.2, 0.3],
        [0.2, 0.4, 0.6],
        [0.4, 0.8, 1.2],
    ];
    let faces = vec![[0, 1, 2], [0, 1, 3], [4, 4, 1], [4, 5, 6]];
    let (geometry, tree) = build((vertices, faces), Preset::Balanced);
    // 0.1, 0.2 and 0.4 differ by powers of two, so the last one is flat exactly.
    assert_eq!(geometry.degenerate_count(), 3);
    let ray = DoubleRay::new([0.5, thin / 2.0, 1.0], [0.0, 0.0, -1.0]);
    let hits = DoubleCaster::new(&tree, &geometry).closest_hit(&[ray]);
    assert_eq!((hits.t[0], hits.prim_id[0]), (1.0, 1));
}

#[test]
fn triangles_by_number() {
    let (geometry, _) = build(grid(&mut Draw::new(130), 20, 3), Preset::Fast);
    let count = geometry.len() as u32;
    for id in 0..count {
        let corners = geometry.faces()[id as usize].map(|i| geometry.vertices()[i as usize]);
        assert_eq!(geometry.triangle(id), Some(corners));
        let length = geometry.normal(id).unwrap().iter().map(|x| x * x).sum::<f64>();
        let flat = geometry.degenerate().contains(&id);
        assert!(if flat { length.is_nan() } else { (length - 1.0).abs() < 1e-12 }, "{id}");
    }
    for id in [count, count + 1, 1 << 30, u32::MAX] {
        assert_eq!((geometry.triangle(id), geometry.normal(id)), (None, None));
    }
}
