//! Intel Embree 4 through its C API, loaded at run time from a shared library.
//!
//! The structures are those of `rtcore_ray.h`, `rtcore_common.h` and `rtcore_scene.h` as compiled
//! by default: one level of instancing, instance arrays on, no minimal width.
#![allow(unsafe_code)]

mod points;

use crate::answer::{BenchHit, HitLists, NO_PRIMITIVE};
use crate::harness::{Builder, Built, Clock, Engine, Family};
use crate::scene::Mesh;
use crate::workload::Question;
use anyhow::Context;
use libloading::Library;
use ropewalk::Ray;
use std::ffi::{CStr, CString, c_char, c_int, c_uint, c_void};
use std::path::{Path, PathBuf};
use std::ptr::null_mut;
use std::sync::Arc;
use std::sync::atomic::{AtomicIsize, Ordering::Relaxed};

type Handle = *mut c_void;

const GEOMETRY_TRIANGLE: c_int = 0;
const BUFFER_INDEX: c_int = 0;
const BUFFER_VERTEX: c_int = 1;
const FORMAT_UINT3: c_int = 0x5003;
const FORMAT_FLOAT3: c_int = 0x9003;
const QUALITY_MEDIUM: c_int = 1;
const QUALITY_HIGH: c_int = 2;
const SCENE_ROBUST: c_int = 1 << 2;
const SCENE_FILTER_IN_ARGUMENTS: c_int = 1 << 3;
const QUERY_INVOKE_ARGUMENT_FILTER: c_int = 1 << 1;
const QUERY_COHERENT: c_int = 1 << 16;
const FEATURES_ALL: c_uint = u32::MAX;
const LANES: usize = 16;

/// `RTCRayHit`; a prefix of it is `RTCRay`.
#[repr(C, align(64))]
struct RayHit {
    origin: [f32; 3],
    t_near: f32,
    dir: [f32; 3],
    time: f32,
    t_far: f32,
    mask: u32,
    id: u32,
    flags: u32,
    normal: [f32; 3],
    u: f32,
    v: f32,
    prim: u32,
    geom: u32,
    inst: u32,
    inst_prim: u32,
}

impl RayHit {
    fn new(ray: &Ray) -> Self {
        RayHit {
            origin: ray.origin,
            t_near: ray.t_min,
            dir: ray.dir,
            time: 0.0,
            t_far: ray.t_max,
            mask: u32::MAX,
            id: 0,
            flags: 0,
            normal: [0.0; 3],
            u: 0.0,
            v: 0.0,
            prim: NO_PRIMITIVE,
            geom: u32::MAX,
            inst: u32::MAX,
            inst_prim: u32::MAX,
        }
    }
}

/// `RTCRayHit16`; a prefix of it is `RTCRay16`.
#[repr(C, align(64))]
struct RayHit16 {
    origin: [[f32; LANES]; 3],
    t_near: [f32; LANES],
    dir: [[f32; LANES]; 3],
    time: [f32; LANES],
    t_far: [f32; LANES],
    mask: [u32; LANES],
    id: [u32; LANES],
    flags: [u32; LANES],
    normal: [[f32; LANES]; 3],
    u: [f32; LANES],
    v: [f32; LANES],
    prim: [u32; LANES],
    geom: [u32; LANES],
    inst: [u32; LANES],
    inst_prim: [u32; LANES],
}

impl RayHit16 {
    const EMPTY: RayHit16 = RayHit16 {
        origin: [[0.0; LANES]; 3],
        t_near: [0.0; LANES],
        dir: [[0.0; LANES]; 3],
        time: [0.0; LANES],
        t_far: [0.0; LANES],
        mask: [u32::MAX; LANES],
        id: [0; LANES],
        flags: [0; LANES],
        normal: [[0.0; LANES]; 3],
        u: [0.0; LANES],
        v: [0.0; LANES],
        prim: [NO_PRIMITIVE; LANES],
        geom: [u32::MAX; LANES],
        inst: [u32::MAX; LANES],
        inst_prim: [u32::MAX; LANES],
    };

