//! What a stretch sensor and its reference do: kinds at the places of a gauge.

use crate::{
    bow::{GAUGE_NONLINEARITY, POT_NONLINEARITY},
    crosstalk::PRESSURE_CROSSTALK,
    drift::THERMAL_DRIFT,
    effect::Effect,
    fading::GAUGE_RELAXATION,
    hum::MAINS_HUM,
    knees::{AMPLIFIER_SATURATION, SLEEVE_SLACK},
    lowpass::AMPLIFIER_LOWPASS,
    play::{POT_BACKLASH, SLEEVE_SLIP},
    prandtl_ishlinskii::GAUGE_HYSTERESIS,
    skew::CHANNEL_SKEW,
    softening::GAUGE_SOFTENING,
    warming::SELF_HEATING,
};

/// Effects of a gauge and of its reference, in the order in which they act.
pub static GAUGE: &[&Effect] = &[
    &SLEEVE_SLACK,
    &SLEEVE_SLIP,
    &PRESSURE_CROSSTALK,
    &GAUGE_HYSTERESIS,
    &GAUGE_RELAXATION,
    &GAUGE_SOFTENING,
    &GAUGE_NONLINEARITY,
    &THERMAL_DRIFT,
    &SELF_HEATING,
    &AMPLIFIER_SATURATION,
    &AMPLIFIER_LOWPASS,
    &MAINS_HUM,
    &CHANNEL_SKEW,
    &POT_NONLINEARITY,
    &POT_BACKLASH,
];

/// The effect of a gauge or its reference called `name`.
pub fn gauge_effect(name: &str) -> Option<&'static Effect> {
    GAUGE.iter().copied().find(|effect| effect.name == name)
}
