//! Coverage, textures, normals, coverage of the view: what is where.

use crate::common::*;
use ropewalk_render::path::{Film, PathSettings};
use ropewalk_scene::Stage;
use ropewalk_scene::stage::{Alpha, Image, Material, Texture, Wrap};

fn looked_at(stage: Stage, samples: u32) -> Film {
    let camera = camera([0.0, -1.0, 0.0], [0.0; 3], 90.0, [4, 4]);
    let settings = PathSettings { samples, max_depth: 8, ..Default::default() };
    expose(&world(stage, &even_light(1.0)), &camera, &settings)
}

/// A wall at `y` that fills the view at 0, with texture coordinates from its upper left corner.
fn wall(stage: &mut Stage, y: f64, material: u32) {
    let size = 1.0 + y;
    let low = [-size, y, -size];
    add_quad(stage, low, [2.0 * size, 0.0, 0.0], [0.0, 0.0, 2.0 * size], material);
    stage.uvs.push([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0]]);
    stage.uvs.push([[0.0, 1.0], [1.0, 0.0], [0.0, 0.0]]);
}

fn image(width: u32, pixels: &[[u8; 4]]) -> (Image, Texture) {
    let height = pixels.len() as u32 / width;
    (Image { width, height, pixels: pixels.to_vec() }, Texture { image: 0, wrap: [Wrap::Clamp; 2] })
}

#[test]
fn images_lie_on_surfaces_the_right_way_up() {
    let (red, green, blue, white) =
        ([255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [255; 4]);
    let (picture, texture) = image(2, &[red, green, blue, white]);
    let mut made = stage(vec![Material { base_color_texture: Some(texture), ..matte(1.0) }]);
    made.images = vec![picture];
    wall(&mut made, 0.0, 0);
    let albedo = looked_at(made, 4).albedo();
    // Outer pixels lie beyond the centres of the image's pixels.
    let corner = |i: usize| albedo[i].map(|x| x.round() as u8);
    assert_eq!([corner(0), corner(3)], [[1, 0, 0], [0, 1, 0]]);
    assert_eq!([corner(12), corner(15)], [[0, 0, 1], [1, 1, 1]]);
}

#[test]
fn masked_surfaces_have_holes_and_blended_ones_let_light_through() {
    let (picture, texture) = image(2, &[[255, 255, 255, 255], [255, 255, 255, 0]]);
    let cut = |alpha, opacity| {
        let front = Material { alpha, opacity, base_color_texture: Some(texture), ..matte(0.0) };
        let mut made = stage(vec![front, lamp(2.0)]);
        made.images = vec![picture.clone()];
        wall(&mut made, 0.0, 0);
        wall(&mut made, 1.0, 1);
        let film = looked_at(made, 256);
        (film.radiance()[4][0], film.radiance()[7][0], film.face()[4], film.face()[7])
    };
    let (left, right, near, far) = cut(Alpha::Mask(0.5), 1.0);
    assert_eq!((left, right), (0.0, 2.0));
    assert!(near < 2 && far >= 2);
    let (left, right, ..) = cut(Alpha::Opaque, 1.0);
    assert_eq!((left, right), (0.0, 0.0));
    let (left, right, ..) = cut(Alpha::Blend, 0.25);
    assert!((left / 1.5 - 1.0).abs() < 0.1 && right == 2.0, "{left} {right}");
}

/// Light through a screen that covers half, by shadow rays: the floor gets half.
#[test]
fn shadows_of_blended_surfaces_are_half_dark() {
    let seen = |opacity| {
        let screen = Material { alpha: Alpha::Blend, opacity, ..matte(0.0) };
        let mut made = stage(vec![matte(0.8), screen, lamp(5.0)]);
        add_quad(&mut made, [-5.0, -5.0, -1.0], [10.0, 0.0, 0.0], [0.0, 10.0, 0.0], 0);
        add_quad(&mut made, [-5.0, -5.0, 1.0], [10.0, 0.0, 0.0], [0.0, 10.0, 0.0], 1);
        add_quad(&mut made, [-1.0, -1.0, 2.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], 2);
        let camera = camera([0.0, -2.0, 0.5], [0.0, 0.0, -1.0], 2.0, [8, 8]);
        let settings = PathSettings { samples: 256, max_depth: 2, ..Default::default() };
        mean(&expose(&world(made, &dark()), &camera, &settings))
    };
    let ratio = seen(0.5) / seen(0.0);
    assert!((ratio - 0.5).abs() < 0.02, "{ratio}");
}

#[test]
fn normal_maps_turn_normals_the_way_they_say() {
    let normal = |pixel: [u8; 4]| {
        let (picture, texture) = image(1, &[pixel]);
        let mut made = stage(vec![Material { normal_texture: Some(texture), ..matte(0.5) }]);
        made.images = vec![picture];
        wall(&mut made, 0.0, 0);
        looked_at(made, 4).normal()[5]
    };
    let near = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(x, y)| (x - y).abs() < 0.02);
    // The wall faces -y; the image's right is +x, its upper edge +z.
    let flat = normal([128, 128, 255, 255]);
    assert!(near(flat, [0.0, -1.0, 0.0]), "{flat:?}");
    let right = normal([218, 128, 218, 255]);
    assert!(near(right, [0.707, -0.707, 0.0]), "{right:?}");
    let up = normal([128, 218, 218, 255]);
    assert!(near(up, [0.0, -0.707, 0.707]), "{up:?}");
}

/// A light behind a wall stays there, whatever the wall's smooth normals say.
#[test]
fn smooth_normals_let_no_light_through() {
    let mut made = stage(vec![Material { roughness: 0.5, ..Material::default() }, lamp(50.0)]);
    wall(&mut made, 0.0, 0);
    // Tilted until they point half away.
    let tilted = [[0.9f32, 0.43, 0.0]; 3];
    made.normals = vec![tilted, tilted];
    add_quad(&mut made, [-9.0, 0.5, -9.0], [18.0, 0.0, 0.0], [0.0, 0.0, 18.0], 1);
    made.normals.resize(4, [[0.0; 3]; 3]);
    made.uvs.resize(4, [[0.0; 2]; 3]);
    let camera = camera([0.0, -1.0, 0.0], [0.0; 3], 60.0, [8, 8]);
    let settings = PathSettings { samples: 64, max_depth: 6, ..Default::default() };
    assert_eq!(mean(&expose(&world(made, &dark()), &camera, &settings)), 0.0);
}
