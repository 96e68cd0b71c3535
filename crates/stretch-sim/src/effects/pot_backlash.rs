//! The potentiometer has backlash.

use stretch_effects::Backlash;

use crate::{
    effects::{Action, Effect, EffectParameter, Form, search::each},
    sketch::backlash,
    stage::Stage,
};

/// The potentiometer has backlash.
pub(super) static POT_BACKLASH: Effect = Effect {
    name: "pot_backlash",
    words: "the potentiometer has backlash",
    stage: Stage::Reference,
    equation: "L_meas = mean of play(L, w {1 - spread, 1, 1 + spread})",
    parameters: &[
        EffectParameter::strength("w", "mm", 0.0, 2.0, 0.3),
        EffectParameter::form("spread", "1", 0.0, 0.95, Form { neutral: 0.0, usual: 0.3 }),
    ],
    action: |values, _| Action::Length(Box::new(Backlash::soft(values[0], values[1]))),
    twins: &["sleeve_slip"],
    hides_input: true,
    starts: Some(|_| each([0.05, 0.2, 0.8])),
    sketch: Some(|v, around| backlash([v[0], v[1]], around.length())),
    ..Effect::PLAIN
};
