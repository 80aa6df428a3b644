//! What shines: faces, the sky, the sun, points, cones and parallel light, and the choice among them.
//!
//! One light is chosen for a point. What is far (sky, sun, parallel light) has a share by its irradiance there, times the
//! share of it that is seen nearby; what is near (faces, points, cones) has the rest and is chosen by a tree.

use super::alias::AliasTable;
use super::bsdf::{Frame, luminance};
use super::light_tree::{LightBounds, LightTree, Place};
use super::settings::LightChoice;
use super::sight::Sight;
use super::world::World;
use crate::offset::lifted_origin;
use glam::{DVec3, Vec3};
use ropewalk_scene::stage::Light;
use std::f32::consts::{PI, TAU};

/// Half of the angle that the sun of the built-in sky fills, in degrees: ten times that of the real one, for shadows
/// with soft edges.
const SUN_HALF_ANGLE: f32 = 2.5;

/// The probability that is shared evenly among far lights and the near ones, lest a bad estimate starves one of them.
const EVEN: f32 = 0.1;

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
    /// The near emitters, which come first: `tree` numbers them alike.
    tree: LightTree,
    near: usize,
    /// Faces among the emitters, which come first of all, in ascending order.
    faces: Vec<u32>,
    environment: Option<usize>,
    sun: Option<usize>,
}

