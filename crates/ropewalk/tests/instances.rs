//! Instances: every level answers bit for bit as brute force over all triangles of all instances does.

use ropewalk::build::{BuildSettings, Preset};
use ropewalk::double::{DoubleGeometry, DoubleRay};
use ropewalk::instance::{
    Instance, InstanceAllHits, InstanceBruteForce, InstanceCaster, InstanceError, InstanceHit,
    InstancedScene, Object, Transform, TransformError,
};
use ropewalk::kernel::Level;
use ropewalk_testkit::rays::Draw;
use std::sync::Arc;

fn uniform(draw: &mut Draw) -> [f64; 3] {
    std::array::from_fn(|_| draw.uniform(-1.0, 1.0))
}

fn object(vertices: Vec<[f64; 3]>, faces: Vec<[u32; 3]>) -> Arc<Object> {
    let geometry = DoubleGeometry::from_triangles(vertices, faces).unwrap();
    let settings = BuildSettings { threads: 1, ..BuildSettings::preset(Preset::Balanced) };
    Arc::new(Object::build(geometry, &settings, &()).unwrap().0)
}

/// Loose triangles about the origin.
fn soup(draw: &mut Draw, n: u32) -> Arc<Object> {
    let mut vertices = Vec::new();
    for _ in 0..n {
        let centre = uniform(draw);
        for _ in 0..3 {
            let offset = uniform(draw);
            vertices.push(std::array::from_fn(|a| centre[a] + 0.4 * offset[a]));
        }
    }
    object(vertices, (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
}

/// Two triangles in a plane: a box without thickness.
fn square() -> Arc<Object> {
    let corner = |x: f64, y: f64| [x, y, 0.0];
    let vertices = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    object(vertices, vec![[0, 1, 2], [0, 2, 3]])
}

fn transform(draw: &mut Draw, scale: f64, offset: f64) -> Transform {
    let (rows, at) = ([uniform(draw), uniform(draw), uniform(draw)], uniform(draw));
    let row = |a: usize| {
        let [x, y, z] = rows[a];
        [scale * x, scale * y, scale * z, offset + 4.0 * scale * at[a]]
    };
    Transform::new([row(0), row(1), row(2)]).unwrap_or(Transform::IDENTITY)
}

fn rays(draw: &mut Draw, scene: &InstancedScene, scale: f64, offset: f64) -> Vec<DoubleRay> {
    let mut rays = Vec::new();
    for i in 0..400 {
        let (from, mut dir) = (uniform(draw), uniform(draw));
        let mut origin = from.map(|x| offset + 6.0 * scale * x);
        let placed = &scene.instances()[draw.below(scene.instances().len())];
        let face = draw.below(placed.object.geometry.len()) as u32;
        let corners =
            placed.object.geometry.triangle(face).unwrap().map(|p| placed.transform.point(p));
        match i % 5 {
            0 => dir = std::array::from_fn(|a| corners[0][a] - origin[a]),
            1 => {
                let middle = |a: usize| (corners[0][a] + corners[1][a] + corners[2][a]) / 3.0;
                dir = std::array::from_fn(|a| middle(a) - origin[a]);
            }
            2 => origin = corners[1],
            // From so far that boxes do not help.
            3 => {
                let distance = 10f64.powf(draw.uniform(1.0, 4.0)) * (scale + offset);
                origin = std::array::from_fn(|a| corners[2][a] + distance * dir[a]);
                dir = dir.map(|x| -x);
            }
            _ => {}
        }
        let length = 10f64.powf(draw.uniform(-3.0, 3.0));
        let ray = DoubleRay::new(origin, dir.map(|x| x * length));
        rays.push(ray);
        rays.push(ray.with_range(f64::NEG_INFINITY, f64::INFINITY));
        if let Some(hit) = (InstanceBruteForce { scene }).closest_hit(&ray) {
            rays.push(ray.with_range(0.0, hit.t));
            rays.push(ray.with_range(hit.t, 2.0 * hit.t));
        }
    }
    rays.push(DoubleRay::new([f64::NAN; 3], [1.0; 3]));
    rays.push(DoubleRay::new([1e300; 3], [-1.0; 3]));
    rays.push(DoubleRay::new([offset; 3], [0.0; 3]));
    rays
}

fn check(scene: &InstancedScene, rays: &[DoubleRay]) -> usize {
    let oracle = InstanceBruteForce { scene };
    let every: Vec<Vec<InstanceHit>> = rays.iter().map(|ray| oracle.all_hits(ray)).collect();
    for level in Level::ALL {
        let Some(caster) = InstanceCaster::new(scene).with_level(level) else { continue };
        let (closest, occluded) = (caster.closest_hit(rays), caster.occluded(rays));
        let (all, first) = (caster.all_hits(rays), caster.first_hits(rays, 2));
        let counts = caster.count_hits(rays);
        for (i, ray) in rays.iter().enumerate() {
            let name = level.name();
            let hit = InstanceHit {
                t: closest.t[i],
                instance: closest.instance[i],
                prim_id: closest.prim_id[i],
            };
            let none = InstanceHit { t: f64::INFINITY, instance: u32::MAX, prim_id: u32::MAX };
            assert_eq!(hit, *every[i].first().unwrap_or(&none), "{name} closest {i}, {ray:?}");
            assert_eq!(occluded[i], !every[i].is_empty(), "{name} occluded {i}, {ray:?}");
            let row = |of: &InstanceAllHits| -> Vec<InstanceHit> {
                let hit = |j: usize| {
                    let (t, instance) = (of.t[j], of.instance[j]);
                    InstanceHit { t, instance, prim_id: of.prim_id[j] }
                };
                (of.offsets[i]..of.offsets[i + 1]).map(hit).collect()
            };
            assert_eq!(row(&all), every[i], "{name} all {i}, {ray:?}");
            assert_eq!(counts[i] as usize, every[i].len(), "{name} count {i}, {ray:?}");
            let two = &every[i][..every[i].len().min(2)];
            assert_eq!(row(&first), two, "{name} first {i}, {ray:?}");
        }
    }
    every.iter().filter(|hits| !hits.is_empty()).count()
}

#[test]
fn instances_equal_brute_force() {
    for (round, (scale, offset)) in
        [(1.0, 0.0), (1e-4, 0.0), (1e5, 0.0), (1.0, 1e6), (10.0, 1e7)].into_iter().enumerate()
    {
        let mut draw = Draw::new(200 + round as u64);
        let objects = [soup(&mut draw, 30), soup(&mut draw, 5), square()];
        let mut instances: Vec<Instance> = (0..12)
            .map(|i| Instance {
                object: objects[i % 3].clone(),
                transform: transform(&mut draw, scale, offset),
            })
            .collect();
        // The same thing twice in the same place: ties.
        instances.push(instances[0].clone());
        instances.insert(0, instances[5].clone());
        let scene = InstancedScene::new(instances, 1).unwrap();
        let rays = rays(&mut draw, &scene, scale, offset);
        let hit = check(&scene, &rays);
        assert!(hit > rays.len() / 10, "{hit} of {} rays hit at {scale:e}", rays.len());
    }
}

#[test]
fn threads_and_long_batches_change_nothing() {
    let mut draw = Draw::new(300);
    let objects = [soup(&mut draw, 40), square()];
    let instances: Vec<Instance> = (0..40)
        .map(|i| Instance {
            object: objects[i % 2].clone(),
            transform: transform(&mut draw, 1.0, 0.0),
        })
        .collect();
    let scene = InstancedScene::new(instances, 1).unwrap();
    let rays: Vec<DoubleRay> = (0..40_000)
        .map(|_| {
            let (from, dir) = (uniform(&mut draw), uniform(&mut draw));
            DoubleRay::new(from.map(|x| 6.0 * x), dir)
        })
        .collect();
    let (one, all) = (InstanceCaster::new(&scene).with_threads(1), InstanceCaster::new(&scene));
    assert_eq!(one.closest_hit(&rays), all.closest_hit(&rays));
    assert_eq!(one.occluded(&rays), all.occluded(&rays));
    assert_eq!(one.all_hits(&rays), all.all_hits(&rays));
    assert_eq!(one.count_hits(&rays), all.count_hits(&rays));
    let closest = one.closest_hit(&rays);
    let oracle = InstanceBruteForce { scene: &scene };
    for i in (0..rays.len()).step_by(97) {
        let expected = oracle.closest_hit(&rays[i]).map_or(f64::INFINITY, |hit| hit.t);
        assert_eq!(closest.t[i], expected);
    }
}

#[test]
fn a_filter_sees_instances() {
    let mut draw = Draw::new(310);
    let object = soup(&mut draw, 20);
    let instances: Vec<Instance> = (0..6)
        .map(|_| Instance { object: object.clone(), transform: transform(&mut draw, 1.0, 0.0) })
        .collect();
    let scene = InstancedScene::new(instances, 1).unwrap();
    let rays = rays(&mut draw, &scene, 1.0, 0.0);
    let odd = |ray: usize, hit: &InstanceHit| (ray as u32 + hit.instance + hit.prim_id) % 2 == 1;
    let hits = InstanceCaster::new(&scene).with_filter(odd).all_hits(&rays);
    let oracle = InstanceBruteForce { scene: &scene };
    for (i, ray) in rays.iter().enumerate() {
        let expected: Vec<f64> =
            oracle.all_hits(ray).iter().filter(|hit| odd(i, hit)).map(|hit| hit.t).collect();
        assert_eq!(hits.t[hits.offsets[i]..hits.offsets[i + 1]], expected, "{ray:?}");
    }
}

#[test]
fn points_and_normals_follow_the_transform() {
    let transform =
        Transform::new([[0.0, -2.0, 0.0, 5.0], [2.0, 0.0, 0.0, 6.0], [0.0, 0.0, 3.0, 7.0]]);
    let transform = transform.unwrap();
    assert_eq!(transform.point([1.0, 2.0, 3.0]), [1.0, 8.0, 16.0]);
    assert_eq!(transform.normal([1.0, 0.0, 0.0]), [0.0, 1.0, 0.0]);
    let slanted = [0.0, -(0.5f64.sqrt()), 0.5f64.sqrt()];
    let [x, y, z] = transform.normal(slanted);
    // Twice as wide and three times as high.
    assert!(y == 0.0 && (z / x - 2.0 / 3.0).abs() < 1e-15 && x > 0.0, "{x} {y} {z}");
}

#[test]
fn bad_transforms_and_empty_scenes() {
    let row = [1.0, 0.0, 0.0, 0.0];
    let error = Transform::new([row, row, [0.0, 0.0, 1.0, 0.0]]).unwrap_err();
    assert!(matches!(error, TransformError::Singular { .. }), "{error}");
    assert!(matches!(Transform::new([[0.0; 4]; 3]), Err(TransformError::Singular { .. })));
    let mut rows = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
    for bad in [f64::NAN, f64::INFINITY, 1e101] {
        rows[1][3] = bad;
        let error = Transform::new(rows).unwrap_err();
        assert!(error.to_string().starts_with("row 1, column 3"), "{error}");
    }
    for tiny in [1e-90, 1e90] {
        let scaled = rows.map(|row| [row[0] * tiny, row[1] * tiny, row[2] * tiny, 0.0]);
        assert!(Transform::new(scaled).is_ok(), "{tiny:e}");
    }
    let empty = InstancedScene::new(Vec::new(), 1).unwrap();
    let ray = DoubleRay::new([0.0; 3], [1.0; 3]);
    assert_eq!(InstanceCaster::new(&empty).closest_hit(&[ray]).prim_id, [u32::MAX]);
    assert!(empty.bounds().is_none());
    rows[1][3] = 1e100;
    let far = Instance { object: square(), transform: Transform::new(rows).unwrap() };
    let error = InstancedScene::new(vec![far], 1).err().unwrap();
    assert!(matches!(error, InstanceError::TooLarge { instance: 0 }), "{error}");
}
