//! Scenes by name: files, compressed or not, and built-in scenes.

use crate::mesh::{
    self, GZIP_MAGIC, Mesh, MeshError, MeshErrorKind, MeshFormat, MeshLimits, Recognised,
};
use crate::model::{Material, Object, Scene, Surface};
use crate::nff::{NffError, NffLimits};
use crate::room;
use crate::spd::{self, Spd, SpdError};
use crate::stage::Stage;
use crate::watched;
use flate2::bufread::MultiGzDecoder;
use ropewalk::build::Monitor;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;

/// Prefix of built-in scenes: `spd:NAME[:SIZE]`.
const BUILTIN_PREFIX: &str = "spd:";
/// Prefix of built-in stages: `stage:room[:SIZE]`.
const STAGE_PREFIX: &str = "stage:";
/// The one there is.
const ROOM: &str = "room";
/// Read buffer in bytes: large enough that calls into the system do not show.
const BUFFER_BYTES: usize = 64 * 1024;

/// Why a scene could not be had. Each displays as one sentence that names the scene.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The file cannot be opened.
    #[error("{path}: cannot open the scene file: {}", open_reason(.source))]
    Open {
        /// The file as the user named it.
        path: String,
        /// What the system says.
        source: io::Error,
    },
    /// The path names a directory.
    #[error("{path}: expected a scene file, found a directory")]
    Directory {
        /// The path as the user named it.
        path: String,
    },
    /// The name ends in `.gz` but the content is not gzip.
    #[error("{path}: expected gzip data, as the name says, found something else")]
    NotGzip {
        /// The file as the user named it.
        path: String,
    },
    /// The file is neither a scene nor a mesh, by its content and its name.
    #[error(
        "{path}: expected a scene in NFF or a mesh in OBJ, PLY, STL, OFF or glTF, found {found}"
    )]
    Unrecognised {
        /// The file as the user named it.
        path: String,
        /// What it looks like.
        found: &'static str,
    },
    /// The text is at fault.
    #[error(transparent)]
    Nff(#[from] NffError),
    /// A mesh file is at fault.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// There is no built-in scene of that name.
    #[error("{spec}: expected a built-in scene ({}), found \"{name}\"", builtin_names())]
    UnknownBuiltin {
        /// What the user asked for.
        spec: String,
        /// The name in it.
        name: String,
    },
    /// The built-in scene does not exist in that size.
    #[error("{spec}: expected a size from 1 to {} for {spd}, found \"{size}\"", .spd.max_size())]
    BuiltinSize {
        /// What the user asked for.
        spec: String,
        /// The scene in it.
        spd: Spd,
        /// The size in it.
        size: String,
    },
    /// There is no built-in stage of that name.
    #[error("{spec}: expected a built-in stage ({ROOM}), found \"{name}\"")]
    UnknownStage {
        /// What the user asked for.
        spec: String,
        /// The name in it.
        name: String,
    },
    /// The built-in stage does not exist in that size.
    #[error(
        "{spec}: expected a size from {} to {} for {ROOM}, found \"{size}\"",
        room::SIZES.start(),
        room::SIZES.end()
    )]
    StageSize {
        /// What the user asked for.
        spec: String,
        /// The size in it.
        size: String,
    },
    /// The built-in scene has more objects than [`NffLimits::objects`] allows.
    #[error("{spec}: expected at most {limit} objects, found a scene of {objects}")]
    BuiltinTooLarge {
        /// What the user asked for.
        spec: String,
        /// Objects it would have.
        objects: u64,
        /// The limit.
        limit: u64,
    },
}

/// Whose fault an error is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The content of the file: mend the file.
    Input,
    /// The name or the size asked for: ask for another one.
    Request,
    /// The system: permissions, disks, damaged media.
    System,
}

impl SceneError {
    /// Whose fault it is.
    pub fn fault(&self) -> Fault {
        use crate::nff::NffErrorKind;
        match self {
            SceneError::Open { source, .. } if source.kind() == io::ErrorKind::NotFound => {
                Fault::Request
            }
            SceneError::Open { .. } => Fault::System,
            SceneError::Nff(error) => match &error.kind {
                NffErrorKind::Io(error) if !is_damaged_archive(error) => Fault::System,
                _ => Fault::Input,
            },
            SceneError::Mesh(error) => match &error.kind {
                MeshErrorKind::Io(error) if !is_damaged_archive(error) => Fault::System,
                _ => Fault::Input,
            },
            SceneError::NotGzip { .. } | SceneError::Unrecognised { .. } => Fault::Input,
            SceneError::Directory { .. }
            | SceneError::UnknownBuiltin { .. }
            | SceneError::BuiltinSize { .. }
            | SceneError::UnknownStage { .. }
            | SceneError::StageSize { .. }
            | SceneError::BuiltinTooLarge { .. } => Fault::Request,
        }
    }
}

