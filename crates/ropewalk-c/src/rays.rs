//! Queries with one answer a ray.

use crate::arrays::{input, output};
use crate::scene::{RopewalkScene, there};
use crate::status::{RopewalkStatus, guard};
use crate::threads::within;
use engine::kernel::BatchCaster;
use engine::ray::PreparedRay;
use engine::{Hit, Ray};
use rayon::prelude::*;
use std::mem::{offset_of, size_of};

/// The id that stands for no primitive.
pub const ROPEWALK_NONE: u32 = u32::MAX;

/// A ray: a hit at `t` is accepted if `t_min <= t <= t_max`, in lengths of `direction`, which need not be 1.
///
/// Rays with NaN, an infinite origin or direction, a zero direction or `t_min > t_max` hit nothing.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct RopewalkRay {
    /// Start point.
    pub origin: [f32; 3],
    /// Direction.
    pub direction: [f32; 3],
    /// Smallest accepted parameter, mostly 0.
    pub t_min: f32,
    /// Largest accepted parameter; may be infinite.
    pub t_max: f32,
}

// They are the core's rays by another name.
const _: () = assert!(
    size_of::<RopewalkRay>() == size_of::<Ray>()
        && align_of::<RopewalkRay>() == align_of::<Ray>()
        && offset_of!(RopewalkRay, direction) == offset_of!(Ray, dir)
        && offset_of!(RopewalkRay, t_min) == offset_of!(Ray, t_min)
        && offset_of!(RopewalkRay, t_max) == offset_of!(Ray, t_max)
);

/// Rays of the caller.
///
/// # Safety
/// As for [`input`].
pub unsafe fn given<'a>(
    rays: *const RopewalkRay,
    count: usize,
) -> Result<&'a [Ray], crate::status::Failure> {
    // SAFETY: of the same layout, as asserted above; the rest is passed on to the caller.
    unsafe { input(rays.cast::<Ray>(), count, "rays") }
}

/// The first hit of each ray: its parameter (infinite for a miss) and primitive (`ROPEWALK_NONE` for a miss).
///
/// `threads` is 1 for the calling thread alone, 0 for one a processor. Answers do not depend on it.
///
/// # Safety
/// `scene` must be a scene, the arrays must have `count` entries each and not overlap.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ropewalk_closest_hit(
    scene: *const RopewalkScene,
    rays: *const RopewalkRay,
    count: usize,
    threads: u32,
    t: *mut f32,
    prim_id: *mut u32,
) -> RopewalkStatus {
    guard(|| {
        // SAFETY: passed on to the caller.
        let (scene, rays, t, prim_id) = unsafe {
            let scene = there(scene, "scene")?;
            let (t, prim_id) = (output(t, count, "t")?, output(prim_id, count, "prim_id")?);
            (scene, given(rays, count)?, t, prim_id)
        };
        let caster = BatchCaster::new(&scene.tree, &scene.geometry);
        within(threads, |n| caster.with_threads(n).closest_hit_into(rays, t, prim_id))?;
        Ok(())
    })
}

/// Whether each ray hits anything in its range.
///
/// # Safety
/// As for `ropewalk_closest_hit`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ropewalk_occluded(
    scene: *const RopewalkScene,
    rays: *const RopewalkRay,
    count: usize,
    threads: u32,
    occluded: *mut bool,
) -> RopewalkStatus {
    guard(|| {
        // SAFETY: passed on to the caller.
        let (scene, rays, occluded) = unsafe {
            let scene = there(scene, "scene")?;
            (scene, given(rays, count)?, output(occluded, count, "occluded")?)
        };
        let caster = BatchCaster::new(&scene.tree, &scene.geometry);
        within(threads, |n| caster.with_threads(n).occluded_into(rays, occluded))?;
        Ok(())
    })
}

/// The number of triangles that each ray hits.
///
/// # Safety
/// As for `ropewalk_closest_hit`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ropewalk_count_hits(
    scene: *const RopewalkScene,
    rays: *const RopewalkRay,
    count: usize,
    threads: u32,
    hits: *mut u32,
) -> RopewalkStatus {
    guard(|| {
        // SAFETY: passed on to the caller.
        let (scene, rays, hits) =
            unsafe { (there(scene, "scene")?, given(rays, count)?, output(hits, count, "hits")?) };
        let caster = BatchCaster::new(&scene.tree, &scene.geometry);
        let counts = within(threads, |n| caster.with_threads(n).count_hits(rays))?;
        hits.copy_from_slice(&counts);
        Ok(())
    })
}

/// The surface at a hit. All NaN for a miss.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct RopewalkSurface {
    /// Weights of vertices 1 and 2: the hit is at `(1 - u - v) v0 + u v1 + v v2`, as Embree has it.
    pub u: f32,
    /// See `u`.
    pub v: f32,
    /// Unit normal, on the side from which the vertices run counter-clockwise.
    pub normal: [f32; 3],
}

/// The surface at the hits that `ropewalk_closest_hit` has found for the same rays.
///
/// # Safety
/// As for `ropewalk_closest_hit`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ropewalk_surface(
    scene: *const RopewalkScene,
    rays: *const RopewalkRay,
    count: usize,
    threads: u32,
    t: *const f32,
    prim_id: *const u32,
    surface: *mut RopewalkSurface,
) -> RopewalkStatus {
    guard(|| {
        // SAFETY: passed on to the caller.
        let (scene, rays, t, prim_id, surface) = unsafe {
            let (t, prim_id) = (input(t, count, "t")?, input(prim_id, count, "prim_id")?);
            let surface = output(surface, count, "surface")?;
            (there(scene, "scene")?, given(rays, count)?, t, prim_id, surface)
        };
        let nothing = RopewalkSurface { u: f32::NAN, v: f32::NAN, normal: [f32::NAN; 3] };
        let look = |i: usize| {
            let prepared = PreparedRay::new(&Ray { t_min: t[i], t_max: t[i], ..rays[i] });
            let hit = prepared.and_then(|ray| scene.geometry.intersect(prim_id[i], &ray));
            hit.map_or(nothing, |hit: Hit| RopewalkSurface {
                u: hit.u,
                v: hit.v,
                normal: scene.geometry.normals(&rays[i], &hit).geometric.map(|x| x as f32),
            })
        };
        within(threads, |n| {
            if n == 1 {
                surface.iter_mut().enumerate().for_each(|(i, s)| *s = look(i));
            } else {
                let surface = surface.par_iter_mut().with_min_len(1024).enumerate();
                surface.for_each(|(i, s)| *s = look(i));
            }
        })
    })
}
