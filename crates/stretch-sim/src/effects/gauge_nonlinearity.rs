//! The gauge is not quite linear.

use stretch_operators::{Operator, Span};

use crate::{
    effects::{Action, Effect, EffectParameter, Surroundings},
    stage::Stage,
};

/// The gauge is not quite linear.
#[derive(Debug)]
pub(super) struct GaugeNonlinearity;

static PARAMETERS: &[EffectParameter] = &[EffectParameter::strength("c", "1", -0.1, 0.1, 0.02)];

impl Effect for GaugeNonlinearity {
    fn name(&self) -> &'static str {
        "gauge_nonlinearity"
    }

    fn stage(&self) -> Stage {
        Stage::Sensing
    }

    fn equation(&self) -> &'static str {
        "R -> R (1 + c 4 (e/e0)(1 - e/e0))"
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        PARAMETERS
    }

    fn action(&self, values: &[f64], around: &Surroundings<'_>) -> Action {
        Action::Resistance(Box::new(Bow { c: values[0], scale: around.strain_scale }))
    }
}

#[derive(Debug)]
struct Bow {
    c: f64,
    scale: f64,
}

impl Operator for Bow {
    fn run(&self, span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        for (r, e) in signal.iter_mut().zip(span.strain) {
            let y = e / self.scale;
            *r *= 1.0 + self.c * 4.0 * y * (1.0 - y);
        }
    }
}
