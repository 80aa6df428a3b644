//! Small pictures that must stay as they are.

use crate::common::{expose, world};
use ropewalk_render::path::{
    Backdrop, PathSettings, Surroundings, Tone, automatic_exposure, developed, fitted_camera,
};
use ropewalk_render::{Image, write_image};
use ropewalk_scene::{Camera, Stage};
use std::path::Path;

/// Largest difference of a channel in 8-bit steps: the platform's math library may round otherwise.
const CHANNEL_TOLERANCE: u8 = 2;

/// Pixels that may differ by more, of 128 x 128: where such rounding sends a path elsewhere.
const PIXEL_TOLERANCE: usize = 160;

/// Set this variable to write the golden pictures anew; look at them before they are kept.
const UPDATE: &str = "ROPEWALK_UPDATE_GOLDEN";

/// Fails if a picture of 128 x 128 pixels is not the one that is kept as `tests/golden/paths_NAME.png`, and writes both it and where it
/// differs.
pub fn golden(name: &str, stage: Stage, around: &Surroundings, camera: Option<Camera>) {
    let size = [128, 128];
    let camera = camera.unwrap_or_else(|| fitted_camera(&stage.mesh.vertices, size, around.up));
    let camera = Camera { resolution: size, ..camera };
    let is_inside = stage.daylight;
    let settings = PathSettings { samples: 32, clamp: Some(4.0), ..Default::default() };
    let film = expose(&world(stage, around), &camera, &settings);
    let exposure = if is_inside || matches!(around.backdrop, Backdrop::None) {
        automatic_exposure(&film)
    } else {
        0.0
    };
    let seen = developed(&film, exposure, Tone::Agx);
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden");
    let path = folder.join(format!("paths_{name}.png"));
    if std::env::var_os(UPDATE).is_some() {
        write_image(&path, &seen).expect("written");
    }
    let bytes = std::fs::read(&path).expect("the golden picture");
    let golden = image::load_from_memory(&bytes).expect("a picture").to_rgb8();
    assert_eq!(golden.dimensions(), (128, 128));
    let now = seen.to_display_rgb8();
    let mut diff = Image::filled(128, 128, [0.0; 3]);
    let mut differing = 0;
    let pairs = now.chunks_exact(3).zip(golden.pixels());
    for (pixel, (a, b)) in diff.pixels_mut().iter_mut().zip(pairs) {
        let apart: [u8; 3] = std::array::from_fn(|c| a[c].abs_diff(b.0[c]));
        differing += usize::from(apart.iter().any(|&d| d > CHANNEL_TOLERANCE));
        // Sixteenfold, so that small differences show.
        *pixel = apart.map(|d| 16.0 * f32::from(d) / 255.0);
    }
    if differing > PIXEL_TOLERANCE {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
        write_image(&folder.join(format!("paths_{name}.png")), &seen).expect("written");
        write_image(&folder.join(format!("paths_{name}.diff.png")), &diff).expect("written");
        panic!("{differing} pixels differ; see paths_{name}.diff.png in {}", folder.display());
    }
}
