//! Why a picture cannot be made.

/// What is wrong with the scene, the settings or the machine.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// The view does not define a picture.
    #[error("the camera is unusable: {what}")]
    Camera {
        /// What was found and expected.
        what: String,
    },
    /// The picture has no pixels or too many.
    #[error("a picture of {width} x {height} pixels: expected 1 to {max} pixels in all")]
    Size {
        /// Requested width.
        width: u32,
        /// Requested height.
        height: u32,
        /// Largest number of pixels.
        max: u64,
    },
    /// A setting is out of range.
    #[error("{name} is {found}: expected {expected}")]
    Setting {
        /// The setting's name.
        name: &'static str,
        /// Its value.
        found: u64,
        /// The accepted range.
        expected: &'static str,
    },
    /// The geometry was not made from the scene.
    #[error("the geometry has {geometry} primitives but the scene has {scene} objects")]
    GeometryMismatch {
        /// Primitives in the geometry.
        geometry: usize,
        /// Objects in the scene.
        scene: usize,
    },
    /// An object names a material that the scene lacks.
    #[error("object {object} has material {material}, but the scene has {materials} materials")]
    MissingMaterial {
        /// The object's index.
        object: usize,
        /// The material it names.
        material: u32,
        /// Number of materials.
        materials: usize,
    },
    /// The stage's parts do not belong together.
    #[error("the stage cannot be rendered: {what}")]
    Stage {
        /// What was expected and found.
        what: String,
    },
    /// A picture of the surroundings is unusable.
    #[error("the environment cannot be used: {what}")]
    Environment {
        /// What was expected and found, and in which file.
        what: String,
    },
    /// The operating system refused the threads.
    #[error("cannot start {threads} threads: {reason}")]
    Threads {
        /// Threads asked for.
        threads: usize,
        /// The system's reason.
        reason: String,
    },
}
