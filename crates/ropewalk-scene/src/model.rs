//! The scene model: what an NFF file can say, in double precision as written.

/// The view (`v`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Eye point.
    pub from: [f64; 3],
    /// Point looked at.
    pub at: [f64; 3],
    /// Up direction.
    pub up: [f64; 3],
    /// Full view angle in degrees, across the picture's width.
    pub angle: f64,
    /// Distance of the near plane; objects before it are not cut off by ray tracers.
    pub hither: f64,
    /// Picture size in pixels, width and height.
    pub resolution: [u32; 2],
}

/// A point light (`l`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Position.
    pub position: [f64; 3],
    /// Colour, if the file gives one; else the renderer's rule applies.
    pub color: Option<[f64; 3]>,
}

/// Fill colour and shading (`f`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Colour.
    pub color: [f64; 3],
    /// Diffuse factor.
    pub kd: f64,
    /// Specular factor.
    pub ks: f64,
    /// Phong exponent.
    pub shine: f64,
    /// Transmittance; above 0 the surface transmits.
    pub transmittance: f64,
    /// Index of refraction.
    pub index_of_refraction: f64,
}

/// A cone or cylinder frustum without caps; both radii negative means inside visible.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// Centre of the base.
    pub base: [f64; 3],
    /// Radius at the base.
    pub base_radius: f64,
    /// Centre of the apex.
    pub apex: [f64; 3],
    /// Radius at the apex.
    pub apex_radius: f64,
}

/// A surface as a file states it.
#[derive(Clone, Debug, PartialEq)]
pub enum Surface {
    /// `s`; a negative radius means inside visible.
    Sphere {
        /// Centre.
        center: [f64; 3],
        /// Radius.
        radius: f64,
    },
    /// `c`.
    Cone(Cone),
    /// `p`: planar, at least three vertices, may be concave, counter-clockwise from the front.
    Polygon(Vec<[f64; 3]>),
    /// `pp`: a polygon with a normal for each vertex.
    Patch {
        /// Vertices.
        vertices: Vec<[f64; 3]>,
        /// Normals, one a vertex, not necessarily of unit length.
        normals: Vec<[f64; 3]>,
    },
}

/// A surface and its material.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Geometry.
    pub surface: Surface,
    /// Index into [`Scene::materials`].
    pub material: u32,
}

/// Receives a scene piece by piece, in file order. Errors are the sink's own (a full disk, say).
pub trait SceneSink {
    /// What can go wrong while taking a piece.
    type Error;
    /// A comment line, without the leading `#`.
    fn comment(&mut self, text: &str) -> Result<(), Self::Error>;
    /// Background colour.
    fn background(&mut self, color: [f64; 3]) -> Result<(), Self::Error>;
    /// The view.
    fn camera(&mut self, camera: &Camera) -> Result<(), Self::Error>;
    /// A light.
    fn light(&mut self, light: &Light) -> Result<(), Self::Error>;
    /// The material of all objects that follow.
    fn material(&mut self, material: &Material) -> Result<(), Self::Error>;
    /// An object with the current material.
    fn surface(&mut self, surface: &Surface) -> Result<(), Self::Error>;
}

/// A scene in memory. Object `i` becomes primitive `i` of [`Scene::geometry`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// Name for messages: the file name without extensions, or the built-in name (`spd:balls:4`).
    pub name: String,
    /// Background colour; black if never given.
    pub background: [f64; 3],
    /// The view, if given.
    pub camera: Option<Camera>,
    /// Lights in file order.
    pub lights: Vec<Light>,
    /// Materials in file order; objects before the first `f` have a default one.
    pub materials: Vec<Material>,
    /// Objects in file order.
    pub objects: Vec<Object>,
}

/// Which sides of opaque surfaces are hit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FacetPolicy {
    /// Opaque primitives are one-sided, transmitting ones two-sided: the SPD rule.
    #[default]
    OneSided,
    /// Everything is two-sided: the SPD rule for the teapot.
    TwoSided,
}
