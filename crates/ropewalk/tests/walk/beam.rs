//! Coherent rays go through beams and are answered bit for bit as brute force does.

use crate::bench::{Bench, coordinates};
use crate::{scenes, wave};
use ropewalk::kernel::{BatchCaster, BatchReport, Level};
use ropewalk::primitive::Triangle;
use ropewalk::traverse::{BruteForce, NoCounts, RayCaster};
use ropewalk::tree::{BspTree, Node};
use ropewalk::wide::WideTree;
use ropewalk::{Geometry, Ray, Sides};
use ropewalk_testkit::rays::{Draw, generic_ray, invalid_rays};
use ropewalk_testkit::trees::{TreeShape, random_tree};

/// Checks the answers at every level; the reports of closest hits and of occlusion at the first.
fn check(geometry: &Geometry, tree: &BspTree, rays: &[Ray]) -> [BatchReport; 2] {
    wave::check(geometry, tree, rays);
    let wide = WideTree::compile(tree, geometry).unwrap();
    let (mut t, mut prim_id) = (vec![0.0; rays.len()], vec![0; rays.len()]);
    let mut hit = vec![false; rays.len()];
    let mut reports = Vec::new();
    for level in Level::ALL {
        let Some(caster) = BatchCaster::new(&wide, geometry).with_level(level) else { continue };
        let closest = caster.closest_hit_into(rays, &mut t, &mut prim_id);
        let occluded = caster.occluded_into(rays, &mut hit);
        for report in [closest, occluded] {
            let all = report.beam_rays + report.wave_rays;
            assert_eq!(all, rays.len() as u64, "{} {report:?}", level.name());
        }
        let wave = caster.with_beams(false);
        assert_eq!(wave.closest_hit_into(rays, &mut t, &mut prim_id).beam_rays, 0);
        reports.push([closest, occluded]);
    }
    reports[0]
}

/// The share of rays in beams.
fn share(report: BatchReport) -> f64 {
    report.beam_rays as f64 / (report.beam_rays + report.wave_rays).max(1) as f64
}

fn sub(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|i| a[i] - b[i])
}

/// Rays from an eye through a square of `side` by `side` points, row by row in tiles of four by four.
fn view(draw: &mut Draw, geometry: &Geometry, side: usize) -> Vec<Ray> {
    let middle = generic_ray(draw, &geometry.bounds());
    let length = middle.dir.iter().map(|d| d * d).sum::<f32>().sqrt();
    let step = length * draw.uniform(-9.0, -4.0).exp2() as f32;
    let across = draw.direction().map(|d| d * step);
    let other = draw.direction().map(|d| d * step);
    let pixel = |i: usize| {
        let (tile, at) = (i / 16, i % 16);
        let x = (tile % (side / 4) * 4 + at % 4) as f32 - side as f32 / 2.0;
        let y = (tile / (side / 4) * 4 + at / 4) as f32 - side as f32 / 2.0;
        let dir = std::array::from_fn(|a| middle.dir[a] + x * across[a] + y * other[a]);
        Ray::new(middle.origin, dir)
    };
    (0..side * side).map(pixel).collect()
}

/// Parallel rays: the same square, as origins.
fn parallel(draw: &mut Draw, geometry: &Geometry, side: usize) -> Vec<Ray> {
    let size = geometry.bounds().diagonal() as f32;
    let mut rays = view(draw, geometry, side);
    let dir = rays[0].dir;
    let origin = rays[0].origin;
    let length = dir.iter().map(|d| d * d).sum::<f32>().sqrt();
    for ray in &mut rays {
        let off = sub(ray.dir, dir).map(|x| x / length * size);
        ray.origin = std::array::from_fn(|a| origin[a] + off[a]);
        ray.dir = dir;
    }
    rays
}

