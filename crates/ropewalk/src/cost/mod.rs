//! Cost models: what a cutting plane is expected to cost. One file a model.
//!
//! Notation of the paper, with its misprints corrected (docs/paper.md): node `v` with area `A`,
//! children with areas `A_L`, `A_R`, one-sided area of the cut `a_c`; `f_L`, `f_R` the costs of the
//! children as [`LeafCost`] has them; `p_L` the probability that a ray that entered through L and
//! heads for the cut ends inside L, `p_R` likewise.

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
    /// The cost of `count` primitives in intersection tests.
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
