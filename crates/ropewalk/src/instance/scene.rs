//! Objects, their places, and the top-level tree.

use super::{Transform, TransformError};
use crate::build::{BuildError, BuildReport, BuildSettings, Monitor, Preset};
use crate::double::{DoubleGeometry, DoubleGeometryError, DoubleHit, DoubleRay, DoubleTree};
use crate::geometry::Geometry;
use crate::wide::WideTree;
use std::sync::Arc;

/// Triangles with their tree, to be placed.
pub struct Object {
    /// The triangles.
    pub geometry: DoubleGeometry,
    /// A tree over them.
    pub tree: DoubleTree,
}

impl Object {
    /// Builds a tree over `geometry`; see [`DoubleGeometry::build`].
    ///
    /// # Errors
    /// See [`build`](crate::build::build).
    pub fn build(
        geometry: DoubleGeometry,
        settings: &BuildSettings,
        monitor: &dyn Monitor,
    ) -> Result<(Object, BuildReport), BuildError> {
        let (tree, report) = geometry.build(settings, monitor)?;
        Ok((Object { geometry, tree }, report))
    }
}

/// An object in its place.
#[derive(Clone)]
pub struct Instance {
    /// What is placed.
    pub object: Arc<Object>,
    /// Where.
    pub transform: Transform,
}

/// Why there is no scene of these instances.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum InstanceError {
    /// A matrix was refused.
    #[error("instance {instance}: {error}")]
    Transform {
        /// Number of the instance.
        instance: usize,
        /// What is wrong with it.
        error: TransformError,
    },
    /// An instance reaches beyond [`DoubleGeometry::MAX_COORDINATE`].
    #[error("instance {instance} reaches beyond 1e100 in size")]
    TooLarge {
        /// Number of the instance.
        instance: usize,
    },
    /// More instances than can be numbered.
    #[error("{found} instances are too many: at most {max} are supported")]
    TooMany {
        /// Their number.
        found: usize,
        /// The limit.
        max: usize,
    },
    /// The top-level tree cannot be built.
    #[error("the tree over the instances: {0}")]
    Top(#[from] BuildError),
}

/// A crossing of a ray and a triangle of an instance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InstanceHit {
    /// Parameter in lengths of the ray's direction.
    pub t: f64,
    /// The instance.
    pub instance: u32,
    /// The triangle within its object.
    pub prim_id: u32,
}

impl InstanceHit {
    /// The order of hits along a ray: by `t`, then by instance, then by triangle.
    pub fn is_before(&self, other: &InstanceHit) -> bool {
        let ids = |hit: &InstanceHit| (hit.instance, hit.prim_id);
        self.t < other.t || (self.t == other.t && ids(self) < ids(other))
    }

    pub(super) fn order(&self, other: &InstanceHit) -> std::cmp::Ordering {
        let ids = |hit: &InstanceHit| (hit.instance, hit.prim_id);
        self.t.total_cmp(&other.t).then(ids(self).cmp(&ids(other)))
    }
}

/// Objects in their places, and a tree over their boxes.
pub struct InstancedScene {
    instances: Vec<Instance>,
    /// Twelve triangles around each instance.
    top: Option<Object>,
    report: BuildReport,
    /// Rays that start farther away than this visit all instances.
    far: f64,
}

/// Triangles around an instance.
pub(super) const FACES: u32 = 12;

/// The faces of a box with corner `i` at the upper side of axis `a` if bit `a` is set.
const BOX: [[u32; 3]; FACES as usize] = [
    [0, 4, 6],
    [0, 6, 2],
    [1, 3, 7],
    [1, 7, 5],
    [0, 1, 5],
    [0, 5, 4],
    [2, 6, 7],
    [2, 7, 3],
    [0, 2, 3],
    [0, 3, 1],
    [4, 5, 7],
    [4, 7, 6],
];

/// Boxes are widened by this share of the scene's largest coordinate, times the condition of the transform: rounding in
/// `f64` on the way to the object and back is off by `2^-49` of it at most, for a ray from [`FAR`].
const MARGIN: f64 = 1.0 / (1u64 << 40) as f64;

/// Distances in largest coordinates of the scene beyond which rays visit all instances.
const FAR: f64 = 16.0;

impl InstancedScene {
    /// Most instances.
    pub const MAX_INSTANCES: usize = 1 << 26;

