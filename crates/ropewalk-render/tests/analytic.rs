//! Scenes whose pictures and ray counts are known in closed form.

mod common;

use common::{GLASS, MATTE, MIRROR, Stage};
use ropewalk::Sides;
use ropewalk_render::{RayKind, RenderSettings, record_rays};
use ropewalk_scene::Material;

/// One pixel, whose centre ray runs along `+y`.
const ONE: RenderSettings = RenderSettings {
    size: Some([1, 1]),
    samples_per_pixel: 1,
    spd_rules: false,
    max_depth: 5,
    threads: Some(1),
    count_traversal: true,
    aov: true,
};

/// Positions are computed in f64 from t rounded to f32: relative 2^-24, amplified by the normals
/// of the small spheres here and the exponent of the highlight (at most 8).
const SHADING_TOLERANCE: f32 = 1e-5;

fn assert_color(got: [f32; 3], want: [f64; 3]) {
    let close = |a: usize| (f64::from(got[a]) - want[a]).abs() < f64::from(SHADING_TOLERANCE);
    assert!((0..3).all(close), "got {got:?}, expected {want:?}");
}

#[test]
fn background_fills_an_empty_scene() {
    let out = Stage::new(7, 5).render(&RenderSettings::default());
    assert!(out.image.pixels().iter().all(|&p| p == [0.25, 0.5, 0.75]));
    assert_eq!((out.counts.primary, out.counts.total()), (35, 35));
}

/// A wall seen head on from distance 2, lit from the eye's side at 45 degrees: ambient Kd/2,
/// diffuse Kd cos 45 / 2, no highlight since R.V = cos 45 to the power 2 = 1/2 times Ks.
#[test]
fn one_light_follows_phong() {
    let material = Material { color: [1.0, 0.5, 0.25], kd: 0.6, ks: 0.4, shine: 2.0, ..MATTE };
    let stage = Stage::new(1, 1).light([2.0, 0.0, 0.0], None).wall(2.0, material, Sides::Front);
    let out = stage.render(&RenderSettings { max_depth: 1, ..ONE });
    let diffuse = 0.5 * 0.6 * (1.0 + 0.5f64.sqrt());
    let highlight = 0.5 * 0.4 * 0.5;
    let want = [1.0, 0.5, 0.25].map(|c| c * diffuse + highlight);
    assert_color(out.image.pixel(0, 0), want);
}

#[test]
fn sphere_under_one_light() {
    let stage = Stage::new(1, 1).light([0.0, 0.0, 2.0], None).sphere(
        [0.0, 3.0, 0.0],
        1.0,
        Material { color: [0.2, 0.4, 0.8], ..MATTE },
        Sides::Front,
    );
    let out = stage.render(&ONE);
    // Hit at (0, 2, 0), normal -y, direction to the light (0, -1, 1) / sqrt 2.
    let light = 0.5 * (1.0 + 0.5f64.sqrt());
    assert_color(out.image.pixel(0, 0), [0.2 * light, 0.4 * light, 0.8 * light]);
    let aov = out.aov.expect("asked for");
    assert_eq!(aov.depth[0], 2.0);
    assert_eq!(aov.normal[0], [0.0, -1.0, 0.0]);
    assert_eq!((aov.tests[0], out.traversal.intersection_tests), (2.0, 2));
    assert_eq!((out.counts.shadow, out.counts.shadow_hits), (1, 0));
}

/// A colour is the light's intensity; without one it is sqrt(L) / (2 L).
#[test]
fn lights_have_their_colour_or_the_relative_intensity() {
    let at = [0.0, -1.0, 0.0];
    let stage = Stage::new(1, 1).light(at, Some([0.1, 0.2, 0.3])).light(at, None).wall(
        1.0,
        MATTE,
        Sides::Front,
    );
    let own = 2f64.sqrt() / 4.0;
    let want = [0.1, 0.2, 0.3].map(|c| c + own + own);
    assert_color(stage.render(&ONE).image.pixel(0, 0), want);
}

#[test]
fn mirror_shows_what_is_behind_the_eye() {
    let stage =
        Stage::new(1, 1).light([0.0, -1.0, 0.0], None).wall(2.0, MIRROR, Sides::Front).triangle(
            [[50.0, -3.0, -50.0], [-50.0, -3.0, -50.0], [0.0, -3.0, 50.0]],
            Material { color: [0.0, 1.0, 0.0], ..MATTE },
            Sides::Front,
        );
    let out = stage.render(&ONE);
    // The highlight of the mirror (R.V = 1, intensity 1/2) and the green wall, ambient and lit.
    assert_color(out.image.pixel(0, 0), [0.5, 1.0 + 0.5, 0.5]);
    assert_eq!((out.counts.reflection, out.counts.reflection_hits), (1, 1));
    assert_eq!((out.counts.refraction, out.counts.shadow), (0, 2));
}

/// Between two mirrors the depth alone ends the tree.
#[test]
fn depth_limits_the_tree() {
    let stage = Stage::new(1, 1).wall(1.0, MIRROR, Sides::Both).wall(-1.0, MIRROR, Sides::Both);
    for max_depth in 1..=6 {
        let counts = stage.render(&RenderSettings { max_depth, ..ONE }).counts;
        assert_eq!(counts.reflection, u64::from(max_depth) - 1);
        assert_eq!(counts.reflection_hits, counts.reflection);
    }
}

