//! The valves act late.

use crate::{
    effects::{Action, Effect, EffectParameter, Surroundings},
    stage::Stage,
};

/// The valves act late.
#[derive(Debug)]
pub(super) struct ValveDelay;

static PARAMETERS: &[EffectParameter] =
    &[EffectParameter::strength("delay_s", "s", 0.0, 0.12, 0.03)];

impl Effect for ValveDelay {
    fn name(&self) -> &'static str {
        "valve_delay"
    }

    fn stage(&self) -> Stage {
        Stage::Pneumatics
    }

    fn equation(&self) -> &'static str {
        "u(t) -> u(t - delay_s)"
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        PARAMETERS
    }

    fn action(&self, values: &[f64], _around: &Surroundings<'_>) -> Action {
        Action::Delay(values[0])
    }
}