/// How a light is chosen.
#[derive(Clone, Copy)]
pub(crate) struct Chooser<'a> {
    pub world: &'a World,
    pub sight: Option<&'a Sight>,
    pub choice: LightChoice,
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
    /// The lights of a world. Their powers are what they send out; those of light from infinity what falls on a disc
    /// of the scene's radius.
    pub fn new(world: &World, radius: f32) -> Lights {
        let mut lights = Lights::default();
        let (mut powers, mut bounds) = (Vec::new(), Vec::new());
        for face in 0..world.geometry().len() as u32 {
            let power = world.emitted_power(face);
            if power > 0.0 {
                lights.emitters.push(Emitter::Face(face));
                lights.faces.push(face);
                powers.push(f64::from(power));
                bounds.push(world.bounds_of_light(face, power));
            }
        }
        let disc = PI * radius * radius;
        let mut add = |emitter, power: f32| {
            let is_light = power > 0.0 && power.is_finite();
            if is_light {
                lights.emitters.push(emitter);
                powers.push(f64::from(power));
            }
            is_light.then(|| lights.emitters.len() - 1)
        };
        for light in world.other_lights() {
            let Some((near, power)) = bounds_of_other(light) else { continue };
            if add(Emitter::Other(*light), power).is_some() {
                bounds.push(near);
            }
        }
        for light in world.other_lights() {
            if let Light::Directional { irradiance, .. } = light {
                add(Emitter::Other(*light), disc * luminance(Vec3::from_array(*irradiance)));
            }
        }
        let sky = world.environment().and_then(|m| add(Emitter::Environment, m.power() * disc));
        let of_sun = |sun: &Sun| luminance(sun.radiance) * sun.solid_angle();
        let sun = world.sun().and_then(|sun| add(Emitter::Sun, of_sun(sun) * disc));
        (lights.environment, lights.sun) = (sky, sun);
        lights.table = AliasTable::new(&powers);
        lights.near = bounds.len();
        lights.tree = LightTree::new(&bounds);
        lights
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.emitters.len()
    }

    /// What a far light weighs at a point: an estimate of its irradiance; 0 only where it gives none.
    fn weight_of_far(&self, index: usize, chooser: &Chooser<'_>, place: &Place) -> f32 {
        let [sky, sun] = chooser.sight.map_or([1.0; 2], |sight| sight.at(place.point));
        let facing = |towards: Vec3, sine: f32| {
            if place.normal == Vec3::ZERO {
                return 1.0;
            }
            (place.normal.dot(towards) + sine + 1e-3).clamp(0.0, 1.0)
        };
        match self.emitters[index] {
            Emitter::Environment => {
                sky * chooser.world.environment().map_or(0.0, |map| 0.25 * map.power())
            }
            Emitter::Sun => chooser.world.sun().map_or(0.0, |disc| {
                let sine = (1.0 - disc.cosine * disc.cosine).max(0.0).sqrt();
                let irradiance = luminance(disc.radiance) * disc.solid_angle();
                sun * irradiance * facing(disc.towards, sine)
            }),
            Emitter::Other(Light::Directional { direction, irradiance }) => {
                let towards = -DVec3::from_array(direction).as_vec3().normalize_or_zero();
                luminance(Vec3::from_array(irradiance)) * facing(towards, 0.0)
            }
            Emitter::Face(_) | Emitter::Other(_) => 0.0,
        }
    }

    /// The weight of the near lights, the sum of the weights of far and near lights, and how many of them are not zero.
    fn weights(&self, chooser: &Chooser<'_>, place: &Place) -> (f32, f32, f32) {
        // Beside nothing else the weight does not matter.
        let alone = self.near == self.len();
        let near = if alone { 1.0 } else { self.tree.importance(place) };
        let start = (near, if near > 0.0 { 1.0 } else { 0.0 });
        let far = (self.near..self.len()).map(|i| self.weight_of_far(i, chooser, place));
        let (sum, count) = far.fold(start, |(sum, count), weight| {
            (sum + weight, if weight > 0.0 { count + 1.0 } else { count })
        });
        (near, sum, count)
    }

    /// A light for a number in `0..1`, and its probability.
    fn choose(&self, chooser: &Chooser<'_>, place: &Place, u: f64) -> Option<(usize, f32)> {
        if chooser.choice == LightChoice::Power {
            let (index, _) = self.table.sample(u as f32);
            return Some((index, self.table.probability(index)));
        }
        let (near, sum, count) = self.weights(chooser, place);
        let mut rest = u;
        for index in self.near..self.len() {
            let share = even_share(self.weight_of_far(index, chooser, place), sum, count);
            if rest < f64::from(share) {
                return Some((index, share));
            }
            rest -= f64::from(share);
        }
        let share = even_share(near, sum, count);
        let inside = (rest / f64::from(share)).clamp(0.0, 1.0 - f64::EPSILON);
        let (index, probability) = self.tree.sample(place, inside)?;
        (share > 0.0).then_some((index, share * probability))
    }

    /// The probability with which a light is chosen.
    fn probability(&self, index: usize, chooser: &Chooser<'_>, place: &Place) -> f32 {
        if chooser.choice == LightChoice::Power {
            return self.table.probability(index);
        }
        let (near, sum, count) = self.weights(chooser, place);
        if index >= self.near {
            return even_share(self.weight_of_far(index, chooser, place), sum, count);
        }
        let share = even_share(near, sum, count);
        share * self.tree.probability(index, place)
    }

    /// Light for a point, chosen by a number and placed by two more; `None` where none arrives.
    pub fn sample(
        &self,
        chooser: &Chooser<'_>,
        point: DVec3,
        at: &Place,
        u: f64,
        place: [f32; 2],
    ) -> Option<Arriving> {
        if self.table.is_empty() {
            return None;
        }
        let (index, chance) = self.choose(chooser, at, u)?;
        let world = chooser.world;
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
                let (direction, radiance, density) = world.environment()?.sample(place)?;
                Some(far(world.sky_to_world(direction), radiance, density))
            }
            Emitter::Sun => {
                let sun = world.sun()?;
                Some(far(sun.sample(place), sun.radiance, 1.0 / sun.solid_angle()))
            }
            Emitter::Other(light) => single(&light, point, chance),
        }
    }

    /// The density with which [`Lights::sample`] gives a point on a face, by area, if the face shines.
    pub fn face_density(&self, chooser: &Chooser<'_>, at: &Place, face: u32, area: f32) -> f32 {
        let index = self.faces.binary_search(&face);
        index.map_or(0.0, |i| self.probability(i, chooser, at) / area)
    }

    /// The density with which [`Lights::sample`] gives a direction of the environment, of which the environment's own
    /// density is given.
    pub fn environment_density(&self, chooser: &Chooser<'_>, at: &Place, density: f32) -> f32 {
        self.environment.map_or(0.0, |i| self.probability(i, chooser, at) * density)
    }

    /// The density with which [`Lights::sample`] gives a direction to the sun.
    pub fn sun_density(&self, chooser: &Chooser<'_>, at: &Place, sun: &Sun) -> f32 {
        self.sun.map_or(0.0, |i| self.probability(i, chooser, at) / sun.solid_angle())
    }
}

/// The share of a weight, part of it even.
fn even_share(weight: f32, sum: f32, count: f32) -> f32 {
    if weight > 0.0 { (1.0 - EVEN) * weight / sum + EVEN / count } else { 0.0 }
}

/// Where a point or a cone of light is, and its power; `None` for parallel light.
fn bounds_of_other(light: &Light) -> Option<(LightBounds, f32)> {
    let (position, intensity, axis, spread) = match *light {
        Light::Point { position, intensity } => (position, intensity, Vec3::Z, PI),
        Light::Spot { position, intensity, direction, cone } => {
            let axis = DVec3::from_array(direction).as_vec3().normalize_or(Vec3::Z);
            (position, intensity, axis, cone[1].min(PI))
        }
        Light::Directional { .. } => return None,
    };
    let position = DVec3::from_array(position).as_vec3();
    let intensity = luminance(Vec3::from_array(intensity));
    let power = TAU * (1.0 - spread.cos()) * intensity;
    let (low, high) = (position, position);
    Some((LightBounds { low, high, axis, spread, intensity, two_sided: false }, power))
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
