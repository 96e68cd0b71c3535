//! Friction in the braid: the static contraction depends on its history.

use stretch_operators::{Loops, PrandtlIshlinskii};

use crate::{
    effects::{Action, Effect, EffectParameter, Surroundings},
    stage::Stage,
};

/// Friction in the braid: the static contraction depends on its history.
#[derive(Debug)]
pub(super) struct MuscleHysteresis;

static PARAMETERS: &[EffectParameter] = &[
    EffectParameter::strength("h", "1", 0.0, 0.6, 0.2),
    EffectParameter::shape("s", "strain", 0.005, 0.06, 0.02),
];

impl Effect for MuscleHysteresis {
    fn name(&self) -> &'static str {
        "muscle_hysteresis"
    }

    fn stage(&self) -> Stage {
        Stage::Muscle
    }

    fn equation(&self) -> &'static str {
        "k_s -> k_s + PI(k_s; h, s)"
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        PARAMETERS
    }

    fn action(&self, values: &[f64], _around: &Surroundings<'_>) -> Action {
        Action::StaticContraction(Box::new(PrandtlIshlinskii::new(Loops {
            h: values[0],
            s: values[1],
            spread: 0.5,
        })))
    }
}
