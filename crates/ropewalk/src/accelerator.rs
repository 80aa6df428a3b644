//! A geometry, its tree and a walk, ready to answer rays.

use crate::geometry::Geometry;
use crate::ray::{Hit, Ray};
use crate::rope::{RopeError, RopeTrees, Ropes};
use crate::traverse::{
    ClosestHit, Counters, LeafId, Occluded, Query, RayCaster, brute_force, locate, rope_trees,
    ropes, sung_shirley, ta_b,
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
    /// From leaf to leaf along single links.
    Ropes,
    /// From leaf to leaf along rope trees.
    RopeTrees,
}

impl Walk {
    /// All walks.
    pub const ALL: [Walk; 5] =
        [Walk::BruteForce, Walk::SungShirley, Walk::TaB, Walk::Ropes, Walk::RopeTrees];

    /// The name used on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Walk::BruteForce => "brute-force",
            Walk::SungShirley => "sung-shirley",
            Walk::TaB => "ta-b",
            Walk::Ropes => "ropes",
            Walk::RopeTrees => "rope-trees",
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
    /// The tree cannot be threaded.
    #[error(transparent)]
    Rope(#[from] RopeError),
}

/// A walk with the links that it needs.
#[derive(Clone)]
enum Way {
    BruteForce,
    SungShirley,
    TaB,
    Ropes(Arc<Ropes>),
    RopeTrees(Arc<RopeTrees>),
}

/// A geometry with a tree and a way to walk it. Cheap to clone; all parts are shared.
#[derive(Clone)]
pub struct Accelerator {
    geometry: Arc<Geometry>,
    tree: Arc<BspTree>,
    way: Way,
}

impl Accelerator {
    /// Joins a geometry with a tree that was built over it, and threads the tree if the walk needs
    /// links.
    ///
    /// # Errors
    /// [`AcceleratorError::ForeignTree`] if the tree refers to a primitive that does not exist;
    /// [`AcceleratorError::Rope`] if the tree is too large for links.
    pub fn new(
        geometry: Arc<Geometry>,
        tree: Arc<BspTree>,
        walk: Walk,
    ) -> Result<Self, AcceleratorError> {
        let last = tree.leaf_refs(0, tree.reference_count() as u32).iter().max();
        if let Some(&prim_id) = last.filter(|&&id| id as usize >= geometry.len()) {
            return Err(AcceleratorError::ForeignTree { prim_id, len: geometry.len() });
        }
        Accelerator { geometry, tree, way: Way::BruteForce }.with_walk(walk)
    }

    /// The same geometry and tree with another walk; links are built anew if it needs them.
    ///
    /// # Errors
    /// [`AcceleratorError::Rope`] if the tree is too large for links.
    pub fn with_walk(&self, walk: Walk) -> Result<Self, AcceleratorError> {
        let way = match walk {
            Walk::BruteForce => Way::BruteForce,
            Walk::SungShirley => Way::SungShirley,
            Walk::TaB => Way::TaB,
            Walk::Ropes => Way::Ropes(Arc::new(Ropes::build(&self.tree)?)),
            Walk::RopeTrees => Way::RopeTrees(Arc::new(RopeTrees::build(&self.tree)?)),
        };
        Ok(Accelerator { way, ..self.clone() })
    }

    /// The same geometry and tree with rope trees of at most `max_bytes` (see
    /// [`RopeTrees::build_within`]).
    ///
    /// # Errors
    /// [`AcceleratorError::Rope`] if the tree is too large for links.
    pub fn with_rope_trees_within(&self, max_bytes: usize) -> Result<Self, AcceleratorError> {
        let way = Way::RopeTrees(Arc::new(RopeTrees::build_within(&self.tree, max_bytes)?));
        Ok(Accelerator { way, ..self.clone() })
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
        match self.way {
            Way::BruteForce => Walk::BruteForce,
            Way::SungShirley => Walk::SungShirley,
            Way::TaB => Walk::TaB,
            Way::Ropes(_) => Walk::Ropes,
            Way::RopeTrees(_) => Walk::RopeTrees,
        }
    }