    /// Takes up to 16 rays; the other lanes are masked out by the returned mask.
    fn load(&mut self, rays: &[Ray]) -> Mask16 {
        let mut valid = Mask16([0; LANES]);
        for (i, ray) in rays.iter().enumerate() {
            for a in 0..3 {
                self.origin[a][i] = ray.origin[a];
                self.dir[a][i] = ray.dir[a];
            }
            self.t_near[i] = ray.t_min;
            self.t_far[i] = ray.t_max;
            valid.0[i] = -1;
        }
        self.geom = [u32::MAX; LANES];
        valid
    }
}

#[repr(C, align(64))]
struct Mask16([c_int; LANES]);

/// `RTCIntersectArguments` and `RTCOccludedArguments`, which have the same layout.
#[repr(C)]
struct Arguments {
    flags: c_int,
    features: c_uint,
    context: *mut Context1,
    filter: Option<Filter>,
    intersect: *mut c_void,
}

impl Arguments {
    fn new(flags: c_int) -> Self {
        let (context, intersect) = (null_mut(), null_mut());
        Arguments { flags, features: FEATURES_ALL, context, filter: None, intersect }
    }
}

/// `RTCRayQueryContext`, extended by what the filter collects.
#[repr(C)]
struct Context1 {
    inst: u32,
    inst_prim: u32,
    found: *mut Vec<BenchHit>,
    limit: usize,
}

/// `RTCFilterFunctionNArguments`.
#[repr(C)]
struct FilterArguments {
    valid: *mut c_int,
    user: *mut c_void,
    context: *mut Context1,
    ray: *mut f32,
    hit: *const f32,
    n: c_uint,
}

type Filter = unsafe extern "C" fn(*const FilterArguments);
type Intersect1 = unsafe extern "C" fn(Handle, *mut RayHit, *mut Arguments);
type Intersect16 = unsafe extern "C" fn(*const Mask16, Handle, *mut RayHit16, *mut Arguments);
type MemoryMonitor = unsafe extern "C" fn(*mut c_void, isize, bool) -> bool;

/// Offsets in floats inside `RTCRayN` and `RTCHitN` with N = 1.
const RAY_T_FAR: usize = 8;
const HIT_PRIM: usize = 5;

macro_rules! api {
    ($($name:ident: $kind:ty,)*) => {
        /// The functions of the library that are used here, and the library that holds them.
        #[allow(non_snake_case)]
        struct Api { $($name: $kind,)* _library: Library }

        impl Api {
            #[allow(non_snake_case)]
            fn load(path: &Path) -> anyhow::Result<Api> {
                // SAFETY: the file is a shared library of Embree, whose initialisers have no
                // precondition; the symbols have the types of Embree's public headers.
                unsafe {
                    let library = Library::new(path)?;
                    $(let $name = *library.get::<$kind>(concat!(stringify!($name), "\0").as_bytes())?;)*
                    Ok(Api { $($name,)* _library: library })
                }
            }
        }
    };
}

api! {
    rtcNewDevice: unsafe extern "C" fn(*const c_char) -> Handle,
    rtcReleaseDevice: unsafe extern "C" fn(Handle),
    rtcGetDeviceError: unsafe extern "C" fn(Handle) -> c_int,
    rtcGetDeviceLastErrorMessage: unsafe extern "C" fn(Handle) -> *const c_char,
    rtcGetDeviceProperty: unsafe extern "C" fn(Handle, c_int) -> isize,
    rtcSetDeviceMemoryMonitorFunction: unsafe extern "C" fn(Handle, Option<MemoryMonitor>, *mut c_void),
    rtcNewScene: unsafe extern "C" fn(Handle) -> Handle,
    rtcReleaseScene: unsafe extern "C" fn(Handle),
    rtcSetSceneBuildQuality: unsafe extern "C" fn(Handle, c_int),
    rtcSetSceneFlags: unsafe extern "C" fn(Handle, c_int),
    rtcCommitScene: unsafe extern "C" fn(Handle),
    rtcNewGeometry: unsafe extern "C" fn(Handle, c_int) -> Handle,
    rtcReleaseGeometry: unsafe extern "C" fn(Handle),
    rtcSetNewGeometryBuffer: unsafe extern "C" fn(Handle, c_int, c_uint, c_int, usize, usize) -> Handle,
    rtcSetGeometryBuildQuality: unsafe extern "C" fn(Handle, c_int),
    rtcCommitGeometry: unsafe extern "C" fn(Handle),
    rtcAttachGeometry: unsafe extern "C" fn(Handle, Handle) -> c_uint,
    rtcIntersect1: Intersect1,
    rtcOccluded1: Intersect1,
    rtcIntersect16: Intersect16,
    rtcOccluded16: Intersect16,
    rtcPointQuery: points::PointQuery,
}

