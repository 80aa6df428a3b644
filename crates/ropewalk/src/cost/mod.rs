//! Cost models: what a cutting plane is expected to cost. One file a model.
//!
//! Notation of the paper, with its misprints corrected (docs/paper.md): node `v` with area `A`,
//! children with areas `A_L`, `A_R`, one-sided area of the cut `a_c`; `f_L`, `f_R` the costs of the
//! children as [`LeafCost`] has them; `p_L` the probability that a ray that entered through L and
//! heads for the cut ends inside L, `p_R` likewise.

mod havran_printed;
mod havran_printed_crossed;
mod macdonald_booth;
mod termination;

pub use havran_printed::HavranPrinted;
pub use havran_printed_crossed::HavranPrintedCrossed;
pub use macdonald_booth::MacDonaldBooth;
pub use termination::Termination;

/// Everything a cost model may look at for one candidate plane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cut {
    /// Surface area of the node's box.
    pub area: f64,
    /// Surface area of the lower child's box.
    pub area_left: f64,
    /// Surface area of the upper child's box.
    pub area_right: f64,
    /// Cost of the lower child, `f_L`.
    pub cost_left: f64,
    /// Cost of the upper child, `f_R`.
    pub cost_right: f64,
    /// Probability `p_L`, 0 where the model does not use it.
    pub ends_left: f64,
    /// Probability `p_R`.
    pub ends_right: f64,
}

impl Cut {
    /// `A^c = A_L + A_R - A = 2 a_c`: the two-sided area of the cut.
    #[inline]
    pub fn shared_area(&self) -> f64 {
        self.area_left + self.area_right - self.area
    }
}

/// The measure that a builder minimises over candidate planes; in units of one intersection test,
/// traversal steps not included.
pub trait CostModel: Send + Sync {
    /// The name used on the command line.
    const NAME: &'static str;
    /// True if the model reads `ends_left` and `ends_right`.
    const USES_TERMINATION: bool;
    /// Expected intersection cost of a ray that hits the node.
    fn cost(&self, cut: &Cut) -> f64;
}

/// The cost `f_C(N)` of a set of N primitives that may be refined further.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum LeafCost {
    /// `N`, as in the paper.
    #[default]
    Linear,
    /// `ceil(N / width)`: leaves tested in packed blocks.
    Blocks {
        /// Primitives in a block, at least 1.
        width: u32,
    },
    /// `min(N, a + b * log2(N))`: what refinement is likely to leave of it.
    Logarithmic {
        /// Constant part.
        a: f64,
        /// Factor of the logarithm.
        b: f64,
    },
}

impl LeafCost {
    /// The cost of a leaf that holds `count` primitives, in intersection tests: refinement is over,
    /// so all of them are tested.
    #[inline]
    pub fn leaf(self, count: usize) -> f64 {
        match self {
            LeafCost::Logarithmic { .. } => count as f64,
            LeafCost::Linear | LeafCost::Blocks { .. } => self.cost(count),
        }
    }

    /// The cost of `count` primitives that may be refined further, in intersection tests.
    #[inline]
    pub fn cost(self, count: usize) -> f64 {
        match self {
            LeafCost::Linear => count as f64,
            LeafCost::Blocks { width } => count.div_ceil(width.max(1) as usize) as f64,
            LeafCost::Logarithmic { a, b } if count > 0 => {
                (count as f64).min(a + b * (count as f64).log2())
            }
            LeafCost::Logarithmic { .. } => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Unit cube cut at 0.3 with 30 primitives below and 10 above: the columns are `p_L`, `p_R`
    /// and the costs of the four models to two decimals (docs/paper.md, check table).
    const CHECK_TABLE: [[f64; 6]; 6] = [
        [0.0, 0.0, 24.00, 24.00, 29.33, 24.00],
        [0.5, 0.5, 24.00, 24.00, 29.33, 20.67],
        [1.0, 1.0, 24.00, 24.00, 29.33, 17.33],
        [0.8, 0.2, 24.00, 26.00, 31.33, 21.67],
        [0.2, 0.8, 24.00, 22.00, 27.33, 19.67],
        [1.0, 0.0, 24.00, 27.33, 32.67, 22.33],
    ];

    #[test]
    fn every_model_matches_the_check_table() {
        for [ends_left, ends_right, expected @ ..] in CHECK_TABLE {
            let cut = Cut {
                area: 6.0,
                area_left: 3.2,
                area_right: 4.8,
                cost_left: LeafCost::Linear.cost(30),
                cost_right: LeafCost::Linear.cost(10),
                ends_left,
                ends_right,
            };
            assert!((cut.shared_area() - 2.0).abs() < 1e-12);
            let costs = [
                MacDonaldBooth.cost(&cut),
                HavranPrinted.cost(&cut),
                HavranPrintedCrossed.cost(&cut),
                Termination.cost(&cut),
            ];
            for (cost, expected) in costs.into_iter().zip(expected) {
                // Half a unit of the table's last decimal.
                assert!((cost - expected).abs() <= 0.005, "{cut:?}: {costs:?}");
            }
        }
    }

    #[test]
    fn leaf_costs() {
        assert_eq!(LeafCost::Linear.cost(9), 9.0);
        let blocks = LeafCost::Blocks { width: 4 };
        assert_eq!([0, 1, 4, 5].map(|n| blocks.cost(n)), [0.0, 1.0, 1.0, 2.0]);
        let log = LeafCost::Logarithmic { a: 2.0, b: 1.0 };
        assert_eq!([0, 1, 2, 1024].map(|n| log.cost(n)), [0.0, 1.0, 2.0, 12.0]);
    }
}
