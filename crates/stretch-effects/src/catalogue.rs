//! The catalogue: every kind of effect, and the effects of a gauge and of its reference.

use crate::{effect::Effect, kind::Kind};

/// Lists the kinds once; the macro creates a module with their names and an ordered table.
macro_rules! kinds {
    ($($file:ident::$kind:ident,)*) => {
        /// Every kind under its own name.
        pub mod kinds {
            $(pub use crate::$file::$kind;)*
        }

        /// Every kind, in the order in which several kinds act on one channel.
        pub static KINDS: &[&Kind] = &[$(&kinds::$kind,)*];
    };
}

kinds! {
    friction::COULOMB_FRICTION,
    friction::VISCOUS_FRICTION,
    friction::STRIBECK_FRICTION,
    friction::LOAD_FRICTION,
    dahl::DAHL_FRICTION,
    dahl::LOAD_DAHL_FRICTION,
    dahl::PLAY_FRICTION,
    friction::TORQUE_SPEED_LIMIT,
    dead_zone::FIRMWARE_DEAD_BAND,
    dead_zone::DEAD_ZONE,
    play::BACKLASH,
    hysteresis::HYSTERESIS,
    hysteresis::BOUC_WEN,
    bow::CURVE,
    bow::GAIN_CURVE,
    softening::SOFTENING,
    drift::GAIN_DRIFT,
    fading::WARMING,
    crosstalk::CROSSTALK,
    profile::SLEW_LIMIT,
    profile::PROFILE,
    lowpass::LAG,
    oscillator::SECOND_ORDER_LAG,
    oscillator::FLEXIBLE_JOINT,
    fading::RELAXATION,
    knees::SATURATION,
    drift::OFFSET,
    drift::DRIFT,
    skew::DELAY,
    skew::SKEW,
    skew::CLOCK_DRIFT,
    hum::HUM,
    dead_zone::QUANTISATION,
}

/// Returns the kind of that name.
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
    &crate::knees::SLEEVE_SLACK,
    &crate::play::SLEEVE_SLIP,
    &crate::crosstalk::PRESSURE_CROSSTALK,
    &crate::hysteresis::GAUGE_HYSTERESIS,
    &crate::fading::GAUGE_RELAXATION,
    &crate::softening::GAUGE_SOFTENING,
    &crate::bow::GAUGE_NONLINEARITY,
    &crate::drift::THERMAL_DRIFT,
    &crate::fading::SELF_HEATING,
    &crate::knees::AMPLIFIER_SATURATION,
    &crate::lowpass::AMPLIFIER_LOWPASS,
    &crate::hum::MAINS_HUM,
    &crate::skew::CHANNEL_SKEW,
    &crate::bow::POT_NONLINEARITY,
    &crate::play::POT_BACKLASH,
];

/// Returns the effect of a gauge or of its reference that is called `name`.
pub fn gauge_effect(name: &str) -> Option<&'static Effect> {
    GAUGE.iter().copied().find(|effect| effect.name == name)
}