/// A loaded library with a device.
pub struct Embree {
    api: Api,
    device: Handle,
    /// Bytes allocated by the device, as its monitor reports them.
    bytes: Box<AtomicIsize>,
    threads: usize,
}

// SAFETY: Embree's devices may be used from any thread; the handle is never changed.
unsafe impl Send for Embree {}
// SAFETY: as above; the only mutable state on this side is atomic.
unsafe impl Sync for Embree {}

impl Embree {
    /// The library somewhere below a folder, such as that of the package scripts/bench installs.
    pub fn find(below: &Path) -> Option<PathBuf> {
        for entry in std::fs::read_dir(below).ok()?.flatten() {
            let (path, name) = (entry.path(), entry.file_name());
            if name.to_string_lossy().starts_with("libembree4") {
                return Some(path);
            }
            if entry.file_type().is_ok_and(|t| t.is_dir())
                && let Some(found) = Self::find(&path)
            {
                return Some(found);
            }
        }
        None
    }

    /// Loads the library and opens a device that builds with `threads` threads.
    ///
    /// With one thread the process is pinned to one CPU while the device is opened: its worker
    /// thread spins if it may use more than one, and would disturb every measurement. Must then be
    /// called from the main thread, whose mask the library reads.
    ///
    /// # Errors
    /// If the library cannot be loaded, lacks a function, or opens no device.
    pub fn load(path: &Path, threads: usize) -> anyhow::Result<Arc<Embree>> {
        let api = Api::load(path).with_context(|| format!("loading {}", path.display()))?;
        let _pinned = (threads == 1).then(PinnedToOneCpu::new).transpose()?;
        let settings =
            CString::new(format!("threads={threads},user_threads=0,set_affinity=0,hugepages=1"))?;
        // SAFETY: a valid C string; a null result is caught below.
        let device = unsafe { (api.rtcNewDevice)(settings.as_ptr()) };
        anyhow::ensure!(!device.is_null(), "Embree opened no device");
        let bytes = Box::new(AtomicIsize::new(0));
        let user = (&raw const *bytes).cast_mut().cast();
        // SAFETY: the counter lives on the heap as long as the device, which is released first.
        unsafe { (api.rtcSetDeviceMemoryMonitorFunction)(device, Some(count_bytes), user) };
        Ok(Arc::new(Embree { api, device, bytes, threads }))
    }

    /// Version of the library, such as `4.4.0`.
    pub fn version(&self) -> String {
        let property = |index| {
            // SAFETY: the device is alive; properties 1, 2 and 3 are the version's numbers.
            unsafe { (self.api.rtcGetDeviceProperty)(self.device, index) }
        };
        format!("{}.{}.{}", property(1), property(2), property(3))
    }

    fn check(&self) -> anyhow::Result<()> {
        // SAFETY: the device is alive, and the message is read before the next call.
        unsafe {
            let code = (self.api.rtcGetDeviceError)(self.device);
            let message = (self.api.rtcGetDeviceLastErrorMessage)(self.device);
            let text = if message.is_null() { c"" } else { CStr::from_ptr(message) };
            anyhow::ensure!(code == 0, "Embree error {code}: {}", text.to_string_lossy());
        }
        Ok(())
    }
}

impl Drop for Embree {
    fn drop(&mut self) {
        // SAFETY: the scenes hold an `Arc` of this, so none is left; released once.
        unsafe { (self.api.rtcReleaseDevice)(self.device) }
    }
}

unsafe extern "C" fn count_bytes(user: *mut c_void, bytes: isize, _post: bool) -> bool {
    // SAFETY: `user` is the counter given to the device, which outlives it.
    unsafe { (*user.cast::<AtomicIsize>()).fetch_add(bytes, Relaxed) };
    true
}

/// Restricts the calling thread to one CPU until dropped.
struct PinnedToOneCpu(rustix::thread::CpuSet);

