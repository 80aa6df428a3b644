//! Whitted's recursive ray tracing by the rules of the Standard Procedural Databases (T. Whitted,
//! "An improved illumination model for shaded display", 1980; E. Haines, SPD Readme, "Testing
//! Procedures"). Each rule is one small function.

use crate::light::{Lighting, PointLight};
use crate::observer::Observer;
use crate::offset::lifted_origin;
use crate::ray_counts::RayKind;
use crate::shading::{ambient, direct, mirrored, refracted};
use crate::vec3::{Vec3, add, add_scaled, dot, scale, sub, unit};
use ropewalk::traverse::{LeafId, RayCaster};
use ropewalk::{Geometry, Hit, Ray};
use ropewalk_scene::{Material, Scene};

/// Traces trees of rays through one scene.
pub(crate) struct Whitted<'a, A> {
    pub scene: &'a Scene,
    pub geometry: &'a Geometry,
    pub caster: &'a A,
    pub lighting: Lighting,
    /// Deepest level; the eye ray is level 1.
    pub max_depth: u32,
    pub facing: FacingRule,
}

/// Which normal decides whether a surface faces a light, and so whether a shadow ray is shot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FacingRule {
    /// The surface's own normal, from whichever side it is seen: "a shadow ray is not generated if
    /// the surface normal points away from the light; this is true even on transmitting surfaces"
    /// (SPD, testing procedure 10).
    SurfaceNormal,
    /// The normal turned to the viewer, which lights the side that is seen.
    ViewerSide,
}

/// What an eye ray brings back.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EyeSample {
    pub color: Vec3,
    /// Distance of the hit along the ray, in lengths of its direction; infinite on a miss.
    pub distance: f32,
    /// Shading normal at the hit, turned to the eye; zero on a miss.
    pub normal: Vec3,
}

/// A hit made ready for shading. Normals and `to_viewer` have unit length.
struct SurfacePoint<'a> {
    material: &'a Material,
    position: Vec3,
    /// Length of the ray that arrived.
    travelled: f64,
    /// Direction in which the ray arrived.
    arriving: Vec3,
    /// Geometric normal, turned to the viewer.
    geometric: Vec3,
    /// Shading normal, turned with the geometric one.
    shading: Vec3,
    /// True if the ray arrived at the front, from outside the object.
    outside: bool,
    /// The leaf of the hit, if the caster knows it: where all rays that leave from here start.
    leaf: Option<LeafId>,
}

