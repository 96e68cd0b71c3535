//! The excitation warms the gauge.

use stretch_effects::{Times, Warming};

use crate::{
    effects::{Action, Effect, EffectParameter, Form, search::pairs},
    sketch::warming,
    stage::Stage,
};

/// The excitation warms the gauge.
pub(super) static SELF_HEATING: Effect = Effect {
    name: "self_heating",
    words: "the gauge warms up in its own current",
    stage: Stage::Sensing,
    equation: "R -> R (1 + h (1 - mean of exp(-t/(tau {1/spread, 1, spread})))), t since the trial's start",
    parameters: &[
        EffectParameter::strength("h", "1", -0.05, 0.05, 0.01),
        EffectParameter::shape("tau", "s", 1.0, 60.0, 8.0),
        EffectParameter::form("spread", "1", 1.0, 8.0, Form { neutral: 1.0, usual: 1.6 }).log(),
    ],
    action: |values, around| {
        let times = Times { tau_s: values[1], spread: values[2] };
        Action::Resistance(Box::new(Warming::new(values[0], times, around.grid)))
    },
    alone: |_, search| search.reach_from(0.15),
    starts: Some(|_| pairs(0.003, [1.5, 5.0, 15.0, 45.0])),
    sketch: Some(|v, around| warming([v[0], v[1], v[2]], around.grid.dt_s(), around.resistance())),
    ..Effect::PLAIN
};
