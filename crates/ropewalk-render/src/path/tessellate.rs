//! NFF scenes as triangles with materials.

use glam::DVec3;
use ropewalk_scene::stage::{Light, Material};
use ropewalk_scene::{Cone, Mesh, Scene, Stage, Surface};
use std::f64::consts::{PI, TAU};

/// Radiant intensity of a light without a colour, for each unit of distance squared from the point looked at: NFF's
/// lights do not fade.
const INTENSITY: f64 = 3.0;

/// A scene of spheres, cones and polygons as triangles: spheres of `steps` parallels and twice as many meridians, both
/// with smooth normals, polygons cut by ears. Lights without fall-off become lights that are as bright at the point
/// looked at; Phong's highlights become rough coats or metal, transmittance glass.
pub fn tessellated(scene: &Scene, steps: u32) -> Stage {
    let steps = steps.max(3);
    let mut soup = Soup { cutter: earcut::Earcut::new(), ..Soup::default() };
    for object in &scene.objects {
        match &object.surface {
            Surface::Sphere { center, radius } => soup.sphere(*center, *radius, steps),
            Surface::Cone(cone) => soup.cone(cone, steps),
            Surface::Polygon(vertices) => soup.polygon(vertices, None),
            Surface::Patch { vertices, normals } => soup.polygon(vertices, Some(normals)),
        }
        soup.material.resize(soup.mesh.faces.len(), object.material);
    }
    let looked_at = scene.camera.map_or([0.0; 3], |camera| camera.at);
    let lights = scene.lights.iter().map(|light| {
        let distance2 =
            DVec3::from_array(light.position).distance_squared(DVec3::from_array(looked_at));
        let strength = INTENSITY * distance2 / (scene.lights.len() as f64).sqrt();
        let color = light.color.unwrap_or([1.0; 3]);
        let intensity = color.map(|c| (c * strength) as f32);
        Light::Point { position: light.position, intensity }
    });
    Stage {
        name: scene.name.clone(),
        mesh: soup.mesh,
        normals: soup.normals,
        material: soup.material,
        materials: scene.materials.iter().map(material).collect(),
        lights: lights.collect(),
        camera: scene.camera,
        ..Stage::default()
    }
}

/// What comes nearest to a material of Phong's model.
fn material(m: &ropewalk_scene::Material) -> Material {
    let color = m.color.map(|c| c.clamp(0.0, 1.0) as f32);
    // The width of Phong's lobe as that of a microsurface (Walter et al. 2007, section 5.2).
    let roughness = (2.0 / (m.shine.max(0.0) + 2.0)).sqrt().sqrt() as f32;
    let glass = m.transmittance.clamp(0.0, 1.0) as f32;
    let metallic = (m.ks / (m.kd + m.ks).max(1e-9)).clamp(0.0, 1.0) as f32;
    let is_glass = glass > 0.0;
    Material {
        base_color: if is_glass { [1.0; 3] } else { color },
        metallic: if is_glass || metallic < 0.5 { 0.0 } else { metallic },
        roughness: if is_glass { 0.0 } else { roughness },
        transmission: glass,
        ior: if is_glass { m.index_of_refraction.max(1.0) as f32 } else { 1.5 },
        ..Material::default()
    }
}

#[derive(Default)]
struct Soup {
    mesh: Mesh,
    normals: Vec<[[f32; 3]; 3]>,
    material: Vec<u32>,
    cutter: earcut::Earcut<f64>,
}

impl Soup {
    fn vertex(&mut self, p: DVec3) -> u32 {
        self.mesh.vertices.push(p.to_array());
        self.mesh.vertices.len() as u32 - 1
    }

    fn face(&mut self, corners: [u32; 3], normals: [DVec3; 3]) {
        let [a, b, c] = corners.map(|i| DVec3::from_array(self.mesh.vertices[i as usize]));
        if (b - a).cross(c - a) != DVec3::ZERO {
            self.mesh.faces.push(corners);
            self.normals.push(normals.map(|n| n.as_vec3().to_array()));
        }
    }

