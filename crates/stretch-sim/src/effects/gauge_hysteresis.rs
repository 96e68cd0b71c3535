//! The gauge remembers its strain.

use stretch_operators::{Loops, PrandtlIshlinskii};

use crate::{
    effects::{Action, Effect, EffectParameter, Surroundings},
    stage::Stage,
};

/// The gauge remembers its strain.
#[derive(Debug)]
pub(super) struct GaugeHysteresis;

static PARAMETERS: &[EffectParameter] = &[
    EffectParameter::strength("h", "1", 0.0, 0.6, 0.2),
    EffectParameter::shape("s", "strain", 0.005, 0.06, 0.02),
];

impl Effect for GaugeHysteresis {
    fn name(&self) -> &'static str {
        "gauge_hysteresis"
    }

    fn stage(&self) -> Stage {
        Stage::Sensing
    }

    fn equation(&self) -> &'static str {
        "e -> e + PI(e; h, s)"
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        PARAMETERS
    }

    fn action(&self, values: &[f64], _around: &Surroundings<'_>) -> Action {
        Action::Strain(Box::new(PrandtlIshlinskii::new(Loops {
            h: values[0],
            s: values[1],
            spread: 0.5,
        })))
    }
}
