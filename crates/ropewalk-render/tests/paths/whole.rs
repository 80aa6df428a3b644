//! Threads, passes, interruption, scale, files, golden pictures.

use crate::common::*;
use crate::golden::golden;
use ropewalk_render::path::{
    Backdrop, Development, Film, PathSettings, Surroundings, Up, WalkCost, World, is_whole_picture,
    tessellated, trace_paths, write_film,
};
use ropewalk_render::{ImageFileError, Monitor, Progress, RenderError};
use ropewalk_scene::stage::{Image as Texels, Light, Material, Texture, Wrap};
use ropewalk_scene::{Camera, MeshLimits, NffLimits, Stage, load_scene};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

/// A sphere of each kind on a chequered floor.
fn spheres() -> Stage {
    let glass = Material { transmission: 1.0, roughness: 0.0, ..matte(1.0) };
    let glass = Material { ior: 1.5, ..glass };
    let gold = Material {
        base_color: [1.0, 0.72, 0.3],
        metallic: 1.0,
        roughness: 0.25,
        ..Material::default()
    };
    let coated = Material { base_color: [0.7, 0.08, 0.05], roughness: 0.1, ..Material::default() };
    let (dark, light) = ([60, 70, 90, 255], [225, 220, 210, 255]);
    let texture = Texture { image: 0, wrap: [Wrap::Repeat; 2] };
    let floor = Material { base_color_texture: Some(texture), ..matte(1.0) };
    let mut made = stage(vec![floor, glass, gold, coated]);
    let side = 16;
    let is_dark = |i: u32| (i % side < side / 2) != (i / side < side / 2);
    let pixels = (0..side * side).map(|i| if is_dark(i) { dark } else { light }).collect();
    made.images = vec![Texels { width: side, height: side, pixels }];
    add_quad(&mut made, [-4.0, -4.0, 0.0], [8.0, 0.0, 0.0], [0.0, 8.0, 0.0], 0);
    made.uvs = vec![[[0.0, 4.0], [4.0, 4.0], [4.0, 0.0]], [[0.0, 4.0], [4.0, 0.0], [0.0, 0.0]]];
    for (k, x) in [(1, -1.25), (2, 0.0), (3, 1.25)] {
        add_sphere(&mut made, [x, 0.0, 0.6], 0.6, 32, true, k);
    }
    made.uvs.resize(made.mesh.faces.len(), [[0.0; 2]; 3]);
    made
}

fn view(size: [u32; 2]) -> Camera {
    camera([1.0, -5.0, 2.2], [0.0, 0.0, 0.5], 42.0, size)
}

fn under_sky() -> Surroundings {
    Surroundings { up: Up::Z, backdrop: Backdrop::Sky, ground: false }
}

fn same(a: &Film, b: &Film) -> bool {
    a.samples() == b.samples()
        && a.radiance() == b.radiance()
        && a.albedo() == b.albedo()
        && a.normal() == b.normal()
        && a.depth() == b.depth()
        && a.face() == b.face()
        && a.walks() == b.walks()
}

#[test]
fn pictures_do_not_depend_on_threads() {
    let made = world(spheres(), &under_sky());
    let with = |threads, seed| {
        let settings =
            PathSettings { samples: 6, threads, seed, walk_costs: true, ..Default::default() };
        expose(&made, &view([150, 90]), &settings)
    };
    let one = with(Some(1), 0);
    for threads in [Some(2), Some(5), None] {
        assert!(same(&one, &with(threads, 0)), "{threads:?}");
    }
    assert_ne!(one.radiance(), with(None, 1).radiance());
}

/// Moved far away and scaled by powers of two, a scene gives the same picture.
#[test]
fn pictures_do_not_depend_on_scale() {
    let settings = PathSettings { samples: 2, ..Default::default() };
    let of = |scale: f64| {
        let mut made = spheres();
        let place = |p: [f64; 3]| p.map(|x| x * scale);
        made.mesh.vertices.iter_mut().for_each(|v| *v = place(*v));
        let intensity = [(3.0 * scale * scale) as f32; 3];
        made.lights = vec![Light::Point { position: place([1.0, -2.0, 3.0]), intensity }];
        let camera = view([40, 30]);
        let camera = Camera { from: place(camera.from), at: place(camera.at), ..camera };
        expose(&world(made, &under_sky()), &camera, &settings)
    };
    let plain = of(1.0);
    for power in [-40, 40] {
        assert_eq!(plain.radiance(), of(2f64.powi(power)).radiance(), "{power}");
    }
}

