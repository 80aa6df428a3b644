//! A stage made ready for paths: what a hit means, what a surface is like there, what shines.

use super::albedo::Glass;
use super::bsdf::{Bsdf, Frame, luminance};
use super::camera::Up;
use super::environment::Environment;
use super::light::{Lights, Sun};
use super::light_tree::LightBounds;
use super::texture::{self, Encoding};
use crate::error::RenderError;
use glam::{DMat3, DVec3, Vec2, Vec3};
use ropewalk::{Geometry, Hit, Ray};
use ropewalk_scene::stage::{Alpha, Light, Material, Texture};
use ropewalk_scene::{Camera, Mesh, Stage};
use std::collections::HashMap;

/// How far the ground reaches, in radii of the mesh.
const GROUND_REACH: f64 = 60.0;

/// How far below the mesh the ground lies, in radii of the mesh: enough that the faces that a mesh stands on do not
/// coincide with it.
const GROUND_GAP: f64 = 1e-3;

/// Irradiance by the sun of the built-in sky.
const SUN: Vec3 = Vec3::new(3.7, 3.4, 2.98);

/// Where that sun stands: turned to the left of the front, and raised, in degrees.
const SUN_TURN: f64 = -42.0;
const SUN_RISE: f64 = 46.0;

/// Light from far away.
#[derive(Clone, Debug, Default)]
pub enum Backdrop {
    /// None: black.
    None,
    /// A clear sky and a sun.
    #[default]
    Sky,
    /// A picture of all directions.
    Environment(Environment),
}

/// What is added to a stage.
#[derive(Clone, Debug, Default)]
pub struct Surroundings {
    /// The axis that points up.
    pub up: Up,
    /// Light from far away.
    pub backdrop: Backdrop,
    /// Whether a plain lies just below the mesh.
    pub ground: bool,
}

impl Surroundings {
    /// What makes a good picture of a stage: a sky unless it has lights of its own and no daylight, and without lights ground unless it has a
    /// camera of its own.
    pub fn of(stage: &Stage, up: Up) -> Surroundings {
        let lit = shines(stage);
        let backdrop = if lit && !stage.daylight { Backdrop::None } else { Backdrop::Sky };
        Surroundings { up, backdrop, ground: !lit && stage.camera.is_none() }
    }

    /// True if there is no light, neither from here nor from the stage.
    pub fn is_dark(&self, stage: &Stage) -> bool {
        matches!(self.backdrop, Backdrop::None) && !shines(stage)
    }
}

/// True if a stage has light of its own.
fn shines(stage: &Stage) -> bool {
    !stage.lights.is_empty() || stage.materials.iter().any(|m| m.emission.iter().any(|&x| x > 0.0))
}

/// A stage made ready for paths. Inside it is moved to the origin and scaled by a power of two, so that meshes of any
/// size and place are computed alike.
pub struct World {
    stage: Stage,
    geometry: Geometry,
    /// Faces of the stage; those behind them are the ground's.
    stage_faces: usize,
    center: DVec3,
    scale: f64,
    ground: Material,
    /// Tables of glass, by material.
    glass: Vec<Option<Glass>>,
    /// Luminance that each material sends out, the mean of its texture.
    shine: Vec<f32>,
    has_cutouts: bool,
    /// Whether corners have coordinates, normals or colours, so that it matters where a face is met.
    varies: bool,
    environment: Option<Environment>,
    sun: Option<Sun>,
    /// Rows: the axes of the sky in the world.
    sky_axes: [Vec3; 3],
    lights: Lights,
}

/// A hit made ready for scattering.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surface<'a> {
    pub face: u32,
    pub material: &'a Material,
    pub position: DVec3,
    /// Length of the ray that arrived.
    pub travelled: f64,
    /// Geometric normal, turned to the viewer.
    pub geometric: Vec3,
    /// The frame of the shading normal, turned with the geometric one.
    pub frame: Frame,
    pub shading: Vec3,
    /// True if the ray arrived at the front.
    pub outside: bool,
    pub uv: [f32; 2],
    /// Colour of the vertices.
    pub color: Vec3,
    pub area: f32,
}

