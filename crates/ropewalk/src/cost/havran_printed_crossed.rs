//! The measure of Havran 1997 as printed, children paired crosswise.

use super::havran_printed::printed_bracket;
use super::{CostModel, Cut};

/// `(A_L f_R + A_R f_L) / A + (A^c / 2A) (p_L - p_R) (f_L - f_R)`: the printed formula taken by the
/// letter, each area paired with the cost of the other side (Havran 1997, where the text names the
/// left box `R+` but the left set `S-`).
#[derive(Clone, Copy, Debug, Default)]
pub struct HavranPrintedCrossed;

impl CostModel for HavranPrintedCrossed {
    const NAME: &'static str = "havran-printed-crossed";
    const USES_TERMINATION: bool = true;

    #[inline]
    fn cost(&self, cut: &Cut) -> f64 {
        let crossed = cut.area_left * cut.cost_right + cut.area_right * cut.cost_left;
        crossed / cut.area + printed_bracket(cut)
    }
}