impl PinnedToOneCpu {
    fn new() -> anyhow::Result<Self> {
        let before = rustix::thread::sched_getaffinity(None)?;
        let first = (0..rustix::thread::CpuSet::MAX_CPU).find(|&c| before.is_set(c));
        let mut one = rustix::thread::CpuSet::new();
        one.set(first.context("the process may run on no CPU")?);
        rustix::thread::sched_setaffinity(None, &one)?;
        Ok(PinnedToOneCpu(before))
    }
}

impl Drop for PinnedToOneCpu {
    fn drop(&mut self) {
        // The mask was in force before; should restoring fail, the process stays on one CPU.
        let _ = rustix::thread::sched_setaffinity(None, &self.0);
    }
}

/// How a scene is built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Quality {
    /// High quality, with spatial splits unless robust; else medium.
    pub high: bool,
    /// The robust flag; it silently turns spatial splits off.
    pub robust: bool,
    /// Accepts filters with each call, for all hits.
    pub filter: bool,
}

/// A built scene of one mesh.
pub struct EmbreeScene {
    embree: Arc<Embree>,
    scene: Handle,
    quality: Quality,
    /// The commit: CPU and wall seconds.
    seconds: (f64, f64),
    /// Bytes of the tree with its own triangles; the caller's vertices and indices left out.
    bytes: usize,
}

// SAFETY: a committed scene may be traced from any thread.
unsafe impl Send for EmbreeScene {}
// SAFETY: as above; nothing changes after the commit.
unsafe impl Sync for EmbreeScene {}

impl EmbreeScene {
    /// Builds a scene.
    ///
    /// # Errors
    /// What the device reports.
    pub fn build(embree: &Arc<Embree>, mesh: &Mesh, quality: Quality) -> anyhow::Result<Self> {
        let api = &embree.api;
        let level = if quality.high { QUALITY_HIGH } else { QUALITY_MEDIUM };
        let flags = if quality.robust { SCENE_ROBUST } else { 0 }
            | if quality.filter { SCENE_FILTER_IN_ARGUMENTS } else { 0 };
        // SAFETY: the handles are used in the documented order; the buffers that Embree returns
        // hold as many items as asked for, and are checked for null before they are written.
        let (scene, clock, before) = unsafe {
            let scene = (api.rtcNewScene)(embree.device);
            (api.rtcSetSceneBuildQuality)(scene, level);
            (api.rtcSetSceneFlags)(scene, flags);
            let geometry = (api.rtcNewGeometry)(embree.device, GEOMETRY_TRIANGLE);
            let new_buffer = api.rtcSetNewGeometryBuffer;
            let (nv, nf) = (mesh.vertices.len(), mesh.faces.len());
            let vertices = new_buffer(geometry, BUFFER_VERTEX, 0, FORMAT_FLOAT3, 12, nv);
            let faces = new_buffer(geometry, BUFFER_INDEX, 0, FORMAT_UINT3, 12, nf);
            embree.check()?;
            anyhow::ensure!(!vertices.is_null() && !faces.is_null(), "Embree gave no buffer");
            std::ptr::copy_nonoverlapping(mesh.vertices.as_ptr(), vertices.cast(), nv);
            std::ptr::copy_nonoverlapping(mesh.faces.as_ptr(), faces.cast(), nf);
            (api.rtcSetGeometryBuildQuality)(geometry, level);
            (api.rtcCommitGeometry)(geometry);
            (api.rtcAttachGeometry)(scene, geometry);
            (api.rtcReleaseGeometry)(geometry);
            let before = embree.bytes.load(Relaxed);
            let clock = Clock::start();
            (api.rtcCommitScene)(scene);
            (scene, clock, before)
        };
        let seconds = clock.elapsed();
        let bytes = (embree.bytes.load(Relaxed) - before).max(0) as usize;
        let built = EmbreeScene { embree: Arc::clone(embree), scene, quality, seconds, bytes };
        embree.check()?;
        Ok(built)
    }

    fn call(&self, function: Intersect1, ray: &mut RayHit, arguments: &mut Arguments) {
        // SAFETY: scene, ray and arguments are valid and laid out as the function expects.
        unsafe { function(self.scene, ray, arguments) }
    }

    fn call16(
        &self,
        function: Intersect16,
        valid: &Mask16,
        rays: &mut RayHit16,
        arguments: &mut Arguments,
    ) {
        // SAFETY: as in `call`; mask and packet are aligned to 64 bytes.
        unsafe { function(valid, self.scene, rays, arguments) }
    }
}

