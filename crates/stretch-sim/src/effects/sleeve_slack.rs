//! The sleeve goes slack: the gauge cannot be compressed.

use stretch_operators::{Operator, Span, soft_floor};

use crate::{
    effects::{Action, Effect, EffectParameter, Surroundings},
    stage::Stage,
};

/// The sleeve goes slack: the gauge cannot be compressed.
#[derive(Debug)]
pub(super) struct SleeveSlack;

static PARAMETERS: &[EffectParameter] =
    &[EffectParameter::strength("e_s", "strain", 0.0, 0.2, 0.08)];

impl Effect for SleeveSlack {
    fn name(&self) -> &'static str {
        "sleeve_slack"
    }

    fn stage(&self) -> Stage {
        Stage::Sensing
    }

    fn equation(&self) -> &'static str {
        "e -> e_s + 0.003 ln(1 + exp((e - e_s)/0.003)): cannot fall below e_s"
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        PARAMETERS
    }

    fn action(&self, values: &[f64], around: &Surroundings<'_>) -> Action {
        Action::Strain(Box::new(Slack { e_s: values[0], knee: KNEE * around.strain_unit }))
    }
}

/// Width of the soft knee in units of strain.
const KNEE: f64 = 0.003;

#[derive(Debug)]
struct Slack {
    e_s: f64,
    knee: f64,
}

impl Operator for Slack {
    fn run(&self, _span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        for e in signal {
            *e = soft_floor(*e, self.e_s, self.knee);
        }
    }
}
