//! On every database, every method answers exactly as brute force does, and so does the batch kernel.

use ropewalk::build::build;
use ropewalk::kernel::BatchCaster;
use ropewalk::method::Method;
use ropewalk::primitive::Primitive;
use ropewalk::traverse::{BruteForce, NoCounts, RayCaster};
use ropewalk::wide::WideTree;
use ropewalk::{Accelerator, Geometry, Hit, Ray};
use ropewalk_scene::Scene;
use ropewalk_scene::spd::{Spd, generate};
use ropewalk_testkit::rays::{Draw, generic_ray};
use std::sync::Arc;

/// Generic rays, and rays between corners of primitives' boxes: through vertices, along edges and
/// planes, and often parallel to an axis.
fn rays(geometry: &Geometry, draw: &mut Draw) -> Vec<Ray> {
    let bounds = geometry.bounds();
    let corner = |draw: &mut Draw| -> [f32; 3] {
        let b = geometry.shape(draw.below(geometry.len()) as u32).bounds();
        std::array::from_fn(|a| if draw.chance(0.5) { b.min[a] } else { b.max[a] })
    };
    let mut rays = Vec::new();
    for _ in 0..60 {
        rays.push(generic_ray(draw, &bounds));
        let (from, to) = (corner(draw), corner(draw));
        rays.push(Ray::new(from, std::array::from_fn(|a| to[a] - from[a])));
        let mut dir = [0.0; 3];
        dir[draw.below(3)] = if draw.chance(0.5) { 1.0 } else { -1.0 };
        rays.push(Ray::new(corner(draw), dir));
    }
    rays
}

fn every_method_equals_brute_force(spd: Spd, size: u32) {
    let mut scene = Scene::default();
    generate(spd, size, &mut scene).unwrap();
    let geometry = Arc::new(scene.geometry(spd.facet_policy()).unwrap());
    let rays = rays(&geometry, &mut Draw::new(spd as u64));
    let oracle = BruteForce { geometry: &geometry };
    let expected: Vec<_> = rays.iter().map(|r| oracle.closest_hit(r, &mut NoCounts)).collect();
    for method in Method::all() {
        let Some(settings) = &method.build else { continue };
        let (tree, _) = build(&geometry, settings, &()).unwrap();
        let tree = Arc::new(tree);
        let engine = Accelerator::new(geometry.clone(), tree.clone(), method.walk).unwrap();
        for (ray, expected) in rays.iter().zip(&expected) {
            let name = method.name;
            let hit = engine.closest_hit(ray, &mut NoCounts);
            assert_eq!(hit, *expected, "{spd} {size}, {name}: {ray:?}");
            let blocked = engine.occluded(ray, &mut NoCounts);
            assert_eq!(blocked, expected.is_some(), "{spd} {size}, {name}: {ray:?}");
        }
        if method.name == Method::DEFAULT {
            let wide = WideTree::compile(&tree, &geometry).unwrap();
            assert_eq!(wide.validate(&tree, &geometry), Ok(()));
            check_batch(&BatchCaster::new(&wide, &geometry), &rays, &expected);
        }
    }
}

fn check_batch(caster: &BatchCaster, rays: &[Ray], expected: &[Option<Hit>]) {
    let hits = caster.closest_hit(rays);
    for (i, expected) in expected.iter().enumerate() {
        let expected = expected.map_or((f32::INFINITY, u32::MAX), |h| (h.t, h.prim_id));
        assert_eq!((hits.t[i], hits.prim_id[i]), expected, "{:?}", rays[i]);
    }
}

/// One test a database, so that they run side by side; some hundred objects each.
macro_rules! databases {
    ($($test:ident: $spd:ident $size:literal),* $(,)?) => {$(
        #[test]
        fn $test() {
            every_method_equals_brute_force(Spd::$spd, $size);
        }
    )*};
}

databases! {
    balls: Balls 2,
    gears: Gears 1,
    mount: Mount 3,
    rings: Rings 2,
    teapot: Teapot 3,
    tetra: Tetra 4,
    tree: Tree 6,
    lattice: Lattice 4,
    jacks: Jacks 2,
    shells: Shells 1,
    sombrero: Sombrero 1,
}
