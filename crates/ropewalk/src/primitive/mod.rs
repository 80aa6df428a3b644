//! The primitives: one file each, all behind the [`Primitive`] trait.
//!
//! A builder sees a primitive as a box, as the tight box of its part inside a cell, and as an area
//! left of an axis plane; a traversal sees one ray test. Nothing else is asked of a primitive.

mod cone;
mod patch;
mod planar;
mod polygon;
mod sphere;
mod triangle;

pub use cone::Cone;
pub use patch::Patch;
pub use polygon::{EDGE_TOLERANCE, Polygon};
pub use sphere::Sphere;
pub(crate) use triangle::{EDGE_FILTER, edge_exactly};
pub use triangle::{Meeting, Triangle};

use crate::aabb::Aabb;
use crate::ray::PreparedRay;
use std::sync::Arc;

/// Why a shape was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ShapeError {
    /// A coordinate is NaN or infinite.
    #[error("{what} {index} is ({}, {}, {}); every coordinate must be a finite f32", .found[0], .found[1], .found[2])]
    NotFinite {
        /// Which kind of point.
        what: &'static str,
        /// Its number, from 0.
        index: usize,
        /// Its value.
        found: [f32; 3],
    },
    /// A radius is negative, NaN or infinite.
    #[error("{what} is {found}; it must be finite and at least 0")]
    BadRadius {
        /// Which radius.
        what: &'static str,
        /// Its value.
        found: f32,
    },
    /// A polygon of fewer than three vertices.
    #[error("polygon has {found} vertices; it needs at least 3")]
    TooFewVertices {
        /// Number of vertices.
        found: usize,
    },
    /// A patch whose normals do not match its vertices.
    #[error("patch has {vertices} vertices and {found} normals; it needs one normal a vertex")]
    NormalCount {
        /// Number of vertices.
        vertices: usize,
        /// Number of normals.
        found: usize,
    },
}

fn check_points(what: &'static str, points: &[[f32; 3]]) -> Result<(), ShapeError> {
    match points.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
        Some(index) => Err(ShapeError::NotFinite { what, index, found: points[index] }),
        None => Ok(()),
    }
}

fn check_radius(what: &'static str, found: f32) -> Result<(), ShapeError> {
    if found.is_finite() && found >= 0.0 {
        Ok(())
    } else {
        Err(ShapeError::BadRadius { what, found })
    }
}

/// Which sides of a surface a ray can hit. The front is the side the normal points to: for
/// triangles and polygons the side from which the vertices run counter-clockwise, for spheres and
/// cones the outside.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Sides {
    /// Only rays that arrive against the normal.
    Front,
    /// Only rays that arrive along the normal ("inside visible" in NFF).
    Back,
    /// Both.
    #[default]
    Both,
}

impl Sides {
    /// True if a ray whose direction makes `facing = dot(dir, normal)` with the outward normal may
    /// hit. An exactly grazing ray (`facing == 0`) hits neither single side.
    pub fn accepts(self, facing: f64) -> bool {
        match self {
            Sides::Front => facing < 0.0,
            Sides::Back => facing > 0.0,
            Sides::Both => true,
        }
    }
}

/// A crossing of a ray and one primitive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Parameter, computed in `f64` and rounded once.
    pub t: f32,
    /// First surface coordinate (see [`Hit::u`](crate::Hit)).
    pub u: f32,
    /// Second surface coordinate.
    pub v: f32,
}

impl Crossing {
    /// The crossing at `t`, rounded to `f32`, if that is finite and in the ray's range.
    #[inline]
    pub fn in_range(ray: &PreparedRay, t: f64) -> Option<Crossing> {
        let t = t as f32;
        (t.is_finite() && ray.accepts(t)).then_some(Crossing { t, u: 0.0, v: 0.0 })
    }
}

