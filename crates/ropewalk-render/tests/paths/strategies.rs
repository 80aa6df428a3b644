//! Sampling lights, meeting them by scattering, and both together agree.

use crate::common::*;
use ropewalk::wide::WideTree;
use ropewalk_render::path::{
    Backdrop, Environment, LightChoice, PathSettings, Strategy, Surroundings, Up, World,
};
use ropewalk_scene::Stage;
use ropewalk_scene::stage::{Light, Material};

/// Independent pictures of each kind.
const SEEDS: u32 = 16;

/// Standard errors by which two means may differ; by chance that happens once in 16,000 times.
const SIGMAS: f64 = 4.0;

/// Largest relative standard error, so that the comparison says something.
const NOISE: f64 = 0.015;

/// A mean over seeds and its standard error, for each third of the picture.
fn estimate(strategy: Strategy) -> Vec<(f64, f64)> {
    let rough = |roughness, metallic| Material { roughness, metallic, ..Material::default() };
    let window = |i: u32| if i % 40 == 17 { [30.0, 20.0, 10.0] } else { [0.2, 0.3, 0.4] };
    let pixels: Vec<[f32; 3]> = (0..32 * 16).map(window).collect();
    let map = Environment::new(32, 16, &pixels).expect("sound");
    let around = Surroundings { up: Up::Z, backdrop: Backdrop::Environment(map), ground: false };
    let mut stage = stage(vec![rough(1.0, 0.0), rough(0.3, 1.0), rough(0.15, 0.0), lamp(6.0)]);
    for (i, x) in [-3.0, -1.0, 1.0].into_iter().enumerate() {
        add_quad(&mut stage, [x, -1.0, 0.0], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0], i as u32);
    }
    add_quad(&mut stage, [-2.5, 2.0, 0.3], [5.0, 0.0, 0.0], [0.0, 0.0, 1.0], 3);
    let glass = Material { transmission: 1.0, roughness: 0.5, ..Material::default() };
    stage.materials.push(glass);
    add_sphere(&mut stage, [-2.0, 0.0, 0.6], 0.5, 16, false, 4);
    let made = world(stage, &around);
    let camera = camera([0.0, -4.0, 3.0], [0.0, 0.4, 0.0], 55.0, [24, 12]);
    let mut values: Vec<Vec<f64>> = vec![Vec::new(); 3];
    for seed in 0..SEEDS {
        let samples = if strategy == Strategy::Both { 64 } else { 512 };
        let settings = PathSettings { samples, strategy, seed, max_depth: 4, ..Default::default() };
        let film = expose(&made, &camera, &settings);
        let mut sums = [0.0; 3];
        for (i, pixel) in film.radiance().iter().enumerate() {
            sums[i % 24 / 8] += f64::from(pixel.iter().sum::<f32>()) / (3.0 * 96.0);
        }
        values.iter_mut().zip(sums).for_each(|(values, sum)| values.push(sum));
    }
    let of = |values: Vec<f64>| {
        let n = f64::from(SEEDS);
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
        (mean, (variance / n).sqrt())
    };
    values.into_iter().map(of).collect()
}

#[test]
fn strategies_agree_within_noise() {
    let [both, lights, bsdf] =
        [Strategy::Both, Strategy::Lights, Strategy::Bsdf].map(|s| (s, estimate(s)));
    for (name, other) in [&lights, &bsdf] {
        for (third, (a, b)) in both.1.iter().zip(other).enumerate() {
            let sigma = a.1.hypot(b.1);
            let apart = (a.0 - b.0).abs();
            assert!(apart <= SIGMAS * sigma, "{name:?}, third {third}: {a:?} {b:?}");
            assert!(a.1 < NOISE * a.0 && b.1 < NOISE * b.0, "{name:?}, {third}: {a:?} {b:?}");
        }
    }
}

/// A corridor of lamps of many powers, most of which are far from any point, under a sky that a roof hides.
pub fn corridor() -> Stage {
    let mut stage = stage(vec![matte(0.6), lamp(30.0), lamp(3.0)]);
    add_quad(&mut stage, [0.0, -1.0, 0.0], [40.0, 0.0, 0.0], [0.0, 2.0, 0.0], 0);
    add_quad(&mut stage, [0.0, 1.0, 0.0], [40.0, 0.0, 0.0], [0.0, 0.0, 2.0], 0);
    add_quad(&mut stage, [0.0, -1.0, 2.0], [0.0, 2.0, 0.0], [40.0, 0.0, 0.0], 0);
    for i in 0..80 {
        let corner = [0.4 + 0.5 * f64::from(i), -0.1, 1.9];
        add_quad(&mut stage, corner, [0.0, 0.15, 0.0], [0.15, 0.0, 0.0], 1 + i % 2);
    }
    let intensity = [0.4; 3];
    stage.lights = vec![Light::Point { position: [33.0, 0.3, 1.0], intensity }];
    stage
}

/// The mean over pixels and seeds, and the mean of the pixels' variances over seeds.
fn noise(
    made: &(World, WideTree),
    light_choice: LightChoice,
    strategy: Strategy,
) -> (f64, f64, f64) {
    let camera = camera([1.0, -0.5, 1.0], [6.0, 0.3, 0.7], 60.0, [24, 16]);
    let films: Vec<_> = (0..SEEDS)
        .map(|seed| {
            let samples = 32;
            let settings = PathSettings {
                samples,
                strategy,
                light_choice,
                seed,
                max_depth: 3,
                ..Default::default()
            };
            expose(made, &camera, &settings).radiance()
        })
        .collect();
    let n = f64::from(SEEDS);
    let means: Vec<f64> = films
        .iter()
        .map(|film| film.iter().map(|p| f64::from(p[1])).sum::<f64>() / film.len() as f64)
        .collect();
    let mean = means.iter().sum::<f64>() / n;
    let error = (means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (n - 1.0) / n).sqrt();
    let pixels = films[0].len();
    let variance = |i: usize| {
        let mean = films.iter().map(|f| f64::from(f[i][1])).sum::<f64>() / n;
        films.iter().map(|f| (f64::from(f[i][1]) - mean).powi(2)).sum::<f64>() / (n - 1.0)
    };
    (mean, error, (0..pixels).map(variance).sum::<f64>() / pixels as f64)
}

/// With equal samples the choice by place has the mean of the choice by power, and less than half of its variance.
#[test]
fn lights_chosen_by_place_give_the_same_picture_with_less_noise() {
    let around = Surroundings { up: Up::Z, backdrop: Backdrop::Sky, ground: false };
    let made = world(corridor(), &around);
    let reference = noise(&made, LightChoice::Power, Strategy::Both);
    for strategy in [Strategy::Both, Strategy::Lights] {
        let power = noise(&made, LightChoice::Power, strategy);
        let place = noise(&made, LightChoice::Place, strategy);
        let sigma = reference.1.hypot(place.1);
        let apart = (reference.0 - place.0).abs();
        assert!(apart <= SIGMAS * sigma, "{strategy:?}: {reference:?} {place:?}");
        assert!(sigma < NOISE * reference.0, "{strategy:?}: {reference:?} {place:?}");
        assert!(place.2 < power.2 / 2.0, "{strategy:?}: {power:?} {place:?}");
    }
}
