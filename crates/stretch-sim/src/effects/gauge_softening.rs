//! The gauge softens as it is worked.

use stretch_effects::Softening;

use crate::{
    effects::{Action, Effect, EffectParameter, Form, search::pairs},
    sketch::{Soft, softening},
    stage::Stage,
};

/// The gauge softens as it is worked.
pub(super) static GAUGE_SOFTENING: Effect = Effect {
    name: "gauge_softening",
    words: "the gauge's response weakens with the distance travelled",
    stage: Stage::Sensing,
    equation: "R - R0 -> (R - R0)(1 - m (1 - (1 + tail travel/n)^(-1/tail))), exp(-travel/n) at a tail of 0; travel: summed abs strain change since the session began",
    parameters: &[
        EffectParameter::strength("m", "1", 0.0, 0.3, 0.1),
        EffectParameter::shape("n", "strain", 0.3, 20.0, 2.5),
        EffectParameter::form("tail", "1", 0.05, 2.5, Form { neutral: 0.0, usual: 1.0 / 3.0 })
            .log(),
    ],
    action: |values, around| {
        Action::Resistance(Box::new(Softening {
            m: values[0],
            n: values[1],
            tail: values[2],
            zero: around.resistance_zero,
            reversal: REVERSAL * around.strain_unit,
        }))
    },
    counts_session: true,
    starts: Some(|_| pairs(0.03, [0.5, 2.5, 12.0])),
    sketch: Some(|v, around| {
        let soft = Soft {
            m: v[0],
            n: v[1],
            tail: v[2],
            zero: around.resistance_zero,
            reversal: REVERSAL * around.strain_unit,
        };
        softening(&soft, around.resistance(), around.strain_beside())
    }),
    ..Effect::PLAIN
};

/// Reversals smaller than this strain do not travel: noise alone would go a long way.
const REVERSAL: f64 = 5e-4;
