//! The measure of Havran 1997 as printed, children paired by side.

use super::{CostModel, Cut, MacDonaldBooth};

/// `f'_M = f_MB + (A^c / 2A) (p_L - p_R) (f_L - f_R)`: the printed bracket expanded with each area
/// paired with the cost of its own side (Havran 1997).
///
/// It equals [`MacDonaldBooth`] wherever `p_L = p_R` and otherwise has the wrong sign; it is kept
/// so that its effect can be measured against [`Termination`](super::Termination).
#[derive(Clone, Copy, Debug, Default)]
pub struct HavranPrinted;

impl CostModel for HavranPrinted {
    const NAME: &'static str = "havran-printed";
    const USES_TERMINATION: bool = true;

    #[inline]
    fn cost(&self, cut: &Cut) -> f64 {
        MacDonaldBooth.cost(cut) + printed_bracket(cut)
    }
}

/// `(A^c / 2A) (p_L - p_R) (f_L - f_R)`, with which the printed forms depart from `f_MB`.
#[inline]
pub(super) fn printed_bracket(cut: &Cut) -> f64 {
    let imbalance = (cut.ends_left - cut.ends_right) * (cut.cost_left - cut.cost_right);
    cut.shared_area() / (2.0 * cut.area) * imbalance
}
