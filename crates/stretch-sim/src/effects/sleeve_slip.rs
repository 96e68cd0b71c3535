//! The sleeve slips on the muscle.

use stretch_effects::Backlash;

use crate::{
    effects::{Action, Effect, EffectParameter, Form, search::each},
    sketch::backlash,
    stage::Stage,
};

/// The sleeve slips on the muscle.
pub(super) static SLEEVE_SLIP: Effect = Effect {
    name: "sleeve_slip",
    words: "the sleeve slips on the muscle before it follows",
    stage: Stage::Sensing,
    equation: "e -> mean of play(e, w {1 - spread, 1, 1 + spread})",
    parameters: &[
        EffectParameter::strength("w", "strain", 0.0, 0.03, 0.008),
        EffectParameter::form("spread", "1", 0.0, 0.95, Form { neutral: 0.0, usual: 0.3 }),
    ],
    action: |values, _| Action::Strain(Box::new(Backlash::soft(values[0], values[1]))),
    twins: &["gauge_hysteresis", "pot_backlash"],
    starts: Some(|_| each([0.0005, 0.002, 0.01])),
    sketch: Some(|v, around| backlash([v[0], v[1]], around.strain())),
    ..Effect::PLAIN
};