/// A point on a face that shines.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shining {
    pub position: DVec3,
    pub normal: Vec3,
    pub area: f32,
    pub radiance: Vec3,
    pub two_sided: bool,
}

impl World {
    /// Takes a stage apart and puts its surroundings around it.
    ///
    /// # Errors
    /// [`RenderError::Stage`] if the stage's parts do not belong together or it has no faces.
    pub fn new(mut stage: Stage, surroundings: &Surroundings) -> Result<World, RenderError> {
        check(&stage)?;
        let mesh = std::mem::take(&mut stage.mesh);
        let (center, radius) = extent(&mesh);
        let scale = if radius > 0.0 { 2f64.powi(-(radius.log2().floor() as i32)) } else { 1.0 };
        let radius = if radius > 0.0 { radius * scale } else { 1.0 };
        let place = |v: &[f64; 3]| ((DVec3::from_array(*v) - center) * scale).as_vec3().to_array();
        let mut vertices: Vec<[f32; 3]> = mesh.vertices.iter().map(place).collect();
        let Mesh { mut faces, .. } = mesh;
        let stage_faces = faces.len();
        if surroundings.ground {
            let first = vertices.len() as u32;
            vertices.extend(ground(&vertices, surroundings.up, radius));
            faces.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        }
        let geometry = Geometry::from_triangles(&vertices, &faces)
            .map_err(|e| RenderError::Stage { what: e.to_string() })?;
        drop((vertices, faces));
        for light in &mut stage.lights {
            move_light(light, center, scale);
        }
        let glass = glass_tables(&stage.materials);
        let shine = shine(&stage);
        let has_cutouts = stage.materials.iter().any(|m| m.alpha != Alpha::Opaque);
        let varies = !(stage.uvs.is_empty() && stage.normals.is_empty() && stage.colors.is_empty());
        let (environment, has_sun) = match &surroundings.backdrop {
            Backdrop::None => (None, false),
            Backdrop::Sky => (Some(Environment::sky(surroundings.ground)), true),
            Backdrop::Environment(map) => (Some(map.clone()), false),
        };
        let ground = Material {
            name: "ground".into(),
            base_color: [0.52, 0.51, 0.50],
            ior: 1.0,
            ..Material::default()
        };
        let mut world = World {
            stage,
            geometry,
            stage_faces,
            center,
            scale,
            ground,
            glass,
            shine,
            has_cutouts,
            varies,
            environment,
            sun: has_sun.then(|| Sun::new(Vec3::Z, SUN)),
            sky_axes: [Vec3::X, Vec3::Y, Vec3::Z],
            lights: Lights::default(),
        };
        world.turn_sky(surroundings.up, 0.0);
        world.lights = Lights::new(&world, radius as f32);
        Ok(world)
    }

    /// Turns sky and sun, or the environment, by degrees around the axis that points up.
    pub fn turn_sky(&mut self, up: Up, degrees: f64) {
        let [right, front, above] = up.axes().map(DVec3::from_array);
        let turn = DMat3::from_axis_angle(above, degrees.to_radians());
        self.sky_axes = [turn * right, turn * -front, above].map(|axis| axis.as_vec3());
        let (azimuth, rise) = (SUN_TURN.to_radians(), SUN_RISE.to_radians());
        let towards =
            rise.cos() * (azimuth.sin() * right + azimuth.cos() * front) + rise.sin() * above;
        if let Some(sun) = &mut self.sun {
            sun.towards = (turn * towards).as_vec3();
        }
    }

    /// The primitives: the faces of the stage in their order, then the ground's two.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// A camera of the stage's space in that of the geometry.
    pub(crate) fn place_camera(&self, camera: &Camera) -> Camera {
        let place = |p: [f64; 3]| ((DVec3::from_array(p) - self.center) * self.scale).to_array();
        Camera { from: place(camera.from), at: place(camera.at), ..*camera }
    }

