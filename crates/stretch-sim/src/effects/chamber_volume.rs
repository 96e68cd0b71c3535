//! The chamber grows as the muscle contracts.

use crate::{
    effects::{Action, Effect, EffectParameter, Surroundings},
    law::Law,
    stage::Stage,
};

/// The chamber grows as the muscle contracts.
#[derive(Debug)]
pub(super) struct ChamberVolume;

static PARAMETERS: &[EffectParameter] = &[EffectParameter::strength("g", "1", 0.0, 3.0, 1.0)];

impl Effect for ChamberVolume {
    fn name(&self) -> &'static str {
        "chamber_volume"
    }

    fn stage(&self) -> Stage {
        Stage::Pneumatics
    }

    fn equation(&self) -> &'static str {
        "V = V0 (1 + g k/k_max), with the p dV/dt term"
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        PARAMETERS
    }

    fn action(&self, values: &[f64], _around: &Surroundings<'_>) -> Action {
        Action::Volume(Box::new(Growth { g: values[0] }))
    }
}

#[derive(Debug)]
struct Growth {
    g: f64,
}

impl Law for Growth {
    #[inline]
    fn at(&self, x: f64) -> f64 {
        1.0 + self.g * x
    }
}
