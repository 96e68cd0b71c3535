//! The gauge is not quite linear.

use stretch_effects::BowedGain;

use crate::{
    effects::{Action, Effect, EffectParameter, Form, search::each},
    sketch::bowed_gain,
    stage::Stage,
};

/// The gauge is not quite linear.
pub(super) static GAUGE_NONLINEARITY: Effect = Effect {
    name: "gauge_nonlinearity",
    words: "the gauge's resistance bends away from the ideal curve",
    stage: Stage::Sensing,
    equation: "R -> R (1 + c 4 x (1 - x)(1 + skew (2 x - 1))), x = e/e0",
    parameters: &[
        EffectParameter::strength("c", "1", -0.1, 0.1, 0.02),
        EffectParameter::form("skew", "1", -0.6, 0.6, Form { neutral: 0.0, usual: 0.0 }),
    ],
    action: |values, around| {
        let scale = around.strain_scale;
        Action::Resistance(Box::new(BowedGain { c: values[0], skew: values[1], scale }))
    },
    twins: &["pot_nonlinearity", "pressure_crosstalk"],
    // At half of the range, where e + 1 is 1.5, it bends by half as much again; further, it would not rise any more.
    alone: |_, search| search.reach_from(0.5),
    starts: Some(|_| each([0.005])),
    sketch: Some(|v, around| {
        bowed_gain([v[0], v[1], around.strain_scale], around.resistance(), around.strain_beside())
    }),
    ..Effect::PLAIN
};
