//! The potentiometer is not quite linear.

use stretch_effects::Bow;

use crate::{
    effects::{Action, Effect, EffectParameter, Form, search::each},
    sketch::bowed,
    stage::Stage,
};

/// The potentiometer is not quite linear.
pub(super) static POT_NONLINEARITY: Effect = Effect {
    name: "pot_nonlinearity",
    words: "the potentiometer's scale bends",
    stage: Stage::Reference,
    equation: "L_meas = L + c 4 y (1 - y)(1 + skew (2 y - 1)), y = k/k_max",
    parameters: &[
        EffectParameter::strength("c", "mm", -3.0, 3.0, 0.5),
        EffectParameter::form("skew", "1", -0.6, 0.6, Form { neutral: 0.0, usual: 0.0 }),
    ],
    action: |values, around| {
        let (zero, span) = (around.length_zero, around.length_span);
        Action::Length(Box::new(Bow { c: values[0], skew: values[1], zero, span }))
    },
    twins: &["gauge_nonlinearity"],
    starts: Some(|_| each([0.2])),
    sketch: Some(|v, around| {
        bowed([v[0], v[1]], [around.length_zero, around.length_span], around.length())
    }),
    ..Effect::PLAIN
};
