//! The gauge remembers its strain.

use stretch_effects::{Loops, PrandtlIshlinskii};

use crate::{
    effects::{Action, Effect, EffectParameter, Form, search::pairs},
    sketch::loops,
    stage::Stage,
};

/// The gauge remembers its strain.
pub(super) static GAUGE_HYSTERESIS: Effect = Effect {
    name: "gauge_hysteresis",
    words: "the gauge follows another path on the way back",
    stage: Stage::Sensing,
    equation: "e -> e - h mean of (e - play(e, s {spread^2, spread, 1}))",
    parameters: &[
        EffectParameter::strength("h", "1", 0.0, 0.6, 0.2),
        EffectParameter::shape("s", "strain", 0.005, 0.06, 0.02),
        EffectParameter::form("spread", "1", 0.15, 0.95, Form { neutral: 0.5, usual: 0.5 }),
    ],
    action: |values, _| {
        let loops = Loops { h: values[0], s: values[1], spread: values[2] };
        Action::Strain(Box::new(PrandtlIshlinskii::new(loops)))
    },
    twins: &["sleeve_slip"],
    starts: Some(|_| pairs(0.1, [0.006, 0.016, 0.045])),
    sketch: Some(|v, around| loops([v[0], v[1], v[2]], around.strain())),
    ..Effect::PLAIN
};
