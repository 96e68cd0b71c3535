//! The potentiometer is not quite linear.

use stretch_operators::{Operator, Span};

use crate::{
    effects::{Action, Effect, EffectParameter, Surroundings},
    stage::Stage,
};

/// The potentiometer is not quite linear.
#[derive(Debug)]
pub(super) struct PotNonlinearity;

static PARAMETERS: &[EffectParameter] = &[EffectParameter::strength("c", "mm", -3.0, 3.0, 0.5)];

impl Effect for PotNonlinearity {
    fn name(&self) -> &'static str {
        "pot_nonlinearity"
    }

    fn stage(&self) -> Stage {
        Stage::Reference
    }

    fn equation(&self) -> &'static str {
        "L_meas = L + c 4 y (1 - y), y = k/k_max"
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        PARAMETERS
    }

    fn action(&self, values: &[f64], around: &Surroundings<'_>) -> Action {
        Action::Length(Box::new(Bow {
            c: values[0],
            zero: around.length_zero,
            span: around.length_span,
        }))
    }
}

#[derive(Debug)]
struct Bow {
    c: f64,
    zero: f64,
    span: f64,
}

impl Operator for Bow {
    fn run(&self, _span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        for length in signal {
            let y = (*length - self.zero) / self.span;
            *length += self.c * 4.0 * y * (1.0 - y);
        }
    }

    fn undo(&self, signal: &mut [f64]) {
        // z = y + b y (1 - y), solved for y; the form that stays exact as b goes to 0.
        let b = 4.0 * self.c / self.span;
        for length in signal {
            let z = (*length - self.zero) / self.span;
            let sum = 1.0 + b;
            let root = (sum * sum - 4.0 * b * z).max(0.0).sqrt();
            *length = self.zero + self.span * (2.0 * z / (sum + root));
        }
    }
}
