//! The rubber of the muscle creeps.

use stretch_effects::{FadingMemory, Times};

use crate::{
    effects::{Action, Effect, EffectParameter, Form, search::pairs},
    sketch::{STILL, fading},
    stage::Stage,
};

/// The rubber of the muscle creeps.
pub(super) static MUSCLE_CREEP: Effect = Effect {
    name: "muscle_creep",
    words: "the muscle creeps on after the pressure has settled",
    stage: Stage::Muscle,
    equation: "k_s -> k_s + c (mean of mean_rev(k_s, tau {1/spread, 1, spread}) - k_s)",
    parameters: &[
        EffectParameter::strength("c", "1", 0.0, 0.3, 0.1),
        EffectParameter::shape("tau", "s", 0.5, 40.0, 4.0),
        EffectParameter::form("spread", "1", 1.0, 8.0, Form { neutral: 1.0, usual: 1.6 }).log(),
    ],
    action: |values, around| {
        let times = Times { tau_s: values[1], spread: values[2] };
        let memory = FadingMemory::new(-values[0], times, around.contraction_stroke, around.grid);
        Action::StaticContraction(Box::new(memory))
    },
    twins: &["muscle_hysteresis"],
    starts: Some(|_| pairs(0.05, [0.6, 2.0, 6.0, 20.0])),
    sketch: Some(|v, around| fading([-v[0], v[1], v[2]], around.grid.dt_s(), STILL)),
    ..Effect::PLAIN
};
