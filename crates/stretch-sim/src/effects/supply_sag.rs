//! The supply gives way to the flow that is drawn from it.

use crate::{
    effects::{Action, Effect, EffectParameter, Surroundings},
    law::Droop,
    stage::Stage,
};

/// The supply gives way to the flow that is drawn from it.
#[derive(Debug)]
pub(super) struct SupplySag;

static PARAMETERS: &[EffectParameter] = &[EffectParameter::strength("r", "Pa s/kg", 0.0, 4e8, 1e8)];

impl Effect for SupplySag {
    fn name(&self) -> &'static str {
        "supply_sag"
    }

    fn stage(&self) -> Stage {
        Stage::Pneumatics
    }

    fn equation(&self) -> &'static str {
        "P_s -> P_s - y, y = mean_rev(r q_in, 0.5 s)"
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        PARAMETERS
    }

    fn action(&self, values: &[f64], _around: &Surroundings<'_>) -> Action {
        Action::Droop(Box::new(Sag { r: values[0] }))
    }
}

/// Time constant of the supply, s.
const TAU_S: f64 = 0.5;

#[derive(Debug)]
struct Sag {
    r: f64,
}

impl Droop for Sag {
    #[inline]
    fn rate(&self, droop_pa: f64, flow_kg_s: f64) -> f64 {
        (self.r * flow_kg_s - droop_pa) / TAU_S
    }

    fn relaxed(&self, droop_pa: f64, rest_s: f64) -> f64 {
        droop_pa * libm::exp(-rest_s / TAU_S)
    }
}
