//! A geometry, its tree and a walk, ready to answer rays.

use crate::geometry::Geometry;
use crate::ray::{Hit, Ray};
use crate::traverse::{
    ClosestHit, Counters, LeafId, Occluded, Query, RayCaster, brute_force, locate, sung_shirley,
    ta_b,
};
use crate::tree::BspTree;
use std::sync::Arc;

/// How rays walk.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Walk {
    /// Every primitive, no tree.
    BruteForce,
    /// From the root by distances (Sung and Shirley 1992).
    SungShirley,
    /// From the root by entry and exit points (Havran 1997).
    #[default]
    TaB,
}

impl Walk {
    /// All walks.
    pub const ALL: [Walk; 3] = [Walk::BruteForce, Walk::SungShirley, Walk::TaB];

    /// The name used on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Walk::BruteForce => "brute-force",
            Walk::SungShirley => "sung-shirley",
            Walk::TaB => "ta-b",
        }
    }
}

/// Why an accelerator cannot be made.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum AcceleratorError {
    /// The tree belongs to another geometry.
    #[error("the tree refers to primitive {prim_id}; the geometry has {len} primitives")]
    ForeignTree {
        /// The largest primitive that the tree refers to.
        prim_id: u32,
        /// Number of primitives.
        len: usize,
    },
}

/// A geometry with a tree and a way to walk it. Cheap to clone; all parts are shared.
#[derive(Clone)]
pub struct Accelerator {
    geometry: Arc<Geometry>,
    tree: Arc<BspTree>,
    walk: Walk,
}

impl Accelerator {
    /// Joins a geometry with a tree that was built over it.
    ///
    /// # Errors
    /// [`AcceleratorError::ForeignTree`] if the tree refers to a primitive that does not exist.
    pub fn new(
        geometry: Arc<Geometry>,
        tree: Arc<BspTree>,
        walk: Walk,
    ) -> Result<Self, AcceleratorError> {
        let last = tree.leaf_refs(0, tree.reference_count() as u32).iter().max();
        if let Some(&prim_id) = last.filter(|&&id| id as usize >= geometry.len()) {
            return Err(AcceleratorError::ForeignTree { prim_id, len: geometry.len() });
        }
        Ok(Accelerator { geometry, tree, walk })
    }

    /// The same geometry and tree with another walk.
    ///
    /// # Errors
    /// As [`Accelerator::new`].
    pub fn with_walk(&self, walk: Walk) -> Result<Self, AcceleratorError> {
        Ok(Accelerator { walk, ..self.clone() })
    }

    /// The geometry.
    pub fn geometry(&self) -> &Arc<Geometry> {
        &self.geometry
    }

    /// The tree.
    pub fn tree(&self) -> &Arc<BspTree> {
        &self.tree
    }

    /// The walk.
    pub fn walk(&self) -> Walk {
        self.walk
    }

    /// The leaf whose cell holds `point`; `None` outside the tree's box.
    pub fn locate(&self, point: [f32; 3]) -> Option<LeafId> {
        locate(&self.tree, point)
    }

    fn answer<Q: Query, C: Counters>(&self, ray: &Ray, counters: &mut C) -> Q::Answer {
        match self.walk {
            Walk::BruteForce => brute_force::<Q, C>(&self.geometry, ray, counters),
            Walk::SungShirley => sung_shirley::<Q, C>(&self.geometry, &self.tree, ray, counters),
            Walk::TaB => ta_b::<Q, C>(&self.geometry, &self.tree, ray, counters),
        }
    }
}

impl RayCaster for Accelerator {
    fn closest_hit<C: Counters>(&self, ray: &Ray, counters: &mut C) -> Option<Hit> {
        self.answer::<ClosestHit, C>(ray, counters)
    }

    fn occluded<C: Counters>(&self, ray: &Ray, counters: &mut C) -> bool {
        self.answer::<Occluded, C>(ray, counters)
    }
}