    /// Rings of vertices with their normals, joined; the front is where normals point.
    fn rings(&mut self, rings: &[Vec<(DVec3, DVec3)>]) {
        let numbered: Vec<Vec<(u32, DVec3)>> = rings
            .iter()
            .map(|ring| ring.iter().map(|&(p, n)| (self.vertex(p), n)).collect())
            .collect();
        for pair in numbered.windows(2) {
            let n = pair[0].len();
            for i in 0..n {
                let j = (i + 1) % n;
                let [a, b, c, d] = [pair[0][i], pair[0][j], pair[1][j], pair[1][i]];
                for [p, q, r] in [[a, b, c], [a, c, d]] {
                    self.face([p.0, q.0, r.0], [p.1, q.1, r.1]);
                }
            }
        }
    }

    fn sphere(&mut self, center: [f64; 3], radius: f64, steps: u32) {
        let center = DVec3::from_array(center);
        let ring = |i: u32| {
            // From the lower pole up, so that normals point outwards.
            let theta = PI * (1.0 - f64::from(i) / f64::from(steps));
            let at = |j: u32| {
                let phi = TAU * f64::from(j) / f64::from(2 * steps);
                let sine = if i == 0 || i == steps { 0.0 } else { theta.sin() };
                let n = DVec3::new(sine * phi.cos(), sine * phi.sin(), theta.cos());
                (center + radius.abs() * n, n)
            };
            (0..2 * steps).map(at).collect()
        };
        self.rings(&(0..=steps).map(ring).collect::<Vec<_>>());
    }

    fn cone(&mut self, cone: &Cone, steps: u32) {
        let (base, apex) = (DVec3::from_array(cone.base), DVec3::from_array(cone.apex));
        let Some(axis) = (apex - base).try_normalize() else { return };
        let (across, along) = axis.any_orthonormal_pair();
        let (low, high) = (cone.base_radius.abs(), cone.apex_radius.abs());
        let slope = (low - high) / base.distance(apex);
        let ring = |center: DVec3, radius: f64| {
            let at = |j: u32| {
                let phi = TAU * f64::from(j) / f64::from(2 * steps);
                let out = phi.cos() * across + phi.sin() * along;
                (center + radius * out, (out + slope * axis).normalize())
            };
            (0..2 * steps).map(at).collect::<Vec<_>>()
        };
        self.rings(&[ring(base, low), ring(apex, high)]);
    }

    fn polygon(&mut self, vertices: &[[f64; 3]], normals: Option<&Vec<[f64; 3]>>) {
        let normal = |i: usize| {
            let given = normals.and_then(|n| n.get(i)).copied().unwrap_or([0.0; 3]);
            DVec3::from_array(given).normalize_or_zero()
        };
        let mut flat = Vec::new();
        let mut cut: Vec<u32> = Vec::new();
        if vertices.len() == 3 {
            cut.extend([0, 1, 2]);
        } else if earcut::utils3d::project3d_to_2d(vertices, vertices.len(), &mut flat) {
            self.cutter.earcut(flat.iter().copied(), &[], &mut cut);
        }
        let first = self.mesh.vertices.len() as u32;
        self.mesh.vertices.extend_from_slice(vertices);
        let front = newell(vertices);
        for &[a, b, c] in cut.as_chunks::<3>().0 {
            let corner = |i: u32| DVec3::from_array(vertices[i as usize]);
            let turn = (corner(b) - corner(a)).cross(corner(c) - corner(a)).dot(front);
            let [a, b, c] = if turn < 0.0 { [a, c, b] } else { [a, b, c] };
            let face = [a, b, c];
            self.face(face.map(|i| first + i), face.map(|i| normal(i as usize)));
        }
    }
}

/// The normal of a polygon, of any length (M. Newell).
fn newell(vertices: &[[f64; 3]]) -> DVec3 {
    let at = |i: usize| DVec3::from_array(vertices[i % vertices.len()]);
    (0..vertices.len()).map(|i| at(i).cross(at(i + 1))).sum()
}
