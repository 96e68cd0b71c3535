//! The chamber grows as the muscle contracts.

use crate::{
    effects::{Action, Effect, EffectParameter, Form, search::each},
    law::Law,
    sketch::growth,
    stage::Stage,
};

/// The chamber grows as the muscle contracts.
pub(super) static CHAMBER_VOLUME: Effect = Effect {
    name: "chamber_volume",
    words: "the chamber's volume grows as the muscle contracts",
    stage: Stage::Pneumatics,
    equation: "V = V0 (1 + g y (1 + bend (1 - y))), y = k/k_max, with the p dV/dt term",
    parameters: &[
        EffectParameter::strength("g", "1", 0.0, 3.0, 1.0),
        EffectParameter::form("bend", "1", -0.7, 0.7, Form { neutral: 0.0, usual: 0.0 }),
    ],
    action: |values, _| Action::Volume(Box::new(Growth { g: values[0], bend: values[1] })),
    starts: Some(|_| each([0.1, 1.0])),
    sketch: Some(|v, _| growth([v[0], v[1]])),
    ..Effect::PLAIN
};

#[derive(Debug)]
struct Growth {
    g: f64,
    bend: f64,
}

impl Law for Growth {
    #[inline]
    fn at(&self, y: f64) -> f64 {
        1.0 + self.g * y * (1.0 + self.bend * (1.0 - y))
    }
}