/// From what the rays hit towards a light, which some reach and some pass.
fn shadows(draw: &mut Draw, geometry: &Geometry, rays: &[Ray]) -> Vec<Ray> {
    let light = generic_ray(draw, &geometry.bounds()).origin;
    let oracle = BruteForce { geometry };
    let end = [0.5, 0.9999, 1.0, 2.0][draw.below(4)];
    let from_hit = |ray: &Ray| {
        let hit = oracle.closest_hit(ray, &mut NoCounts)?;
        let at = ray.at(hit.t * 0.9999).map(|x| x as f32);
        let to = sub(light, at);
        let length = to.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>().sqrt();
        let dir = to.map(|x| (f64::from(x) / length) as f32);
        (length > 0.0).then(|| Ray::new(at, dir).with_range(0.0, (length * end) as f32))
    };
    rays.iter().filter_map(from_hit).collect()
}

/// Spoils some rays: other ranges, ends at a hit or beside it, invalid ones, other directions.
fn spoil(draw: &mut Draw, geometry: &Geometry, rays: &mut [Ray]) {
    let oracle = BruteForce { geometry };
    let invalid = invalid_rays();
    for ray in rays {
        let hit = oracle.closest_hit(ray, &mut NoCounts).map_or(1.0, |h| h.t);
        *ray = match draw.below(24) {
            0 => ray.with_range(hit, f32::INFINITY),
            1 => ray.with_range(hit.next_up(), f32::INFINITY),
            2 => ray.with_range(f32::NEG_INFINITY, hit),
            3 => ray.with_range(-1.0, hit.next_down()),
            4 => ray.with_range(0.0, hit * 2.0),
            5 => invalid[draw.below(invalid.len())],
            6 => Ray { dir: ray.dir.map(|d| -d), ..*ray },
            7 => Ray { dir: ray.dir.map(|d| d * 3.0), ..*ray },
            _ => *ray,
        };
    }
}

fn scene(draw: &mut Draw, kind: usize) -> Geometry {
    match kind {
        0 => scenes::soup(draw, 300, 1.0),
        1 => scenes::exponent_soup(draw, 120, -6.0, 6.0),
        2 => scenes::grid_soup(draw, 150, 4),
        3 => scenes::grid_quads(draw, 60, 4),
        4 => scenes::flat(draw, 50, 1),
        5 => scenes::offset(&scenes::soup(draw, 200, 1.0), [1e4, -3e4, 2e4]),
        _ => scenes::soup(draw, 1 + draw.clone().below(3), 1.0),
    }
}
const SCENES: usize = 7;

fn tree(draw: &mut Draw, geometry: &Geometry) -> BspTree {
    let shape = TreeShape { max_depth: 6 + draw.below(16), ..TreeShape::default() };
    random_tree(draw, geometry, shape).unwrap()
}

#[test]
fn views_parallel_rays_and_shadows_equal_brute_force() {
    let mut shares = [0.0; 3];
    let rounds = 4;
    for round in 0..rounds * SCENES {
        let mut draw = Draw::new(100 + round as u64);
        let geometry = scene(&mut draw, round % SCENES);
        let tree = tree(&mut draw, &geometry);
        let view = view(&mut draw, &geometry, 24);
        let parallel = parallel(&mut draw, &geometry, 24);
        let shadows = shadows(&mut draw, &geometry, &view);
        for (mut rays, sum) in [view, parallel, shadows].into_iter().zip(&mut shares) {
            let [closest, occluded] = check(&geometry, &tree, &rays);
            *sum += 0.5 * (share(closest) + share(occluded)) / (rounds * SCENES) as f64;
            spoil(&mut draw, &geometry, &mut rays);
            check(&geometry, &tree, &rays);
        }
    }
    // Views through a plane in which a component changes sign, and groups wider than the tree is
    // coarse, go to the wave; some views see nothing and cast no shadow rays.
    assert!(shares[0] > 0.6 && shares[1] > 0.6 && shares[2] > 0.2, "{shares:?}");
}

