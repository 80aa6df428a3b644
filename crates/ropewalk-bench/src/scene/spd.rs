//! Scenes of the Standard Procedural Databases as triangles.

use super::mesh::{Mesh, MeshError, Scene};
use crate::workload::View;
use anyhow::Context;
use ropewalk_scene::spd::{Spd, generate};
use ropewalk_scene::{Camera, Surface};

/// Meridians and parallels of a tessellated sphere: 720 triangles.
const MERIDIANS: u32 = 24;
const PARALLELS: u32 = 16;

/// A scene of the databases at a size factor, spheres tessellated, polygons fanned.
pub(super) fn tessellate(name: &str, spd: Spd, size: u32) -> Result<Scene, MeshError> {
    let mut scene = ropewalk_scene::Scene::default();
    generate(spd, size, &mut scene)?;
    let mut mesh = Mesh { name: name.to_owned(), ..Mesh::default() };
    for object in &scene.objects {
        match &object.surface {
            Surface::Sphere { center, radius } => sphere(&mut mesh, *center, radius.abs()),
            Surface::Polygon(vertices) | Surface::Patch { vertices, .. } => {
                let first = mesh.vertices.len() as u32;
                mesh.vertices.extend(vertices.iter().map(|v| v.map(|x| x as f32)));
                mesh.faces
                    .extend((2..vertices.len() as u32).map(|k| [first, first + k - 1, first + k]));
            }
            Surface::Cone(_) => anyhow::bail!("cones are not tessellated"),
        }
    }
    let Camera { from, at, up, angle, .. } = scene.camera.context("the scene has no view")?;
    let light = scene.lights.first().context("the scene has no light")?.position;
    let point = |v: [f64; 3]| v.map(|x| x as f32);
    let view = View {
        eye: point(from),
        at: point(at),
        up: point(up),
        fov_degrees: angle as f32,
        light: point(light),
    };
    Ok(Scene { mesh: mesh.checked()?, view })
}

/// A sphere by longitude and latitude; its poles are shared by all meridians.
fn sphere(mesh: &mut Mesh, center: [f64; 3], radius: f64) {
    let first = mesh.vertices.len() as u32;
    let mut push = |x: f64, y: f64, z: f64| {
        let v = [center[0] + radius * x, center[1] + radius * y, center[2] + radius * z];
        mesh.vertices.push(v.map(|x| x as f32));
    };
    push(0.0, 0.0, 1.0);
    for parallel in 1..PARALLELS {
        let polar = std::f64::consts::PI * f64::from(parallel) / f64::from(PARALLELS);
        for meridian in 0..MERIDIANS {
            let turn = std::f64::consts::TAU * f64::from(meridian) / f64::from(MERIDIANS);
            push(polar.sin() * turn.cos(), polar.sin() * turn.sin(), polar.cos());
        }
    }
    push(0.0, 0.0, -1.0);
    let at = |parallel: u32, meridian: u32| match parallel {
        0 => first,
        PARALLELS => first + 1 + (PARALLELS - 1) * MERIDIANS,
        p => first + 1 + (p - 1) * MERIDIANS + meridian % MERIDIANS,
    };
    for p in 0..PARALLELS {
        for m in 0..MERIDIANS {
            let [a, b, c, d] = [at(p, m), at(p + 1, m), at(p + 1, m + 1), at(p, m + 1)];
            if p + 1 < PARALLELS {
                mesh.faces.push([a, b, c]);
            }
            if p > 0 {
                mesh.faces.push([a, c, d]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sphere_is_closed_and_faces_outward() {
        let mut mesh = Mesh::default();
        sphere(&mut mesh, [1.0, 2.0, 3.0], 2.0);
        assert_eq!(mesh.faces.len(), 720);
        let mut edges: Vec<[u32; 2]> =
            mesh.faces.iter().flat_map(|f| [[f[0], f[1]], [f[1], f[2]], [f[2], f[0]]]).collect();
        edges.sort_unstable();
        assert!(edges.iter().all(|e| edges.binary_search(&[e[1], e[0]]).is_ok()));
        edges.dedup();
        assert_eq!(edges.len(), 3 * 720);
    }

    #[test]
    fn balls_become_spheres_on_a_floor() {
        let scene = tessellate("balls", Spd::Balls, 1).unwrap();
        assert_eq!(scene.mesh.faces.len(), 10 * 720 + 2);
        assert!(tessellate("rings", Spd::Rings, 1).is_err());
    }
}
