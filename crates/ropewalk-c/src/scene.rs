//! Scenes: made of arrays, saved, opened, freed.

use crate::arrays::input;
use crate::status::{Failure, RopewalkStatus, guard};
use engine::build::{BuildError, BuildSettings, Monitor, Preset};
use engine::file::{Check, Contents};
use engine::wide::WideTree;
use engine::{Geometry, GeometryError};
use ropewalk_file::{OpenError, SaveError};
use std::ffi::{CStr, c_char, c_void};
use std::path::Path;
use std::sync::Mutex;

/// Triangles and the tree over them. It never changes, and any number of threads may ask it at once.
pub struct RopewalkScene {
    pub(crate) geometry: Geometry,
    pub(crate) tree: WideTree,
}

/// How much work a build takes, and what the tree is worth for it: values of `RopewalkOptions::preset`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RopewalkPreset {
    /// A third to half of the time, somewhat slower rays.
    Fast = 0,
    /// The default.
    Balanced = 1,
    /// Exact sweeps: slower builds, rays a few per cent faster at best.
    Best = 2,
    /// Less memory, somewhat slower rays.
    Compact = 3,
}

/// Told how far a build is, 0 to 1, one call at a time but from any thread; returning false cancels the build.
pub type RopewalkProgress = Option<extern "C" fn(fraction: f64, user: *mut c_void) -> bool>;

/// How a scene is built; begin with `ropewalk_options()`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct RopewalkOptions {
    /// A `RopewalkPreset`.
    pub preset: u32,
    /// Threads of the build; 0 is one a processor. The tree does not depend on it.
    pub threads: u32,
    /// Bytes that build and tree may take beside the triangles; 0 for no limit. A build that needs more is refused before
    /// it takes them.
    pub memory_limit: u64,
    /// Called while the scene is built; may be null.
    pub progress: RopewalkProgress,
    /// Passed on to `progress`.
    pub user: *mut c_void,
}

/// The default options.
#[unsafe(no_mangle)]
pub extern "C" fn ropewalk_options() -> RopewalkOptions {
    RopewalkOptions {
        preset: RopewalkPreset::Balanced as u32,
        threads: 0,
        memory_limit: 0,
        progress: None,
        user: std::ptr::null_mut(),
    }
}

/// Passes progress on, one call at a time.
struct Watch {
    call: Mutex<(RopewalkProgress, *mut c_void, f64, bool)>,
}

// SAFETY: the pointer is only passed on, under a lock; `RopewalkProgress` says that calls come from any thread.
unsafe impl Sync for Watch {}

impl Monitor for Watch {
    fn progress(&self, fraction: f64) {
        let Ok(mut call) = self.call.lock() else { return };
        let (progress, user, done, stopped) = &mut *call;
        if let Some(progress) = progress
            && !*stopped
            && fraction > *done
        {
            *done = fraction;
            *stopped = !progress(fraction, *user);
        }
    }

    fn is_cancelled(&self) -> bool {
        self.call.lock().is_ok_and(|call| call.3)
    }
}

/// Builds a scene of triangles.
///
/// `vertices` has three coordinates a vertex, `triangles` three vertices a triangle; triangle `i` is primitive `i`, hit on both
/// sides. Both are copied. `options` may be null for the default. Triangles without area are kept and never hit.
///
/// Writes the scene to `scene`, or null and returns what went wrong: vertices that are not finite, triangles that name no
/// vertex, no triangles, a limit that is too small.
///
/// # Safety
/// The arrays must have that many entries, and `scene` room for a pointer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ropewalk_scene_new(
    vertices: *const f32,
    vertex_count: usize,
    triangles: *const u32,
    triangle_count: usize,
    options: *const RopewalkOptions,
    scene: *mut *mut RopewalkScene,
) -> RopewalkStatus {
    guard(|| {
        // SAFETY: passed on to the caller.
        let (out, vertices, faces, options) = unsafe {
            let out = out(scene)?;
            let vertices = input(vertices, size(vertex_count, "vertex_count")?, "vertices")?;
            let faces = input(triangles, size(triangle_count, "triangle_count")?, "triangles")?;
            let options = if options.is_null() { ropewalk_options() } else { options.read() };
            (out, vertices, faces, options)
        };
        let preset = match options.preset {
            0 => Preset::Fast,
            1 => Preset::Balanced,
            2 => Preset::Best,
            3 => Preset::Compact,
            found => {
                return Err(Failure::argument(format!(
                    "options.preset is {found}; expected ROPEWALK_PRESET_FAST (0) to ROPEWALK_PRESET_COMPACT (3)"
                )));
            }
        };
        let geometry = Geometry::from_triangles(vertices.as_chunks().0, faces.as_chunks().0)
            .map_err(|error| Failure { status: status_of(&error), message: error.to_string() })?;
        let settings = BuildSettings {
            threads: options.threads as usize,
            memory_limit: (options.memory_limit > 0).then_some(options.memory_limit),
            ..BuildSettings::preset(preset)
        };
        let watch = Watch { call: Mutex::new((options.progress, options.user, 0.0, false)) };
        let (tree, _) = WideTree::build(&geometry, &settings, &watch).map_err(|error| {
            let status = match error {
                BuildError::Cancelled => RopewalkStatus::Cancelled,
                BuildError::Setting { .. } => RopewalkStatus::InvalidArgument,
                _ => RopewalkStatus::OutOfMemory,
            };
            Failure { status, message: error.to_string() }
        })?;
        *out = Box::into_raw(Box::new(RopewalkScene { geometry, tree }));
        Ok(())
    })
}