/// Whenever a render is stopped, what is left are complete passes: the picture of fewer samples.
#[test]
fn interrupted_pictures_are_whole_or_none() {
    let folder = tempfile::tempdir().expect("a folder");
    let made = world(spheres(), &under_sky());
    let camera = view([150, 90]); // six tiles
    let stopped_after = |tiles: usize| {
        let cancel = AtomicBool::new(false);
        let stop = |p: Progress| cancel.store(p.done >= tiles, Ordering::Relaxed);
        let monitor = Monitor { progress: Some(&stop), cancel: Some(&cancel) };
        let settings =
            PathSettings { size: [150, 90], samples: 16, threads: Some(1), ..Default::default() };
        let each = &mut |_: &Film| ControlFlow::Continue(());
        trace_paths(&made.0, &made.1, &camera, &settings, monitor, each).expect("good")
    };
    for (tiles, samples) in [(3, 0), (6, 1), (11, 1), (12, 2), (20, 4)] {
        let done = stopped_after(tiles);
        assert!(done.cancelled);
        assert_eq!(done.film.samples(), samples, "after {tiles} tiles");
        let path = folder.path().join(format!("{tiles}.png"));
        let written = write_film(&path, &done.film, &Development::default());
        if samples == 0 {
            assert!(matches!(written, Err(ImageFileError::Cancelled { .. })));
            continue;
        }
        written.expect("written");
        assert!(is_whole_picture(&path, [150, 90]) && !is_whole_picture(&path, [90, 150]));
        let settings = PathSettings { samples, ..Default::default() };
        assert!(same(&done.film, &expose(&made, &camera, &settings)));
    }
    assert_eq!(std::fs::read_dir(folder.path()).expect("readable").count(), 4);
}

#[test]
fn a_time_limit_leaves_the_first_pass_at_least() {
    let made = world(spheres(), &under_sky());
    let settings = PathSettings { seconds: Some(0.0), samples: 1 << 20, ..Default::default() };
    assert_eq!(expose(&made, &view([70, 70]), &settings).samples(), 1);
}

#[test]
fn layers_are_written_and_cut_files_are_no_pictures() {
    use exr::prelude::*;
    let folder = tempfile::tempdir().expect("a folder");
    let settings = PathSettings { samples: 3, walk_costs: true, ..Default::default() };
    let film = expose(&world(spheres(), &under_sky()), &view([20, 10]), &settings);
    let path = folder.path().join("a.exr");
    write_film(&path, &film, &Development::default()).expect("written");
    let image = read_first_flat_layer_from_file(&path).expect("readable");
    let names: Vec<_> =
        image.layer_data.channel_data.list.iter().map(|c| c.name.to_string()).collect();
    let expected = [
        "B", "G", "R", "Z", "albedo.B", "albedo.G", "albedo.R", "blocks", "id", "normal.X",
        "normal.Y", "normal.Z", "samples", "steps",
    ];
    assert_eq!(names, expected);
    let channel = |name: &str| {
        let at = names.iter().position(|n| n == name).expect("there");
        &image.layer_data.channel_data.list[at].sample_data
    };
    assert_eq!(channel("samples"), &FlatSamples::U32(vec![3; 200]));
    assert_eq!(channel("id"), &FlatSamples::U32(film.face().to_vec()));
    assert_eq!(channel("Z"), &FlatSamples::F32(film.depth().to_vec()));
    let counted = |which: fn(&WalkCost) -> u32| film.walks().iter().map(which).collect();
    assert_eq!(channel("steps"), &FlatSamples::U32(counted(|w| w.steps)));
    assert_eq!(channel("blocks"), &FlatSamples::U32(counted(|w| w.blocks)));
    let red = film.radiance().iter().map(|p| p[0]).collect();
    assert_eq!(channel("R"), &FlatSamples::F32(red));
    assert!(is_whole_picture(&path, [20, 10]));
    let bytes = std::fs::read(&path).expect("readable");
    std::fs::write(&path, &bytes[..bytes.len() / 2]).expect("written");
    assert!(!is_whole_picture(&path, [20, 10]));
}

/// A ray that meets a face has gone through at least one treelet and one block; one that passes by the box through none.
#[test]
fn walks_are_counted_when_asked_for() {
    let made = world(spheres(), &under_sky());
    let with = |samples, walk_costs| {
        let settings = PathSettings { samples, walk_costs, ..Default::default() };
        expose(&made, &camera([0.0, -9.0, 4.0], [0.0, 0.0, 2.0], 70.0, [40, 30]), &settings)
    };
    let film = with(1, true);
    assert_eq!(film.walks().len(), 40 * 30);
    let (sky, middle) = (film.walks()[0], film.walks()[18 * 40 + 20]);
    assert_eq!(sky, WalkCost::default());
    assert!(middle.steps >= 1 && middle.blocks >= 1, "{middle:?}");
    let most = film.walks().iter().map(|w| w.steps).max();
    assert!(most > Some(middle.steps.min(2)), "{most:?}");
    // Samples do not change them, and without asking there are none.
    assert_eq!(film.walks(), with(4, true).walks());
    assert!(with(1, false).walks().is_empty());
}

