//! Picture files: formats, channels, and that nothing is left behind on errors.

mod common;

use common::still_life;
use ropewalk_render::{
    AovKind, Image, ImageFileError, ImageFormat, RenderSettings, check_image_path, write_image,
};
use std::path::Path;

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> = std::fs::read_dir(folder)
        .expect("readable")
        .map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

#[test]
fn png_holds_display_values() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.PNG");
    let mut image = Image::filled(3, 2, [0.078, 0.361, 0.753]);
    image.pixels_mut()[5] = [-1.0, f32::NAN, 7.0];
    write_image(&path, &image).expect("written");
    let bytes = std::fs::read(&path).expect("readable");
    let back = image::load_from_memory(&bytes).expect("a picture").to_rgb8();
    assert_eq!(back.dimensions(), (3, 2));
    // The bytes of the published SPD pictures.
    assert_eq!(back.get_pixel(0, 0).0, [20, 92, 192]);
    assert_eq!(back.get_pixel(2, 1).0, [0, 0, 255]);
    assert_eq!(names(folder.path()), ["a.PNG"]);
}

#[test]
fn exr_holds_exact_values_and_named_channels() {
    use exr::prelude::{ReadChannels, ReadLayers, read};
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.exr");
    let out = still_life(20).render(&RenderSettings { aov: true, ..Default::default() });
    out.write(&path).expect("written");
    let file = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_file(&path)
        .expect("an EXR file");
    let layer = &file.layer_data;
    assert_eq!((layer.size.0, layer.size.1), (20, 20));
    let channel = |name: &str| -> Vec<f32> {
        let found = layer.channel_data.list.iter().find(|c| c.name.eq(name));
        found.unwrap_or_else(|| panic!("channel {name}")).sample_data.values_as_f32().collect()
    };
    let aov = out.aov.as_ref().expect("asked for");
    let plane = |p: &[[f32; 3]], c: usize| p.iter().map(|v| v[c]).collect::<Vec<_>>();
    for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
        assert_eq!(channel(name), plane(out.image.pixels(), c));
    }
    for (c, name) in ["N.X", "N.Y", "N.Z"].into_iter().enumerate() {
        assert_eq!(channel(name), plane(&aov.normal, c));
    }
    assert_eq!(channel("Z"), aov.depth);
    assert_eq!(channel("steps"), aov.steps);
    assert_eq!(channel("tests"), aov.tests);
    assert_eq!(names(folder.path()), ["a.exr"]);
}

#[test]
fn auxiliary_pictures_exist_only_on_request() {
    let plain = still_life(16).render(&RenderSettings::default());
    assert!(AovKind::ALL.iter().all(|&k| plain.aov_image(k).is_none()));
    let out = still_life(16).render(&RenderSettings { aov: true, ..Default::default() });
    for kind in AovKind::ALL {
        let picture = out.aov_image(kind).expect("asked for");
        assert_eq!(picture.width(), 16);
    }
}

#[test]
fn unknown_extensions_name_the_known_ones() {
    for name in ["picture.jpg", "picture", "png", ".exr", "picture.png.gz"] {
        let error = write_image(Path::new(name), &Image::filled(1, 1, [0.0; 3]))
            .expect_err("no such format");
        assert!(matches!(error, ImageFileError::UnknownExtension { .. }), "{name}");
        let text = error.to_string();
        assert!(text.contains(".png") && text.contains(".exr") && text.contains(name), "{text}");
    }
    assert_eq!(check_image_path(Path::new("a.Exr")).expect("known"), ImageFormat::Exr);
}

#[test]
fn errors_leave_nothing_behind() {
    let folder = tempfile::tempdir().expect("a folder");
    let image = Image::filled(2, 2, [0.5; 3]);
    let missing = folder.path().join("not/there.png");
    let error = write_image(&missing, &image).expect_err("no folder");
    assert!(matches!(error, ImageFileError::MissingFolder { .. }), "{error}");
    // A folder already has the name: the rename fails after the temporary file was written.
    let taken = folder.path().join("taken.png");
    std::fs::create_dir(&taken).expect("created");
    let error = write_image(&taken, &image).expect_err("a folder is in the way");
    assert!(matches!(error, ImageFileError::Io { .. }), "{error}");
    assert_eq!(names(folder.path()), ["taken.png"]);
    // An old file survives a picture that cannot be encoded.
    let old = folder.path().join("old.png");
    std::fs::write(&old, b"old").expect("written");
    let error = write_image(&old, &Image::filled(0, 0, [0.0; 3])).expect_err("no pixels");
    assert!(matches!(error, ImageFileError::Encode { .. }), "{error}");
    assert_eq!(std::fs::read(&old).expect("readable"), b"old");
}