    /// The single links, if the walk uses them.
    pub fn ropes(&self) -> Option<&Ropes> {
        match &self.way {
            Way::Ropes(ropes) => Some(ropes),
            _ => None,
        }
    }

    /// The rope trees, if the walk uses them.
    pub fn rope_trees(&self) -> Option<&RopeTrees> {
        match &self.way {
            Way::RopeTrees(rope_trees) => Some(rope_trees),
            _ => None,
        }
    }

    /// Bytes of what the walk reads beside the primitives: the tree's nodes and references (none
    /// for brute force) and the links.
    pub fn bytes(&self) -> usize {
        let references = self.tree.reference_count() * size_of::<u32>();
        let tree = size_of_val(self.tree.nodes()) + references;
        match &self.way {
            Way::BruteForce => 0,
            Way::SungShirley | Way::TaB => tree,
            Way::Ropes(ropes) => tree + ropes.bytes(),
            Way::RopeTrees(rope_trees) => tree + rope_trees.bytes(),
        }
    }

    /// The leaf whose cell holds `point`; `None` outside the tree's box.
    pub fn locate(&self, point: [f32; 3]) -> Option<LeafId> {
        locate(&self.tree, point)
    }

    /// The first hit, for a ray whose range begins in the leaf `start`; and the leaf in which the
    /// walk ended, which holds the hit and is the right start for rays that leave from it.
    ///
    /// A wrong, stale or missing `start` costs a descent and never changes the answer. The leaf is
    /// `None` for walks from the root, where nothing is hit, and where a rope walk was finished
    /// from the root; [`Accelerator::locate`] finds it then.
    pub fn closest_hit_from<C: Counters>(
        &self,
        ray: &Ray,
        start: Option<LeafId>,
        counters: &mut C,
    ) -> (Option<Hit>, Option<LeafId>) {
        let (hit, leaf) = self.answer::<ClosestHit, C>(ray, start, counters);
        (hit, leaf.filter(|_| hit.is_some()))
    }

    /// True if anything is hit, for a ray whose range begins in the leaf `start` (see
    /// [`Accelerator::closest_hit_from`]).
    pub fn occluded_from<C: Counters>(
        &self,
        ray: &Ray,
        start: Option<LeafId>,
        counters: &mut C,
    ) -> bool {
        self.answer::<Occluded, C>(ray, start, counters).0
    }

    fn answer<Q: Query, C: Counters>(
        &self,
        ray: &Ray,
        start: Option<LeafId>,
        counters: &mut C,
    ) -> (Q::Answer, Option<LeafId>) {
        let (geometry, tree) = (&*self.geometry, &*self.tree);
        match &self.way {
            Way::BruteForce => (brute_force::<Q, C>(geometry, ray, counters), None),
            Way::SungShirley => (sung_shirley::<Q, C>(geometry, tree, ray, counters), None),
            Way::TaB => (ta_b::<Q, C>(geometry, tree, ray, counters), None),
            Way::Ropes(links) => ropes::<Q, C>(geometry, tree, links, ray, start, counters),
            Way::RopeTrees(links) => {
                rope_trees::<Q, C>(geometry, tree, links, ray, start, counters)
            }
        }
    }
}

impl RayCaster for Accelerator {
    fn closest_hit<C: Counters>(&self, ray: &Ray, counters: &mut C) -> Option<Hit> {
        self.answer::<ClosestHit, C>(ray, None, counters).0
    }

    fn occluded<C: Counters>(&self, ray: &Ray, counters: &mut C) -> bool {
        self.answer::<Occluded, C>(ray, None, counters).0
    }

    fn closest_hit_from<C: Counters>(
        &self,
        ray: &Ray,
        start: Option<LeafId>,
        counters: &mut C,
    ) -> (Option<Hit>, Option<LeafId>) {
        Accelerator::closest_hit_from(self, ray, start, counters)
    }

    fn occluded_from<C: Counters>(
        &self,
        ray: &Ray,
        start: Option<LeafId>,
        counters: &mut C,
    ) -> bool {
        Accelerator::occluded_from(self, ray, start, counters)
    }
}
