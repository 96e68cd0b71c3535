//! The sleeve slips on the muscle.

use stretch_operators::Backlash;

use crate::{
    effects::{Action, Effect, EffectParameter, Surroundings},
    stage::Stage,
};

/// The sleeve slips on the muscle.
#[derive(Debug)]
pub(super) struct SleeveSlip;

static PARAMETERS: &[EffectParameter] =
    &[EffectParameter::strength("w", "strain", 0.0, 0.03, 0.008)];

impl Effect for SleeveSlip {
    fn name(&self) -> &'static str {
        "sleeve_slip"
    }

    fn stage(&self) -> Stage {
        Stage::Sensing
    }

    fn equation(&self) -> &'static str {
        "e -> play(e, w)"
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        PARAMETERS
    }

    fn action(&self, values: &[f64], _around: &Surroundings<'_>) -> Action {
        Action::Strain(Box::new(Backlash::hard(values[0])))
    }
}
