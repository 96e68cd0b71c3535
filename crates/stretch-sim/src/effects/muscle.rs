//! Effects of the muscle and the crossbeam that it lifts: kinds at the places of the muscle.

use stretch_effects::{
    Acts, Effect, EffectParameter, Form, Place, RigStage, each,
    kinds::{HYSTERESIS, RELAXATION, SECOND_ORDER_LAG},
    pairs,
};

/// Friction in the braid: the static contraction depends on its history.
pub(super) static MUSCLE_HYSTERESIS: Effect = Effect {
    name: "muscle_hysteresis",
    title: "the muscle's hysteresis",
    words: "the muscle follows another path on the way back",
    stage: RigStage::Muscle,
    equation: "k_s -> k_s - h mean of (k_s - play(k_s, s {spread^2, spread, 1}))",
    parameters: &[
        EffectParameter::strength("h", "1", 0.0, 0.6, 0.2),
        EffectParameter::shape("s", "strain", 0.005, 0.06, 0.02),
        EffectParameter::form("spread", "1", 0.15, 0.95, Form { neutral: 0.5, usual: 0.5 }),
    ],
    acts: Acts::at(&HYSTERESIS, Place::StaticContraction),
    twins: &["muscle_creep"],
    starts: Some(|_| pairs(0.1, [0.007, 0.02, 0.05])),
    ..Effect::PLAIN
};

/// The rubber of the muscle creeps.
pub(super) static MUSCLE_CREEP: Effect = Effect {
    name: "muscle_creep",
    title: "the muscle's creep",
    words: "the muscle creeps on after the pressure has settled",
    stage: RigStage::Muscle,
    equation: "k_s -> k_s + c (mean of mean_rev(k_s, tau {1/spread, 1, spread}) - k_s)",
    parameters: &[
        EffectParameter::strength("c", "1", 0.0, 0.3, 0.1),
        EffectParameter::shape("tau", "s", 0.5, 40.0, 4.0),
        EffectParameter::form("spread", "1", 1.0, 8.0, Form { neutral: 1.0, usual: 1.6 }).log(),
    ],
    acts: Acts::with(&RELAXATION, Place::StaticContraction, |v, _| vec![-v[0], v[1], v[2]]),
    twins: &["muscle_hysteresis"],
    starts: Some(|_| pairs(0.05, [0.6, 2.0, 6.0, 20.0])),
    ..Effect::PLAIN
};

/// The crossbeam has a mass, on the spring of the muscle.
pub(super) static CROSSBEAM_INERTIA: Effect = Effect {
    name: "crossbeam_inertia",
    title: "the crossbeam's inertia",
    words: "the crossbeam's mass overshoots and rings",
    stage: RigStage::Muscle,
    equation: "k'' = (k_lag - k - dry k'/sqrt(k'^2 + (0.5 dry/m)^2))/m^2 - (2 damping + drag |k'|) k'/m behind the lag: natural frequency 1/(2 pi m)",
    parameters: &[
        EffectParameter::strength("m", "s", 0.0, 0.08, 0.02),
        EffectParameter::form("damping", "1", 0.1, 0.6, Form { neutral: 0.25, usual: 0.25 }),
        EffectParameter::form("drag", "s", 0.0, 1.25, Form { neutral: 0.0, usual: 0.1 }),
        EffectParameter::form("dry", "strain", 0.0, 0.002, Form { neutral: 0.0, usual: 0.0003 }),
    ],
    acts: Acts::at(&SECOND_ORDER_LAG, Place::MovingContraction),
    twins: &["valve_delay"],
    starts: Some(|_| each([0.003, 0.01, 0.03])),
    ..Effect::PLAIN
};
