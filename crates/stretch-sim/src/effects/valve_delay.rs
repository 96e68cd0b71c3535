//! The valves act late.

use crate::{
    effects::{Action, Effect, EffectParameter, search::each},
    sketch::delayed,
    stage::Stage,
};

/// The valves act late.
pub(super) static VALVE_DELAY: Effect = Effect {
    name: "valve_delay",
    words: "the valves act late",
    stage: Stage::Pneumatics,
    equation: "u(t) -> u(t - delay_s)",
    parameters: &[EffectParameter::strength("delay_s", "s", 0.0, 0.12, 0.03)],
    action: |values, _| Action::Delay(values[0]),
    twins: &["crossbeam_inertia"],
    starts: Some(|_| each([0.004, 0.015, 0.05])),
    sketch: Some(|v, around| delayed(v[0], around.grid.dt_s())),
    ..Effect::PLAIN
};
