//! The gauge overshoots a quick strain and relaxes.

use stretch_effects::{FadingMemory, Times};

use crate::{
    effects::{Action, Effect, EffectParameter, Form, search::pairs},
    sketch::fading,
    stage::Stage,
};

/// The gauge overshoots a quick strain and relaxes.
pub(super) static GAUGE_RELAXATION: Effect = Effect {
    name: "gauge_relaxation",
    words: "the gauge relaxes (or overshoots) after a change of strain",
    stage: Stage::Sensing,
    equation: "e -> e + c (e - mean of mean_rev(e, tau {1/spread, 1, spread}))",
    parameters: &[
        EffectParameter::strength("c", "1", -0.3, 0.6, 0.1),
        EffectParameter::shape("tau", "s", 0.02, 4.0, 0.3),
        EffectParameter::form("spread", "1", 1.0, 8.0, Form { neutral: 1.0, usual: 1.6 }).log(),
    ],
    action: |values, around| {
        let times = Times { tau_s: values[1], spread: values[2] };
        let memory = FadingMemory::new(values[0], times, around.strain_stroke, around.grid);
        Action::Strain(Box::new(memory))
    },
    twins: &["amplifier_lowpass"],
    // A gauge that is no foil gives way by more of a step, and more slowly.
    alone: |_, search| {
        search.reach(0.6);
        search.ranges[1][1] = 20.0;
        let slow = search.starts.last().map(|s| [&[s[0], 10.0], &s[2..]].concat());
        search.starts.extend(slow);
    },
    starts: Some(|_| pairs(0.05, [0.03, 0.1, 0.35, 1.2, 3.5])),
    sketch: Some(|v, around| fading([v[0], v[1], v[2]], around.grid.dt_s(), around.strain())),
    ..Effect::PLAIN
};