/// The normals at a point of a primitive, in `f64`, unit length, pointing to the front.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceNormals {
    /// Normal of the surface itself.
    pub geometric: [f64; 3],
    /// Interpolated normal for shading; equal to `geometric` except on smooth patches.
    pub shading: [f64; 3],
}

/// How far from the surface a ray may pass and still be reported, as a share of the largest
/// coordinate of ray origin and primitive: the bounds of the kernels' errors, each stated at its
/// primitive, lie below 2^-42, and vertices of a polygon that miss its plane by less than 2^-43
/// are taken as in it.
pub const HIT_ERROR: f64 = 1.0 / (1u64 << 41) as f64;

/// What a builder and a traversal need to know of a shape.
///
/// Contracts, all checked by the property tests of `ropewalk-testkit`:
/// * `bounds` and `clipped_bounds` are rounded outward: no point of the surface lies outside.
/// * The point at the exact parameter of a reported crossing lies within [`HIT_ERROR`] of the
///   surface; its rounding to `f32` moves it along the ray by another `2^-24 t`.
/// * `clipped_bounds(cell)` lies in `cell` and in `bounds`, and is `None` only if no point of the
///   surface touches the closed cell. It is tight for triangles and polygons ("perfect splits").
/// * `intersect` returns the smallest accepted `t` in the ray's range on an accepted side.
pub trait Primitive: Send + Sync {
    /// The box of the whole surface.
    fn bounds(&self) -> Aabb;

    /// The box of the part of the surface inside the closed `cell`.
    fn clipped_bounds(&self, cell: &Aabb) -> Option<Aabb>;

    /// One-sided area of the whole surface.
    fn area(&self) -> f64;

    /// Adds the primitive's part inside `cell` to the area functions of a plane that sweeps the
    /// cell along `axis` (see [`AreaRamp`]).
    fn area_ramps(&self, cell: &Aabb, axis: usize, out: &mut Vec<AreaRamp>);

    /// One-sided area of the part inside the closed `cell`, to the accuracy of `area_ramps`.
    fn area_in(&self, cell: &Aabb) -> f64 {
        let mut ramps = Vec::new();
        self.area_ramps(cell, 0, &mut ramps);
        ramps.iter().map(|ramp| ramp.area_until(cell.extent(0))).sum()
    }

    /// The first crossing in `ray.t_min ..= ray.t_max` on one of `sides`.
    fn intersect(&self, ray: &PreparedRay, sides: Sides) -> Option<Crossing>;

    /// The normals at a crossing that `intersect` returned for a ray; `point` is the hit point.
    fn normals(&self, point: [f64; 3], crossing: Crossing) -> SurfaceNormals;

    /// True if the surface has no area and so is never hit.
    fn is_degenerate(&self) -> bool;
}

/// One breakpoint of the area left of a sweeping plane, in coordinates local to the cell
/// (`x = 0` at the cell's lower face, in `f64`). From `x` on, the area of the primitive's part
/// left of a plane at `t` grows by `step + width * (t - x) + slope / 2 * (t - x)^2`.
///
/// A flat piece in the plane is a `step`; a piece with parallel sides is a pair of opposite
/// `width`s; a triangle is three `slope`s. Sums of breakpoints with `x < t` give `S_L(t)`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AreaRamp {
    /// Position along the axis, relative to the cell's lower face.
    pub x: f64,
    /// Change of the area itself.
    pub step: f64,
    /// Change of the width `dS/dt`.
    pub width: f64,
    /// Change of the slope of the width.
    pub slope: f64,
}

impl AreaRamp {
    /// What this breakpoint adds to the area left of a plane at `t`, planes at `x` included.
    #[inline]
    pub fn area_until(&self, t: f64) -> f64 {
        let d = t - self.x;
        if d < 0.0 { 0.0 } else { self.step + d * (self.width + 0.5 * self.slope * d) }
    }
}

