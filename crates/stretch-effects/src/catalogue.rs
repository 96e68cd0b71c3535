//! The catalogue: every kind of effect, and the effects of a gauge and of its reference.

use crate::{
    bow::{GAUGE_NONLINEARITY, POT_NONLINEARITY},
    crosstalk::PRESSURE_CROSSTALK,
    drift::THERMAL_DRIFT,
    effect::Effect,
    fading::{GAUGE_RELAXATION, SELF_HEATING},
    hum::MAINS_HUM,
    hysteresis::GAUGE_HYSTERESIS,
    kind::Kind,
    knees::{AMPLIFIER_SATURATION, SLEEVE_SLACK},
    lowpass::AMPLIFIER_LOWPASS,
    play::{POT_BACKLASH, SLEEVE_SLIP},
    skew::CHANNEL_SKEW,
    softening::GAUGE_SOFTENING,
};

/// Every kind by its own name.
pub mod kinds {
    pub use crate::{
        bow::{CURVE, GAIN_CURVE},
        crosstalk::CROSSTALK,
        dahl::{DAHL_FRICTION, LOAD_DAHL_FRICTION, PLAY_FRICTION},
        dead_zone::{DEAD_ZONE, FIRMWARE_DEAD_BAND, QUANTISATION},
        drift::{DRIFT, GAIN_DRIFT, OFFSET},
        fading::{RELAXATION, WARMING},
        friction::{
            COULOMB_FRICTION, LOAD_FRICTION, STRIBECK_FRICTION, TORQUE_SPEED_LIMIT,
            VISCOUS_FRICTION,
        },
        hum::HUM,
        hysteresis::{BOUC_WEN, HYSTERESIS},
        knees::SATURATION,
        lowpass::LAG,
        oscillator::{FLEXIBLE_JOINT, SECOND_ORDER_LAG},
        play::BACKLASH,
        profile::{PROFILE, SLEW_LIMIT},
        skew::{CLOCK_DRIFT, DELAY, SKEW},
        softening::SOFTENING,
    };
}

/// Every kind, in the order in which they act where several are on one channel.
pub static KINDS: &[&Kind] = &[
    &kinds::COULOMB_FRICTION,
    &kinds::VISCOUS_FRICTION,
    &kinds::STRIBECK_FRICTION,
    &kinds::LOAD_FRICTION,
    &kinds::DAHL_FRICTION,
    &kinds::LOAD_DAHL_FRICTION,
    &kinds::PLAY_FRICTION,
    &kinds::TORQUE_SPEED_LIMIT,
    &kinds::FIRMWARE_DEAD_BAND,
    &kinds::DEAD_ZONE,
    &kinds::BACKLASH,
    &kinds::HYSTERESIS,
    &kinds::BOUC_WEN,
    &kinds::CURVE,
    &kinds::GAIN_CURVE,
    &kinds::SOFTENING,
    &kinds::GAIN_DRIFT,
    &kinds::WARMING,
    &kinds::CROSSTALK,
    &kinds::SLEW_LIMIT,
    &kinds::PROFILE,
    &kinds::LAG,
    &kinds::SECOND_ORDER_LAG,
    &kinds::FLEXIBLE_JOINT,
    &kinds::RELAXATION,
    &kinds::SATURATION,
    &kinds::OFFSET,
    &kinds::DRIFT,
    &kinds::DELAY,
    &kinds::SKEW,
    &kinds::CLOCK_DRIFT,
    &kinds::HUM,
    &kinds::QUANTISATION,
];

/// The kind of that name.
///
/// ```
/// use stretch_effects::{Extent, Grid, Operator, Span, kind_named};
/// let scale = kind_named("curve").unwrap();
/// let (grid, mut shown) = (Grid::samples(0.01)?, [0.0, 15.0, 30.0]);
/// let bent = (scale.operator)(&[0.5, 0.0], &Extent::between(0.0, 30.0), &grid);
/// bent.run(&Span::whole(&grid), &mut [], &mut shown);
/// assert_eq!(shown, [0.0, 15.5, 30.0]);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
pub fn kind_named(name: &str) -> Option<&'static Kind> {
    KINDS.iter().copied().find(|kind| kind.name == name)
}

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
