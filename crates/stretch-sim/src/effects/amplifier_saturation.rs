//! The amplifier's output is bounded.

use stretch_operators::{Operator, Span, soft_ceiling, soft_floor};

use crate::{
    effects::{Action, Effect, EffectParameter, Surroundings},
    stage::Stage,
};

/// The amplifier's output is bounded.
#[derive(Debug)]
pub(super) struct AmplifierSaturation;

static PARAMETERS: &[EffectParameter] = &[
    EffectParameter { off: Some(0.5), ..EffectParameter::strength("v_lo", "V", 0.5, 2.2, 1.4) },
    EffectParameter { off: Some(3.3), ..EffectParameter::strength("v_hi", "V", 1.2, 3.3, 2.1) },
];

impl Effect for AmplifierSaturation {
    fn name(&self) -> &'static str {
        "amplifier_saturation"
    }

    fn stage(&self) -> Stage {
        Stage::Sensing
    }

    fn equation(&self) -> &'static str {
        "v cannot leave [v_lo, v_hi], soft knees of 0.01 V"
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        PARAMETERS
    }

    fn action(&self, values: &[f64], _around: &Surroundings<'_>) -> Action {
        let bound = |p: usize| (PARAMETERS[p].off != Some(values[p])).then_some(values[p]);
        Action::Volts(Box::new(Rails { low: bound(0), high: bound(1) }))
    }

    fn needs(&self) -> Option<&'static str> {
        Some("an amplifier")
    }
}

/// Width of the soft knees, V.
const KNEE_V: f64 = 0.01;

#[derive(Debug)]
struct Rails {
    low: Option<f64>,
    high: Option<f64>,
}

impl Operator for Rails {
    fn run(&self, _span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        if let Some(low) = self.low {
            for v in signal.iter_mut() {
                *v = soft_floor(*v, low, KNEE_V);
            }
        }
        if let Some(high) = self.high {
            for v in signal.iter_mut() {
                *v = soft_ceiling(*v, high, KNEE_V);
            }
        }
    }
}
