//! What shines: faces, the sky, the sun, points, cones and parallel light, chosen by power.

use super::alias::AliasTable;
use super::bsdf::{Frame, luminance};
use super::world::World;
use crate::offset::lifted_origin;
use glam::{DVec3, Vec3};
use ropewalk_scene::stage::Light;
use std::f32::consts::{PI, TAU};

/// Half of the angle that the sun of the built-in sky fills, in degrees: ten times that of the real one, for shadows
/// with soft edges.
const SUN_HALF_ANGLE: f32 = 2.5;

/// A disc in the sky.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sun {
    /// Unit vector to its centre.
    pub towards: Vec3,
    /// Radiance of the disc.
    pub radiance: Vec3,
    /// Cosine of half of its angle.
    pub cosine: f32,
}

impl Sun {
    /// A sun that gives a surface which faces it an irradiance.
    pub fn new(towards: Vec3, irradiance: Vec3) -> Sun {
        let half = SUN_HALF_ANGLE.to_radians();
        Sun { towards, radiance: irradiance / (PI * half.sin().powi(2)), cosine: half.cos() }
    }

    /// Radiance from a direction.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        if direction.dot(self.towards) >= self.cosine { self.radiance } else { Vec3::ZERO }
    }

    fn solid_angle(&self) -> f32 {
        TAU * (1.0 - self.cosine)
    }

    fn sample(&self, u: [f32; 2]) -> Vec3 {
        let z = 1.0 - u[0] * (1.0 - self.cosine);
        let (r, phi) = ((1.0 - z * z).max(0.0).sqrt(), TAU * u[1]);
        Frame::new(self.towards).world(Vec3::new(r * phi.cos(), r * phi.sin(), z)).normalize()
    }
}

/// One thing that shines.
#[derive(Clone, Copy, Debug)]
enum Emitter {
    Face(u32),
    Environment,
    Sun,
    Other(Light),
}

/// All that shines in a world.
#[derive(Clone, Debug, Default)]
pub(crate) struct Lights {
    emitters: Vec<Emitter>,
    table: AliasTable,
    /// Faces among the emitters, which come first, in ascending order.
    faces: Vec<u32>,
    environment: Option<usize>,
    sun: Option<usize>,
}

/// Light that may arrive at a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arriving {
    /// Unit vector to where it comes from.
    pub direction: Vec3,
    /// Where the shadow ray ends; `None` for light from infinity.
    pub from: Option<[f32; 3]>,
    /// Radiance, or irradiance of a surface that faces a light without extent.
    pub radiance: Vec3,
    /// Density by solid angle, or the probability of a light without extent.
    pub density: f32,
    /// True if nothing but a shadow ray meets the light.
    pub is_single: bool,
}

impl Lights {
    /// The lights of a world, weighed by what they send out; light from infinity by what falls on a disc of the
    /// scene's radius.
    pub fn new(world: &World, radius: f32) -> Lights {
        let mut lights = Lights::default();
        let mut powers = Vec::new();
        for face in 0..world.geometry().len() as u32 {
            let power = world.emitted_power(face);
            if power > 0.0 {
                lights.emitters.push(Emitter::Face(face));
                lights.faces.push(face);
                powers.push(f64::from(power));
            }
        }
        let disc = PI * radius * radius;
        let mut add = |emitter, power: f32, place: &mut Option<usize>| {
            if power > 0.0 && power.is_finite() {
                *place = Some(lights.emitters.len());
                lights.emitters.push(emitter);
                powers.push(f64::from(power));
            }
        };
        if let Some(map) = world.environment() {
            add(Emitter::Environment, map.power() * disc, &mut lights.environment);
        }
        if let Some(sun) = world.sun() {
            let power = luminance(sun.radiance) * sun.solid_angle() * disc;
            add(Emitter::Sun, power, &mut lights.sun);
        }
        for light in world.other_lights() {
            let bright = |c: [f32; 3]| luminance(Vec3::from_array(c));
            let power = match light {
                Light::Point { intensity, .. } => 2.0 * TAU * bright(*intensity),
                Light::Spot { intensity, cone, .. } => {
                    TAU * (1.0 - cone[1].min(PI).cos()) * bright(*intensity)
                }
                Light::Directional { irradiance, .. } => disc * bright(*irradiance),
            };
            add(Emitter::Other(*light), power, &mut None);
        }
        lights.table = AliasTable::new(&powers);
        lights
    }

