//! The gauge drifts while the session lasts.

use stretch_effects::Drift;

use crate::{
    effects::{Action, Effect, EffectParameter, Form, search::each},
    sketch::drifting,
    stage::Stage,
};

/// The gauge drifts while the session lasts.
pub(super) static THERMAL_DRIFT: Effect = Effect {
    name: "thermal_drift",
    words: "the gauge drifts with time",
    stage: Stage::Sensing,
    equation: "R -> R (1 + d (1 - exp(-settle_per_s t))/settle_per_s), 1 + d t at 0; t since the session began",
    parameters: &[
        EffectParameter::strength("d", "1/s", -4e-4, 4e-4, 5e-5),
        EffectParameter::form(
            "settle_per_s",
            "1/s",
            5e-5,
            1.0 / 150.0,
            Form { neutral: 0.0, usual: 1.0 / 3e3 },
        )
        .log(),
    ],
    action: |values, _| {
        Action::Resistance(Box::new(Drift { per_s: values[0], settle_per_s: values[1] }))
    },
    // It takes at most half of the signal's span away over the session.
    alone: |alone, search| search.reach_from(0.5 / alone.session_s.max(1.0)),
    starts: Some(|_| each([2e-5])),
    sketch: Some(|v, around| drifting([v[0], v[1]], around.resistance())),
    ..Effect::PLAIN
};
