//! Closed forms.

use crate::common::*;
use ropewalk_render::path::{Lens, PathSettings};
use ropewalk_scene::stage::{Light, Material};
use std::f64::consts::PI;

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| a[i] - b[i])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| a[i] * b[i]).sum()
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn unit(a: [f64; 3]) -> [f64; 3] {
    a.map(|x| x / dot(a, a).sqrt())
}

/// A matte sphere under a point light: radiance is `albedo / pi * I cos / d^2`.
#[test]
fn sphere_under_a_point_light() {
    let mut stage = stage(vec![matte(0.6)]);
    add_sphere(&mut stage, [0.0; 3], 1.0, 256, true, 0);
    let light = [2.0, -3.0, 2.5];
    stage.lights = vec![Light::Point { position: light, intensity: [10.0; 3] }];
    let n = 64;
    // From far away, as good as parallel rays: the picture is 2.2 across at the centre.
    let distance = 2000.0;
    let angle = 2.0 * (1.1f64 / distance).atan().to_degrees();
    let camera = camera([0.0, -distance, 0.0], [0.0; 3], angle, [n, n]);
    let settings = PathSettings { samples: 64, max_depth: 2, ..Default::default() };
    let film = expose(&world(stage, &dark()), &camera, &settings);
    let mut compared = 0;
    for (i, pixel) in film.radiance().iter().enumerate() {
        let place = |k: u32| (f64::from(k) + 0.5) / f64::from(n) * 2.2 - 1.1;
        let (x, z) = (place(i as u32 % n), -place(i as u32 / n));
        let r2 = x * x + z * z;
        if r2 > 0.8 {
            continue;
        }
        let p = [x, -(1.0 - r2).sqrt(), z];
        let way = sub(light, p);
        let cosine = dot(unit(way), p);
        // Within a pixel of the terminator the mean over the pixel is another.
        if cosine < 0.15 {
            continue;
        }
        let expected = 0.6 / PI * 10.0 * cosine / dot(way, way);
        let found = f64::from(pixel[1]);
        assert!((found / expected - 1.0).abs() < 0.01, "{x} {z}: {found}, expected {expected}");
        compared += 1;
    }
    assert!(compared > 1000, "{compared}");
}

/// Irradiance by a polygon of even radiance (J. Lambert): `L / 2 * sum of angles times normals of the edges' planes`.
fn irradiance(polygon: &[[f64; 3]], point: [f64; 3], normal: [f64; 3], radiance: f64) -> f64 {
    let ways: Vec<_> = polygon.iter().map(|&p| unit(sub(p, point))).collect();
    let edge = |i: usize| {
        let (a, b) = (ways[i], ways[(i + 1) % ways.len()]);
        dot(a, b).acos() * dot(unit(cross(a, b)), normal)
    };
    0.5 * radiance * (0..ways.len()).map(edge).sum::<f64>().abs()
}

#[test]
fn direct_light_of_a_square() {
    let mut stage = stage(vec![matte(0.5), Material { two_sided: false, ..lamp(3.0) }]);
    add_quad(&mut stage, [-9.0, -9.0, 0.0], [18.0, 0.0, 0.0], [0.0, 18.0, 0.0], 0);
    // Looks down: its edges turn clockwise from above.
    let square = ([-0.5, 0.2, 1.5], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]);
    add_quad(&mut stage, square.0, square.1, square.2, 1);
    let made = world(stage, &dark());
    let settings = PathSettings { samples: 1024, max_depth: 2, ..Default::default() };
    for point in [[0.0, 0.0, 0.0], [1.5, -1.0, 0.0], [0.1, 0.7, 0.0], [-3.0, 2.0, 0.0]] {
        let eye = [point[0] + 0.1, point[1] - 1.0, 0.4];
        let film = expose(&made, &camera(eye, point, 0.05, [8, 8]), &settings);
        let corner = |s: f64, t: f64| [square.0[0] + t, square.0[1] + s, square.0[2]];
        let polygon = [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
        let expected = 0.5 / PI * irradiance(&polygon, point, [0.0, 0.0, 1.0], 3.0);
        let found = mean(&film);
        assert!((found / expected - 1.0).abs() < 0.005, "{point:?}: {found}, expected {expected}");
    }
    // From behind a one-sided lamp is dark.
    let above = camera([0.0, 0.7, 5.0], [0.0, 0.7, 0.0], 0.05, [4, 4]);
    assert_eq!(mean(&expose(&made, &above, &settings)), 0.0);
}

