//! Estimates of `p_L` and `p_R`: the probability that a ray which heads for the cut from inside a
//! child ends in it before it gets there.

mod area_sweep;
mod error_sample;
mod lines;

pub(super) use area_sweep::AreaSweep;
pub use error_sample::EstimatorStats;
pub(super) use error_sample::estimator_stats;

use super::plane::{CellAreas, Plane};
use super::settings::TerminationEstimator;
use crate::aabb::Aabb;
use crate::geometry::Geometry;
use crate::primitive::{AreaRamp, Primitive, Shape};
use crate::tree::BspTree;
use lines::Lines;

/// Range of a calibrated exponent: far outside it the sample says nothing about inner nodes.
const BETA_RANGE: (f64, f64) = (0.05, 2.0);

/// Exponent where there is nothing to calibrate with: thin open soup (docs/paper.md, section 4).
const BETA_OF_SOUP: f64 = 1.0;

/// Lines that calibrate the exponent: a standard error of at most 0.022 in the share that hits.
const CALIBRATION_LINES: u32 = 512;

/// Seeds of the samples, arbitrary and fixed.
const CALIBRATION_SEED: u64 = 0x726f_7065_7761_6c6b;
const SPLIT_SEED: u64 = 0x0062_6c6f_636b_6167;

/// An estimator made ready for one geometry.
pub(super) struct Blockage<'a> {
    geometry: &'a Geometry,
    estimator: TerminationEstimator,
    beta: f64,
    /// A tree over the geometry that answers sampled lines.
    probe: Option<BspTree>,
}

impl<'a> Blockage<'a> {
    /// True if the estimator needs a tree to shoot sampled lines through.
    pub fn needs_probe(estimator: TerminationEstimator) -> bool {
        match estimator {
            TerminationEstimator::SurfaceArea { beta } => beta.is_none(),
            TerminationEstimator::Projection => false,
            TerminationEstimator::SampledLines { .. } => true,
        }
    }

    /// Calibrates the exponent where none is given; `probe` as [`Blockage::needs_probe`] says.
    pub fn new(
        geometry: &'a Geometry,
        estimator: TerminationEstimator,
        probe: Option<BspTree>,
    ) -> Self {
        let beta = match (estimator, &probe) {
            (TerminationEstimator::SurfaceArea { beta: Some(beta) }, _) => beta,
            (_, Some(tree)) => calibrated_beta(geometry, tree),
            (_, None) => BETA_OF_SOUP,
        };
        Blockage { geometry, estimator, beta, probe }
    }

    /// The exponent in use, where the estimator has one.
    pub fn beta(&self) -> Option<f64> {
        (self.estimator != TerminationEstimator::Projection).then_some(self.beta)
    }

    /// Collects the sorted area functions of the primitives `prims` in a cell along an axis, in
    /// units that [`Blockage::ends`] understands: areas, or areas projected onto the cut.
    pub fn collect_ramps(
        &self,
        prims: impl Iterator<Item = u32>,
        cell: &Aabb,
        axis: usize,
        ramps: &mut Vec<AreaRamp>,
    ) {
        ramps.clear();
        for prim in prims {
            let (shape, start) = (self.geometry.shape(prim), ramps.len());
            shape.area_ramps(cell, axis, ramps);
            if self.estimator == TerminationEstimator::Projection {
                let facing = facing(shape, axis);
                for ramp in &mut ramps[start..] {
                    ramp.step *= facing;
                    ramp.width *= facing;
                    ramp.slope *= facing;
                }
            }
        }
        ramps.sort_unstable_by(|a, b| a.x.total_cmp(&b.x));
    }

    /// The probability from the area inside a child with surface area `cell_area`, cut off by a
    /// cut of one-sided area `cut`. Without area to divide by, nothing is known to end: 0.
    #[inline]
    pub fn ends(&self, area: f64, cell_area: f64, cut: f64) -> f64 {
        let hits = match self.estimator {
            TerminationEstimator::Projection => area / cut,
            _ => self.beta * 2.0 * area / cell_area,
        };
        // NaN (0 / 0) fails the comparison.
        if hits > 0.0 { -(-hits).exp_m1() } else { 0.0 }
    }

