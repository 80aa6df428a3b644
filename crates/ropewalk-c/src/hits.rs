//! Queries with lists of hits.

use crate::rays::{RopewalkRay, given};
use crate::scene::{RopewalkScene, out, there};
use crate::status::{RopewalkStatus, guard};
use crate::threads::within;
use engine::kernel::{AllHits, BatchCaster};

/// The hits of several rays, one list a ray, each in the order of `t`, then of primitives.
pub struct RopewalkHitLists(AllHits);

/// All hits of each ray within its range, each once, in order; of `limit` above 0 the first `limit` of each.
///
/// Writes the lists to `lists`, or null; they are to be freed by `ropewalk_hit_lists_free`.
///
/// # Safety
/// `scene` must be a scene, `rays` have `count` entries, `lists` have room for a pointer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ropewalk_all_hits(
    scene: *const RopewalkScene,
    rays: *const RopewalkRay,
    count: usize,
    threads: u32,
    limit: usize,
    lists: *mut *mut RopewalkHitLists,
) -> RopewalkStatus {
    guard(|| {
        // SAFETY: passed on to the caller.
        let (out, scene, rays) =
            unsafe { (out(lists)?, there(scene, "scene")?, given(rays, count)?) };
        let caster = BatchCaster::new(&scene.tree, &scene.geometry);
        let limit = if limit == 0 { usize::MAX } else { limit };
        let hits = within(threads, |n| caster.with_threads(n).first_hits(rays, limit))?;
        *out = Box::into_raw(Box::new(RopewalkHitLists(hits)));
        Ok(())
    })
}

/// Frees lists; null is fine.
///
/// # Safety
/// `lists` must be null or come from this library, and must not have been freed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ropewalk_hit_lists_free(lists: *mut RopewalkHitLists) {
    if !lists.is_null() {
        // SAFETY: the caller's word.
        drop(unsafe { Box::from_raw(lists) });
    }
}

/// Where lists begin: those of ray `i` are the entries `offsets[i]` to `offsets[i + 1] - 1`; there is one offset more than there are
/// rays, and the last one is the number of all hits. Null for null; valid until the lists are freed.
///
/// # Safety
/// `lists` must be null or lists.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ropewalk_hit_lists_offsets(
    lists: *const RopewalkHitLists,
) -> *const usize {
    // SAFETY: the caller's word.
    unsafe { lists.as_ref() }.map_or(std::ptr::null(), |lists| lists.0.offsets.as_ptr())
}

/// Parameters of the hits; see `ropewalk_hit_lists_offsets`.
///
/// # Safety
/// `lists` must be null or lists.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ropewalk_hit_lists_t(lists: *const RopewalkHitLists) -> *const f32 {
    // SAFETY: the caller's word.
    unsafe { lists.as_ref() }.map_or(std::ptr::null(), |lists| lists.0.t.as_ptr())
}

/// Primitives of the hits; see `ropewalk_hit_lists_offsets`.
///
/// # Safety
/// `lists` must be null or lists.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ropewalk_hit_lists_prim_id(lists: *const RopewalkHitLists) -> *const u32 {
    // SAFETY: the caller's word.
    unsafe { lists.as_ref() }.map_or(std::ptr::null(), |lists| lists.0.prim_id.as_ptr())
}
