//! Scenes as the core sees them: order, sides, and what is refused.

use ropewalk::{GeometryError, Shape, Sides};
use ropewalk_scene::{Cone, FacetPolicy, Material, Object, Scene, Surface};

fn material(transmittance: f64) -> Material {
    Material {
        color: [1.0; 3],
        kd: 1.0,
        ks: 0.0,
        shine: 1.0,
        transmittance,
        index_of_refraction: 1.0,
    }
}

/// Objects of an opaque (0) and a transmitting (1) material.
fn scene(surfaces: Vec<(Surface, u32)>) -> Scene {
    let objects = surfaces.into_iter().map(|(surface, material)| Object { surface, material });
    Scene {
        materials: vec![material(0.0), material(0.5)],
        objects: objects.collect(),
        ..Scene::default()
    }
}

fn sphere(radius: f64) -> Surface {
    Surface::Sphere { center: [0.0; 3], radius }
}

fn cone(base_radius: f64, apex_radius: f64) -> Surface {
    Surface::Cone(Cone { base: [0.0; 3], base_radius, apex: [0.0, 0.0, 1.0], apex_radius })
}

fn square() -> Vec<[f64; 3]> {
    vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]
}

#[test]
fn objects_keep_their_order_and_get_their_sides() {
    let normals = vec![[0.0, 0.0, 1.0]; 4];
    let scene = scene(vec![
        (sphere(2.0), 0),
        (sphere(-2.0), 0),
        (sphere(-2.0), 1),
        (cone(1.0, 0.5), 0),
        (cone(-1.0, -0.5), 0),
        (cone(-1.0, 0.0), 0),
        (Surface::Polygon(square()), 0),
        (Surface::Polygon(square()[..3].to_vec()), 1),
        (Surface::Patch { vertices: square(), normals }, 7),
    ]);
    let geometry = scene.geometry(FacetPolicy::OneSided).unwrap();
    use Sides::{Back, Both, Front};
    let expected = [Front, Back, Both, Front, Back, Back, Front, Both, Front];
    for (id, sides) in (0..).zip(expected) {
        assert_eq!(geometry.sides(id), sides, "{id}");
        let kind = match geometry.shape(id) {
            Shape::Sphere(s) => {
                assert_eq!(s.radius, 2.0);
                's'
            }
            Shape::Cone(c) => {
                assert!(c.base_radius == 1.0 && c.apex_radius >= 0.0);
                'c'
            }
            Shape::Polygon(_) => 'p',
            Shape::Triangle(_) => 't',
            Shape::Patch(_) => 'n',
            _ => '?',
        };
        assert_eq!("ssscccptn".as_bytes()[id as usize], kind as u8);
    }
    let both = scene.geometry(FacetPolicy::TwoSided).unwrap();
    assert!((0..9).all(|id| both.sides(id) == Both));
}

#[test]
fn what_cannot_be_represented_is_named() {
    let error = |surface| {
        let scene = scene(vec![(sphere(1.0), 0), (surface, 0)]);
        match scene.geometry(FacetPolicy::OneSided) {
            Ok(_) => panic!("accepted"),
            Err(error) => error,
        }
    };
    let far = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1e39, 0.0]];
    let cases = [
        (sphere(f64::NAN), "primitive 1: radius is NaN; it must be finite and at least 0"),
        (cone(1.0, -1.0), "primitive 1: apex radius is -1; it must be finite and at least 0"),
        (
            Surface::Polygon(far),
            "primitive 1: vertex 2 is (0, inf, 0); every coordinate must be a finite f32",
        ),
        (
            Surface::Polygon(square()[..2].to_vec()),
            "primitive 1: polygon has 2 vertices; it needs at least 3",
        ),
        (
            Surface::Patch { vertices: square(), normals: vec![] },
            "primitive 1: patch has 4 vertices and 0 normals; it needs one normal a vertex",
        ),
    ];
    for (surface, text) in cases {
        let error = error(surface);
        assert!(matches!(error, GeometryError::Shape { index: 1, .. }));
        assert_eq!(error.to_string(), text);
    }
}
