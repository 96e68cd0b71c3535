//! The catalogue of the rig's effects: those inside its differential equation are defined here, the
//! others are kinds at its places.

use stretch_effects::{Effect, GAUGE};

mod catalogue;
mod set;

mod chamber_volume;
mod leak;
mod muscle;
mod supply_sag;
mod valve_deadband;
mod valve_delay;

pub use catalogue::Catalogue;
pub use set::{ActiveEffect, EffectSet};

/// Effects of valves, chamber and muscle.
static ACTUATION: [&Effect; 8] = [
    &supply_sag::SUPPLY_SAG,
    &valve_delay::VALVE_DELAY,
    &valve_deadband::VALVE_DEADBAND,
    &leak::LEAK,
    &chamber_volume::CHAMBER_VOLUME,
    &muscle::MUSCLE_HYSTERESIS,
    &muscle::MUSCLE_CREEP,
    &muscle::CROSSBEAM_INERTIA,
];

/// Every effect, in the order in which several of one stage act: those of the actuation, then those of the gauge.
pub static CATALOGUE: &[&Effect] = &joined();

const fn joined() -> [&'static Effect; ACTUATION.len() + GAUGE.len()] {
    let mut all = [ACTUATION[0]; ACTUATION.len() + GAUGE.len()];
    let mut i = 0;
    while i < all.len() {
        all[i] = if i < ACTUATION.len() { ACTUATION[i] } else { GAUGE[i - ACTUATION.len()] };
        i += 1;
    }
    all
}

/// The catalogue's effect called `name`, if there is one.
///
/// ```
/// let effect = stretch_sim::effect_named("leak").unwrap();
/// assert_eq!(effect.parameters[0].name, "c");
/// ```
pub fn effect_named(name: &str) -> Option<&'static Effect> {
    CATALOGUE.iter().copied().find(|e| e.name == name)
}
