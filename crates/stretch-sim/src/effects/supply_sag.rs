//! The supply pressure falls with the flow that is drawn from it.

use stretch_effects::{
    Action, Acts, Droop, Effect, EffectParameter, Form, Quantity, RigStage, Sketch, each,
};

/// The supply pressure falls with the flow that is drawn from it.
pub(super) static SUPPLY_SAG: Effect = Effect {
    name: "supply_sag",
    title: "the supply's sag",
    words: "the supply pressure sags while air is drawn",
    stage: RigStage::Pneumatics,
    equation: "P_s -> P_s - y, y = mean_rev(r q_in, lag_s)",
    parameters: &[
        EffectParameter::strength("r", "Pa s/kg", 0.0, 4e8, 1e8),
        EffectParameter::form("lag_s", "s", 0.1, 1.5, Form { neutral: 0.5, usual: 0.5 }).log(),
    ],
    acts: Acts::Own {
        action: |values, _| Action::Droop(Box::new(Sag { r: values[0], lag_s: values[1] })),
        sketch: Some(|v, _| {
            let state =
                "how far the supply has fallen: a state of the chamber's equations, 0 at rest";
            let rate = "rate of the droop; the valve sees P_s - droop";
            Sketch::of(Quantity::new("droop", "Pa", state), "let y = (R * flow - droop) / LAG")
                .beside(Quantity::new("flow", "kg/s", "mass flow through the inlet"))
                .giving(Quantity::new("y", "Pa/s", rate))
                .with_all(&[("R", v[0], "Pa s/kg"), ("LAG", v[1], "s")])
        }),
    },
    starts: Some(|_| each([3e7, 1.5e8])),
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