impl Drop for EmbreeScene {
    fn drop(&mut self) {
        // SAFETY: created once, released once, while the device is alive.
        unsafe { (self.embree.api.rtcReleaseScene)(self.scene) }
    }
}

/// Which function of the C API is called.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Call {
    /// `rtcIntersect1`, `rtcOccluded1`.
    Single,
    /// `rtcIntersect16`, `rtcOccluded16`.
    Packet,
    /// The same with the coherent flag.
    PacketCoherent,
    /// `rtcIntersect1` with a filter that collects: all hits.
    Filter,
}

/// An entry point of Embree on a scene.
pub struct EmbreeEngine {
    scene: Arc<EmbreeScene>,
    call: Call,
}

impl EmbreeEngine {
    /// An entry point on a scene; [`Call::Filter`] needs a scene built with [`Quality::filter`].
    pub fn new(scene: &Arc<EmbreeScene>, call: Call) -> Self {
        EmbreeEngine { scene: Arc::clone(scene), call }
    }

    fn packet_arguments(&self) -> Arguments {
        Arguments::new(if self.call == Call::PacketCoherent { QUERY_COHERENT } else { 0 })
    }
}

impl Engine for EmbreeEngine {
    fn name(&self) -> String {
        let call = match self.call {
            Call::Single => "1",
            Call::Packet => "16",
            Call::PacketCoherent => "16c",
            Call::Filter => "filter",
        };
        format!("embree-{call}{}", if self.scene.quality.robust { "-robust" } else { "" })
    }

    fn family(&self) -> Family {
        if self.scene.quality.robust { Family::EmbreeRobust } else { Family::Embree }
    }

    fn level(&self) -> &str {
        "auto"
    }

    fn supports(&self, question: Question) -> bool {
        match question {
            Question::AllHits | Question::FirstHits(_) => self.call == Call::Filter,
            Question::Build => false,
            _ => self.call != Call::Filter,
        }
    }

    fn closest(&self, rays: &[Ray], out: &mut [BenchHit]) {
        let api = &self.scene.embree.api;
        if self.call == Call::Single {
            let mut arguments = Arguments::new(0);
            for (ray, hit) in rays.iter().zip(out) {
                let mut r = RayHit::new(ray);
                self.scene.call(api.rtcIntersect1, &mut r, &mut arguments);
                *hit = hit_of(r.geom, r.t_far, r.prim);
            }
            return;
        }
        let (mut packet, mut arguments) = (RayHit16::EMPTY, self.packet_arguments());
        for (rays, hits) in rays.chunks(LANES).zip(out.chunks_mut(LANES)) {
            let valid = packet.load(rays);
            self.scene.call16(api.rtcIntersect16, &valid, &mut packet, &mut arguments);
            for (i, hit) in hits.iter_mut().enumerate() {
                *hit = hit_of(packet.geom[i], packet.t_far[i], packet.prim[i]);
            }
        }
    }

    fn occluded(&self, rays: &[Ray], out: &mut [bool]) {
        let api = &self.scene.embree.api;
        if self.call == Call::Single {
            let mut arguments = Arguments::new(0);
            for (ray, flag) in rays.iter().zip(out) {
                let mut r = RayHit::new(ray);
                self.scene.call(api.rtcOccluded1, &mut r, &mut arguments);
                *flag = r.t_far == f32::NEG_INFINITY;
            }
            return;
        }
        let (mut packet, mut arguments) = (RayHit16::EMPTY, self.packet_arguments());
        for (rays, flags) in rays.chunks(LANES).zip(out.chunks_mut(LANES)) {
            let valid = packet.load(rays);
            self.scene.call16(api.rtcOccluded16, &valid, &mut packet, &mut arguments);
            for (i, flag) in flags.iter_mut().enumerate() {
                *flag = packet.t_far[i] == f32::NEG_INFINITY;
            }
        }
    }