/// In a closed room whose walls all emit `E` and reflect `rho`, radiance is `E / (1 - rho)` everywhere.
#[test]
fn closed_rooms_of_even_walls() {
    let walls = Material { emission: [0.4; 3], ..matte(0.7) };
    let settings = PathSettings { samples: 64, max_depth: 256, ..Default::default() };
    for is_box in [true, false] {
        let mut stage = stage(vec![walls.clone()]);
        if is_box {
            add_box(&mut stage, [-1.0, -2.0, -0.5], [1.5, 1.0, 0.5], 0);
        } else {
            add_sphere(&mut stage, [0.0; 3], 1.0, 24, false, 0);
        }
        let camera = camera([0.1, -0.2, 0.1], [0.3, 0.8, 0.0], 90.0, [32, 32]);
        let found = mean(&expose(&world(stage, &dark()), &camera, &settings));
        let expected = 0.4 / (1.0 - 0.7);
        assert!((found / expected - 1.0).abs() < 0.005, "box {is_box}: {found}");
    }
}

/// Parallel light and a cone of light on a matte floor.
#[test]
fn lights_without_extent() {
    let settings = PathSettings { samples: 16, max_depth: 2, ..Default::default() };
    let seen = |light: Light, at: [f64; 3]| {
        let mut stage = stage(vec![matte(0.5)]);
        add_quad(&mut stage, [-9.0, -9.0, 0.0], [18.0, 0.0, 0.0], [0.0, 18.0, 0.0], 0);
        stage.lights = vec![light];
        let eye = [at[0], at[1] - 1.0, 3.0];
        mean(&expose(&world(stage, &dark()), &camera(eye, at, 0.01, [4, 4]), &settings))
    };
    let direction = unit([0.6, 0.0, -0.8]);
    let sun = Light::Directional { direction, irradiance: [2.0; 3] };
    assert!((seen(sun, [3.0, 1.0, 0.0]) / (0.5 / PI * 2.0 * 0.8) - 1.0).abs() < 1e-3);
    let spot = Light::Spot {
        position: [0.0, 0.0, 2.0],
        direction: [0.0, 0.0, -1.0],
        intensity: [8.0; 3],
        cone: [0.3, 0.5],
    };
    assert!((seen(spot, [0.0; 3]) / (0.5 / PI * 8.0 / 4.0) - 1.0).abs() < 1e-3);
    assert_eq!(seen(spot, [2.0 * 0.51f64.tan(), 0.0, 0.0]), 0.0);
    // Halfway between the cosines of both cones a quarter is left.
    let angle = (0.5 * (0.3f64.cos() + 0.5f64.cos())).acos();
    let at = [2.0 * angle.tan(), 0.0, 0.0];
    let full = 0.5 / PI * 8.0 * angle.cos().powi(3) / 4.0;
    assert!((seen(spot, at) / (0.25 * full) - 1.0).abs() < 2e-3);
}

/// A small lamp out of focus is an even disc: at the plane in focus its diameter is the aperture times
/// `|depth - focus| / depth`.
#[test]
fn circle_of_confusion() {
    let (aperture, focus) = (0.3, 4.0);
    for depth in [2.5, 4.0, 9.0] {
        let mut stage = stage(vec![lamp(1000.0)]);
        let half = 0.015 * depth / focus; // 2.4 pixels in focus
        let low = [-half, depth, -half];
        add_quad(&mut stage, low, [2.0 * half, 0.0, 0.0], [0.0, 0.0, 2.0 * half], 0);
        let n = 64u32;
        let width = 0.8; // of the picture at the plane in focus
        let angle = 2.0 * (0.5f64 * width / focus).atan().to_degrees();
        let camera = camera([0.0; 3], [0.0, 1.0, 0.0], angle, [n, n]);
        let lens = Lens { aperture, focus: Some(focus) };
        let settings = PathSettings { samples: 1024, max_depth: 1, lens, ..Default::default() };
        let film = expose(&world(stage, &dark()), &camera, &settings);
        let (mut sum, mut moment) = (0.0, 0.0);
        for (i, pixel) in film.radiance().iter().enumerate() {
            let place = |k: u32| ((f64::from(k) + 0.5) / f64::from(n) - 0.5) * width;
            let (x, z) = (place(i as u32 % n), place(i as u32 / n));
            sum += f64::from(pixel[0]);
            moment += f64::from(pixel[0]) * (x * x + z * z);
        }
        // An even disc has half the square of its radius as its second moment; pixels add theirs, and the lamp.
        let pixel = width / f64::from(n);
        let lamp = 2.0 * half * focus / depth;
        let found = (2.0 * (moment / sum - (pixel * pixel + lamp * lamp) / 6.0)).max(0.0).sqrt();
        let expected = 0.5 * aperture * (depth - focus).abs() / depth;
        // In focus all is in the four pixels around the middle.
        let tolerance = if depth == focus { pixel } else { 0.03 * expected };
        assert!((found - expected).abs() < tolerance, "{depth}: {found}, expected {expected}");
    }
}