/// The decoder reports damage by these kinds; no device does.
fn is_damaged_archive(error: &io::Error) -> bool {
    use io::ErrorKind::{InvalidData, InvalidInput, UnexpectedEof};
    matches!(error.kind(), InvalidData | InvalidInput | UnexpectedEof)
}

/// The system's reason without its error number where plain words exist.
fn open_reason(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "there is no such file".to_owned(),
        io::ErrorKind::PermissionDenied => "no permission to read it".to_owned(),
        _ => error.to_string(),
    }
}

fn builtin_names() -> String {
    Spd::ALL.map(Spd::name).join(", ")
}

/// What a file holds.
#[derive(Clone, Debug)]
pub enum Loaded {
    /// A scene with materials, lights and a view.
    Scene(Scene),
    /// Triangles and nothing else, under the file's name.
    Mesh(String, Mesh),
}

impl Loaded {
    /// The scene; triangles of a mesh become its objects, in their order, matte white.
    pub fn into_scene(self) -> Scene {
        match self {
            Loaded::Scene(scene) => scene,
            Loaded::Mesh(name, Mesh { vertices, faces }) => {
                let corners = |face: [u32; 3]| face.map(|i| vertices[i as usize]).to_vec();
                let object =
                    |face| Object { surface: Surface::Polygon(corners(face)), material: 0 };
                let objects = faces.into_iter().map(object).collect();
                Scene { name, materials: vec![Material::default()], objects, ..Scene::default() }
            }
        }
    }
}

/// Loads a scene or a mesh: `spd:NAME[:SIZE]` is a built-in scene, `stage:room[:SIZE]` a built-in mesh, anything else a file, whose format is told by its content, then
/// by its name. Files may be compressed by gzip whatever their names. A scene's
/// name becomes the file's name without its extensions, or `spd:NAME:SIZE`.
///
/// # Errors
/// [`SceneError`]; errors in a file carry its name and the place in it.
pub fn load(spec: &str, limits: &NffLimits) -> Result<Loaded, SceneError> {
    load_monitored(spec, limits, &())
}

/// The same, until the monitor cancels the reading of a file.
///
/// # Errors
/// Those of [`load`], and an error of the file that says so.
pub fn load_monitored(
    spec: &str,
    limits: &NffLimits,
    monitor: &dyn Monitor,
) -> Result<Loaded, SceneError> {
    match parse_builtin(spec)? {
        Some(Builtin::Spd(spd, size)) => {
            return load_builtin(spec, spd, size, limits).map(Loaded::Scene);
        }
        Some(Builtin::Room(size)) => {
            return room_of(spec, size).map(|stage| Loaded::Mesh(stage.name, stage.mesh));
        }
        None => {}
    }
    match recognise(spec)? {
        Recognised::Mesh(_) => load_mesh(spec, monitor),
        Recognised::Nff => load_file(spec, limits, monitor).map(Loaded::Scene),
        Recognised::Neither(found) => {
            Err(SceneError::Unrecognised { path: spec.to_owned(), found })
        }
    }
}

/// [`load`] as a scene, whatever it is.
///
/// # Errors
/// Those of [`load`].
pub fn load_scene(spec: &str, limits: &NffLimits) -> Result<Scene, SceneError> {
    load(spec, limits).map(Loaded::into_scene)
}

/// What a file is, by its first bytes after unpacking, its size and its name.
///
/// # Errors
/// Of opening it and reading these, and [`SceneError::NotGzip`].
pub fn recognise(spec: &str) -> Result<Recognised, SceneError> {
    let path = Path::new(spec);
    let cannot_open = |source| SceneError::Open { path: spec.to_owned(), source };
    if path.is_dir() {
        return Err(SceneError::Directory { path: spec.to_owned() });
    }
    let mut file = File::open(path).map_err(cannot_open)?;
    let data = file.metadata().map_err(cannot_open)?;
    if !data.is_file() {
        // What is no regular file may be read only once.
        return Ok(mesh::recognise(path, b"v\n", None));
    }
    let (mut head, mut size) = (Vec::new(), Some(data.len()));
    (&mut file).take(mesh::HEAD as u64).read_to_end(&mut head).map_err(cannot_open)?;
    if head.starts_with(&GZIP_MAGIC) {
        let mut plain = Vec::new();
        // A damaged archive is found out by those who read all of it.
        let _ = MultiGzDecoder::new(&head[..]).take(mesh::HEAD as u64).read_to_end(&mut plain);
        (head, size) = (plain, None);
    } else if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz")) {
        return Err(SceneError::NotGzip { path: spec.to_owned() });
    }
    Ok(mesh::recognise(path, &head, size))
}

fn load_mesh(spec: &str, monitor: &dyn Monitor) -> Result<Loaded, SceneError> {
    let path = Path::new(spec);
    let mesh = Mesh::read_monitored(path, &MeshLimits::DEFAULT, monitor)?;
    Ok(Loaded::Mesh(stem(path), mesh))
}

