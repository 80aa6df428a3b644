//! The expected cost with ray termination, `f*`.

use super::{CostModel, Cut, MacDonaldBooth};

/// `f* = f_MB - (A^c / 2A) (p_L f_R + p_R f_L)`: a ray that ends in the child through which it
/// entered does not pay for the other one.
///
/// Deviation: Havran 1997 prints a bracket that is not this expectation (see
/// [`HavranPrinted`](super::HavranPrinted)).
#[derive(Clone, Copy, Debug, Default)]
pub struct Termination;

impl CostModel for Termination {
    const NAME: &'static str = "termination";
    const USES_TERMINATION: bool = true;

    #[inline]
    fn cost(&self, cut: &Cut) -> f64 {
        let spared = cut.ends_left * cut.cost_right + cut.ends_right * cut.cost_left;
        MacDonaldBooth.cost(cut) - cut.shared_area() / (2.0 * cut.area) * spared
    }
}
