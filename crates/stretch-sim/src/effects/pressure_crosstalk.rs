//! The pressure inside the muscle stretches the gauge.

use stretch_operators::{Operator, Span};

use crate::{
    effects::{Action, Effect, EffectParameter, Surroundings},
    stage::Stage,
};

/// The pressure inside the muscle stretches the gauge.
#[derive(Debug)]
pub(super) struct PressureCrosstalk;

static PARAMETERS: &[EffectParameter] =
    &[EffectParameter::strength("c", "strain", -0.05, 0.05, 0.01)];

impl Effect for PressureCrosstalk {
    fn name(&self) -> &'static str {
        "pressure_crosstalk"
    }

    fn stage(&self) -> Stage {
        Stage::Sensing
    }

    fn equation(&self) -> &'static str {
        "e -> e + c (p - P_atm)/P_ref"
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        PARAMETERS
    }

    fn action(&self, values: &[f64], around: &Surroundings<'_>) -> Action {
        Action::Strain(Box::new(Crosstalk { per_kpa: values[0] / around.pressure_scale_kpa }))
    }

    fn needs(&self) -> Option<&'static str> {
        Some("a pressure")
    }
}

#[derive(Debug)]
struct Crosstalk {
    per_kpa: f64,
}

impl Operator for Crosstalk {
    fn run(&self, span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        for (e, p) in signal.iter_mut().zip(span.pressure_kpa) {
            *e += self.per_kpa * p;
        }
    }
}
