//! The gauge drifts while the session lasts.

use stretch_operators::{Operator, Span};

use crate::{
    effects::{Action, Effect, EffectParameter, Surroundings},
    stage::Stage,
};

/// The gauge drifts while the session lasts.
#[derive(Debug)]
pub(super) struct ThermalDrift;

static PARAMETERS: &[EffectParameter] = &[EffectParameter::strength("d", "1/s", -4e-4, 4e-4, 5e-5)];

impl Effect for ThermalDrift {
    fn name(&self) -> &'static str {
        "thermal_drift"
    }

    fn stage(&self) -> Stage {
        Stage::Sensing
    }

    fn equation(&self) -> &'static str {
        "R -> R (1 + d t), t since the session began"
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        PARAMETERS
    }

    fn action(&self, values: &[f64], _around: &Surroundings<'_>) -> Action {
        Action::Resistance(Box::new(Drift { d: values[0] }))
    }
}

#[derive(Debug)]
struct Drift {
    d: f64,
}

impl Operator for Drift {
    fn run(&self, span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        for (i, r) in signal.iter_mut().enumerate() {
            *r *= 1.0 + self.d * (span.start_s + span.grid.time_s(span.first_node + i));
        }
    }
}
