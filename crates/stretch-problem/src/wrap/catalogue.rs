//! Every kind of wrapper.

use super::{forces, kind::Wrapper, loops, scales, times};

/// Every kind, in the order in which they act where several are on.
static ALL: [&Wrapper; 21] = [
    &forces::COULOMB,
    &forces::VISCOUS,
    &forces::STRIBECK,
    &loops::DEAD_ZONE,
    &loops::BACKLASH,
    &loops::HYSTERESIS,
    &loops::BOUC_WEN,
    &scales::CURVE,
    &scales::SOFTENING,
    &forces::CROSSTALK,
    &times::SLEW_LIMIT,
    &times::LAG,
    &times::SECOND_ORDER_LAG,
    &times::RELAXATION,
    &scales::SATURATION,
    &scales::OFFSET,
    &scales::DRIFT,
    &times::DELAY,
    &times::SKEW,
    &forces::HUM,
    &scales::QUANTISATION,
];

/// Every kind of wrapper, in the order in which they act where several are on.
pub fn wrappers() -> impl Iterator<Item = &'static Wrapper> + Clone {
    ALL.iter().copied()
}

/// The kind of that name.
pub fn wrapper_named(name: &str) -> Option<&'static Wrapper> {
    wrappers().find(|w| w.name == name)
}
