//! The channels are not sampled at the same time.

use stretch_effects::SkewSpec;

use crate::{
    effects::{Action, Effect, EffectParameter, Form, search::each},
    sketch::skewed,
    stage::Stage,
};

/// The channels are not sampled at the same time.
pub(super) static CHANNEL_SKEW: Effect = Effect {
    name: "channel_skew",
    words: "the bridge is sampled earlier or later than the length",
    stage: Stage::Sensing,
    equation: "bridge samples show the length of skew_s + rate t earlier, t since the trial began, first and last value held",
    parameters: &[
        EffectParameter::strength("skew_s", "s", -0.1, 0.2, 0.02),
        EffectParameter::form("rate", "s/s", -5e-4, 5e-4, Form { neutral: 0.0, usual: 0.0 }),
    ],
    action: |values, _| Action::Skew(SkewSpec { skew_s: values[0], rate: values[1] }),
    twins: &["amplifier_lowpass"],
    // Two recorders may be started by two hands.
    alone: |alone, search| {
        search.reach(1.0);
        let more = [alone.lag_s, 0.9 * alone.lag_s, -0.15, 0.2];
        search.starts.extend(more.map(|skew_s| vec![skew_s, 0.0]));
    },
    starts: Some(|_| starts()),
    sketch: Some(|v, around| skewed([v[0], v[1]], around.grid.dt_s(), around.record())),
    ..Effect::PLAIN
};

/// Late or early by as much throughout, and two clocks that part.
fn starts() -> Vec<Vec<f64>> {
    let mut all = each([-0.02, -0.004, 0.004, 0.02, 0.08]);
    all.extend([-1e-4, 1e-4].map(|rate| vec![0.002, rate]));
    all
}
