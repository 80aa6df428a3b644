//! Generators of the Standard Procedural Databases (Eric Haines, "A Proposal for Standard
//! Graphics Environments", IEEE Computer Graphics and Applications, November 1987; version 3.13).
//!
//! Each database is a family of scenes with a size factor. [`generate`] hands one to a
//! [`SceneSink`] object by object, in the published order, in memory that does not grow with the
//! number of objects: a row of a height field at most. Coordinates are computed in `f64` in the
//! order of operations of the published programs, so that a scene printed with six significant
//! digits is the published file, the rounded-off zeros included.

mod balls;
mod emitter;
mod gears;
mod jacks;
mod lattice;
mod mount;
mod rings;
mod sample;
mod shells;
mod sombrero;
mod teapot;
mod teapot_patches;
mod tetra;
mod transform;
mod tree;

use crate::{FacetPolicy, SceneSink};
use emitter::Emitter;
use std::fmt;
use std::ops::RangeInclusive;

/// A database.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Spd {
    /// The sphereflake: shiny spheres on spheres, above a floor.
    Balls,
    /// A cube of meshing gears with concave faces, some of glass.
    Gears,
    /// A fractal mountain and four glass spheres.
    Mount,
    /// A pyramid of clusters of rings, before a wall.
    Rings,
    /// The teapot on a chequered board.
    Teapot,
    /// A tetrahedral pyramid.
    Tetra,
    /// A binary tree of cones and spheres on a field.
    Tree,
    /// Spheres and cylinders on a cubic grid.
    Lattice,
    /// Crossed cylinders with spheres at their ends, copied into each octant.
    Jacks,
    /// A sea shell of overlapping spheres.
    Shells,
    /// A height field.
    Sombrero,
    /// A few tori, a cone and a disc, in one size.
    Sample,
}

/// Why a scene was not made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SpdError<E> {
    /// The size factor is not one of [`Spd::sizes`]; nothing was handed to the sink.
    #[error(
        "size {size} of the database {spd} is out of range: expected {} to {}",
        spd.sizes().start(),
        spd.sizes().end()
    )]
    SizeOutOfRange {
        /// The database.
        spd: Spd,
        /// The size factor asked for.
        size: u32,
    },
    /// The sink failed.
    #[error(transparent)]
    Sink(E),
}

impl Spd {
    /// All databases: the eight standard ones first.
    pub const ALL: [Spd; 12] = [
        Spd::Balls,
        Spd::Gears,
        Spd::Mount,
        Spd::Rings,
        Spd::Teapot,
        Spd::Tetra,
        Spd::Tree,
        Spd::Lattice,
        Spd::Jacks,
        Spd::Shells,
        Spd::Sombrero,
        Spd::Sample,
    ];

