//! One row of a log.

/// At this rate and voltage the surface should be `value`.
///
/// The numbers carry whatever units the caller's normalisation gives them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample<T> {
    /// Rate of the signal; without effect on a surface of degree 0 in the rate.
    pub rate: T,
    /// The signal.
    pub volts: T,
    /// What was measured there.
    pub value: T,
}
