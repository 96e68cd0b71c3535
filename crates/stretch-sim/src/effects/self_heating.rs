//! The excitation warms the gauge.

use stretch_operators::{Operator, Span, Start};

use crate::{
    effects::{Action, Effect, EffectParameter, Surroundings},
    stage::Stage,
};

/// The excitation warms the gauge.
#[derive(Debug)]
pub(super) struct SelfHeating;

static PARAMETERS: &[EffectParameter] = &[
    EffectParameter::strength("h", "1", -0.05, 0.05, 0.01),
    EffectParameter::shape("tau", "s", 1.0, 60.0, 8.0),
];

impl Effect for SelfHeating {
    fn name(&self) -> &'static str {
        "self_heating"
    }

    fn stage(&self) -> Stage {
        Stage::Sensing
    }

    fn equation(&self) -> &'static str {
        "R -> R (1 + h (1 - exp(-t/tau))), t since the trial's start"
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        PARAMETERS
    }

    fn action(&self, values: &[f64], around: &Surroundings<'_>) -> Action {
        let decays = around.grid.steps().iter().map(|step| libm::exp(-step / values[1])).collect();
        Action::Resistance(Box::new(Heating { h: values[0], decays }))
    }
}

/// Remembers what is still to warm up, exp(-t/tau).
#[derive(Debug)]
struct Heating {
    h: f64,
    decays: Vec<f64>,
}

impl Operator for Heating {
    fn cells(&self) -> usize {
        1
    }

    fn begin(&self, _start: Start, _first: f64, cells: &mut [f64]) {
        cells[0] = 1.0;
    }

    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        let mut left = cells[0];
        span.each(signal.len(), |step, i| {
            if let Some(step) = step {
                left *= self.decays[step];
            }
            signal[i] *= 1.0 + self.h * (1.0 - left);
        });
        cells[0] = left;
    }
}