/// A stored primitive. Large or rare kinds are boxed so that a triangle stays small.
#[derive(Clone)]
#[non_exhaustive]
pub enum Shape {
    /// A triangle.
    Triangle(Triangle),
    /// A sphere.
    Sphere(Sphere),
    /// A frustum of a cone or cylinder.
    Cone(Cone),
    /// A planar polygon.
    Polygon(Box<Polygon>),
    /// A polygon with normals.
    Patch(Box<Patch>),
    /// Any other primitive.
    Custom(Arc<dyn Primitive>),
}

const _: () = assert!(size_of::<Shape>() <= 48);

impl Shape {
    /// A planar polygon; one of three vertices is stored as a triangle.
    ///
    /// # Errors
    /// See [`Polygon::new`].
    pub fn polygon(vertices: Vec<[f32; 3]>) -> Result<Shape, ShapeError> {
        match <[[f32; 3]; 3]>::try_from(vertices) {
            Ok(corners) => Triangle::new(corners).map(Shape::Triangle),
            Err(vertices) => Polygon::new(vertices).map(Shape::from),
        }
    }

    /// A custom primitive.
    pub fn custom(primitive: impl Primitive + 'static) -> Shape {
        Shape::Custom(Arc::new(primitive))
    }

    /// Checks the values that the public fields of a shape can hold: all finite, no negative
    /// radius.
    ///
    /// # Errors
    /// [`ShapeError`] as the shape's constructor returns it.
    pub fn check(&self) -> Result<(), ShapeError> {
        match self {
            Shape::Triangle(p) => Triangle::new(p.vertices).map(drop),
            Shape::Sphere(p) => Sphere::new(p.center, p.radius).map(drop),
            Shape::Cone(p) => Cone::new(p.base, p.base_radius, p.apex, p.apex_radius).map(drop),
            Shape::Polygon(_) | Shape::Patch(_) | Shape::Custom(_) => Ok(()),
        }
    }
}

impl From<Triangle> for Shape {
    fn from(p: Triangle) -> Self {
        Shape::Triangle(p)
    }
}

impl From<Sphere> for Shape {
    fn from(p: Sphere) -> Self {
        Shape::Sphere(p)
    }
}

impl From<Cone> for Shape {
    fn from(p: Cone) -> Self {
        Shape::Cone(p)
    }
}

impl From<Polygon> for Shape {
    fn from(p: Polygon) -> Self {
        Shape::Polygon(Box::new(p))
    }
}

impl From<Patch> for Shape {
    fn from(p: Patch) -> Self {
        Shape::Patch(Box::new(p))
    }
}

macro_rules! each_shape {
    ($self:expr, $p:ident => $body:expr) => {
        match $self {
            Shape::Triangle($p) => $body,
            Shape::Sphere($p) => $body,
            Shape::Cone($p) => $body,
            Shape::Polygon($p) => $body,
            Shape::Patch($p) => $body,
            Shape::Custom($p) => $body,
        }
    };
}

impl Primitive for Shape {
    fn bounds(&self) -> Aabb {
        each_shape!(self, p => p.bounds())
    }
    fn clipped_bounds(&self, cell: &Aabb) -> Option<Aabb> {
        each_shape!(self, p => p.clipped_bounds(cell))
    }
    fn area(&self) -> f64 {
        each_shape!(self, p => p.area())
    }
    fn area_ramps(&self, cell: &Aabb, axis: usize, out: &mut Vec<AreaRamp>) {
        each_shape!(self, p => p.area_ramps(cell, axis, out))
    }
    fn area_in(&self, cell: &Aabb) -> f64 {
        each_shape!(self, p => p.area_in(cell))
    }
    #[inline]
    fn intersect(&self, ray: &PreparedRay, sides: Sides) -> Option<Crossing> {
        each_shape!(self, p => p.intersect(ray, sides))
    }
    fn normals(&self, point: [f64; 3], crossing: Crossing) -> SurfaceNormals {
        each_shape!(self, p => p.normals(point, crossing))
    }
    fn is_degenerate(&self) -> bool {
        each_shape!(self, p => p.is_degenerate())
    }
}
