//! Scenes built in code and a caster that tests every primitive.
#![allow(dead_code)] // each test binary uses its own part

use ropewalk::primitive::{Sphere, Triangle};
use ropewalk::ray::PreparedRay;
use ropewalk::traverse::{ClosestHit, Counters, Query, RayCaster};
use ropewalk::{Geometry, Hit, Ray, Sides};
use ropewalk_render::{Monitor, Render, RenderSettings, render};
use ropewalk_scene::{Camera, Light, Material, Object, Scene, Surface};

/// Tests every primitive.
pub struct EveryPrimitive<'a>(pub &'a Geometry);

impl RayCaster for EveryPrimitive<'_> {
    fn closest_hit<C: Counters>(&self, ray: &Ray, counters: &mut C) -> Option<Hit> {
        let prepared = PreparedRay::new(ray)?;
        let mut query = ClosestHit::default();
        for prim_id in 0..self.0.len() as u32 {
            counters.intersection_test();
            self.0.intersect(prim_id, &prepared).into_iter().for_each(|hit| query.offer(hit));
        }
        query.answer()
    }

    fn occluded<C: Counters>(&self, ray: &Ray, counters: &mut C) -> bool {
        self.closest_hit(ray, counters).is_some()
    }
}

/// White, diffuse only.
pub const MATTE: Material = Material {
    color: [1.0; 3],
    kd: 1.0,
    ks: 0.0,
    shine: 100_000.0,
    transmittance: 0.0,
    index_of_refraction: 0.0,
};

/// Mirrors and has no colour of its own.
pub const MIRROR: Material = Material { kd: 0.0, ks: 1.0, ..MATTE };

/// Transmits all and has no colour of its own.
pub const GLASS: Material =
    Material { kd: 0.0, transmittance: 1.0, index_of_refraction: 1.5, ..MATTE };

/// A scene and its primitives, grown together.
pub struct Stage {
    pub scene: Scene,
    pub geometry: Geometry,
}

impl Stage {
    /// An eye at the origin that looks along `+y` with `z` up, over 90 degrees; grey background.
    pub fn new(width: u32, height: u32) -> Self {
        let camera = Camera {
            from: [0.0; 3],
            at: [0.0, 1.0, 0.0],
            up: [0.0, 0.0, 1.0],
            angle: 90.0,
            hither: 0.0,
            resolution: [width, height],
        };
        let scene =
            Scene { camera: Some(camera), background: [0.25, 0.5, 0.75], ..Scene::default() };
        Stage { scene, geometry: Geometry::new() }
    }

    pub fn light(mut self, position: [f64; 3], color: Option<[f64; 3]>) -> Self {
        self.scene.lights.push(Light { position, color });
        self
    }

    pub fn sphere(
        mut self,
        center: [f64; 3],
        radius: f64,
        material: Material,
        sides: Sides,
    ) -> Self {
        let shape = Sphere { center: center.map(|x| x as f32), radius: radius as f32 };
        self.geometry.push(shape, sides).expect("a finite sphere");
        self.object(Surface::Sphere { center, radius }, material)
    }

    pub fn triangle(mut self, vertices: [[f64; 3]; 3], material: Material, sides: Sides) -> Self {
        let shape = Triangle { vertices: vertices.map(|v| v.map(|x| x as f32)) };
        self.geometry.push(shape, sides).expect("a finite triangle");
        self.object(Surface::Polygon(vertices.to_vec()), material)
    }

    /// A wall across the view at distance `y` that faces the eye, much larger than the view.
    pub fn wall(self, y: f64, material: Material, sides: Sides) -> Self {
        let s = 100.0 * y.abs();
        self.triangle([[-s, y, -s], [s, y, -s], [0.0, y, s]], material, sides)
    }

    fn object(mut self, surface: Surface, material: Material) -> Self {
        let index = self.scene.materials.len() as u32;
        self.scene.materials.push(material);
        self.scene.objects.push(Object { surface, material: index });
        self
    }

    pub fn render(&self, settings: &RenderSettings) -> Render {
        self.render_watched(settings, Monitor::default())
    }

    pub fn render_watched(&self, settings: &RenderSettings, monitor: Monitor<'_>) -> Render {
        let caster = EveryPrimitive(&self.geometry);
        render(&self.scene, &self.geometry, &caster, settings, monitor).expect("a good scene")
    }
}

/// Mirror and glass balls over a two-coloured floor, two lights, one of them coloured.
pub fn still_life(size: u32) -> Stage {
    let floor = |color| Material { color, kd: 0.8, ..MATTE };
    let shiny = Material { color: [1.0, 0.3, 0.2], kd: 0.6, ks: 0.4, shine: 20.0, ..MATTE };
    let glass = Material { ks: 0.1, shine: 60.0, transmittance: 0.9, ..GLASS };
    Stage::new(size, size)
        .light([-4.0, -2.0, 6.0], None)
        .light([5.0, 1.0, 3.0], Some([0.2, 0.4, 0.6]))
        .triangle(
            [[-9.0, 1.0, -1.0], [9.0, 1.0, -1.0], [-9.0, 12.0, -1.0]],
            floor([0.9, 0.9, 0.4]),
            Sides::Front,
        )
        .triangle(
            [[9.0, 1.0, -1.0], [9.0, 12.0, -1.0], [-9.0, 12.0, -1.0]],
            floor([0.3, 0.5, 0.3]),
            Sides::Front,
        )
        .sphere([-0.9, 4.0, 0.0], 1.0, shiny, Sides::Front)
        .sphere([1.1, 3.2, -0.2], 0.8, glass, Sides::Both)
        .sphere([0.3, 6.0, 1.0], 1.2, Material { kd: 0.1, ks: 0.9, ..shiny }, Sides::Front)
}