    /// The name in files and on command lines: one lower-case word.
    pub const fn name(self) -> &'static str {
        match self {
            Spd::Balls => "balls",
            Spd::Gears => "gears",
            Spd::Mount => "mount",
            Spd::Rings => "rings",
            Spd::Teapot => "teapot",
            Spd::Tetra => "tetra",
            Spd::Tree => "tree",
            Spd::Lattice => "lattice",
            Spd::Jacks => "jacks",
            Spd::Shells => "shells",
            Spd::Sombrero => "sombrero",
            Spd::Sample => "sample",
        }
    }

    /// The database with this [`name`](Spd::name).
    pub fn from_name(name: &str) -> Option<Spd> {
        Spd::ALL.into_iter().find(|spd| spd.name() == name)
    }

    /// What the scene shows, in one line.
    pub const fn description(self) -> &'static str {
        match self {
            Spd::Balls => "sphereflake of mirroring spheres above a floor",
            Spd::Gears => "cube of meshing gears with concave faces, some of glass",
            Spd::Mount => "fractal mountain of triangles behind four glass spheres",
            Spd::Rings => "pyramid of clusters of cylinders and spheres before a wall",
            Spd::Teapot => "teapot of smooth triangles on a chequered board",
            Spd::Tetra => "tetrahedral pyramid of triangles",
            Spd::Tree => "binary tree of cones and spheres on a field",
            Spd::Lattice => "cubic grid of mirroring spheres joined by cylinders",
            Spd::Jacks => "crossed cylinders with spheres at their ends, copied into octants",
            Spd::Shells => "sea shell of overlapping spheres, many of them tiny",
            Spd::Sombrero => "height field of a damped cosine",
            Spd::Sample => "tessellated tori, a cone and a disc",
        }
    }

    /// The size factor at which the database is published and measured; for the ones that no
    /// figures are published of, the default of their program.
    pub const fn standard_size(self) -> u32 {
        match self {
            Spd::Balls | Spd::Gears => 4,
            Spd::Mount | Spd::Tetra => 6,
            Spd::Rings => 7,
            Spd::Teapot | Spd::Lattice => 12,
            Spd::Tree => 11,
            Spd::Shells => 5,
            Spd::Jacks | Spd::Sombrero | Spd::Sample => 1,
        }
    }

    /// The largest size factor: the last one whose objects can be numbered with a `u32`.
    pub const fn max_size(self) -> u32 {
        match self {
            Spd::Balls | Spd::Jacks => 10,
            Spd::Gears => 308,
            Spd::Mount | Spd::Tetra => 15,
            Spd::Rings => 598,
            Spd::Teapot => 8128,
            Spd::Tree => 30,
            Spd::Lattice => 1023,
            Spd::Shells => 24,
            Spd::Sombrero => 11,
            Spd::Sample => 1,
        }
    }

    /// The valid size factors.
    pub const fn sizes(self) -> RangeInclusive<u32> {
        1..=self.max_size()
    }

    /// How many objects [`generate`] makes, in closed form: at most `u32::MAX`, and 0 for a size
    /// that is not one of [`sizes`](Spd::sizes).
    pub fn object_count(self, size: u32) -> u64 {
        if !self.sizes().contains(&size) {
            return 0;
        }
        match self {
            Spd::Balls => balls::object_count(size),
            Spd::Gears => gears::object_count(size),
            Spd::Mount => mount::object_count(size),
            Spd::Rings => rings::object_count(size),
            Spd::Teapot => teapot::object_count(size),
            Spd::Tetra => tetra::object_count(size),
            Spd::Tree => tree::object_count(size),
            Spd::Lattice => lattice::object_count(size),
            Spd::Jacks => jacks::object_count(size),
            Spd::Shells => shells::object_count(size),
            Spd::Sombrero => sombrero::object_count(size),
            Spd::Sample => sample::object_count(),
        }
    }

    /// True if opaque primitives show their front only, as the database's rules say; false for
    /// the teapot, whose patches are seen from both sides.
    pub const fn one_sided_opaque(self) -> bool {
        !matches!(self, Spd::Teapot)
    }

    /// [`one_sided_opaque`](Spd::one_sided_opaque) as a policy for [`Scene`](crate::Scene).
    pub const fn facet_policy(self) -> FacetPolicy {
        if self.one_sided_opaque() { FacetPolicy::OneSided } else { FacetPolicy::TwoSided }
    }
}

impl fmt::Display for Spd {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Hands the scene `spd` at `size` to `sink`: background, view, lights, then materials and
/// objects in the published order. Lights have no colour, comments are not made.
///
/// # Errors
/// [`SpdError::SizeOutOfRange`] before anything is handed over; [`SpdError::Sink`] as soon as the
/// sink fails.
pub fn generate<S: SceneSink>(spd: Spd, size: u32, sink: &mut S) -> Result<(), SpdError<S::Error>> {
    if !spd.sizes().contains(&size) {
        return Err(SpdError::SizeOutOfRange { spd, size });
    }
    let out = &mut Emitter::new(sink);
    match spd {
        Spd::Balls => balls::generate(size, out),
        Spd::Gears => gears::generate(size, out),
        Spd::Mount => mount::generate(size, out),
        Spd::Rings => rings::generate(size, out),
        Spd::Teapot => teapot::generate(size, out),
        Spd::Tetra => tetra::generate(size, out),
        Spd::Tree => tree::generate(size, out),
        Spd::Lattice => lattice::generate(size, out),
        Spd::Jacks => jacks::generate(size, out),
        Spd::Shells => shells::generate(size, out),
        Spd::Sombrero => sombrero::generate(size, out),
        Spd::Sample => sample::generate(out),
    }
    .map_err(SpdError::Sink)
}
