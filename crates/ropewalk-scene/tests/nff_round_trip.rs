//! What is written is read back equal.

use proptest::prelude::*;
use ropewalk_scene::{
    Camera, Cone, Light, Material, NffLimits, NffWriter, NumberFormat, Object, Scene, SceneSink,
    Surface,
};

/// Any number that the format takes: drawn in exponent space, or small integers.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        (-8..=8_i32).prop_map(f64::from),
        (any::<f64>(), -340..38_i32).prop_map(|(bits, exponent)| {
            // The fraction of any finite number, scaled to each power of ten that fits.
            let fraction = if bits.is_finite() { bits.to_bits() as u32 } else { 0 };
            (f64::from(fraction) / f64::from(u32::MAX) - 0.5) * 10f64.powi(exponent)
        }),
        any::<f32>().prop_filter("finite", |x| x.is_finite()).prop_map(f64::from),
    ]
}

fn point() -> impl Strategy<Value = [f64; 3]> {
    [number(), number(), number()]
}

fn surface() -> impl Strategy<Value = Surface> {
    prop_oneof![
        (point(), number()).prop_map(|(center, radius)| Surface::Sphere { center, radius }),
        (point(), number(), point(), number(), any::<bool>()).prop_map(
            |(base, r, apex, q, inside)| {
                let sign = if inside { -1.0 } else { 1.0 };
                let (base_radius, apex_radius) = (sign * r.abs(), sign * q.abs());
                Surface::Cone(Cone { base, base_radius, apex, apex_radius })
            }
        ),
        prop::collection::vec(point(), 3..9).prop_map(Surface::Polygon),
        prop::collection::vec((point(), point()), 3..6).prop_map(|pairs| {
            let (vertices, normals) = pairs.into_iter().unzip();
            Surface::Patch { vertices, normals }
        }),
    ]
}

fn material() -> impl Strategy<Value = Material> {
    (point(), point(), number(), number()).prop_map(|(color, [kd, ks, shine], t, ior)| Material {
        color,
        kd,
        ks,
        shine,
        transmittance: t,
        index_of_refraction: ior,
    })
}

fn camera() -> impl Strategy<Value = Camera> {
    let angle = prop_oneof![(1..180_i32).prop_map(f64::from), 1e-30..179.9];
    let resolution = [1..=u32::MAX, 1..=u32::MAX];
    (point(), point(), point(), angle, number(), resolution).prop_map(
        |(from, at, up, angle, hither, resolution)| Camera {
            from,
            at,
            up,
            angle,
            hither,
            resolution,
        },
    )
}

/// Scenes with material indices in any order.
fn scene() -> impl Strategy<Value = Scene> {
    let light = (point(), prop::option::of(point()))
        .prop_map(|(position, color)| Light { position, color });
    let object = (surface(), 0..4_u32).prop_map(|(surface, material)| Object { surface, material });
    (
        point(),
        prop::option::of(camera()),
        prop::collection::vec(light, 0..4),
        prop::collection::vec(material(), 4),
        prop::collection::vec(object, 1..12),
    )
        .prop_map(|(background, camera, lights, materials, objects)| {
            let name = String::new();
            Scene { name, background, camera, lights, materials, objects }
        })
}

fn text(scene: &Scene, format: NumberFormat) -> Vec<u8> {
    let mut writer = NffWriter::new(Vec::new()).number_format(format);
    scene.write_to(&mut writer).unwrap();
    writer.into_inner()
}

