//! Every kind of effect.

use crate::kind::Kind;

pub use crate::{
    bouc_wen::BOUC_WEN,
    bow::{CURVE, GAIN_CURVE},
    clock_drift::CLOCK_DRIFT,
    crosstalk::CROSSTALK,
    dahl::{DAHL_FRICTION, LOAD_DAHL_FRICTION, PLAY_FRICTION},
    dead_zone::DEAD_ZONE,
    drift::GAIN_DRIFT,
    fading::RELAXATION,
    flexible_joint::FLEXIBLE_JOINT,
    friction::{COULOMB_FRICTION, STRIBECK_FRICTION, VISCOUS_FRICTION},
    hold_band::FIRMWARE_DEAD_BAND,
    hum::HUM,
    knees::SATURATION,
    load_friction::LOAD_FRICTION,
    lowpass::LAG,
    offset::{DRIFT, OFFSET},
    oscillator::SECOND_ORDER_LAG,
    play::BACKLASH,
    prandtl_ishlinskii::HYSTERESIS,
    profile::PROFILE,
    quantiser::QUANTISATION,
    skew::{DELAY, SKEW},
    slew_limit::SLEW_LIMIT,
    softening::SOFTENING,
    torque_speed::TORQUE_SPEED_LIMIT,
    warming::WARMING,
};

/// Every kind, in the order in which they act where several are on one channel.
pub static KINDS: &[&Kind] = &[
    &COULOMB_FRICTION,
    &VISCOUS_FRICTION,
    &STRIBECK_FRICTION,
    &LOAD_FRICTION,
    &DAHL_FRICTION,
    &LOAD_DAHL_FRICTION,
    &PLAY_FRICTION,
    &TORQUE_SPEED_LIMIT,
    &FIRMWARE_DEAD_BAND,
    &DEAD_ZONE,
    &BACKLASH,
    &HYSTERESIS,
    &BOUC_WEN,
    &CURVE,
    &GAIN_CURVE,
    &SOFTENING,
    &GAIN_DRIFT,
    &WARMING,
    &CROSSTALK,
    &SLEW_LIMIT,
    &PROFILE,
    &LAG,
    &SECOND_ORDER_LAG,
    &FLEXIBLE_JOINT,
    &RELAXATION,
    &SATURATION,
    &OFFSET,
    &DRIFT,
    &DELAY,
    &SKEW,
    &CLOCK_DRIFT,
    &HUM,
    &QUANTISATION,
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