#[test]
fn stages_that_do_not_hold_together_are_refused() {
    let refused = |change: &dyn Fn(&mut Stage)| {
        let mut made = spheres();
        change(&mut made);
        match World::new(made, &under_sky()).err() {
            Some(RenderError::Stage { what }) => what,
            other => panic!("expected a refusal, found {other:?}"),
        }
    };
    assert!(refused(&|s| s.mesh.faces.clear()).contains("at least one face"));
    assert!(refused(&|s| s.materials.clear()).contains("at least one material"));
    assert!(refused(&|s| s.material[3] = 9).contains("one of 4 materials, found number 9"));
    assert!(refused(&|s| s.normals.truncate(5)).contains("normals, one a face, found 5"));
    assert!(refused(&|s| s.images.clear()).contains("one of 0 images, found number 0"));
    assert!(refused(&|s| s.images[0].pixels.truncate(255)).contains("of 256 pixels, found 255"));
}

fn built_in(spec: &str) -> Stage {
    tessellated(&load_scene(spec, &NffLimits::default()).expect("built in"), 16)
}

#[test]
fn golden_spheres() {
    golden("spheres", spheres(), &under_sky(), Some(view([128, 128])));
}

#[test]
fn golden_balls_under_the_sky() {
    let mut made = built_in("spd:balls:2");
    made.lights.clear();
    let camera = made.camera;
    golden("balls", made, &under_sky(), camera);
}

/// What the command makes of a mesh of which nothing but triangles is known.
#[test]
fn golden_teapot_without_options() {
    let plain = built_in("spd:teapot:4");
    let made = Stage::of_mesh("teapot".into(), plain.mesh);
    let around = Surroundings::of(&made, Up::Z);
    assert!(around.ground && matches!(around.backdrop, Backdrop::Sky));
    golden("teapot", made, &around, None);
}

#[test]
fn golden_gears_in_their_own_light() {
    let made = built_in("spd:gears:2");
    let camera = made.camera;
    golden("gears", made, &dark(), camera);
}

/// Two boxes in a room with one lamp, two coloured walls.
#[test]
fn golden_room() {
    let color = |base_color| Material { base_color, ..matte(0.0) };
    let mut made = stage(vec![
        color([0.73; 3]),
        color([0.63, 0.06, 0.05]),
        color([0.14, 0.45, 0.09]),
        Material { two_sided: false, ..lamp(12.0) },
        Material { transmission: 1.0, roughness: 0.0, base_color: [1.0; 3], ..Material::default() },
    ]);
    let (x, y, z) = ([2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]);
    add_quad(&mut made, [-1.0, -1.0, 0.0], x, y, 0);
    add_quad(&mut made, [-1.0, -1.0, 2.0], y, x, 0);
    add_quad(&mut made, [-1.0, 1.0, 0.0], x, z, 0);
    add_quad(&mut made, [-1.0, -1.0, 0.0], y, z, 1);
    add_quad(&mut made, [1.0, -1.0, 0.0], z, y, 2);
    add_quad(&mut made, [-0.3, -0.3, 1.99], [0.0, 0.6, 0.0], [0.6, 0.0, 0.0], 3);
    add_box(&mut made, [-0.7, 0.0, 0.0], [-0.1, 0.6, 1.2], 0);
    add_sphere(&mut made, [0.4, -0.3, 0.4], 0.4, 32, true, 4);
    made.normals.resize(made.mesh.faces.len(), [[0.0; 3]; 3]);
    let camera = camera([0.0, -4.6, 1.0], [0.0, 0.0, 1.0], 32.0, [128, 128]);
    golden("room", made, &dark(), Some(camera));
}

/// The generated interior by its own view, sky, sun and lamps, with curves of few segments.
#[test]
fn golden_interior() {
    let made = ropewalk_scene::room::room(2).expect("a size that there is");
    let around = Surroundings::of(&made, Up::Y);
    assert!(matches!(around.backdrop, Backdrop::Sky) && !around.ground);
    let camera = made.camera;
    golden("interior", made, &around, camera);
}

/// A file with textures of colour, bumps, metal and roughness, and a camera; it was made for this test.
#[test]
fn golden_textured_gltf() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/textured.gltf");
    let made = Stage::read_monitored(&path, &MeshLimits::DEFAULT, &()).expect("a sound file");
    let camera = made.camera;
    assert!(camera.is_some() && made.images.len() == 4);
    let around = Surroundings { up: Up::Y, backdrop: Backdrop::Sky, ground: false };
    golden("textured", made, &around, camera);
}

/// An arcade with eighty lamps, open to the sky on one side.
#[test]
fn golden_arcade_of_many_lamps() {
    let mut made = crate::strategies::corridor();
    for i in 0..6 {
        let x = 3.0 + 3.0 * f64::from(i);
        add_box(&mut made, [x, -1.0, 0.0], [x + 0.3, -0.7, 2.0], 0);
        add_box(&mut made, [x, 0.5, 0.0], [x + 0.5, 0.9, 0.5], 0);
    }
    let camera = camera([0.5, 0.1, 1.1], [8.0, 0.0, 0.9], 75.0, [128, 128]);
    golden("arcade", made, &under_sky(), Some(camera));
}
