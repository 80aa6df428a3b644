//! Sixteen candidate positions at a time: counting what lies beside them, and pricing them.
//!
//! All of it is written over arrays of sixteen lanes without branches, for the compiler to turn
//! into SIMD. Counts are `f32`, exact up to 2^24: integer sums would be reordered into sums over
//! fragments, which costs more than it gains.

use crate::build::fragment::Fragment;
use crate::build::plane::{CellAreas, Plane, Pricing};
use crate::build::rays::{NodeRays, is_above};
use crate::cost::{LeafCost, MacDonaldBooth};

/// Positions in a tally.
pub(super) const LANES: usize = 16;

/// A value for each position.
pub(super) type Lanes = [f32; LANES];

/// How many fragments reach below, lie in, and reach above each of some positions.
#[derive(Clone, Copy)]
pub(super) struct Tally {
    pub left: Lanes,
    pub planar: Lanes,
    pub right: Lanes,
}

impl Tally {
    pub const ZERO: Tally = Tally { left: [0.0; LANES], planar: [0.0; LANES], right: [0.0; LANES] };

    pub fn add(&mut self, other: Tally) {
        for c in 0..LANES {
            self.left[c] += other.left[c];
            self.planar[c] += other.planar[c];
            self.right[c] += other.right[c];
        }
    }

    /// Counts directly, on one axis; `any_planar` may be false if no fragment is flat there.
    #[inline]
    pub fn of(fragments: &[Fragment], axis: usize, positions: &Lanes, any_planar: bool) -> Self {
        let mut tally = Tally::ZERO;
        for f in fragments {
            let (lo, hi) = (f.min(axis), f.max(axis));
            for c in 0..LANES {
                tally.left[c] += if lo < positions[c] { 1.0 } else { 0.0 };
                tally.right[c] += if hi > positions[c] { 1.0 } else { 0.0 };
            }
        }
        if !any_planar {
            return tally;
        }
        for f in fragments.iter().filter(|f| f.min(axis) == f.max(axis)) {
            let x = f.min(axis);
            for c in 0..LANES {
                tally.planar[c] += if x == positions[c] { 1.0 } else { 0.0 };
            }
        }
        tally
    }
}

/// The probabilities that a ray which meets a cell meets its parts below and above some positions.
#[derive(Clone, Copy)]
pub(super) struct Shares {
    below: Lanes,
    above: Lanes,
}

impl Shares {
    /// Mixed with the shares of a node's rays, which are counted here.
    #[inline]
    pub fn with_rays(self, rays: &NodeRays<'_>, axis: usize, positions: &Lanes) -> Self {
        let (mut left, mut right) = ([0.0; LANES], [0.0; LANES]);
        for part in rays.parts {
            let (lo, hi) = (part.min(axis), part.max(axis));
            for c in 0..LANES {
                left[c] += if lo < positions[c] { 1.0 } else { 0.0 };
                right[c] += if is_above(lo, hi, positions[c]) { 1.0 } else { 0.0 };
            }
        }
        self.mixed(rays, &left, &right)
    }

    /// Mixed with the shares of a node's rays of which so many are below and above.
    #[inline]
    pub fn mixed(self, rays: &NodeRays<'_>, left: &Lanes, right: &Lanes) -> Self {
        let (of_area, of_ray) = rays.weights();
        let (of_area, of_ray) = (of_area as f32, of_ray as f32);
        let mix = |areas: &Lanes, rays: &Lanes| {
            std::array::from_fn(|c| of_area * areas[c] + of_ray * rays[c])
        };
        Shares { below: mix(&self.below, left), above: mix(&self.above, right) }
    }
}

/// The measure of MacDonald and Booth on one axis of a cell, relative to the cell's area.
pub(super) struct AxisMeasure {
    axis: usize,
    lo: f32,
    hi: f32,
    caps: f32,
    rim: f32,
    /// A count times this and plus `bias` rounds to its number of blocks.
    per_block: f32,
    bias: f32,
    size_price: f32,
    /// Both children would hold everything.
    useless: f32,
}

/// Adding and taking it away rounds to an integer.
const ROUNDING: f32 = (1u32 << 23) as f32;

/// The block width of a leaf cost that a tally can price.
pub(super) fn block_width(leaf_cost: LeafCost) -> Option<u32> {
    match leaf_cost {
        LeafCost::Linear => Some(1),
        LeafCost::Blocks { width } => Some(width),
        LeafCost::Logarithmic { .. } => None,
    }
}

impl AxisMeasure {
    pub fn new(
        areas: &CellAreas,
        axis: usize,
        count: usize,
        width: u32,
        pricing: &Pricing,
    ) -> Self {
        let (lo, hi) = areas.range();
        let (below, above) = areas.parts(lo);
        let (caps, rest) = (below / areas.area, (above - below) / areas.area);
        AxisMeasure {
            axis,
            lo,
            hi,
            caps: caps as f32,
            rim: (rest / (f64::from(hi) - f64::from(lo))) as f32,
            per_block: 1.0 / width as f32,
            bias: 0.5 * (width - 1) as f32 / width as f32,
            size_price: pricing.size_price(areas) as f32,
            useless: 2.0 * count as f32,
        }
    }

