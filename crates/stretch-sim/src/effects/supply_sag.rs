//! The supply gives way to the flow that is drawn from it.

use crate::{
    effects::{Action, Effect, EffectParameter, Form, search::each},
    law::Droop,
    sketch::droop,
    stage::Stage,
};

/// The supply gives way to the flow that is drawn from it.
pub(super) static SUPPLY_SAG: Effect = Effect {
    name: "supply_sag",
    words: "the supply pressure sags while air is drawn",
    stage: Stage::Pneumatics,
    equation: "P_s -> P_s - y, y = mean_rev(r q_in, lag_s)",
    parameters: &[
        EffectParameter::strength("r", "Pa s/kg", 0.0, 4e8, 1e8),
        EffectParameter::form("lag_s", "s", 0.1, 1.5, Form { neutral: 0.5, usual: 0.5 }).log(),
    ],
    action: |values, _| Action::Droop(Box::new(Sag { r: values[0], lag_s: values[1] })),
    starts: Some(|_| each([3e7, 1.5e8])),
    sketch: Some(|v, _| droop([v[0], v[1]])),
    ..Effect::PLAIN
};

#[derive(Debug)]
struct Sag {
    r: f64,
    lag_s: f64,
}

impl Droop for Sag {
    #[inline]
    fn rate(&self, droop_pa: f64, flow_kg_s: f64) -> f64 {
        (self.r * flow_kg_s - droop_pa) / self.lag_s
    }

    fn relaxed(&self, droop_pa: f64, rest_s: f64) -> f64 {
        droop_pa * libm::exp(-rest_s / self.lag_s)
    }
}
