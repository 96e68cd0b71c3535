//! The amplifier is slow.

use stretch_effects::{Lowpass, Poles};

use crate::{
    effects::{Action, Effect, EffectParameter, Form, search::each},
    sketch::lowpass,
    stage::Stage,
};

/// The amplifier is slow.
pub(super) static AMPLIFIER_LOWPASS: Effect = Effect {
    name: "amplifier_lowpass",
    words: "the amplifier is slow",
    stage: Stage::Sensing,
    equation: "v -> mean_rev(mean_rev(v, tau (1 - second)), tau second)",
    parameters: &[
        EffectParameter::strength("tau", "s", 0.0, 0.4, 0.05),
        EffectParameter::form("second", "1", 0.0, 0.5, Form { neutral: 0.0, usual: 0.1 }),
    ],
    action: |values, around| {
        let poles = Poles { tau_s: values[0], second: values[1] };
        Action::Volts(Box::new(Lowpass::new(poles, around.grid)))
    },
    twins: &["channel_skew", "gauge_relaxation"],
    needs_fine_steps: true,
    starts: Some(|_| each([0.004, 0.02, 0.08])),
    sketch: Some(|v, around| lowpass([v[0], v[1]], around.grid.dt_s(), around.volts())),
    ..Effect::PLAIN
};
