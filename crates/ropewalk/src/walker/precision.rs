//! What particles move among: triangles in `f32` or in `f64`, and the numbers of the particles themselves.

use super::lists::{Lists, Part, walk};
use crate::double::{DoubleGeometry, DoubleRay, Narrowed};
use crate::geometry::Geometry;
use crate::kernel::BatchCaster;
use crate::point::Triangles;
use crate::ray::Ray;
use std::fmt::Debug;

/// A number of a particle: `f32` or `f64`.
pub trait Float:
    Copy + Debug + Default + PartialOrd + From<f32> + Into<f64> + Send + Sync + 'static
{
    /// A number rounded to this precision.
    fn rounded(x: f64) -> Self;
}

impl Float for f32 {
    #[inline(always)]
    fn rounded(x: f64) -> f32 {
        x as f32
    }
}

impl Float for f64 {
    #[inline(always)]
    fn rounded(x: f64) -> f64 {
        x
    }
}

/// Triangles among which a [`Walker`](super::Walker) moves particles: a [`Geometry`], or a [`DoubleGeometry`].
///
/// Crossings are decided in the *scaled* numbers of [`Triangles`].
pub trait WalkerGeometry: Triangles {
    /// Numbers of positions, directions and lengths.
    type Float: Float;

    /// The largest scaled coordinate of a particle.
    const LARGEST: f64;

    /// The geometry that the kernels are handed; they read triangles from the tree.
    fn of_kernels(&self) -> &Geometry;

    /// The ray with which the tree is searched for what the segment between two points may cross, in the
    /// numbers of the tree.
    fn search_ray(&self, from: [Self::Float; 3], to: [Self::Float; 3]) -> Ray;

    /// Moves the particles of a task. Each geometry has its own, so that its kernels are compiled in this crate
    /// alone.
    #[doc(hidden)]
    fn walk(caster: &BatchCaster<'_>, lists: Lists<'_, Self>) -> Part<Self::Float>
    where
        Self: Sized;
}

/// The ray of a segment begins earlier and ends later by this share of it. The filters bound their
/// errors for a ray of exact direction; this one's is rounded, which moves parameters by less.
const BEYOND: f32 = 1.0 / (1u32 << 16) as f32;

impl WalkerGeometry for Geometry {
    type Float = f32;
    const LARGEST: f64 = super::LARGEST as f64;

    fn of_kernels(&self) -> &Geometry {
        self
    }

    #[inline(always)]
    fn search_ray(&self, from: [f32; 3], to: [f32; 3]) -> Ray {
        let dir = [to[0] - from[0], to[1] - from[1], to[2] - from[2]];
        Ray::new(from, dir).with_range(-BEYOND, 1.0 + BEYOND)
    }

    fn walk(caster: &BatchCaster<'_>, lists: Lists<'_, Self>) -> Part<Self::Float> {
        walk(caster, lists)
    }
}

/// A ray that hits nothing.
const NOWHERE: Ray = Ray::new([0.0; 3], [0.0; 3]);

/// A ray beyond the filters: its segment takes all triangles in cells that its box touches.
const EXTREME: Ray = Ray::new([super::LARGEST; 3], [1.0, 0.0, 0.0]);

impl WalkerGeometry for DoubleGeometry {
    type Float = f64;
    const LARGEST: f64 = crate::point::LARGEST;

    fn of_kernels(&self) -> &Geometry {
        self.none()
    }

    #[inline(always)]
    fn search_ray(&self, from: [f64; 3], to: [f64; 3]) -> Ray {
        let dir = [to[0] - from[0], to[1] - from[1], to[2] - from[2]];
        match self.narrow(&DoubleRay::new(from, dir).with_range(0.0, 1.0)) {
            Narrowed::Ray(ray, _) => ray,
            Narrowed::Misses => NOWHERE,
            Narrowed::Beyond => EXTREME,
        }
    }

    fn walk(caster: &BatchCaster<'_>, lists: Lists<'_, Self>) -> Part<Self::Float> {
        walk(caster, lists)
    }
}
