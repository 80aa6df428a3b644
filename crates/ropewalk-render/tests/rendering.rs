//! What a render keeps whatever the machine does: threads, cancellation, progress, recording.

mod common;

use common::{EveryPrimitive, MATTE, Stage, still_life};
use ropewalk::{Geometry, Sides};
use ropewalk_render::{
    ImageFileError, Monitor, Progress, RayKind, RenderError, RenderSettings, record_rays, render,
};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

#[test]
fn picture_and_counts_do_not_depend_on_threads() {
    let stage = still_life(70);
    for settings in [
        RenderSettings { aov: true, ..RenderSettings::spd() },
        RenderSettings { samples_per_pixel: 3, aov: true, ..Default::default() },
    ] {
        let one = stage.render(&RenderSettings { threads: Some(1), ..settings });
        for threads in [Some(2), Some(5), None] {
            let many = stage.render(&RenderSettings { threads, ..settings });
            assert_eq!(one.image, many.image);
            assert_eq!(one.aov, many.aov);
            assert_eq!(one.counts, many.counts);
            assert_eq!(one.traversal_by_kind, many.traversal_by_kind);
        }
    }
}

#[test]
fn counting_changes_nothing_but_the_counts() {
    let stage = still_life(40);
    let counted = stage.render(&RenderSettings::spd());
    let plain = stage.render(&RenderSettings { count_traversal: false, ..RenderSettings::spd() });
    assert_eq!((&plain.image, plain.counts), (&counted.image, counted.counts));
    assert_eq!(plain.traversal.intersection_tests, 0);
    assert_eq!(counted.traversal.intersection_tests, 5 * counted.counts.total());
    let shadow = counted.traversal_by_kind[RayKind::Shadow.index()].intersection_tests;
    assert_eq!(shadow, 5 * counted.counts.shadow);
}

#[test]
fn cancelled_render_stops_and_leaves_no_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("stopped.png");
    let cancel = AtomicBool::new(false);
    let stop = |p: Progress| cancel.store(p.done >= 2, Ordering::Relaxed);
    let monitor = Monitor { progress: Some(&stop), cancel: Some(&cancel) };
    let settings = RenderSettings { threads: Some(1), ..Default::default() };
    let out = still_life(200).render_watched(&settings, monitor);
    assert!(out.cancelled);
    assert_eq!(out.counts.primary, 2 * 32 * 32);
    assert!(matches!(out.write(&path), Err(ImageFileError::Cancelled { .. })));
    assert_eq!(std::fs::read_dir(folder.path()).expect("readable").count(), 0);
}

#[test]
fn progress_counts_every_tile_once() {
    let seen = Mutex::new(Vec::new());
    let note = |p: Progress| seen.lock().expect("not poisoned").push(p);
    let monitor = Monitor { progress: Some(&note), cancel: None };
    let out = still_life(65).render_watched(&RenderSettings::default(), monitor);
    assert!(!out.cancelled);
    let mut seen = seen.into_inner().expect("not poisoned");
    seen.sort_by_key(|p| p.done);
    let want: Vec<_> = (1..=9).map(|done| Progress { done, total: 9 }).collect();
    assert_eq!(seen, want);
}

/// A recorded set holds the same rays as the render shot, and answers alike when replayed.
#[test]
fn recorded_rays_are_the_rays_of_the_render() {
    use ropewalk::traverse::{NoCounts, RayCaster};
    let stage = still_life(48);
    let settings = RenderSettings::spd();
    let caster = EveryPrimitive(&stage.geometry);
    let set =
        record_rays(&stage.scene, &stage.geometry, &caster, &settings, 1 << 20).expect("good");
    let counts = stage.render(&settings).counts;
    assert_eq!((set.counts, set.stride), (counts, 1));
    assert_eq!(set.rays.len() as u64, counts.total());
    let mut shadow_hits = 0;
    for r in set.rays.iter().filter(|r| r.kind == RayKind::Shadow) {
        assert_eq!((r.ray.t_min, r.ray.t_max), (0.0, 1.0));
        shadow_hits += u64::from(caster.occluded(&r.ray, &mut NoCounts));
    }
    assert_eq!(shadow_hits, counts.shadow_hits);
    let few = record_rays(&stage.scene, &stage.geometry, &caster, &settings, 1000).expect("good");
    assert!((500..=1000).contains(&few.rays.len()));
    let expected: Vec<_> = set.rays.iter().step_by(few.stride as usize).collect();
    assert!(few.rays.iter().eq(expected.into_iter()));
}

/// More samples approach the coverage of an edge; the same samples come again.
#[test]
fn samples_per_pixel_resolve_an_edge() {
    let dark = ropewalk_scene::Material { kd: 0.0, ..MATTE };
    // Covers x < 0.3 at distance 1; of 8 pixels over -1..1, the sixth spans 0.25..0.5.
    let stage = Stage::new(8, 8).triangle(
        [[-50.0, 1.0, -50.0], [0.3, 1.0, -50.0], [0.3, 1.0, 5000.0]],
        dark,
        Sides::Both,
    );
    let n = 64;
    let settings = RenderSettings { samples_per_pixel: n, ..Default::default() };
    let out = stage.render(&settings);
    assert_eq!(out.counts.primary, 64 * u64::from(n));
    // One sample in each of n columns: the covered fifth is met to one column.
    let open = out.image.pixel(5, 3)[1] / 0.5;
    assert!((open - 0.8).abs() <= 1.0 / n as f32, "{open}");
}

#[test]
fn bad_requests_are_refused() {
    let stage = still_life(8);
    let caster = EveryPrimitive(&stage.geometry);
    let plain = RenderSettings::default();
    let fail = |settings: RenderSettings| {
        render(&stage.scene, &stage.geometry, &caster, &settings, Monitor::default())
            .expect_err("refused")
    };
    let size = fail(RenderSettings { size: Some([0, 5]), ..plain });
    assert!(matches!(size, RenderError::Size { width: 0, height: 5, .. }));
    let huge = fail(RenderSettings { size: Some([u32::MAX, u32::MAX]), ..plain });
    assert!(matches!(huge, RenderError::Size { .. }));
    for settings in [
        RenderSettings { samples_per_pixel: 0, ..plain },
        RenderSettings { max_depth: 0, ..plain },
        RenderSettings { max_depth: 1000, ..plain },
        RenderSettings { threads: Some(0), ..plain },
    ] {
        assert!(matches!(fail(settings), RenderError::Setting { .. }));
    }
    let other = Geometry::new();
    let mismatch = render(&stage.scene, &other, &caster, &plain, Monitor::default());
    assert!(matches!(mismatch, Err(RenderError::GeometryMismatch { geometry: 0, scene: 5 })));
    let mut scene = stage.scene.clone();
    scene.objects[3].material = 77;
    let missing = render(&scene, &stage.geometry, &caster, &plain, Monitor::default());
    assert!(matches!(missing, Err(RenderError::MissingMaterial { object: 3, material: 77, .. })));
}

/// Without a camera and without lights a scene is still seen, and lit from the eye.
#[test]
fn bare_scene_gets_a_view_and_a_light() {
    let mut stage = Stage::new(1, 1).sphere([50.0, 3.0, -7.0], 2.0, MATTE, Sides::Front);
    stage.scene.camera = None;
    let out = stage.render(&RenderSettings { size: Some([64, 64]), ..Default::default() });
    let bright = out.image.pixel(32, 32);
    assert!(bright[0] > 0.95, "{bright:?}");
    assert_eq!(out.image.pixel(0, 0), [0.25, 0.5, 0.75]);
    assert_eq!(out.counts.shadow, out.counts.primary_hits);
}
