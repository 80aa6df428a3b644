//! Saved scenes: what the command adds to them, and how it opens them.

use crate::engine::Loaded;
use anyhow::Context;
use ropewalk::Aabb;
use ropewalk::file::{AnyOpened, Check, Extra, Opened, Tag};
use ropewalk_render::default_camera;
use ropewalk_workload::View;

/// The section that holds the view of a scene: eye, point looked at, up, view angle in degrees, light; 13 `f32`.
const VIEW: Tag = Tag(*b"view");

/// The view of a scene, by the renderer's rule: without a light there is one at the eye.
pub fn view_of(loaded: &Loaded) -> View {
    let scene = &loaded.scene;
    let camera = scene.camera.unwrap_or_else(|| default_camera(&loaded.geometry.bounds()));
    let single = |v: [f64; 3]| v.map(|x| x as f32);
    View {
        eye: single(camera.from),
        at: single(camera.at),
        up: single(camera.up),
        fov_degrees: camera.angle as f32,
        light: single(scene.lights.first().map_or(camera.from, |light| light.position)),
    }
}

/// A view as a section.
pub fn view_section(view: &View) -> Extra {
    let View { eye, at, up, fov_degrees, light } = view;
    let numbers = eye.iter().chain(at).chain(up).chain([fov_degrees]).chain(light);
    Extra { tag: VIEW, bytes: numbers.flat_map(|x| x.to_le_bytes()).collect() }
}

/// The view saved with a scene, else one from outside.
pub fn view_in(opened: &Opened) -> View {
    let saved = opened.extra.iter().find(|extra| extra.tag == VIEW);
    saved
        .and_then(|extra| parse(&extra.bytes))
        .unwrap_or_else(|| outside(&opened.geometry.bounds()))
}

fn parse(bytes: &[u8]) -> Option<View> {
    let (numbers, []) = bytes.as_chunks::<4>() else { return None };
    let numbers: Vec<f32> = numbers.iter().map(|&x| f32::from_le_bytes(x)).collect();
    let [a, b, c, d, e, f, g, h, i, fov_degrees, j, k, l] = numbers[..] else { return None };
    let sound = numbers.iter().all(|x| x.is_finite()) && fov_degrees > 0.0 && fov_degrees < 180.0;
    let view = View { eye: [a, b, c], at: [d, e, f], up: [g, h, i], fov_degrees, light: [j, k, l] };
    sound.then_some(view)
}

fn outside(bounds: &Aabb) -> View {
    let camera = default_camera(bounds);
    let single = |v: [f64; 3]| v.map(|x| x as f32);
    let eye = single(camera.from);
    View {
        eye,
        at: single(camera.at),
        up: single(camera.up),
        fov_degrees: camera.angle as f32,
        light: eye,
    }
}

/// True if a scene's name is that of a file that begins as saved scenes do; what cannot be read is left to
/// those who say why.
pub fn is_saved(spec: &str) -> bool {
    ropewalk_file::is_saved_scene(spec).unwrap_or(false)
}

/// Opens a saved scene of either precision.
pub fn open_any(spec: &str, verify: bool) -> anyhow::Result<AnyOpened> {
    let check = if verify { Check::Everything } else { Check::Structure };
    ropewalk_file::open_any(spec, check).context("no saved scene was opened")
}

/// Opens a saved scene of single precision.
pub fn open(spec: &str, verify: bool) -> anyhow::Result<Opened> {
    let check = if verify { Check::Everything } else { Check::Structure };
    ropewalk_file::open(spec, check).context("no saved scene was opened")
}
