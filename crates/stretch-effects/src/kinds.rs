//! Every kind of effect.

use crate::kind::Kind;

pub use crate::{
    bouc_wen::BOUC_WEN,
    bow::{CURVE, GAIN_CURVE},
    crosstalk::CROSSTALK,
    dead_zone::DEAD_ZONE,
    drift::GAIN_DRIFT,
    fading::RELAXATION,
    friction::{COULOMB_FRICTION, STRIBECK_FRICTION, VISCOUS_FRICTION},
    hum::HUM,
    knees::SATURATION,
    lowpass::LAG,
    offset::{DRIFT, OFFSET},
    oscillator::SECOND_ORDER_LAG,
    play::BACKLASH,
    prandtl_ishlinskii::HYSTERESIS,
    quantiser::QUANTISATION,
    skew::{DELAY, SKEW},
    slew_limit::SLEW_LIMIT,
    softening::SOFTENING,
    warming::WARMING,
};

/// Every kind, in the order in which they act where several are on one channel.
pub static KINDS: &[&Kind] = &[
    &COULOMB_FRICTION,
    &VISCOUS_FRICTION,
    &STRIBECK_FRICTION,
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
    &LAG,
    &SECOND_ORDER_LAG,
    &RELAXATION,
    &SATURATION,
    &OFFSET,
    &DRIFT,
    &DELAY,
    &SKEW,
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
