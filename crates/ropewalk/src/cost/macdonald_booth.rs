//! The surface-area heuristic of MacDonald and Booth.

use super::{CostModel, Cut};

/// `f_MB = (A_L f_L + A_R f_R) / A`, to be minimised (MacDonald and Booth 1990): no ray ends.
///
/// Deviation: Havran 1997 prints it as a maximum of sums with `+` and `-` cross-paired.
#[derive(Clone, Copy, Debug, Default)]
pub struct MacDonaldBooth;

impl CostModel for MacDonaldBooth {
    const NAME: &'static str = "macdonald-booth";
    const USES_TERMINATION: bool = false;

    #[inline]
    fn cost(&self, cut: &Cut) -> f64 {
        (cut.area_left * cut.cost_left + cut.area_right * cut.cost_right) / cut.area
    }
}
