//! One row of a log.

/// One observation of the surface: `value` at a rate and a voltage.
///
/// The numbers may have any units.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sample<T> {
    /// Rate of the signal; has no effect on a surface of degree 0 in the rate.
    pub rate: T,
    /// The signal.
    pub volts: T,
    /// The measured value.
    pub value: T,
}