#[test]
fn rays_along_axes_in_planes_and_through_lattice_points() {
    let mut in_beams = 0;
    for round in 0..8 {
        let mut draw = Draw::new(200 + round);
        let geometry = scene(&mut draw, 2 + round as usize % 3);
        let tree = tree(&mut draw, &geometry);
        let bench = Bench::new(geometry.clone().into(), tree.clone().into());
        let values = coordinates(&bench);
        let mut rays = Vec::new();
        for axis in 0..3 {
            for sign in [1.0, -1.0] {
                // Parallel to an axis, from lattice points and from the planes of the tree.
                let mut dir = [0.0; 3];
                dir[axis] = sign;
                let mut lattice = |i: usize, a: usize| {
                    let x = (if a == (axis + 1) % 3 { i % 9 } else { i / 9 }) as f32 - 4.0;
                    if draw.chance(0.5) { values[a][draw.below(values[a].len())] } else { x }
                };
                for i in 0..81 {
                    let mut origin = std::array::from_fn(|a| lattice(i, a));
                    origin[axis] = -6.0 * sign;
                    rays.push(Ray::new(origin, dir));
                }
                // From one lattice point through others, one component zero in all of them.
                let mut eye = draw.grid_point(3);
                eye[axis] = -9.0 * sign;
                for i in 0..64 {
                    let mut to = eye;
                    to[axis] = 8.0 * sign;
                    to[(axis + 1) % 3] += (i % 8) as f32;
                    to[(axis + 2) % 3] += if round % 2 == 0 { 0.0 } else { (i / 8) as f32 };
                    rays.push(Ray::new(eye, sub(to, eye)));
                }
            }
        }
        in_beams += check(&geometry, &tree, &rays)[0].beam_rays;
    }
    // Most of these groups are as wide as the scene.
    assert!(in_beams > 1_000, "{in_beams} rays in beams");
}

#[test]
fn incoherent_rays_are_left_to_the_wave() {
    let mut draw = Draw::new(300);
    let geometry = scenes::soup(&mut draw, 300, 1.0);
    let tree = tree(&mut draw, &geometry);
    let bounds = geometry.bounds();
    let rays: Vec<_> = (0..2_000).map(|_| generic_ray(&mut draw, &bounds)).collect();
    assert_eq!(check(&geometry, &tree, &rays).map(|r| r.beam_rays), [0, 0]);
    // From one point into all directions, and from all points of a cube into like directions.
    let dirs = (0..2_000).map(|_| Ray::new([0.5; 3], draw.direction()));
    let mut rays: Vec<_> = dirs.collect();
    let origins = (0..2_000).map(|_| {
        let jitter = draw.direction().map(|d| 0.05 * d);
        Ray::new(draw.point_in(&bounds), [0.3 + jitter[0], 0.4 + jitter[1], 1.0 + jitter[2]])
    });
    rays.extend(origins);
    assert_eq!(check(&geometry, &tree, &rays).map(|r| r.beam_rays), [0, 0]);
    // Too few to be a group.
    let view = view(&mut draw, &geometry, 8);
    for count in 1..4 {
        assert_eq!(check(&geometry, &tree, &view[..count]).map(|r| r.beam_rays), [0, 0]);
    }
}

/// Few rays of each sixteen look elsewhere, as behind a silhouette: together they are worth a beam.
#[test]
fn unlike_rays_share_packets() {
    for round in 0..6 {
        let mut draw = Draw::new(600 + round);
        let geometry = scenes::soup(&mut draw, 200, 1.0);
        let tree = tree(&mut draw, &geometry);
        let eye = draw.point_in(&geometry.bounds());
        let [one, other] = [draw.direction(), draw.direction()];
        let looks = |dir: [f32; 3], draw: &mut Draw| {
            let off = draw.direction().map(|d| 0.01 * d);
            Ray::new(eye, std::array::from_fn(|a| dir[a] + off[a]))
        };
        // Of 1,000 rays, so that the last group is not full.
        let few = |i: usize| matches!(i % 16, 2 | 7 | 11);
        let rays = (0..1_000).map(|i| looks(if few(i) { one } else { other }, &mut draw));
        let rays: Vec<Ray> = rays.collect();
        let [closest, occluded] = check(&geometry, &tree, &rays);
        assert!(share(closest) > 0.9 && share(occluded) > 0.9, "{closest:?} {occluded:?}");
    }
}

