//! A small picture that must stay as it is.

mod common;

use common::still_life;
use ropewalk_render::{Image, RenderSettings, write_image};
use std::path::Path;

/// Largest difference of a channel in 8-bit steps. The same arithmetic gives the same bytes; one
/// step is left for another `powf` or `sin` of the platform's math library.
const CHANNEL_TOLERANCE: u8 = 1;

/// Pixels that may differ by more, of 96 x 96: eye rays on a silhouette or a shadow's edge.
const PIXEL_TOLERANCE: usize = 9;

/// Set this variable to write the golden picture anew; look at it before it is kept.
const UPDATE: &str = "ROPEWALK_UPDATE_GOLDEN";

#[test]
fn still_life_looks_as_before() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden");
    let path = folder.join("still_life.png");
    let out = still_life(96).render(&RenderSettings::spd());
    if std::env::var_os(UPDATE).is_some() {
        out.write(&path).expect("written");
    }
    let bytes = std::fs::read(&path).expect("the golden picture");
    let golden = image::load_from_memory(&bytes).expect("a picture").to_rgb8();
    assert_eq!(golden.dimensions(), (96, 96));
    let now = out.image.to_display_rgb8();
    let mut diff = Image::filled(96, 96, [0.0; 3]);
    let mut differing = 0;
    let pairs = now.chunks_exact(3).zip(golden.pixels());
    for (pixel, (a, b)) in diff.pixels_mut().iter_mut().zip(pairs) {
        let apart: [u8; 3] = std::array::from_fn(|c| a[c].abs_diff(b.0[c]));
        differing += usize::from(apart.iter().any(|&d| d > CHANNEL_TOLERANCE));
        // Sixteenfold, so that small differences show.
        *pixel = apart.map(|d| 16.0 * f32::from(d) / 255.0);
    }
    if differing > PIXEL_TOLERANCE {
        let seen = Path::new(env!("CARGO_TARGET_TMPDIR"));
        write_image(&seen.join("still_life.png"), &out.image).expect("written");
        write_image(&seen.join("still_life.diff.png"), &diff).expect("written");
        panic!("{differing} pixels differ; see still_life.diff.png in {}", seen.display());
    }
}
