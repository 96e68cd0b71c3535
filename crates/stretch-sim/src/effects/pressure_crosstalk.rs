//! The pressure inside the muscle stretches the gauge.

use stretch_effects::{Operator, Span};

use crate::{
    effects::{Action, Effect, EffectParameter, Form, Need},
    sketch::crosstalk,
    stage::Stage,
};

/// The pressure inside the muscle stretches the gauge.
pub(super) static PRESSURE_CROSSTALK: Effect = Effect {
    name: "pressure_crosstalk",
    words: "the pressure itself strains the gauge",
    stage: Stage::Sensing,
    equation: "e -> e + c x (1 + bend (1 - x)), x = (p - P_atm)/P_ref",
    parameters: &[
        EffectParameter::strength("c", "strain", -0.05, 0.05, 0.01),
        EffectParameter::form("bend", "1", -0.6, 0.6, Form { neutral: 0.0, usual: 0.0 }),
    ],
    action: |values, around| {
        let scale_kpa = around.pressure_scale_kpa;
        Action::Strain(Box::new(Crosstalk {
            per_kpa: values[0] / scale_kpa,
            bend: values[1],
            scale_kpa,
        }))
    },
    twins: &["gauge_nonlinearity"],
    needs: Some(Need::Pressure),
    starts: Some(|_| vec![vec![0.003], vec![0.003, -0.4], vec![0.003, 0.4]]),
    sketch: Some(|v, around| crosstalk([v[0], v[1], around.pressure_scale_kpa], around.strain())),
    ..Effect::PLAIN
};

#[derive(Debug)]
struct Crosstalk {
    per_kpa: f64,
    bend: f64,
    scale_kpa: f64,
}

impl Operator for Crosstalk {
    fn run(&self, span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        for (e, p) in signal.iter_mut().zip(span.pressure_kpa) {
            *e += self.per_kpa * p * (1.0 + self.bend * (1.0 - p / self.scale_kpa));
        }
    }
}