#[test]
fn groups_that_diverge_are_given_up_or_split() {
    let mut draw = Draw::new(400);
    let mut geometry = Geometry::new();
    for _ in 0..20_000 {
        let center = draw.direction();
        let corner = |d: &mut Draw| center.map(|c| (f64::from(c) + d.uniform(-0.01, 0.01)) as f32);
        let vertices = std::array::from_fn(|_| corner(&mut draw));
        geometry.push(Triangle { vertices }, Sides::Both).unwrap();
    }
    let (tree, _) = ropewalk::build::build_default(&geometry).unwrap();
    let wide = WideTree::compile(&tree, &geometry).unwrap();
    let eye = [-1.8, 0.1, 0.1];
    // Narrow groups of 256 rays and wide ones in turn.
    let dir =
        |d: &mut Draw, width| [1.0, d.uniform(0.0, width) as f32, -d.uniform(0.0, width) as f32];
    let width = |i: usize| if (i / 256).is_multiple_of(2) { 0.002 } else { 0.2 };
    let rays: Vec<_> = (0..8_192).map(|i| Ray::new(eye, dir(&mut draw, width(i)))).collect();
    for level in Level::ALL {
        let Some(caster) = BatchCaster::new(&wide, &geometry).with_level(level) else { continue };
        let caster = caster.with_threads(1);
        let (mut t, mut prim_id) = (vec![0.0; rays.len()], vec![0; rays.len()]);
        let report = caster.closest_hit_into(&rays, &mut t, &mut prim_id);
        assert!(
            report.given_up > 0 && report.wave_rays > 2_000 && report.beam_rays > 2_000,
            "{report:?}"
        );
        let wave = caster.with_beams(false).closest_hit(&rays);
        assert_eq!((wave.t, wave.prim_id), (t, prim_id), "{}", level.name());
    }
}

#[test]
fn leaves_of_many_blocks() {
    let mut draw = Draw::new(500);
    for count in [1, 8, 9, 113, 400] {
        let geometry = scenes::soup(&mut draw, count, 1.0);
        let refs: Vec<u32> = (0..count as u32).collect();
        let nodes = vec![Node::leaf(0, count as u32)];
        let tree = BspTree::from_nodes(geometry.bounds(), nodes, refs).unwrap();
        let rays = view(&mut draw, &geometry, 16);
        check(&geometry, &tree, &rays);
    }
}

/// An eye in the planes of primitives, cuts and the scene's box: hits lie within rounding of 0.
#[test]
fn eyes_in_planes_change_nothing() {
    let mut in_beams = 0.0;
    for round in 0..10 {
        let mut draw = Draw::new(90 + round);
        let geometry = scenes::grid_quads(&mut draw, 60, 4);
        let tree = random_tree(&mut draw, &geometry, TreeShape::default()).unwrap();
        for _ in 0..6 {
            let mut rays = view(&mut draw, &geometry, 16);
            let mut eye = draw.point_in(&geometry.bounds());
            eye[draw.below(3)] = draw.below(9) as f32 - 4.0;
            let low = [0.0, -1.0, f32::NEG_INFINITY][draw.below(3)];
            for ray in &mut rays {
                *ray = Ray { origin: eye, ..*ray }.with_range(low, f32::INFINITY);
            }
            let [closest, _] = check(&geometry, &tree, &rays);
            in_beams += share(closest);
        }
    }
    assert!(in_beams > 10.0, "{in_beams}");
}