    /// What lengths of the stage are multiplied with.
    pub(crate) fn scale(&self) -> f64 {
        self.scale
    }

    pub(crate) fn has_cutouts(&self) -> bool {
        self.has_cutouts
    }

    pub(crate) fn lights(&self) -> &Lights {
        &self.lights
    }

    pub(crate) fn environment(&self) -> Option<&Environment> {
        self.environment.as_ref()
    }

    pub(crate) fn sun(&self) -> Option<&Sun> {
        self.sun.as_ref()
    }

    pub(crate) fn other_lights(&self) -> &[Light] {
        &self.stage.lights
    }

    /// A direction of the sky's frame in the world.
    pub(crate) fn sky_to_world(&self, d: Vec3) -> Vec3 {
        let [x, y, z] = self.sky_axes;
        d.x * x + d.y * y + d.z * z
    }

    fn to_sky(&self, d: Vec3) -> Vec3 {
        let [x, y, z] = self.sky_axes;
        Vec3::new(d.dot(x), d.dot(y), d.dot(z))
    }

    /// Radiance of the environment from a direction, without the sun, and the density with which the environment
    /// samples the direction.
    pub(crate) fn sky(&self, direction: Vec3) -> (Vec3, f32) {
        let of = |map: &Environment| map.radiance_and_density(self.to_sky(direction));
        self.environment.as_ref().map_or((Vec3::ZERO, 0.0), of)
    }

    fn material_index(&self, face: u32) -> Option<usize> {
        match self.stage.material.get(face as usize) {
            Some(&index) => Some(index as usize),
            None if (face as usize) < self.stage_faces => Some(0),
            None => None,
        }
    }

    fn material(&self, face: u32) -> &Material {
        self.material_index(face).map_or(&self.ground, |i| &self.stage.materials[i])
    }

    fn corners(&self, face: u32) -> [DVec3; 3] {
        // All primitives are triangles.
        let triangle = self.geometry.triangle(face).map_or([[0.0; 3]; 3], |t| t.vertices);
        triangle.map(|v| Vec3::from_array(v).as_dvec3())
    }

    /// Texture coordinates of a point by the weights of corners 1 and 2.
    fn uv(&self, face: u32, [b, c]: [f32; 2]) -> [f32; 2] {
        let Some(corners) = self.stage.uvs.get(face as usize) else { return [0.0; 2] };
        let [p, q, r] = corners.map(Vec2::from_array);
        (p * (1.0 - b - c) + q * b + r * c).to_array()
    }

    fn textured(&self, texture: Option<Texture>, uv: [f32; 2], encoding: Encoding) -> (Vec3, f32) {
        texture.map_or((Vec3::ONE, 1.0), |t| texture::sample(&self.stage.images, t, uv, encoding))
    }

