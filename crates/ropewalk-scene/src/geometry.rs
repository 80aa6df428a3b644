//! From the scene model to the primitives of the core.

use crate::model::{FacetPolicy, Object, Scene, Surface};
use ropewalk::primitive::{Cone, Patch, ShapeError, Sphere};
use ropewalk::{Geometry, GeometryError, Shape, Sides};

impl Scene {
    /// The primitives for the core, object `i` as primitive `i`, rounded to `f32`.
    ///
    /// A sphere of negative radius, or a cone with no positive and at least one negative radius, is
    /// visible from the inside: one-sided it can only be hit there.
    ///
    /// # Errors
    /// [`GeometryError`] names the first object that cannot be represented, by its index.
    pub fn geometry(&self, policy: FacetPolicy) -> Result<Geometry, GeometryError> {
        let mut geometry = Geometry::new();
        for (index, object) in self.objects.iter().enumerate() {
            let (shape, inward) =
                shape(&object.surface).map_err(|error| GeometryError::Shape { index, error })?;
            let sides = match (self.is_one_sided(object, policy), inward) {
                (false, _) => Sides::Both,
                (true, false) => Sides::Front,
                (true, true) => Sides::Back,
            };
            geometry.push(shape, sides)?;
        }
        Ok(geometry)
    }

    /// True if only one side of the object can be hit.
    fn is_one_sided(&self, object: &Object, policy: FacetPolicy) -> bool {
        let material = self.materials.get(object.material as usize);
        let opaque = material.is_none_or(|m| m.transmittance <= 0.0);
        policy == FacetPolicy::OneSided && opaque
    }
}

fn round(p: [f64; 3]) -> [f32; 3] {
    p.map(|x| x as f32)
}

fn round_all(points: &[[f64; 3]]) -> Vec<[f32; 3]> {
    points.iter().copied().map(round).collect()
}

/// The shape of a surface, and whether it is visible from the inside.
fn shape(surface: &Surface) -> Result<(Shape, bool), ShapeError> {
    Ok(match surface {
        Surface::Sphere { center, radius } => {
            let sphere = Sphere::new(round(*center), radius.abs() as f32)?;
            (sphere.into(), *radius < 0.0)
        }
        Surface::Cone(cone) => {
            let (base, apex) = (cone.base_radius, cone.apex_radius);
            let inward = base.max(apex) <= 0.0 && base.min(apex) < 0.0;
            let sign = if inward { -1.0 } else { 1.0 };
            let cone = Cone::new(
                round(cone.base),
                (sign * base) as f32,
                round(cone.apex),
                (sign * apex) as f32,
            )?;
            (cone.into(), inward)
        }
        Surface::Polygon(vertices) => (Shape::polygon(round_all(vertices))?, false),
        Surface::Patch { vertices, normals } => {
            (Patch::new(round_all(vertices), round_all(normals))?.into(), false)
        }
    })
}
