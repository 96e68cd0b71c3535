//! The mains couple into the bridge.

use std::f64::consts::{FRAC_PI_4, TAU};

use stretch_effects::{Hum, WanderingLine};

use crate::{
    effects::{Action, Effect, EffectParameter, Line, Measured, Role},
    sketch::hum,
    stage::Stage,
};

/// The mains couple into the bridge.
pub(super) static MAINS_HUM: Effect = Effect {
    name: "mains_hum",
    words: "mains hum is picked up",
    stage: Stage::Sensing,
    equation: "v -> v + a sin(2 pi f t + phase), not skewed",
    parameters: &[
        EffectParameter::strength("a", "V", 0.0, 0.1, 0.02),
        EffectParameter::shape("f", "Hz", 50.0, 60.0, 50.0).linear().with_role(Role::Choice),
        // On samples at twice the mains' frequency a hum is as large as the sine of its phase: one that stands for all.
        EffectParameter::shape("phase", "rad", -TAU, TAU, 0.0)
            .linear()
            .with_role(Role::Found { stand_in: FRAC_PI_4 }),
    ],
    action: |values, _| {
        Action::Record(Box::new(Hum { a: values[0], f_hz: values[1], phase: values[2] }))
    },
    find: Some(wandering),
    line: Some(|values| Line { hertz: values[1], amplitude: values[0] }),
    // At fs the hum shows at |f - k fs|. From 1.5 f on that is a third of fs at least and f/2 = 25 Hz at least, where no muscle
    // moves; a slower record shows it anywhere, down to a slow wave that passes for motion or drift.
    shown_from_hz: Some(|values| 1.5 * values[1]),
    starts: Some(|_| {
        [50.0, 60.0].iter().flat_map(|f| [0.002, 0.02].map(|a| vec![a, *f])).collect()
    }),
    sketch: Some(|v, around| hum([v[0], v[1], v[2]], around.record())),
    ..Effect::PLAIN
};

fn wandering(values: &[f64], record: &Measured<'_>, simulated: &mut [f64]) {
    let line = WanderingLine { a: values[0] * record.unit, f_hz: values[1] };
    line.follow(record.samples, record.noise, record.dt_s, simulated);
}