    /// True if [`Blockage::sampled_ends`] decides between the best planes of a node.
    pub fn samples_nodes_of(&self, fragments: usize) -> bool {
        match self.estimator {
            TerminationEstimator::SampledLines { stop_below, .. } => {
                fragments >= stop_below as usize
            }
            _ => false,
        }
    }

    /// `p_L` and `p_R` of a plane by sampled lines; `None` where a child is flat.
    pub fn sampled_ends(&self, cell: &Aabb, plane: &Plane) -> Option<(f64, f64)> {
        let TerminationEstimator::SampledLines { lines, .. } = self.estimator else {
            return None;
        };
        // The same random numbers for all planes of a node: their differences are less noisy.
        let seed = cell.min.iter().chain(&cell.max).fold(SPLIT_SEED, |hash, x| {
            (hash ^ u64::from(x.to_bits())).wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(29)
        });
        let tree = self.probe.as_ref()?;
        sampled_ends(self.geometry, tree, cell, plane.axis, plane.position, lines, seed)
    }
}

/// The shares of `lines` uniform lines towards the cut that end in the lower and in the upper part
/// of a cell; `None` where one of the parts is flat.
fn sampled_ends(
    geometry: &Geometry,
    tree: &BspTree,
    cell: &Aabb,
    axis: usize,
    position: f32,
    lines: u32,
    seed: u64,
) -> Option<(f64, f64)> {
    if !(cell.min[axis] < position && position < cell.max[axis]) {
        return None;
    }
    let (below, above) = cell.split(axis, position);
    let mut sample = Lines::new(geometry, tree, seed);
    let left = sample.share_ended(lines, |random| random.towards_face(&below, axis, true));
    let right = sample.share_ended(lines, |random| random.towards_face(&above, axis, false));
    Some((left, right))
}

/// Solves `1 - exp(-beta 2 S / A) = share of lines that hit something` at the root.
fn calibrated_beta(geometry: &Geometry, tree: &BspTree) -> f64 {
    let cell = tree.bounds();
    let surface: f64 = (0..geometry.len() as u32).map(|p| geometry.shape(p).area()).sum();
    let crossings = 2.0 * surface / cell.area();
    if !(crossings > 0.0 && crossings.is_finite()) {
        return BETA_OF_SOUP;
    }
    let mut sample = Lines::new(geometry, tree, CALIBRATION_SEED);
    let share = sample.share_ended(CALIBRATION_LINES, |random| random.across(&cell));
    // If every line hits, half a line is assumed to miss.
    let missed = (1.0 - share).max(0.5 / f64::from(CALIBRATION_LINES));
    (-missed.ln() / crossings).clamp(BETA_RANGE.0, BETA_RANGE.1)
}

/// Mean of `|n_axis|` over a primitive's surface, which turns its area into its projection onto a
/// plane across the axis. One half, the mean over all directions, holds exactly for whole spheres
/// and stands for whatever is not a triangle.
fn facing(shape: &Shape, axis: usize) -> f64 {
    let Shape::Triangle(triangle) = shape else { return 0.5 };
    let n = triangle.scaled_normal();
    let length = n.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length > 0.0 { n[axis].abs() / length } else { 0.0 }
}

/// The two probabilities of a plane at which `area_left` and `area_right` lie on its sides.
#[inline]
pub(super) fn ends_of_sides(
    blockage: &Blockage<'_>,
    areas: &CellAreas,
    position: f32,
    area_left: f64,
    area_right: f64,
) -> (f64, f64) {
    let (cell_left, cell_right) = areas.parts(position);
    (
        blockage.ends(area_left, cell_left, areas.cut()),
        blockage.ends(area_right, cell_right, areas.cut()),
    )
}