    /// What a hit means.
    pub(crate) fn surface(&self, ray: &Ray, t: f32, face: u32) -> Surface<'_> {
        let corners = self.corners(face);
        let position = DVec3::from_array(ray.at(t));
        let direction = Vec3::from_array(ray.dir);
        let (e, f) = (corners[1] - corners[0], corners[2] - corners[0]);
        let scaled = e.cross(f);
        let length = scaled.length();
        let front = (scaled / length).as_vec3();
        let outside = direction.dot(front) < 0.0;
        let weights =
            if self.varies { weights(position - corners[0], e, f, scaled) } else { [0.0; 2] };
        let uv = self.uv(face, weights);
        let material = self.material(face);
        let smooth = self.smooth_normal(face, weights).unwrap_or(front);
        let smooth = self.mapped_normal(material, face, [e, f], uv, smooth);
        let geometric = if outside { front } else { -front };
        let toward = if smooth.dot(geometric) < 0.0 { -smooth } else { smooth };
        let shading = seen_normal(toward, -direction.normalize());
        let mix = |c: &[[f32; 3]; 3]| {
            let [p, q, r] = c.map(Vec3::from_array);
            p * (1.0 - weights[0] - weights[1]) + q * weights[0] + r * weights[1]
        };
        Surface {
            face,
            material,
            position,
            travelled: f64::from(t) * f64::from(direction.length()),
            geometric,
            frame: Frame::new(shading),
            shading,
            outside,
            uv,
            color: self.stage.colors.get(face as usize).map_or(Vec3::ONE, mix),
            area: 0.5 * length as f32,
        }
    }

    /// The interpolated normal, on the side of the front; `None` where a corner has none.
    fn smooth_normal(&self, face: u32, [b, c]: [f32; 2]) -> Option<Vec3> {
        let corners = self.stage.normals.get(face as usize)?.map(Vec3::from_array);
        if corners.contains(&Vec3::ZERO) {
            return None;
        }
        let [p, q, r] = corners;
        (p * (1.0 - b - c) + q * b + r * c).try_normalize()
    }

    /// The normal that the material's map says, in the tangent space of the texture coordinates.
    fn mapped_normal(
        &self,
        material: &Material,
        face: u32,
        [e, f]: [DVec3; 2],
        uv: [f32; 2],
        normal: Vec3,
    ) -> Vec3 {
        let (Some(map), Some(corners)) =
            (material.normal_texture, self.stage.uvs.get(face as usize))
        else {
            return normal;
        };
        let [p, q, r] = corners.map(Vec2::from_array);
        let (a, b) = (q - p, r - p);
        let turn = a.perp_dot(b);
        let tangent = (e.as_vec3() * b.y - f.as_vec3() * a.y) * turn.signum();
        let Some(tangent) = (tangent - normal * normal.dot(tangent)).try_normalize() else {
            return normal;
        };
        // Texture coordinates grow downwards, the map's second axis points up: on a face that is not mirrored the
        // corners turn the other way in the image.
        let upward = normal.cross(tangent) * -turn.signum();
        let said =
            texture::sample(&self.stage.images, map, uv, Encoding::Linear).0 * 2.0 - Vec3::ONE;
        (tangent * said.x + upward * said.y + normal * said.z.max(0.01)).normalize_or(normal)
    }

    /// How a surface scatters light.
    pub(crate) fn bsdf(&self, surface: &Surface<'_>) -> Bsdf<'_> {
        let m = surface.material;
        let (base, _) = self.textured(m.base_color_texture, surface.uv, Encoding::Srgb);
        let (rough, _) = self.textured(m.metallic_roughness_texture, surface.uv, Encoding::Linear);
        let metal = (m.metallic * rough.z).clamp(0.0, 1.0);
        let glass = (1.0 - metal) * m.transmission.clamp(0.0, 1.0);
        let base = Vec3::from_array(m.base_color) * base * surface.color;
        let tables = self.material_index(surface.face).and_then(|i| self.glass[i].as_ref());
        Bsdf {
            metal,
            matte: 1.0 - metal - glass,
            glass,
            base: base.clamp(Vec3::ZERO, Vec3::ONE),
            roughness: (m.roughness * rough.y).clamp(0.0, 1.0),
            ior: m.ior.max(1.0),
            outside: surface.outside,
            tables,
        }
    }

    /// Radiance that a surface emits towards the viewer.
    pub(crate) fn emitted(&self, surface: &Surface<'_>) -> Vec3 {
        if !surface.outside && !surface.material.two_sided {
            return Vec3::ZERO;
        }
        self.emission(surface.material, surface.uv)
    }

    fn emission(&self, material: &Material, uv: [f32; 2]) -> Vec3 {
        let plain = Vec3::from_array(material.emission);
        if plain == Vec3::ZERO {
            return plain;
        }
        plain * self.textured(material.emission_texture, uv, Encoding::Srgb).0
    }

    /// What a face sends out, in all directions and colours.
    pub(crate) fn emitted_power(&self, face: u32) -> f32 {
        let luminance = self.material_index(face).map_or(0.0, |i| self.shine[i]);
        if luminance == 0.0 {
            return 0.0;
        }
        let [a, b, c] = self.corners(face);
        let area = 0.5 * (b - a).cross(c - a).length() as f32;
        let sides = if self.material(face).two_sided { 2.0 } else { 1.0 };
        sides * area * std::f32::consts::PI * luminance
    }

    /// Where a face of some power shines.
    pub(crate) fn bounds_of_light(&self, face: u32, power: f32) -> LightBounds {
        let corners = self.corners(face);
        let axis = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
        let [a, b, c] = corners.map(|p| p.as_vec3());
        let two_sided = self.material(face).two_sided;
        let sides = if two_sided { 2.0 } else { 1.0 };
        LightBounds {
            low: a.min(b).min(c),
            high: a.max(b).max(c),
            axis: axis.as_vec3(),
            spread: 0.0,
            intensity: power / (sides * std::f32::consts::PI),
            two_sided,
        }
    }

    /// Corners of a box around the mesh, without the ground.
    pub(crate) fn stage_box(&self) -> [Vec3; 2] {
        let start = [Vec3::INFINITY, Vec3::NEG_INFINITY];
        (0..self.stage_faces as u32)
            .flat_map(|face| self.corners(face))
            .fold(start, |[low, high], p| [low.min(p.as_vec3()), high.max(p.as_vec3())])
    }

    /// A point of a face that shines, evenly by area.
    pub(crate) fn point_on_face(&self, face: u32, u: [f32; 2]) -> Shining {
        let corners = self.corners(face);
        let root = u[0].sqrt();
        let (b, c) = (root * (1.0 - u[1]), root * u[1]);
        let (e, f) = (corners[1] - corners[0], corners[2] - corners[0]);
        let scaled = e.cross(f);
        let material = self.material(face);
        Shining {
            position: corners[0] + f64::from(b) * e + f64::from(c) * f,
            normal: scaled.normalize().as_vec3(),
            area: 0.5 * scaled.length() as f32,
            radiance: self.emission(material, self.uv(face, [b, c])),
            two_sided: material.two_sided,
        }
    }

    /// Whether there is something where a face is hit, decided for surfaces that are partly there by a number in
    /// `0..1`.
    pub(crate) fn is_there(&self, hit: &Hit, u: impl FnOnce() -> f32) -> bool {
        let material = self.material(hit.prim_id);
        let opacity = || {
            let uv = self.uv(hit.prim_id, [hit.u, hit.v]);
            material.opacity * self.textured(material.base_color_texture, uv, Encoding::Srgb).1
        };
        match material.alpha {
            Alpha::Opaque => true,
            Alpha::Mask(least) => opacity() >= least,
            Alpha::Blend => u() < opacity(),
        }
    }
}

