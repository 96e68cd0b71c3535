//! The crossbeam has a mass, on the spring of the muscle.

use stretch_effects::{Oscillator, Swing};

use crate::{
    effects::{Action, Effect, EffectParameter, Form, search::each},
    sketch::{MOVING, swinging},
    stage::Stage,
};

/// The crossbeam has a mass, on the spring of the muscle.
pub(super) static CROSSBEAM_INERTIA: Effect = Effect {
    name: "crossbeam_inertia",
    words: "the crossbeam's mass overshoots and rings",
    stage: Stage::Muscle,
    equation: "k'' = (k_lag - k)/m^2 - 2 damping k'/m behind the lag: natural frequency 1/(2 pi m)",
    parameters: &[
        EffectParameter::strength("m", "s", 0.0, 0.08, 0.02),
        EffectParameter::form("damping", "1", 0.1, 0.6, Form { neutral: 0.25, usual: 0.25 }),
    ],
    action: |values, around| {
        let swing = Swing { m: values[0], damping: values[1] };
        Action::MovingContraction(Box::new(Oscillator::new(swing, around.grid)))
    },
    twins: &["valve_delay"],
    starts: Some(|_| each([0.003, 0.01, 0.03])),
    sketch: Some(|v, around| swinging([v[0], v[1]], around.grid.dt_s(), MOVING)),
    ..Effect::PLAIN
};