/// A ray that enters a glass ball off its centre is bent by Snell's law at the front.
#[test]
fn refraction_bends_by_snell() {
    let stage = Stage::new(1, 1).sphere([0.6, 3.0, 0.0], 1.0, GLASS, Sides::Both);
    let caster = common::EveryPrimitive(&stage.geometry);
    let settings = RenderSettings { max_depth: 3, ..ONE };
    let set = record_rays(&stage.scene, &stage.geometry, &caster, &settings, 100).expect("good");
    let inner: Vec<_> = set.rays.iter().filter(|r| r.kind == RayKind::Refraction).collect();
    // Enters at sin(a) = 0.6, runs at sin(b) = 0.4: turned from the axis by a - b towards the
    // centre line, leaves turned by 2 (a - b).
    let turn = 0.6f64.asin() - 0.4f64.asin();
    let sine = |r: &ropewalk_render::RecordedRay| f64::from(r.ray.dir[0]);
    assert!((sine(inner[0]) - turn.sin()).abs() < 1e-6, "{:?}", inner[0]);
    assert!((sine(inner[1]) - (2.0 * turn).sin()).abs() < 1e-6, "{:?}", inner[1]);
    // One pair at the front; one at the back, where depth 3 ends.
    assert_eq!((set.counts.reflection, set.counts.refraction), (2, 2));
}

/// From inside glass a wall met at 60 degrees (critical angle 41.8) reflects only.
#[test]
fn total_internal_reflection_spawns_no_refraction() {
    let tilted = |degrees: f64| {
        let (s, c) = degrees.to_radians().sin_cos();
        // The plane through (0, 2, 0) whose normal makes `degrees` with +y: seen from behind.
        let at = |u: f64, v: f64| [u * c, 2.0 - u * s, v];
        let stage = Stage::new(1, 1).triangle(
            [at(90.0, -90.0), at(-90.0, -90.0), at(0.0, 90.0)],
            GLASS,
            Sides::Both,
        );
        stage.render(&ONE).counts
    };
    let (steep, grazing) = (tilted(30.0), tilted(60.0));
    assert_eq!((steep.reflection, steep.refraction), (1, 1));
    assert_eq!((grazing.reflection, grazing.refraction), (1, 0));
}

/// Shadow rays go to the lights that the surface faces, on the viewer's side, blocked or not.
#[test]
fn shadow_rays_go_to_the_lights_in_front() {
    let stage = Stage::new(1, 1)
        .light([5.0, 0.0, 0.0], None)
        .light([0.0, 9.0, 0.0], None)
        .light([-5.0, 0.0, 0.0], None)
        .wall(2.0, MATTE, Sides::Front)
        .sphere([-2.0, 1.2, 0.0], 0.5, MATTE, Sides::Front);
    let counts = stage.render(&ONE).counts;
    assert_eq!((counts.shadow, counts.shadow_hits), (2, 1));
}

#[test]
fn light_behind_the_light_does_not_block() {
    let stage = Stage::new(1, 1)
        .light([0.5, 0.0, 0.0], None)
        .wall(2.0, MATTE, Sides::Front)
        .sphere([1.0, -2.0, 0.0], 0.5, MATTE, Sides::Both);
    let counts = stage.render(&ONE).counts;
    assert_eq!((counts.shadow, counts.shadow_hits), (1, 0));
}

#[test]
fn one_sided_surfaces_are_culled_from_behind() {
    let behind = Stage::new(1, 1).wall(2.0, MATTE, Sides::Back).render(&ONE);
    assert_eq!(behind.counts.primary_hits, 0);
    assert_eq!(behind.image.pixel(0, 0), [0.25, 0.5, 0.75]);
    let before = Stage::new(1, 1).wall(2.0, MATTE, Sides::Front).render(&ONE);
    assert_eq!(before.counts.primary_hits, 1);
}

/// Rays that leave a surface do not meet it again, at any scale and under grazing light: a lit
/// sphere without anything else has no shadow on its lit side, a mirror ball sees only background.
#[test]
fn no_surface_shadows_or_mirrors_itself() {
    for scale in [1e-3, 1.0, 1e3, 1e6] {
        let center = [0.3 * scale, 4.0 * scale, 0.2 * scale];
        let shiny = Material { kd: 0.5, ks: 0.5, ..MATTE };
        let stage = Stage::new(128, 128)
            .light([7.0 * scale, 4.0 * scale, 0.0], None)
            .light([-2.0 * scale, 90.0 * scale, 3.0 * scale], None)
            .sphere(center, 2.5 * scale, shiny, Sides::Both);
        let counts = stage.render(&RenderSettings::spd()).counts;
        assert!(counts.primary_hits > 1000 && counts.shadow > 500, "{counts:?}");
        assert_eq!((counts.shadow_hits, counts.reflection_hits), (0, 0), "scale {scale}");
    }
}

#[test]
fn spd_rules_shoot_through_every_corner() {
    let out = Stage::new(512, 512)
        .sphere([0.0, 3.0, 0.0], 1.0, MATTE, Sides::Front)
        .render(&RenderSettings::spd());
    assert_eq!(out.counts.primary, 513 * 513);
    assert_eq!((out.image.width(), out.image.height()), (512, 512));
}

/// With the boundary of a half plane along pixel corners, a corner-averaged pixel beside it mixes
/// both sides half and half.
#[test]
fn pixels_average_their_four_corners() {
    // Covers x < 0.3 at distance 1: of 8 pixels over -1..1, corner columns 0..=5 hit.
    let stage = Stage::new(8, 8).triangle(
        [[-50.0, 1.0, -50.0], [0.3, 1.0, -50.0], [0.3, 1.0, 5000.0]],
        Material { kd: 0.0, ..MATTE },
        Sides::Both,
    );
    let out = stage.render(&RenderSettings::spd());
    assert_eq!(out.counts.primary_hits, 6 * 9);
    assert_eq!(out.image.pixel(4, 3), [0.0; 3]);
    assert_eq!(out.image.pixel(5, 3), [0.125, 0.25, 0.375]);
    assert_eq!(out.image.pixel(6, 3), [0.25, 0.5, 0.75]);
}
