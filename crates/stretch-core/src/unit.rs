//! Newtypes for quantities with units, so that arguments of public functions cannot be swapped.
//!
//! These types have no arithmetic operators. Internal code uses the bare number (field `0`).

use core::fmt;

use crate::DesignError;

macro_rules! unit {
    ($($(#[$doc:meta])* $name:ident, $symbol:literal;)*) => {$(
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, Default, PartialEq, PartialOrd)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        pub struct $name<T = f64>(pub T);

        impl<T: core::fmt::Display> core::fmt::Display for $name<T> {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                self.0.fmt(f)?;
                f.write_str(concat!(" ", $symbol))
            }
        }
    )*};
}

unit! {
    /// An electric potential, in volts.
    Volts, "V";
    /// A length, in millimetres.
    Millimetres, "mm";
    /// A rate of length, in millimetres per second.
    MillimetresPerSecond, "mm/s";
    /// A duration, in seconds.
    Seconds, "s";
    /// A frequency of a signal (a cutoff, say), in hertz. Not a [`SampleRate`].
    Hertz, "Hz";
}

/// Sample rate of a stream, in samples per second: finite and above zero.
///
/// It is a separate type, so that a cutoff frequency cannot be passed instead.
///
/// ```
/// use stretch_core::SampleRate;
/// let rate = SampleRate::new(100.0).unwrap();
/// assert_eq!(rate.period_s(), 0.01);
/// assert_eq!(rate.to_string(), "100 Hz");
/// assert!(SampleRate::new(0.0).is_err());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "f64", into = "f64"))]
pub struct SampleRate(f64);

impl SampleRate {
    /// Creates a rate of `hz` samples per second.
    ///
    /// # Errors
    /// [`DesignError::OutOfRange`] unless `hz` is finite and above zero.
    pub fn new(hz: f64) -> Result<Self, DesignError> {
        DesignError::check("sample_rate_hz", hz, hz > 0.0).map(Self)
    }

    /// Returns the samples per second.
    pub fn hz(self) -> f64 {
        self.0
    }

    /// Returns the sample period in seconds.
    pub fn period_s(self) -> f64 {
        1.0 / self.0
    }
}

impl fmt::Display for SampleRate {
    /// Writes the rate with its unit, such as `100 Hz`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} Hz", self.0)
    }
}

impl TryFrom<f64> for SampleRate {
    type Error = DesignError;
    fn try_from(hz: f64) -> Result<Self, DesignError> {
        Self::new(hz)
    }
}

impl From<SampleRate> for f64 {
    fn from(rate: SampleRate) -> f64 {
        rate.0
    }
}
