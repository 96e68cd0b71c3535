//! The valves stay shut up to a least command.

use stretch_effects::DeadBand;

use crate::{
    effects::{Action, Effect, EffectParameter, Form, search::each},
    sketch::{Band, dead_band},
    stage::Stage,
};

/// The valves stay shut up to a least command.
pub(super) static VALVE_DEADBAND: Effect = Effect {
    name: "valve_deadband",
    words: "the valves stay shut at small openings",
    stage: Stage::Pneumatics,
    equation: "u -> max(0, (u - d(u))/(1 - d(1))), d(u) = u_db (1 - exp(-u/(u_db softness))) before u_eff; conductance times 1 - exp(-u/(u_db gate)); u_db times outlet at the outlet, times 2 - outlet at the inlet",
    parameters: &[
        EffectParameter::strength("u_db", "1", 0.0, 0.11, 0.03),
        EffectParameter::form("softness", "1", 0.02, 1.5, Form { neutral: 0.0, usual: 0.1 }).log(),
        EffectParameter::form("gate", "1", 0.001, 2.0, Form { neutral: 0.0, usual: 0.01 }).log(),
        EffectParameter::form("outlet", "1", 0.0, 2.0, Form { neutral: 1.0, usual: 1.0 }),
    ],
    action: |values, around| {
        let &[u_db, softness, gate, outlet] = values else { return Action::Nothing };
        let least = around.least_opening;
        let valve = |share: f64| DeadBand { u_db: share * u_db, softness, gate, least };
        Action::Commands([Box::new(valve(2.0 - outlet)), Box::new(valve(outlet))])
    },
    starts: Some(|_| starts()),
    sketch: Some(|v, around| {
        let &[u_db, softness, gate, outlet] = v else { return dead_band(&Band::default()) };
        dead_band(&Band { u_db, softness, gate, outlet, least: around.least_opening })
    }),
    ..Effect::PLAIN
};

/// Hard and gradual bands, valves that differ, and a gate that lets the slowest ramp through as pulses.
fn starts() -> Vec<Vec<f64>> {
    let mut all = each([0.001, 0.01, 0.04]);
    all.extend([0.02, 0.06].map(|u| vec![u, 1.0, 0.01, 1.0]));
    all.extend([0.01, 0.03].map(|u| vec![u, 1.0, 0.01, 1.9]));
    all.extend([0.005, 0.015].map(|u| vec![u, 0.5, 0.5, 1.0]));
    all
}