impl<A: RayCaster> Whitted<'_, A> {
    /// The tree of rays of one eye ray.
    pub fn eye<O: Observer>(&self, ray: &Ray, observer: &mut O) -> EyeSample {
        let (hit, leaf) = self.closest_hit(ray, RayKind::Primary, None, observer);
        let Some(hit) = hit else {
            let color = self.scene.background;
            return EyeSample { color, distance: f32::INFINITY, normal: [0.0; 3] };
        };
        let point = self.surface_point(ray, &hit, leaf);
        let color = self.shade(&point, 1, observer);
        EyeSample { color, distance: hit.t, normal: point.shading }
    }

    /// The colour that a secondary ray at level `depth` brings back; the background if it misses.
    fn trace<O: Observer>(
        &self,
        ray: &Ray,
        kind: RayKind,
        from: &SurfacePoint,
        depth: u32,
        observer: &mut O,
    ) -> Vec3 {
        match self.closest_hit(ray, kind, from.leaf, observer) {
            (Some(hit), leaf) => self.shade(&self.surface_point(ray, &hit, leaf), depth, observer),
            (None, _) => self.scene.background,
        }
    }

    fn closest_hit<O: Observer>(
        &self,
        ray: &Ray,
        kind: RayKind,
        start: Option<LeafId>,
        observer: &mut O,
    ) -> (Option<Hit>, Option<LeafId>) {
        let (hit, leaf) = self.caster.closest_hit_from(ray, start, observer.cast(kind, ray));
        observer.answered(kind, hit.is_some());
        (hit, leaf)
    }

    fn surface_point(&self, ray: &Ray, hit: &Hit, leaf: Option<LeafId>) -> SurfacePoint<'_> {
        let material = self.scene.objects[hit.prim_id as usize].material;
        let normals = self.geometry.normals(ray, hit);
        let along = ray.dir.map(f64::from);
        let outside = dot(along, normals.geometric) < 0.0;
        let turn = if outside { 1.0 } else { -1.0 };
        SurfacePoint {
            material: &self.scene.materials[material as usize],
            position: ray.at(hit.t),
            travelled: f64::from(hit.t) * dot(along, along).sqrt(),
            arriving: unit(along).unwrap_or([0.0; 3]),
            geometric: scale(normals.geometric, turn),
            shading: scale(normals.shading, turn),
            outside,
            leaf,
        }
    }

    /// Light towards the viewer: ambient, each light that the surface faces and that is not
    /// blocked, and what the secondary rays of this node bring.
    fn shade<O: Observer>(&self, point: &SurfacePoint, depth: u32, observer: &mut O) -> Vec3 {
        let material = point.material;
        let mut color = ambient(material, self.lighting.ambient);
        for light in &self.lighting.lights {
            color = add(color, self.light(point, light, observer));
        }
        if !spawns_rays(depth, self.max_depth) {
            return color;
        }
        if reflects(material) {
            let ray = leaving_ray(point, reflection_dir(point));
            let seen = self.trace(&ray, RayKind::Reflection, point, depth + 1, observer);
            color = add_scaled(color, material.ks, seen);
        }
        if transmits(material)
            && let Some(dir) = refraction_dir(point)
        {
            let ray = leaving_ray(point, dir);
            let seen = self.trace(&ray, RayKind::Refraction, point, depth + 1, observer);
            color = add_scaled(color, material.transmittance, seen);
        }
        color
    }

    /// Light from one light; a shadow ray is shot only if the surface faces it. Where the rule
    /// shoots one to a light on the far side of the surface, it counts but brings no light.
    fn light<O: Observer>(
        &self,
        point: &SurfacePoint,
        light: &PointLight,
        observer: &mut O,
    ) -> Vec3 {
        let Some(to_light) = unit(sub(light.position, point.position)) else {
            return [0.0; 3];
        };
        if !self.faces(point, to_light) {
            return [0.0; 3];
        }
        let ray = shadow_ray(point, light);
        let blocked =
            self.caster.occluded_from(&ray, point.leaf, observer.cast(RayKind::Shadow, &ray));
        observer.answered(RayKind::Shadow, blocked);
        if blocked {
            return [0.0; 3];
        }
        let to_viewer = scale(point.arriving, -1.0);
        direct(point.material, light.intensity, point.shading, to_light, to_viewer)
    }

    /// Whether the shading normal, taken by the facing rule, points to the light's side.
    fn faces(&self, point: &SurfacePoint, to_light: Vec3) -> bool {
        let cosine = dot(point.shading, to_light);
        match self.facing {
            FacingRule::SurfaceNormal if !point.outside => cosine < 0.0,
            _ => cosine > 0.0,
        }
    }
}

/// SPD, testing procedure 7: a ray at the deepest level spawns nothing.
fn spawns_rays(depth: u32, max_depth: u32) -> bool {
    depth < max_depth
}

/// SPD, testing procedure 8: reflective and transmitting surfaces both spawn a reflection ray,
/// whatever its weight.
fn reflects(material: &Material) -> bool {
    material.ks > 0.0 || transmits(material)
}

/// SPD, testing procedure 9.
fn transmits(material: &Material) -> bool {
    material.transmittance > 0.0
}

/// From the surface to the light and no further: the direction is the whole way, `t` ends at 1.
fn shadow_ray(point: &SurfacePoint, light: &PointLight) -> Ray {
    let way = sub(light.position, point.position);
    let origin = leaving_origin(point, way);
    let dir = std::array::from_fn(|a| (light.position[a] - f64::from(origin[a])) as f32);
    Ray::new(origin, dir).with_range(0.0, 1.0)
}

/// The mirrored direction at the shading normal. Where interpolation has tilted that so far that
/// the ray would enter the surface, the geometric normal mirrors instead.
fn reflection_dir(point: &SurfacePoint) -> Vec3 {
    let dir = mirrored(point.arriving, point.shading);
    if dot(dir, point.geometric) > 0.0 { dir } else { mirrored(point.arriving, point.geometric) }
}

/// Snell's law; a ray that arrives at the front enters the object, one that arrives at the back
/// leaves it for empty space. `None` on total internal reflection. An index of refraction that is
/// not positive counts as 1.
fn refraction_dir(point: &SurfacePoint) -> Option<Vec3> {
    let written = point.material.index_of_refraction;
    let index = if written > 0.0 { written } else { 1.0 };
    let eta = if point.outside { 1.0 / index } else { index };
    refracted(point.arriving, point.shading, eta)
}

/// A ray from the surface in direction `dir`, which decides the side it starts on.
fn leaving_ray(point: &SurfacePoint, dir: Vec3) -> Ray {
    Ray::new(leaving_origin(point, dir), dir.map(|x| x as f32))
}

fn leaving_origin(point: &SurfacePoint, dir: Vec3) -> [f32; 3] {
    let side = if dot(dir, point.geometric) < 0.0 { -1.0 } else { 1.0 };
    lifted_origin(point.position, scale(point.geometric, side), point.travelled)
}