/// What is built in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Builtin {
    /// A database and its size: `spd:NAME[:SIZE]`.
    Spd(Spd, u32),
    /// The [`room`](room::room) of a size: `stage:room[:SIZE]`.
    Room(u32),
}

/// The built-in scene that `spd:NAME[:SIZE]` or `stage:room[:SIZE]` names, of the standard size if none is given; `None`
/// if `spec` begins with neither prefix and so is a path.
///
/// # Errors
/// [`SceneError::UnknownBuiltin`], [`SceneError::BuiltinSize`], [`SceneError::UnknownStage`] and
/// [`SceneError::StageSize`].
pub fn parse_builtin(spec: &str) -> Result<Option<Builtin>, SceneError> {
    let parts = |text: &'_ str| match text.split_once(':') {
        None => (text.to_owned(), None),
        Some((name, size)) => (name.to_owned(), Some(size.to_owned())),
    };
    if let Some(stage) = spec.strip_prefix(STAGE_PREFIX) {
        let (name, size) = parts(stage);
        if name != ROOM {
            return Err(SceneError::UnknownStage { spec: spec.into(), name });
        }
        let Some(text) = size else { return Ok(Some(Builtin::Room(room::STANDARD_SIZE))) };
        return match text.parse() {
            Ok(size) if room::SIZES.contains(&size) => Ok(Some(Builtin::Room(size))),
            _ => Err(SceneError::StageSize { spec: spec.into(), size: text }),
        };
    }
    let Some(builtin) = spec.strip_prefix(BUILTIN_PREFIX) else {
        return Ok(None);
    };
    let (name, size) = parts(builtin);
    let Some(spd) = Spd::from_name(&name) else {
        return Err(SceneError::UnknownBuiltin { spec: spec.into(), name });
    };
    let Some(text) = size else {
        return Ok(Some(Builtin::Spd(spd, spd.standard_size())));
    };
    match text.parse() {
        Ok(size) if spd.sizes().contains(&size) => Ok(Some(Builtin::Spd(spd, size))),
        _ => Err(SceneError::BuiltinSize { spec: spec.into(), spd, size: text }),
    }
}

fn room_of(spec: &str, size: u32) -> Result<Stage, SceneError> {
    let wrong = || SceneError::StageSize { spec: spec.to_owned(), size: size.to_string() };
    room::room(size).ok_or_else(wrong)
}

fn load_builtin(spec: &str, spd: Spd, size: u32, limits: &NffLimits) -> Result<Scene, SceneError> {
    let (objects, limit) = (spd.object_count(size), limits.objects);
    if objects > limit {
        return Err(SceneError::BuiltinTooLarge { spec: spec.to_owned(), objects, limit });
    }
    let name = format!("{BUILTIN_PREFIX}{spd}:{size}");
    let mut scene = Scene { name, ..Scene::default() };
    match spd::generate(spd, size, &mut scene) {
        Ok(()) => Ok(scene),
        Err(SpdError::SizeOutOfRange { spd, size }) => {
            Err(SceneError::BuiltinSize { spec: spec.to_owned(), spd, size: size.to_string() })
        }
        Err(SpdError::Sink(never)) => match never {},
    }
}

fn load_file(spec: &str, limits: &NffLimits, monitor: &dyn Monitor) -> Result<Scene, SceneError> {
    let path = Path::new(spec);
    let cannot_open = |source| SceneError::Open { path: spec.to_owned(), source };
    if path.is_dir() {
        return Err(SceneError::Directory { path: spec.to_owned() });
    }
    let file = File::open(path).map_err(cannot_open)?;
    let mut input = BufReader::with_capacity(BUFFER_BYTES, file);
    let is_gzip = input.fill_buf().map_err(cannot_open)?.starts_with(&GZIP_MAGIC);
    let named_gzip = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz"));
    let scene = if is_gzip {
        let text = BufReader::with_capacity(BUFFER_BYTES, MultiGzDecoder::new(input));
        Scene::read_nff(watched::Text { input: text, monitor }, limits)
    } else if named_gzip {
        return Err(SceneError::NotGzip { path: spec.to_owned() });
    } else {
        Scene::read_nff(watched::Text { input, monitor }, limits)
    };
    let mut scene = scene.map_err(|error| error.in_file(spec))?;
    scene.name = stem(path);
    Ok(scene)
}

/// The file's name without `.gz` and without the extension before it, if it is a known one.
pub(crate) fn stem(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    let known =
        |extension: &str| extension == "nff" || MeshFormat::of_name(Path::new(name)).is_some();
    match name.rsplit_once('.') {
        Some((stem, extension)) if known(extension) => stem.to_owned(),
        _ => name.to_owned(),
    }
}
