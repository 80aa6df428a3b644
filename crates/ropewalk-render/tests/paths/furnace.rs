//! White surfaces in even light cannot be told from it.

use crate::common::*;
use ropewalk_render::path::PathSettings;
use ropewalk_scene::stage::Material;

/// Share of energy that may be lost or gained.
const TOLERANCE: f64 = 0.005;

fn energy(material: Material) -> f64 {
    let mut stage = stage(vec![material]);
    add_sphere(&mut stage, [0.0; 3], 1.0, 48, false, 0);
    // The sphere fills 0.9 of the view's half: grazing angles are seen, the surroundings are not.
    let camera = camera([0.0, -4.0, 0.5], [0.0; 3], 18.0, [48, 48]);
    let settings = PathSettings { samples: 128, max_depth: 1024, ..Default::default() };
    mean(&expose(&world(stage, &even_light(1.0)), &camera, &settings))
}

fn check(name: &str, material: Material) {
    let energy = energy(Material { base_color: [1.0; 3], ..material });
    assert!((energy - 1.0).abs() < TOLERANCE, "{name}: {energy}");
}

#[test]
fn matte_and_coated_surfaces_lose_nothing() {
    check("matte", matte(1.0));
    for roughness in [0.0, 0.1, 0.3, 0.6, 1.0] {
        check(&format!("coat {roughness}"), Material { roughness, ..Material::default() });
    }
    check("strong coat", Material { roughness: 0.25, ior: 2.4, ..Material::default() });
}

#[test]
fn metal_loses_nothing() {
    for roughness in [0.0, 0.05, 0.2, 0.5, 0.8, 1.0] {
        let metal = Material { metallic: 1.0, roughness, ..Material::default() };
        check(&format!("metal {roughness}"), metal);
    }
}

#[test]
fn glass_loses_nothing() {
    for (roughness, ior) in [(0.0, 1.5), (0.0, 1.0), (0.3, 1.0), (0.1, 1.5), (0.4, 1.5), (0.9, 1.3)]
    {
        let glass = Material { transmission: 1.0, roughness, ior, ..Material::default() };
        check(&format!("glass {roughness} {ior}"), glass);
    }
}

#[test]
fn mixtures_lose_nothing() {
    let half = Material { metallic: 0.5, roughness: 0.4, ..Material::default() };
    check("half metal", half);
    let milky = Material { transmission: 0.5, roughness: 0.0, ..Material::default() };
    check("half glass", milky);
    let all = Material { metallic: 0.3, transmission: 0.6, roughness: 0.35, ..Material::default() };
    check("all three", all);
}

/// The test can fail: what is not white is darker.
#[test]
fn grey_surfaces_lose_their_share() {
    assert!((energy(matte(0.5)) - 0.5).abs() < TOLERANCE);
    let gold = Material { metallic: 1.0, base_color: [0.5; 3], ..Material::default() };
    assert!(energy(gold) < 0.6);
}