    /// A scene of these instances, numbered in order; its top-level tree is built on `threads` threads, 0
    /// for one a core. Without instances every ray misses.
    ///
    /// # Errors
    /// [`InstanceError`] for instances that reach too far or are too many, or if the top-level tree cannot be
    /// built.
    pub fn new(instances: Vec<Instance>, threads: usize) -> Result<Self, InstanceError> {
        let (found, max) = (instances.len(), Self::MAX_INSTANCES);
        if found > max {
            return Err(InstanceError::TooMany { found, max });
        }
        let mut boxes = Vec::with_capacity(instances.len());
        let mut largest = 0.0f64;
        for (instance, placed) in instances.iter().enumerate() {
            // An object without triangles has a box too, since boxes and instances go by the same numbers.
            let (low, high) = placed.object.geometry.bounds().unwrap_or(([0.0; 3], [0.0; 3]));
            let mut corners = [[0.0; 3]; 8];
            for (i, corner) in corners.iter_mut().enumerate() {
                let side = |a: usize| if i >> a & 1 == 1 { high[a] } else { low[a] };
                *corner = placed.transform.point([side(0), side(1), side(2)]);
            }
            let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
            for corner in corners {
                for a in 0..3 {
                    (min[a], max[a]) = (min[a].min(corner[a]), max[a].max(corner[a]));
                }
            }
            let size = min.iter().chain(&max).fold(0.0f64, |s, x| s.max(x.abs()));
            if size.is_nan() || size > 0.5 * DoubleGeometry::MAX_COORDINATE {
                return Err(InstanceError::TooLarge { instance });
            }
            largest = largest.max(size);
            boxes.push((min, max));
        }
        let settings = BuildSettings { threads, ..BuildSettings::preset(Preset::Balanced) };
        if instances.is_empty() {
            let (_, report) = WideTree::build(&Geometry::new(), &settings, &())?;
            return Ok(InstancedScene { instances, top: None, report, far: 0.0 });
        }
        let (mut vertices, mut faces) = (Vec::new(), Vec::new());
        for (placed, (min, max)) in instances.iter().zip(boxes) {
            let first = vertices.len() as u32;
            let margin = MARGIN * placed.transform.condition() * largest.max(f64::MIN_POSITIVE);
            for i in 0..8 {
                vertices.push(std::array::from_fn(|a| {
                    if i >> a & 1 == 1 { max[a] + margin } else { min[a] - margin }
                }));
            }
            faces.extend(BOX.map(|face| face.map(|corner| first + corner)));
        }
        let geometry = DoubleGeometry::from_triangles(vertices, faces);
        let geometry = match geometry {
            Ok(geometry) => geometry,
            Err(DoubleGeometryError::Vertex { vertex, .. }) => {
                return Err(InstanceError::TooLarge { instance: vertex / 8 });
            }
            Err(_) => return Err(InstanceError::TooMany { found, max }),
        };
        let (top, report) = Object::build(geometry, &settings, &())?;
        let (top, far) = (Some(top), FAR * largest);
        Ok(InstancedScene { instances, top, report, far })
    }

    /// The instances.
    pub fn instances(&self) -> &[Instance] {
        &self.instances
    }

    /// Lower and upper corner of the box of everything, a little widened.
    pub fn bounds(&self) -> Option<([f64; 3], [f64; 3])> {
        self.top.as_ref().and_then(|top| top.geometry.bounds())
    }

    /// The build of the top-level tree, whose primitives are twelve triangles an instance.
    pub fn report(&self) -> &BuildReport {
        &self.report
    }

    /// Bytes of the top-level tree with its boxes and of the instances, objects left out.
    pub fn bytes(&self) -> usize {
        let top = self.top.as_ref().map_or(0, |top| top.tree.bytes() + top.geometry.bytes());
        top + size_of_val(&self.instances[..])
    }

    /// Tests one triangle of an instance.
    ///
    /// # Panics
    /// If there is no such instance or triangle.
    pub fn intersect(&self, instance: u32, prim_id: u32, ray: &DoubleRay) -> Option<DoubleHit> {
        let placed = &self.instances[instance as usize];
        placed.object.geometry.intersect(prim_id, &placed.transform.ray_to_object(ray))
    }

    pub(super) fn top(&self) -> Option<&Object> {
        self.top.as_ref()
    }

    /// True if the boxes may not hold what a ray hits, because of rounding.
    pub(super) fn is_far(&self, ray: &DoubleRay) -> bool {
        !ray.origin.iter().all(|x| x.abs() <= self.far)
    }
}