    fn hits(&self, rays: &[Ray], limit: usize, out: &mut HitLists) {
        let api = &self.scene.embree.api;
        let mut found = Vec::new();
        let mut context =
            Context1 { inst: u32::MAX, inst_prim: u32::MAX, found: &raw mut found, limit };
        let mut arguments = Arguments::new(QUERY_INVOKE_ARGUMENT_FILTER);
        arguments.context = &raw mut context;
        arguments.filter = Some(if limit == usize::MAX { collect_all } else { collect_first });
        out.clear();
        for ray in rays {
            let mut r = RayHit::new(ray);
            self.scene.call(api.rtcIntersect1, &mut r, &mut arguments);
            // SAFETY: the call is over, so nobody else refers to the list; the pointer is the one
            // that the context holds.
            out.push_unordered(unsafe { &mut *context.found }, limit);
        }
    }
}

fn hit_of(geom: u32, t: f32, prim: u32) -> BenchHit {
    if geom == u32::MAX { BenchHit::MISS } else { BenchHit { t, prim } }
}

/// Takes note of each hit and rejects it, so that the ray goes on.
unsafe extern "C" fn collect_all(arguments: *const FilterArguments) {
    // SAFETY: Embree calls with one ray (N = 1) and the context that `hits` gave it.
    unsafe {
        let a = &*arguments;
        let prim = (*a.hit.add(HIT_PRIM)).to_bits();
        (*(*a.context).found).push(BenchHit { t: *a.ray.add(RAY_T_FAR), prim });
        *a.valid = 0;
    }
}

/// Keeps the first hits in order. Once there are enough, the last of them is accepted as the end
/// of the ray, so that nothing beyond it is visited.
unsafe extern "C" fn collect_first(arguments: *const FilterArguments) {
    // SAFETY: as in `collect_all`; the list is borrowed for this call alone.
    unsafe {
        let a = &*arguments;
        let prim = (*a.hit.add(HIT_PRIM)).to_bits();
        let hit = BenchHit { t: *a.ray.add(RAY_T_FAR), prim };
        let (found, limit) = (&mut *(*a.context).found, (*a.context).limit);
        *a.valid = 0;
        if !found.iter().any(|h| h.prim == prim) {
            let place = found.partition_point(|h| h.order(&hit).is_lt());
            found.insert(place, hit);
            found.truncate(limit);
        }
        if found.len() == limit {
            *a.ray.add(RAY_T_FAR) = found[limit - 1].t;
            *a.valid = -1;
        }
    }
}

/// Times builds of one quality.
pub struct EmbreeBuilder<'a> {
    /// A device that builds with the number of threads that will be asked for.
    pub device: &'a Arc<Embree>,
    /// The mesh.
    pub mesh: &'a Mesh,
    /// The quality.
    pub quality: Quality,
}

impl Builder for EmbreeBuilder<'_> {
    fn name(&self) -> String {
        let level = if self.quality.high { "high" } else { "medium" };
        format!("embree-{level}{}", if self.quality.robust { "-robust" } else { "" })
    }

    fn family(&self) -> Family {
        if self.quality.robust { Family::EmbreeRobust } else { Family::Embree }
    }

    fn build(&self, threads: usize) -> anyhow::Result<Built> {
        let found = self.device.threads;
        anyhow::ensure!(found == threads, "the device has {found} threads, not {threads}");
        let scene = EmbreeScene::build(self.device, self.mesh, self.quality)?;
        let (cpu, wall) = scene.seconds;
        let seconds = if threads == 1 { cpu } else { wall };
        Ok(Built { seconds, wall_seconds: wall, bytes: Some(scene.bytes) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_structures_have_the_sizes_of_the_headers() {
        // RTCRay is 48 bytes, RTCHit 36, RTCRayHit is padded to 96 and aligned to 16 there.
        assert_eq!(std::mem::offset_of!(RayHit, normal), 48);
        assert_eq!(std::mem::offset_of!(RayHit, prim), 68);
        assert_eq!(std::mem::offset_of!(RayHit, inst_prim), 80);
        assert_eq!(std::mem::offset_of!(RayHit16, normal), 12 * 64);
        assert_eq!(std::mem::offset_of!(RayHit16, geom), 18 * 64);
        assert_eq!(size_of::<Arguments>(), 32);
    }

    #[test]
    fn pinning_is_undone() {
        let before = rustix::thread::sched_getaffinity(None).unwrap();
        drop(PinnedToOneCpu::new().unwrap());
        assert_eq!(rustix::thread::sched_getaffinity(None).unwrap(), before);
    }
}