    /// The axis.
    #[inline(always)]
    pub fn axis(&self) -> usize {
        self.axis
    }

    /// The shares of the cell's area.
    #[inline(always)]
    pub fn shares(&self, positions: &Lanes) -> Shares {
        Shares {
            below: std::array::from_fn(|c| self.caps + self.rim * (positions[c] - self.lo)),
            above: std::array::from_fn(|c| self.caps + self.rim * (self.hi - positions[c])),
        }
    }

    #[inline(always)]
    fn of(&self, (below, above): (f32, f32), left: f32, right: f32) -> f32 {
        let blocks = |n: f32| n * self.per_block + self.bias + ROUNDING - ROUNDING;
        let (l, r) = (blocks(left), blocks(right));
        let measure = below * l + above * r + self.size_price * (l + r);
        if left + right >= self.useless { f32::INFINITY } else { measure }
    }
}

/// The lane with the lowest value, the first one on ties.
#[inline]
pub(super) fn lowest(lanes: &Lanes) -> usize {
    let mut low = *lanes;
    for half in [8, 4, 2, 1] {
        for c in 0..half {
            low[c] = if low[c + half] < low[c] { low[c + half] } else { low[c] };
        }
    }
    lanes.iter().position(|&x| x == low[0]).unwrap_or(0)
}

/// The cheapest position of each lane so far.
pub(super) struct Best {
    measure: Lanes,
    position: Lanes,
    left: Lanes,
    right: Lanes,
    /// Axis, and 4 where fragments in the plane go to the lower side.
    side: Lanes,
}

impl Best {
    pub const NONE: Best = Best {
        measure: [f32::INFINITY; LANES],
        position: [0.0; LANES],
        left: [0.0; LANES],
        right: [0.0; LANES],
        side: [0.0; LANES],
    };

    /// Offers all positions of a tally, with what lies in them on either side.
    #[inline]
    pub fn offer(&mut self, measure: &AxisMeasure, positions: &Lanes, tally: &Tally) {
        self.offer_shared(measure, positions, tally, &measure.shares(positions));
    }

    /// The same with the probabilities given.
    #[inline]
    pub fn offer_shared(
        &mut self,
        measure: &AxisMeasure,
        positions: &Lanes,
        tally: &Tally,
        shares: &Shares,
    ) {
        let axis = measure.axis as f32;
        let with = |a: &Lanes, b: &Lanes| std::array::from_fn(|c| a[c] + b[c]);
        let lower = with(&tally.left, &tally.planar);
        self.take(measure, positions, shares, (&lower, &tally.right), axis + 4.0);
        if tally.planar != [0.0; LANES] {
            let upper = with(&tally.right, &tally.planar);
            self.take(measure, positions, shares, (&tally.left, &upper), axis);
        }
    }

    #[inline]
    fn take(
        &mut self,
        measure: &AxisMeasure,
        positions: &Lanes,
        shares: &Shares,
        (left, right): (&Lanes, &Lanes),
        side: f32,
    ) {
        for c in 0..LANES {
            let cost = measure.of((shares.below[c], shares.above[c]), left[c], right[c]);
            let better = cost < self.measure[c];
            self.measure[c] = if better { cost } else { self.measure[c] };
            self.position[c] = if better { positions[c] } else { self.position[c] };
            self.left[c] = if better { left[c] } else { self.left[c] };
            self.right[c] = if better { right[c] } else { self.right[c] };
            self.side[c] = if better { side } else { self.side[c] };
        }
    }

    /// The measure of the cheapest plane, infinite without one.
    pub fn lowest(&self) -> f32 {
        self.measure[lowest(&self.measure)]
    }

    /// The cheapest position and its measure.
    pub fn cheapest(&self) -> Option<(f32, f32)> {
        let lane = lowest(&self.measure);
        (self.measure[lane] < f32::INFINITY).then(|| (self.position[lane], self.measure[lane]))
    }

    /// The cheapest plane, priced in `f64`.
    pub fn plane(
        &self,
        areas: &[Option<CellAreas>; 3],
        total: usize,
        pricing: &Pricing,
        rays: Option<&NodeRays<'_>>,
    ) -> Option<Plane> {
        let lane = lowest(&self.measure);
        if self.measure[lane] == f32::INFINITY {
            return None;
        }
        let axis = self.side[lane] as usize & 3;
        let (left, right) = (self.left[lane] as usize, self.right[lane] as usize);
        let (position, planar_left) = (self.position[lane], self.side[lane] >= 4.0);
        let areas = areas[axis].as_ref()?;
        let children = (left, right);
        let parts = mixed_parts(areas, axis, position, rays);
        let cost = pricing.price_parts(&MacDonaldBooth, areas, parts, total, children, (0.0, 0.0));
        Some(Plane { axis, position, planar_left, cost, left, right })
    }
}

/// The areas of a plane's children, mixed with the shares of a node's rays where it has any.
#[inline]
pub(super) fn mixed_parts(
    areas: &CellAreas,
    axis: usize,
    position: f32,
    rays: Option<&NodeRays<'_>>,
) -> (f64, f64) {
    rays.map_or_else(|| areas.parts(position), |rays| rays.areas(areas, axis, position))
}
