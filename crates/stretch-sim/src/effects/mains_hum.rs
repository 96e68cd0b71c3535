//! The mains couple into the bridge.

use std::f64::consts::TAU;

use stretch_operators::{Operator, Span};

use crate::{
    effects::{Action, Effect, EffectParameter, Scale, Surroundings},
    stage::Stage,
};

/// The mains couple into the bridge.
#[derive(Debug)]
pub(super) struct MainsHum;

static PARAMETERS: &[EffectParameter] = &[
    EffectParameter::strength("a", "V", 0.0, 0.1, 0.02),
    EffectParameter { scale: Scale::Linear, ..EffectParameter::shape("f", "Hz", 50.0, 60.0, 50.0) },
    EffectParameter {
        scale: Scale::Linear,
        ..EffectParameter::shape("phase", "rad", -TAU, TAU, 0.0)
    },
];

impl Effect for MainsHum {
    fn name(&self) -> &'static str {
        "mains_hum"
    }

    fn stage(&self) -> Stage {
        Stage::Sensing
    }

    fn equation(&self) -> &'static str {
        "v -> v + a sin(2 pi f t + phase), not skewed"
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        PARAMETERS
    }

    fn action(&self, values: &[f64], _around: &Surroundings<'_>) -> Action {
        Action::Record(Box::new(Hum { a: values[0], f: values[1], phase: values[2] }))
    }
}

#[derive(Debug)]
struct Hum {
    a: f64,
    f: f64,
    phase: f64,
}

impl Operator for Hum {
    fn run(&self, span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        // Samples, not nodes: a rotation by the same angle each, exact again every 256 samples.
        let turn = TAU * self.f * span.grid.dt_s();
        let (sin_turn, cos_turn) = (libm::sin(turn), libm::cos(turn));
        for (block, samples) in signal.chunks_mut(256).enumerate() {
            let sample = span.first_node / span.grid.pieces() + 256 * block;
            let t = span.start_s + sample as f64 * span.grid.dt_s();
            // Whole turns are taken off before the angle grows large.
            let turns = self.f * t;
            let angle = TAU * (turns - turns.floor()) + self.phase;
            let (mut sin, mut cos) = (libm::sin(angle), libm::cos(angle));
            for v in samples {
                *v += self.a * sin;
                (sin, cos) = (sin * cos_turn + cos * sin_turn, cos * cos_turn - sin * sin_turn);
            }
        }
    }
}
