//! A cutting plane and what it does to the fragments of a node.

use super::fragment::Fragment;
use crate::aabb::Aabb;
use crate::cost::{CostModel, Cut, LeafCost};

/// Where a fragment goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    Left,
    Right,
    Both,
}

/// A cutting plane, chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Plane {
    pub axis: usize,
    pub position: f32,
    /// Fragments that lie in the plane go to the lower child, else to the upper one.
    pub planar_left: bool,
    /// Expected cost of the node with this cut, traversal step included.
    pub cost: f64,
    /// Fragments of the lower child before clipping.
    pub left: usize,
    /// Fragments of the upper child before clipping.
    pub right: usize,
}

impl Plane {
    /// Which side a fragment belongs to. A fragment that only touches the plane stays on its side.
    #[inline]
    pub fn side_of(&self, fragment: &Fragment) -> Side {
        let (lo, hi) = (fragment.min(self.axis), fragment.max(self.axis));
        if lo == hi && lo == self.position {
            if self.planar_left { Side::Left } else { Side::Right }
        } else if hi <= self.position {
            Side::Left
        } else if lo >= self.position {
            Side::Right
        } else {
            Side::Both
        }
    }
}

/// How many of a node's fragments lie below, in and above a plane; those on both sides count twice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Counts {
    pub left: usize,
    pub planar: usize,
    pub right: usize,
}

impl Counts {
    /// Counts directly, in O(N).
    pub fn of(fragments: &[Fragment], axis: usize, position: f32) -> Self {
        let mut counts = Counts::default();
        for f in fragments {
            let (lo, hi) = (f.min(axis), f.max(axis));
            counts.left += usize::from(lo < position);
            counts.planar += usize::from(lo == position && hi == position);
            counts.right += usize::from(hi > position);
        }
        counts
    }

    /// The counts of the two children with the planar fragments on one side.
    pub fn children(&self, planar_left: bool) -> (usize, usize) {
        if planar_left {
            (self.left + self.planar, self.right)
        } else {
            (self.left, self.right + self.planar)
        }
    }
}

/// The surface areas of a cell and of its two parts as functions of a plane on one axis.
///
/// A cell that is flat on two axes has no area; there the lengths stand for the areas, which is the
/// limit of a box that is thin in both directions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CellAreas {
    lo: f32,
    hi: f32,
    /// Both faces across the axis.
    caps: f64,
    /// Growth of the area per unit along the axis.
    rim: f64,
    /// Of the whole cell.
    pub area: f64,
}

impl CellAreas {
    /// `None` where the cell has no extent on the axis: nothing can be cut there.
    pub fn new(cell: &Aabb, axis: usize) -> Option<Self> {
        let (lo, hi) = (cell.min[axis], cell.max[axis]);
        if lo >= hi {
            return None;
        }
        let (a, b) = (cell.extent((axis + 1) % 3), cell.extent((axis + 2) % 3));
        let (caps, mut rim) = (2.0 * a * b, 2.0 * (a + b));
        if rim == 0.0 {
            rim = 1.0;
        }
        Some(CellAreas { lo, hi, caps, rim, area: caps + rim * cell.extent(axis) })
    }

    /// The cell's extent along the axis.
    pub fn range(&self) -> (f32, f32) {
        (self.lo, self.hi)
    }

    /// Distance of a plane from the lower face.
    #[inline]
    pub fn local(&self, position: f32) -> f64 {
        f64::from(position) - f64::from(self.lo)
    }

    /// Areas of the parts below and above a plane.
    #[inline]
    pub fn parts(&self, position: f32) -> (f64, f64) {
        let above = f64::from(self.hi) - f64::from(position);
        (self.caps + self.rim * self.local(position), self.caps + self.rim * above)
    }

    /// `a_c`, the one-sided area of the cut.
    #[inline]
    pub fn cut(&self) -> f64 {
        0.5 * self.caps
    }

    /// True if a cut that leaves `left` and `right` of `total` fragments gains anything.
    ///
    /// Inside the cell it does unless all fragments are on both sides. At a face the part beyond
    /// is flat, which pays only if it takes fragments that lie in the face.
    #[inline]
    pub fn makes_progress(&self, position: f32, left: usize, right: usize, total: usize) -> bool {
        if position <= self.lo {
            return position == self.lo && left > 0;
        }
        if position >= self.hi {
            return position == self.hi && right > 0;
        }
        left < total || right < total
    }
}

/// The constants of the cost of a plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pricing {
    pub leaf_cost: LeafCost,
    pub traversal_cost: f64,
    pub empty_factor: f64,
    /// Price of one more unit of leaf cost anywhere in the tree, times the area of the root.
    pub size_unit: f64,
    /// Largest price of one more unit of leaf cost to a ray that hits the node.
    pub max_size_price: f64,
}

impl Pricing {
    /// The same in a node that rays meet so much more often than its surface area says: what it grows by is paid
    /// for by more rays.
    #[inline]
    pub fn where_crowded(&self, crowding: f64) -> Self {
        Pricing { size_unit: self.size_unit / crowding, ..*self }
    }

    /// Price of one more unit of leaf cost in the children than in the node, to a ray that hits it.
    #[inline]
    pub fn size_price(&self, areas: &CellAreas) -> f64 {
        (self.size_unit / areas.area).min(self.max_size_price)
    }

    /// `traversal_cost + measure`, the measure times `empty_factor` if a side is empty, and the
    /// price of what the children hold beyond the `total` of the node.
    #[inline]
    pub fn price<M: CostModel>(
        &self,
        model: &M,
        areas: &CellAreas,
        position: f32,
        total: usize,
        children: (usize, usize),
        ends: (f64, f64),
    ) -> f64 {
        self.price_parts(model, areas, areas.parts(position), total, children, ends)
    }

    /// The same with the areas of the children given.
    #[inline]
    pub fn price_parts<M: CostModel>(
        &self,
        model: &M,
        areas: &CellAreas,
        (area_left, area_right): (f64, f64),
        total: usize,
        (left, right): (usize, usize),
        (ends_left, ends_right): (f64, f64),
    ) -> f64 {
        let (cost_left, cost_right) = (self.leaf_cost.cost(left), self.leaf_cost.cost(right));
        let measure = model.cost(&Cut {
            area: areas.area,
            area_left,
            area_right,
            cost_left,
            cost_right,
            ends_left,
            ends_right,
        });
        let bonus = if left == 0 || right == 0 { self.empty_factor } else { 1.0 };
        let growth = cost_left + cost_right - self.leaf_cost.cost(total);
        self.traversal_cost + bonus * measure + self.size_price(areas) * growth
    }
}
