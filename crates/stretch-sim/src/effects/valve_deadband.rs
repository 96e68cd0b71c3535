//! The valves stay shut up to a least command.

use crate::{
    effects::{Action, Effect, EffectParameter, Surroundings},
    law::Law,
    stage::Stage,
};

/// The valves stay shut up to a least command.
#[derive(Debug)]
pub(super) struct ValveDeadband;

static PARAMETERS: &[EffectParameter] = &[EffectParameter::strength("u_db", "1", 0.0, 0.11, 0.03)];

impl Effect for ValveDeadband {
    fn name(&self) -> &'static str {
        "valve_deadband"
    }

    fn stage(&self) -> Stage {
        Stage::Pneumatics
    }

    fn equation(&self) -> &'static str {
        "u -> max(0, (u - u_db)/(1 - u_db)) before u_eff"
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        PARAMETERS
    }

    fn action(&self, values: &[f64], _around: &Surroundings<'_>) -> Action {
        Action::Opening(Box::new(Deadband { u_db: values[0] }))
    }
}

#[derive(Debug)]
struct Deadband {
    u_db: f64,
}

impl Law for Deadband {
    fn at(&self, x: f64) -> f64 {
        ((x - self.u_db) / (1.0 - self.u_db)).max(0.0)
    }
}