/// Weights of corners 1 and 2 at a point of a triangle's plane, from corner 0.
fn weights(p: DVec3, e: DVec3, f: DVec3, normal: DVec3) -> [f32; 2] {
    let square = normal.length_squared();
    let b = (p.cross(f).dot(normal) / square).clamp(0.0, 1.0);
    let c = (e.cross(p).dot(normal) / square).clamp(0.0, 1.0 - b);
    [b as f32, c as f32]
}

/// A shading normal bent until the viewer sees its front.
fn seen_normal(normal: Vec3, viewer: Vec3) -> Vec3 {
    const LEAST: f32 = 1e-3;
    let cosine = normal.dot(viewer);
    if cosine >= LEAST { normal } else { (normal + (LEAST - cosine) * viewer).normalize() }
}

/// The middle of a mesh's box, and half of its diagonal.
fn extent(mesh: &Mesh) -> (DVec3, f64) {
    let used = mesh.faces.iter().flatten().map(|&i| DVec3::from_array(mesh.vertices[i as usize]));
    let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) = used.fold(start, |(low, high), p| (low.min(p), high.max(p)));
    // Halved first: the sum of two large numbers may not be finite.
    (0.5 * low + 0.5 * high, (0.5 * high - 0.5 * low).length())
}

/// The corners of the ground, counter-clockwise from above.
fn ground(vertices: &[[f32; 3]], up: Up, radius: f64) -> [[f32; 3]; 4] {
    let [right, front, above] = up.axes().map(|a| DVec3::from_array(a).as_vec3());
    let low = vertices.iter().map(|&v| Vec3::from_array(v).dot(above)).fold(f32::MAX, f32::min);
    let level = (low - (GROUND_GAP * radius) as f32) * above;
    let reach = (GROUND_REACH * radius) as f32;
    [[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]]
        .map(|[x, y]| (level + reach * (x * right + y * front)).to_array())
}

