//! Stages built in code, and their pictures.

use ropewalk::build::{BuildSettings, Preset};
use ropewalk::wide::WideTree;
use ropewalk_render::Monitor;
use ropewalk_render::path::{
    Backdrop, Environment, Film, PathSettings, Surroundings, Up, World, trace_paths,
};
use ropewalk_scene::stage::Material;
use ropewalk_scene::{Camera, Stage};
use std::f64::consts::{PI, TAU};
use std::ops::ControlFlow;

/// White, and nothing but diffuse: there is no coat where the index of refraction is that of air.
pub fn matte(albedo: f32) -> Material {
    Material { base_color: [albedo; 3], ior: 1.0, ..Material::default() }
}

/// Black, and emits.
pub fn lamp(radiance: f32) -> Material {
    Material { emission: [radiance; 3], ..matte(0.0) }
}

/// A stage without faces, with materials.
pub fn stage(materials: Vec<Material>) -> Stage {
    Stage { name: "test".into(), materials, ..Stage::default() }
}

/// Adds a triangle.
pub fn add_triangle(stage: &mut Stage, corners: [[f64; 3]; 3], material: u32) {
    let first = stage.mesh.vertices.len() as u32;
    stage.mesh.vertices.extend(corners);
    stage.mesh.faces.push([first, first + 1, first + 2]);
    stage.material.push(material);
}

/// Adds a parallelogram from a corner along two edges; its front is where their cross product points.
pub fn add_quad(stage: &mut Stage, corner: [f64; 3], e: [f64; 3], f: [f64; 3], material: u32) {
    let at = |s: f64, t: f64| std::array::from_fn(|a| corner[a] + s * e[a] + t * f[a]);
    let [a, b, c, d] = [at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)];
    add_triangle(stage, [a, b, c], material);
    add_triangle(stage, [a, c, d], material);
}

/// Adds a box from `low` to `high`, fronts outwards.
pub fn add_box(stage: &mut Stage, low: [f64; 3], high: [f64; 3], material: u32) {
    let d: [f64; 3] = std::array::from_fn(|a| high[a] - low[a]);
    let [x, y, z] = [[d[0], 0.0, 0.0], [0.0, d[1], 0.0], [0.0, 0.0, d[2]]];
    for (e, f) in [(y, x), (z, y), (x, z)] {
        add_quad(stage, low, e, f, material);
        let corner = std::array::from_fn(|a| high[a] - e[a] - f[a]);
        add_quad(stage, corner, f, e, material);
    }
}

/// Adds a sphere of so many parallels; with normals of the sphere itself if it is smooth.
pub fn add_sphere(
    stage: &mut Stage,
    center: [f64; 3],
    radius: f64,
    steps: u32,
    smooth: bool,
    material: u32,
) {
    let normal = |i: u32, j: u32| {
        let theta = PI * f64::from(i) / f64::from(steps);
        let phi = TAU * f64::from(j % (2 * steps)) / f64::from(2 * steps);
        let sine = if i == 0 || i == steps { 0.0 } else { theta.sin() };
        [sine * phi.cos(), sine * phi.sin(), theta.cos()]
    };
    let mut corner = |n: [[f64; 3]; 3]| {
        let p = n.map(|n| std::array::from_fn(|a| center[a] + radius * n[a]));
        if p[0] == p[1] || p[1] == p[2] || p[2] == p[0] {
            return;
        }
        add_triangle(stage, p, material);
        if smooth {
            stage.normals.resize(stage.mesh.faces.len() - 1, [[0.0; 3]; 3]);
            stage.normals.push(n.map(|n| n.map(|x| x as f32)));
        }
    };
    for i in 0..steps {
        for j in 0..2 * steps {
            let [a, b, c, d] =
                [normal(i, j), normal(i + 1, j), normal(i + 1, j + 1), normal(i, j + 1)];
            corner([a, b, c]);
            corner([a, c, d]);
        }
    }
}

/// A camera for a picture of `size` pixels.
pub fn camera(from: [f64; 3], at: [f64; 3], angle: f64, size: [u32; 2]) -> Camera {
    Camera { from, at, up: [0.0, 1e-3, 1.0], angle, hither: 0.0, resolution: size }
}

/// The same radiance from everywhere.
pub fn even_light(radiance: f32) -> Surroundings {
    let map = Environment::even([radiance; 3]);
    Surroundings { up: Up::Z, backdrop: Backdrop::Environment(map), ground: false }
}

/// No light but the stage's.
pub fn dark() -> Surroundings {
    Surroundings { up: Up::Z, backdrop: Backdrop::None, ground: false }
}

/// A world with its tree.
pub fn world(stage: Stage, around: &Surroundings) -> (World, WideTree) {
    let world = World::new(stage, around).expect("a sound stage");
    let settings = BuildSettings::preset(Preset::Balanced);
    let (tree, _) = WideTree::build(world.geometry(), &settings, &()).expect("built");
    (world, tree)
}

/// The picture of a world.
pub fn expose((world, tree): &(World, WideTree), camera: &Camera, settings: &PathSettings) -> Film {
    let settings = PathSettings { size: camera.resolution, ..*settings };
    let each = &mut |_: &Film| ControlFlow::Continue(());
    trace_paths(world, tree, camera, &settings, Monitor::default(), each)
        .expect("good settings")
        .film
}

/// The mean over all pixels and channels.
pub fn mean(film: &Film) -> f64 {
    let pixels = film.radiance();
    let sum: f64 = pixels.iter().flatten().map(|&x| f64::from(x)).sum();
    sum / (3 * pixels.len()) as f64
}
