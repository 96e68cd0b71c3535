//! The catalogue of effects, one file each.

mod action;
mod catalogue;
mod effect;
mod parameter;
mod search;
mod set;
mod starts;

pub use action::{Action, Surroundings};
pub use catalogue::Catalogue;
pub use effect::{Alone, Effect, Extent, Find, Line, Measured, Need, Starts};
pub use parameter::{EffectParameter, Form, Role, Scale};
pub use search::Search;
pub use set::{ActiveEffect, EffectSet};

mod amplifier_lowpass;
mod amplifier_saturation;
mod chamber_volume;
mod channel_skew;
mod crossbeam_inertia;
mod gauge_hysteresis;
mod gauge_nonlinearity;
mod gauge_relaxation;
mod gauge_softening;
mod leak;
mod mains_hum;
mod muscle_creep;
mod muscle_hysteresis;
mod pot_backlash;
mod pot_nonlinearity;
mod pressure_crosstalk;
mod self_heating;
mod sleeve_slack;
mod sleeve_slip;
mod supply_sag;
mod thermal_drift;
mod valve_deadband;
mod valve_delay;

/// Every effect, in the order in which several of one stage act.
pub static CATALOGUE: &[&Effect] = &[
    &supply_sag::SUPPLY_SAG,
    &valve_delay::VALVE_DELAY,
    &valve_deadband::VALVE_DEADBAND,
    &leak::LEAK,
    &chamber_volume::CHAMBER_VOLUME,
    &muscle_hysteresis::MUSCLE_HYSTERESIS,
    &muscle_creep::MUSCLE_CREEP,
    &crossbeam_inertia::CROSSBEAM_INERTIA,
    &sleeve_slack::SLEEVE_SLACK,
    &sleeve_slip::SLEEVE_SLIP,
    &pressure_crosstalk::PRESSURE_CROSSTALK,
    &gauge_hysteresis::GAUGE_HYSTERESIS,
    &gauge_relaxation::GAUGE_RELAXATION,
    &gauge_softening::GAUGE_SOFTENING,
    &gauge_nonlinearity::GAUGE_NONLINEARITY,
    &thermal_drift::THERMAL_DRIFT,
    &self_heating::SELF_HEATING,
    &amplifier_saturation::AMPLIFIER_SATURATION,
    &amplifier_lowpass::AMPLIFIER_LOWPASS,
    &mains_hum::MAINS_HUM,
    &channel_skew::CHANNEL_SKEW,
    &pot_nonlinearity::POT_NONLINEARITY,
    &pot_backlash::POT_BACKLASH,
];

/// The catalogue's effect called `name`, if there is one.
///
/// ```
/// let effect = stretch_sim::effect_named("leak").unwrap();
/// assert_eq!(effect.parameters[0].name, "c");
/// ```
pub fn effect_named(name: &str) -> Option<&'static Effect> {
    CATALOGUE.iter().copied().find(|e| e.name == name)
}