fn move_light(light: &mut Light, center: DVec3, scale: f64) {
    let place = |p: [f64; 3]| ((DVec3::from_array(p) - center) * scale).to_array();
    // Irradiance stays as it is where lengths are scaled.
    let brighten = |c: [f32; 3]| c.map(|x| (f64::from(x) * scale * scale) as f32);
    match light {
        Light::Point { position, intensity } | Light::Spot { position, intensity, .. } => {
            *position = place(*position);
            *intensity = brighten(*intensity);
        }
        Light::Directional { .. } => {}
    }
}

/// [`World::shine`].
fn shine(stage: &Stage) -> Vec<f32> {
    let of = |material: &Material| {
        let plain = Vec3::from_array(material.emission);
        if plain == Vec3::ZERO {
            return 0.0;
        }
        let mean = material.emission_texture.map_or(Vec3::ONE, |t| texture::mean(&stage.images, t));
        luminance(plain * mean)
    };
    stage.materials.iter().map(of).collect()
}

/// The tables of each material that is rough glass.
fn glass_tables(materials: &[Material]) -> Vec<Option<Glass>> {
    let mut made: HashMap<u32, Glass> = HashMap::new();
    let table = |m: &Material| {
        (m.transmission > 0.0 && m.metallic < 1.0 && m.roughness > 0.0 && m.ior > 1.0)
            .then(|| made.entry(m.ior.to_bits()).or_insert_with(|| Glass::new(m.ior)).clone())
    };
    materials.iter().map(table).collect()
}

/// What a stage promises.
fn check(stage: &Stage) -> Result<(), RenderError> {
    let fail = |what: String| Err(RenderError::Stage { what });
    let faces = stage.mesh.faces.len();
    if faces == 0 {
        return fail("expected at least one face".to_owned());
    }
    let lists = [
        ("normals", stage.normals.len()),
        ("texture coordinates", stage.uvs.len()),
        ("colours", stage.colors.len()),
        ("materials of faces", stage.material.len()),
    ];
    if let Some((name, found)) = lists.into_iter().find(|&(_, n)| n != 0 && n != faces) {
        return fail(format!("expected {faces} {name}, one a face, found {found}"));
    }
    let materials = stage.materials.len();
    if materials == 0 {
        return fail("expected at least one material".to_owned());
    }
    if let Some(found) = stage.material.iter().find(|&&m| m as usize >= materials) {
        return fail(format!("expected one of {materials} materials, found number {found}"));
    }
    for image in &stage.images {
        let expected = u64::from(image.width) * u64::from(image.height);
        if expected == 0 || image.pixels.len() as u64 != expected {
            let found = image.pixels.len();
            return fail(format!("expected an image of {expected} pixels, found {found}"));
        }
    }
    for m in &stage.materials {
        let textures = [
            m.base_color_texture,
            m.metallic_roughness_texture,
            m.emission_texture,
            m.normal_texture,
        ];
        let missing =
            textures.into_iter().flatten().find(|t| t.image as usize >= stage.images.len());
        if let Some(Texture { image, .. }) = missing {
            let images = stage.images.len();
            return fail(format!("expected one of {images} images, found number {image}"));
        }
    }
    Ok(())
}
