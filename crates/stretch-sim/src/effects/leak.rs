//! Air leaks out of the chamber.

use crate::{
    effects::{Action, Effect, EffectParameter, Surroundings},
    law::Law,
    stage::Stage,
};

/// Air leaks out of the chamber.
#[derive(Debug)]
pub(super) struct Leak;

static PARAMETERS: &[EffectParameter] =
    &[EffectParameter::strength("c", "kg/(s Pa)", 0.0, 2e-10, 5e-11)];

impl Effect for Leak {
    fn name(&self) -> &'static str {
        "leak"
    }

    fn stage(&self) -> Stage {
        Stage::Pneumatics
    }

    fn equation(&self) -> &'static str {
        "q_leak = c (p - P_atm)"
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        PARAMETERS
    }

    fn action(&self, values: &[f64], _around: &Surroundings<'_>) -> Action {
        Action::Leak(Box::new(Linear { c: values[0] }))
    }
}

#[derive(Debug)]
struct Linear {
    c: f64,
}

impl Law for Linear {
    #[inline]
    fn at(&self, x: f64) -> f64 {
        self.c * x
    }
}
