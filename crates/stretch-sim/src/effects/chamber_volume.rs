//! The chamber grows as the muscle contracts.

use stretch_effects::{
    Action, Acts, Effect, EffectParameter, Form, Law, Quantity, RigStage, Sketch, each,
};

/// The chamber grows as the muscle contracts.
pub(super) static CHAMBER_VOLUME: Effect = Effect {
    name: "chamber_volume",
    title: "the chamber's growing volume",
    words: "the chamber's volume grows as the muscle contracts",
    stage: RigStage::Pneumatics,
    equation: "V = V0 (1 + g y (1 + bend (1 - y))), y = k/k_max, with the p dV/dt term",
    parameters: &[
        EffectParameter::strength("g", "1", 0.0, 3.0, 1.0),
        EffectParameter::form("bend", "1", -0.7, 0.7, Form { neutral: 0.0, usual: 0.0 }),
    ],
    acts: Acts::Own {
        action: |values, _| Action::Volume(Box::new(Growth { g: values[0], bend: values[1] })),
        sketch: Some(|v, _| {
            let body = "let y = 1 + G * x * (1 + BEND * (1 - x))";
            let volume = "V/V0; p = m R T/V then has the p dV/dt term in it";
            Sketch::of(Quantity::new("x", "1", "contraction k/k_max"), body)
                .giving(Quantity::new("y", "1", volume))
                .with_all(&[("G", v[0], "1"), ("BEND", v[1], "1")])
        }),
    },
    starts: Some(|_| each([0.1, 1.0])),
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