proptest! {
    #[test]
    fn a_written_scene_reads_back_equal(mut scene in scene()) {
        let read = Scene::read_nff(&text(&scene, NumberFormat::Shortest)[..], &NffLimits::DEFAULT);
        let read = read.unwrap();
        // Whatever the numbering, each object keeps its surface and its material.
        prop_assert_eq!(read.objects.len(), scene.objects.len());
        for (a, b) in read.objects.iter().zip(&scene.objects) {
            prop_assert_eq!(&a.surface, &b.surface);
            let (a, b) = (a.material as usize, b.material as usize);
            prop_assert_eq!(read.materials[a], scene.materials[b]);
        }
        // In the numbering of files the whole scene is equal.
        scene.objects.sort_by_key(|object| object.material);
        let read = Scene::read_nff(&text(&scene, NumberFormat::Shortest)[..], &NffLimits::DEFAULT);
        prop_assert_eq!(read.unwrap(), scene);
    }

    #[test]
    fn six_digits_written_again_are_the_same_text(scene in scene()) {
        let once = text(&scene, NumberFormat::default());
        let read = Scene::read_nff(&once[..], &NffLimits::DEFAULT).unwrap();
        let twice = text(&read, NumberFormat::default());
        prop_assert_eq!(String::from_utf8_lossy(&once), String::from_utf8_lossy(&twice));
    }
}

#[test]
fn the_layout_is_that_of_the_databases() {
    let layout = "\
# a comment
b 0.078 0.361 0.753
v
from 2.1 1.3 1.7
at 0 0 0
up 0 0 1
angle 45
hither 0.01
resolution 512 512
l 4 3 2
l 1 -4 4 1 0.5 0.25
f 1 0.75 0.33 0.8 0 100000 0 1
p 3
12 12 -0.5
-12 12 -0.5
-12 -12 -4.44089e-16
s 0.272166 0.272166 0.544331 0.166667
c 0 0 0 0.15 0 0 1 0.1005
pp 3
0 0 0 0 0 1
1 0 0 0 1 -0
0 1 0 1e+06 0 1
";
    let mut writer = NffWriter::new(Vec::new());
    ropewalk_scene::read_nff(layout.as_bytes(), &NffLimits::DEFAULT, &mut writer).unwrap();
    assert_eq!(String::from_utf8_lossy(&writer.into_inner()), layout);
}

#[test]
fn objects_before_the_first_material_have_the_default_one() {
    let scene =
        Scene::read_nff("s 0 0 0 1 f 1 0 0 1 0 1 0 1 s 0 0 0 2".as_bytes(), &NffLimits::DEFAULT)
            .unwrap();
    assert_eq!(scene.materials.len(), 2);
    assert_eq!(scene.materials[0], Material::default());
    assert_eq!(scene.objects.iter().map(|o| o.material).collect::<Vec<_>>(), [0, 1]);
}

#[test]
fn comments_reach_the_sink_and_cannot_break_out() {
    let mut writer = NffWriter::new(Vec::new());
    writer.comment("one\ns 0 0 0 1\r\ntwo").unwrap();
    let text = String::from_utf8(writer.into_inner()).unwrap();
    assert_eq!(text, "#one\n#s 0 0 0 1\n#\n#two\n");
    let long = format!("#{}\ns 0 0 0 1", "x".repeat(100_000));
    let mut writer = NffWriter::new(Vec::new());
    ropewalk_scene::read_nff(long.as_bytes(), &NffLimits::DEFAULT, &mut writer).unwrap();
    let text = String::from_utf8(writer.into_inner()).unwrap();
    assert_eq!(text, format!("#{}\ns 0 0 0 1\n", "x".repeat(4096)));
}

#[test]
fn the_writer_refuses_what_the_reader_would_refuse() {
    let origin = [0.0; 3];
    for (surface, sentence) in [
        (
            Surface::Sphere { center: [0.0, f64::NAN, 0.0], radius: 1.0 },
            "cannot write NaN: NFF numbers are finite",
        ),
        (
            Surface::Polygon(vec![origin; 2]),
            "cannot write a polygon of 2 vertices: NFF polygons have at least 3",
        ),
        (
            Surface::Patch { vertices: vec![origin; 3], normals: vec![origin; 2] },
            "cannot write a patch of 3 vertices and 2 normals: each vertex has one normal",
        ),
    ] {
        let mut writer = NffWriter::new(Vec::new());
        assert_eq!(writer.surface(&surface).unwrap_err().to_string(), sentence);
        assert!(writer.into_inner().is_empty(), "nothing is written of {surface:?}");
    }
}
