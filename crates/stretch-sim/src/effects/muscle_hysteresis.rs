//! Friction in the braid: the static contraction depends on its history.

use stretch_effects::{Loops, PrandtlIshlinskii};

use crate::{
    effects::{Action, Effect, EffectParameter, Form, search::pairs},
    sketch::{STILL, loops},
    stage::Stage,
};

/// Friction in the braid: the static contraction depends on its history.
pub(super) static MUSCLE_HYSTERESIS: Effect = Effect {
    name: "muscle_hysteresis",
    words: "the muscle follows another path on the way back",
    stage: Stage::Muscle,
    equation: "k_s -> k_s - h mean of (k_s - play(k_s, s {spread^2, spread, 1}))",
    parameters: &[
        EffectParameter::strength("h", "1", 0.0, 0.6, 0.2),
        EffectParameter::shape("s", "strain", 0.005, 0.06, 0.02),
        EffectParameter::form("spread", "1", 0.15, 0.95, Form { neutral: 0.5, usual: 0.5 }),
    ],
    action: |values, _| {
        let loops = Loops { h: values[0], s: values[1], spread: values[2] };
        Action::StaticContraction(Box::new(PrandtlIshlinskii::new(loops)))
    },
    twins: &["muscle_creep"],
    starts: Some(|_| pairs(0.1, [0.007, 0.02, 0.05])),
    sketch: Some(|v, _| loops([v[0], v[1], v[2]], STILL)),
    ..Effect::PLAIN
};
