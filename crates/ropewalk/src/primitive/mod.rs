//! The primitives: one file each, all behind the [`Primitive`] trait.
//!
//! A builder sees a primitive as a box, as the tight box of its part inside a cell, and as an area
//! left of an axis plane; a traversal sees one ray test. Nothing else is asked of a primitive.

mod sphere;
mod triangle;

pub use sphere::Sphere;
pub use triangle::Triangle;

use crate::aabb::Aabb;
use crate::ray::PreparedRay;
use std::sync::Arc;

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

/// The normals at a point of a primitive, in `f64`, unit length, pointing to the front.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceNormals {
    /// Normal of the surface itself.
    pub geometric: [f64; 3],
    /// Interpolated normal for shading; equal to `geometric` except on smooth patches.
    pub shading: [f64; 3],
}

/// What a builder and a traversal need to know of a shape.
///
/// Contracts, all checked by the property tests of `ropewalk-testkit`:
/// * `bounds` and `clipped_bounds` are rounded outward: no point of the surface that
///   `intersect` can report lies outside.
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

/// A stored primitive. Large or rare kinds are boxed so that a triangle stays small.
#[derive(Clone)]
#[non_exhaustive]
pub enum Shape {
    /// A triangle.
    Triangle(Triangle),
    /// A sphere.
    Sphere(Sphere),
    /// Any other primitive.
    Custom(Arc<dyn Primitive>),
}

macro_rules! each_shape {
    ($self:expr, $p:ident => $body:expr) => {
        match $self {
            Shape::Triangle($p) => $body,
            Shape::Sphere($p) => $body,
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