fn status_of(error: &GeometryError) -> RopewalkStatus {
    match error {
        GeometryError::TooMany { .. } => RopewalkStatus::OutOfMemory,
        _ => RopewalkStatus::InvalidArgument,
    }
}

/// Entries of an array of threes.
fn size(count: usize, name: &str) -> Result<usize, Failure> {
    let error = || Failure::argument(format!("{name} is {count}, more than memory holds"));
    count.checked_mul(3).ok_or_else(error)
}

/// Where a pointer to something new goes, null until there is something.
///
/// # Safety
/// `out` must have room for a pointer, if it is not null.
pub unsafe fn out<'a, T>(out: *mut *mut T) -> Result<&'a mut *mut T, Failure> {
    if out.is_null() {
        return Err(Failure::argument("the place for the result is null"));
    }
    // SAFETY: not null; the rest is the caller's word.
    unsafe {
        out.write(std::ptr::null_mut());
        Ok(&mut *out)
    }
}

/// What a pointer leads to.
///
/// # Safety
/// It must lead there, if it is not null.
pub unsafe fn there<'a, T>(pointer: *const T, name: &str) -> Result<&'a T, Failure> {
    // SAFETY: the caller's word.
    unsafe { pointer.as_ref() }.ok_or_else(|| Failure::argument(format!("{name} is null")))
}

/// Frees a scene; null is fine. It must not be used by any thread then.
///
/// # Safety
/// `scene` must be null or come from this library, and must not have been freed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ropewalk_scene_free(scene: *mut RopewalkScene) {
    if !scene.is_null() {
        // SAFETY: the caller's word.
        drop(unsafe { Box::from_raw(scene) });
    }
}

/// Number of triangles; 0 for null.
///
/// # Safety
/// `scene` must be null or a scene.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ropewalk_scene_size(scene: *const RopewalkScene) -> usize {
    // SAFETY: the caller's word.
    unsafe { scene.as_ref() }.map_or(0, |scene| scene.geometry.len())
}

/// Bytes of the tree with its own triangles; 0 for null. Of an opened scene they lie in its file.
///
/// # Safety
/// `scene` must be null or a scene.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ropewalk_scene_bytes(scene: *const RopewalkScene) -> usize {
    // SAFETY: the caller's word.
    unsafe { scene.as_ref() }.map_or(0, |scene| scene.tree.bytes())
}

/// Saves a scene into a file (UTF-8 path), written under another name and then renamed, so that there is a whole file or none.
///
/// # Safety
/// `scene` must be a scene, `path` end with a zero.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ropewalk_scene_save(
    scene: *const RopewalkScene,
    path: *const c_char,
) -> RopewalkStatus {
    guard(|| {
        // SAFETY: passed on to the caller.
        let (scene, path) = unsafe { (there(scene, "scene")?, text(path)?) };
        let saved = ropewalk_file::save(path, &Contents::new(&scene.tree, &scene.geometry));
        saved.map(|_| ()).map_err(|error: SaveError| Failure {
            status: RopewalkStatus::Io,
            message: error.to_string(),
        })
    })
}

/// Opens a file that was saved here, in Rust, Python or by the command, by mapping it into memory; the primitives of several meshes
/// are numbered through. Header, sizes and links are checked, and with `verify` the checksums of all bytes.
///
/// # Safety
/// `path` must end with a zero, and `scene` have room for a pointer; nobody may change the file while it is in use.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ropewalk_scene_open(
    path: *const c_char,
    verify: bool,
    scene: *mut *mut RopewalkScene,
) -> RopewalkStatus {
    guard(|| {
        // SAFETY: passed on to the caller.
        let (out, path) = unsafe { (out(scene)?, text(path)?) };
        let check = if verify { Check::Everything } else { Check::Structure };
        let opened = ropewalk_file::open(path, check).map_err(|error| {
            let status = match error {
                OpenError::Content { .. } => RopewalkStatus::BadFile,
                _ => RopewalkStatus::Io,
            };
            Failure { status, message: error.to_string() }
        })?;
        let (geometry, tree) = (opened.geometry, opened.tree);
        *out = Box::into_raw(Box::new(RopewalkScene { geometry, tree }));
        Ok(())
    })
}

/// A path.
unsafe fn text<'a>(path: *const c_char) -> Result<&'a Path, Failure> {
    if path.is_null() {
        return Err(Failure::argument("path is null"));
    }
    // SAFETY: not null; that it ends is the caller's word.
    let text = unsafe { CStr::from_ptr(path) };
    text.to_str().map(Path::new).map_err(|_| Failure::argument("path is not UTF-8"))
}
