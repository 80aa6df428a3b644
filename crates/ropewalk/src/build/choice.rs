//! Cost models by name.

use super::settings::{BuildSettings, Measure, TerminationEstimator};

/// A cost model as users name it: a measure that the builder minimises, and where it reads probabilities of ray
/// termination, how they are estimated.
///
/// The surface area is what the presets are made for and what the binned search knows; all others sweep over
/// all planes of a node with the areas on both sides kept along, which makes builds several times as long.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum CostChoice {
    /// [`Measure::MacDonaldBooth`]: rays are lines that end nowhere.
    #[default]
    SurfaceArea,
    /// [`Measure::Termination`] by [`TerminationEstimator::SurfaceArea`], calibrated.
    Termination,
    /// [`Measure::Termination`] by [`TerminationEstimator::Projection`].
    TerminationProjection,
    /// [`Measure::Termination`] by [`TerminationEstimator::SampledLines`], 128 of them in nodes of 32 primitives
    /// and more.
    TerminationLines,
    /// [`Measure::HavranPrinted`], the paper's formula as it was printed.
    HavranPrinted,
    /// [`Measure::HavranPrintedCrossed`], the same with children paired crosswise.
    HavranPrintedCrossed,
}

impl CostChoice {
    /// All cost models.
    pub const ALL: [CostChoice; 6] = [
        CostChoice::SurfaceArea,
        CostChoice::Termination,
        CostChoice::TerminationProjection,
        CostChoice::TerminationLines,
        CostChoice::HavranPrinted,
        CostChoice::HavranPrintedCrossed,
    ];

    /// The name in Python and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            CostChoice::SurfaceArea => "surface_area",
            CostChoice::Termination => "termination",
            CostChoice::TerminationProjection => "termination_projection",
            CostChoice::TerminationLines => "termination_lines",
            CostChoice::HavranPrinted => "havran_printed",
            CostChoice::HavranPrintedCrossed => "havran_printed_crossed",
        }
    }

    /// The cost model of a name.
    pub fn by_name(name: &str) -> Option<CostChoice> {
        Self::ALL.into_iter().find(|choice| choice.name() == name)
    }

    /// The cost model of some settings; `None` if they look for planes otherwise, or estimate termination by
    /// other numbers.
    pub fn of(settings: &BuildSettings) -> Option<CostChoice> {
        let (measure, estimator) = (settings.measure, settings.estimator);
        Self::ALL.into_iter().find(|choice| {
            let same = !measure.uses_termination() || choice.estimator() == estimator;
            choice.measure() == measure && same
        })
    }

    /// Settings with this cost model and otherwise as given.
    pub fn applied(self, settings: BuildSettings) -> BuildSettings {
        BuildSettings { measure: self.measure(), estimator: self.estimator(), ..settings }
    }

    fn measure(self) -> Measure {
        match self {
            CostChoice::SurfaceArea => Measure::MacDonaldBooth,
            CostChoice::Termination
            | CostChoice::TerminationProjection
            | CostChoice::TerminationLines => Measure::Termination,
            CostChoice::HavranPrinted => Measure::HavranPrinted,
            CostChoice::HavranPrintedCrossed => Measure::HavranPrintedCrossed,
        }
    }

    fn estimator(self) -> TerminationEstimator {
        match self {
            CostChoice::TerminationProjection => TerminationEstimator::Projection,
            CostChoice::TerminationLines => {
                TerminationEstimator::SampledLines { lines: 128, stop_below: 32 }
            }
            _ => TerminationEstimator::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::settings::Preset;
    use super::*;

    #[test]
    fn names_and_settings_lead_back_to_the_choice() {
        for choice in CostChoice::ALL {
            assert_eq!(CostChoice::by_name(choice.name()), Some(choice));
            let settings = choice.applied(BuildSettings::preset(Preset::Balanced));
            assert_eq!(CostChoice::of(&settings), Some(choice));
        }
        assert_eq!(CostChoice::by_name("sah"), None);
        let median = BuildSettings { measure: Measure::SpatialMedian, ..BuildSettings::default() };
        assert_eq!(CostChoice::of(&median), None);
    }
}
