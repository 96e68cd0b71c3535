//! The channels are not sampled at the same time.

use crate::{
    effects::{Action, Effect, EffectParameter, Surroundings},
    stage::Stage,
};

/// The channels are not sampled at the same time.
#[derive(Debug)]
pub(super) struct ChannelSkew;

static PARAMETERS: &[EffectParameter] =
    &[EffectParameter::strength("skew_s", "s", -0.1, 0.2, 0.02)];

impl Effect for ChannelSkew {
    fn name(&self) -> &'static str {
        "channel_skew"
    }

    fn stage(&self) -> Stage {
        Stage::Sensing
    }

    fn equation(&self) -> &'static str {
        "bridge samples show the length of skew_s earlier, first and last value held"
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        PARAMETERS
    }

    fn action(&self, values: &[f64], _around: &Surroundings<'_>) -> Action {
        Action::Skew(values[0])
    }
}
