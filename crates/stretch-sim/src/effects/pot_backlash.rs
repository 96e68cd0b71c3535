//! The potentiometer has backlash.

use stretch_operators::Backlash;

use crate::{
    effects::{Action, Effect, EffectParameter, Surroundings},
    stage::Stage,
};

/// The potentiometer has backlash.
#[derive(Debug)]
pub(super) struct PotBacklash;

static PARAMETERS: &[EffectParameter] = &[EffectParameter::strength("w", "mm", 0.0, 2.0, 0.3)];

impl Effect for PotBacklash {
    fn name(&self) -> &'static str {
        "pot_backlash"
    }

    fn stage(&self) -> Stage {
        Stage::Reference
    }

    fn equation(&self) -> &'static str {
        "L_meas = play(L, w)"
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        PARAMETERS
    }

    fn action(&self, values: &[f64], _around: &Surroundings<'_>) -> Action {
        Action::Length(Box::new(Backlash::hard(values[0])))
    }
}