    /// Light for a point, chosen by four numbers; `None` where none arrives.
    pub fn sample(&self, world: &World, point: DVec3, u: [f32; 3]) -> Option<Arriving> {
        if self.table.is_empty() {
            return None;
        }
        let (index, _) = self.table.sample(u[0]);
        let chance = self.table.probability(index);
        let place = [u[1], u[2]];
        let far = |direction, radiance, density: f32| Arriving {
            direction,
            from: None,
            radiance,
            density: density * chance,
            is_single: false,
        };
        match self.emitters[index] {
            Emitter::Face(face) => {
                let shining = world.point_on_face(face, place);
                let way = shining.position - point;
                let distance2 = way.length_squared();
                let direction = (way / distance2.sqrt()).as_vec3();
                let cosine = -direction.dot(shining.normal);
                if distance2 <= 0.0 || cosine == 0.0 || !(cosine > 0.0 || shining.two_sided) {
                    return None;
                }
                let side = if cosine > 0.0 { shining.normal } else { -shining.normal };
                let normal = side.as_dvec3().to_array();
                let lifted = lifted_origin(shining.position.to_array(), normal, distance2.sqrt());
                let density = chance * (distance2 / f64::from(shining.area)) as f32 / cosine.abs();
                Some(Arriving {
                    direction,
                    from: Some(lifted),
                    radiance: shining.radiance,
                    density,
                    is_single: false,
                })
            }
            Emitter::Environment => {
                let (direction, density) = world.environment()?.sample(place)?;
                let direction = world.sky_to_world(direction);
                Some(far(direction, world.sky_radiance(direction), density))
            }
            Emitter::Sun => {
                let sun = world.sun()?;
                Some(far(sun.sample(place), sun.radiance, 1.0 / sun.solid_angle()))
            }
            Emitter::Other(light) => single(&light, point, chance),
        }
    }

    /// The density with which [`Lights::sample`] gives a point on a face, by area, if the face shines.
    pub fn face_density(&self, face: u32, area: f32) -> f32 {
        self.faces.binary_search(&face).map_or(0.0, |i| self.table.probability(i) / area)
    }

    /// The density with which [`Lights::sample`] gives a direction of the environment, of which the environment's own
    /// density is given.
    pub fn environment_density(&self, density: f32) -> f32 {
        self.environment.map_or(0.0, |i| self.table.probability(i) * density)
    }

    /// The density with which [`Lights::sample`] gives a direction to the sun.
    pub fn sun_density(&self, sun: &Sun) -> f32 {
        self.sun.map_or(0.0, |i| self.table.probability(i) / sun.solid_angle())
    }
}

/// Light without extent: it is met by shadow rays alone.
fn single(light: &Light, point: DVec3, chance: f32) -> Option<Arriving> {
    let arriving = |direction, from, radiance: Vec3| Arriving {
        direction,
        from,
        radiance,
        density: chance,
        is_single: true,
    };
    let (position, intensity) = match *light {
        Light::Directional { direction, irradiance } => {
            let towards = -DVec3::from_array(direction).as_vec3();
            return Some(arriving(towards.normalize(), None, Vec3::from_array(irradiance)));
        }
        Light::Point { position, intensity } | Light::Spot { position, intensity, .. } => {
            (DVec3::from_array(position), Vec3::from_array(intensity))
        }
    };
    let way = position - point;
    let distance2 = way.length_squared();
    if distance2 <= 0.0 {
        return None;
    }
    let direction = (way / distance2.sqrt()).as_vec3();
    let mut irradiance = intensity / distance2 as f32;
    if let Light::Spot { direction: axis, cone, .. } = *light {
        // The smooth edge that KHR_lights_punctual suggests.
        let cosine = -direction.dot(DVec3::from_array(axis).as_vec3());
        let (inner, outer) = (cone[0].cos(), cone[1].cos());
        let share = ((cosine - outer) / (inner - outer).max(1e-4)).clamp(0.0, 1.0);
        irradiance *= share * share;
    }
    let from = position.as_vec3().to_array();
    (irradiance != Vec3::ZERO).then(|| arriving(direction, Some(from), irradiance))
}
