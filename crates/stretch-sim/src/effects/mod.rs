//! The catalogue of effects, one file each.

mod effect;
mod set;

pub use effect::{Action, Effect, EffectParameter, Scale, Surroundings};
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
pub static CATALOGUE: &[&dyn Effect] = &[
    &supply_sag::SupplySag,
    &valve_delay::ValveDelay,
    &valve_deadband::ValveDeadband,
    &leak::Leak,
    &chamber_volume::ChamberVolume,
    &muscle_hysteresis::MuscleHysteresis,
    &muscle_creep::MuscleCreep,
    &crossbeam_inertia::CrossbeamInertia,
    &sleeve_slack::SleeveSlack,
    &sleeve_slip::SleeveSlip,
    &pressure_crosstalk::PressureCrosstalk,
    &gauge_hysteresis::GaugeHysteresis,
    &gauge_relaxation::GaugeRelaxation,
    &gauge_softening::GaugeSoftening,
    &gauge_nonlinearity::GaugeNonlinearity,
    &thermal_drift::ThermalDrift,
    &self_heating::SelfHeating,
    &amplifier_saturation::AmplifierSaturation,
    &amplifier_lowpass::AmplifierLowpass,
    &mains_hum::MainsHum,
    &channel_skew::ChannelSkew,
    &pot_nonlinearity::PotNonlinearity,
    &pot_backlash::PotBacklash,
];

/// The catalogue's effect called `name`, if there is one.
///
/// ```
/// let effect = stretch_sim::effect_named("leak").unwrap();
/// assert_eq!(effect.parameters()[0].name, "c");
/// ```
pub fn effect_named(name: &str) -> Option<&'static dyn Effect> {
    CATALOGUE.iter().copied().find(|e| e.name() == name)
}
