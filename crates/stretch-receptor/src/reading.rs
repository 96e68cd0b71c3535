//! The answer of a receptor for one sample.

use core::fmt;

use stretch_core::{Branch, Millimetres, MillimetresPerSecond, Real};

/// An answer: the estimate, its rate, its branch and domain, and its standard deviation if the model computes one.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Reading<T = f64> {
    /// The estimated reference, in the unit of the reference (millimetres of a muscle, degrees of a joint).
    pub estimate: T,
    /// Rate of the estimate, in the reference's unit per second. A line or a surface gives the local slope of the
    /// calibration times the rate of the signal; if its estimate needs no rate, this is 0 until there are enough
    /// samples for a rate. Other models estimate the rate themselves.
    pub rate: T,
    /// The branch that was evaluated.
    pub branch: Branch,
    /// Whether the inputs lay in the calibrated domain.
    pub domain: Domain,
    /// Standard deviation of the estimate, in the reference's unit. A diagnosed model computes it; the other models give
    /// `None`.
    pub sd: Option<T>,
}

impl<T: Real> Reading<T> {
    /// The estimate as a length, for a calibration whose reference is in millimetres.
    pub fn length(&self) -> Millimetres<T> {
        Millimetres(self.estimate)
    }

    /// The rate of a length, for a calibration whose reference is in millimetres.
    pub fn length_rate(&self) -> MillimetresPerSecond<T> {
        MillimetresPerSecond(self.rate)
    }
}

/// Whether the inputs of a [`Reading`] lay in the calibrated domain.
///
/// An input outside the domain is moved to the nearest end before the calibration is evaluated, because a polynomial
/// is never extrapolated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Domain {
    /// Both inputs of this sample were inside. The estimate of a model with memory also depends on earlier samples.
    Inside,
    /// The signal was outside, and was clamped.
    SignalClamped,
    /// The rate was outside, and was clamped.
    RateClamped,
    /// Both inputs were outside, and were clamped.
    BothClamped,
    /// The inputs were inside, but the estimate was outside the range of the fitted reference, and was clamped.
    EstimateClamped,
}

impl Domain {
    #[inline]
    pub(crate) fn from_flags(signal_outside: bool, rate_outside: bool) -> Self {
        match (signal_outside, rate_outside) {
            (false, false) => Self::Inside,
            (true, false) => Self::SignalClamped,
            (false, true) => Self::RateClamped,
            (true, true) => Self::BothClamped,
        }
    }
}

impl fmt::Display for Domain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Inside => "inside",
            Self::SignalClamped => "signal_clamped",
            Self::RateClamped => "rate_clamped",
            Self::BothClamped => "both_clamped",
            Self::EstimateClamped => "estimate_clamped",
        })
    }
}

/// The reason why there is no [`Reading`] for a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Withheld {
    /// The rate estimator has not seen enough samples yet, and the model needs a rate; or the model settles after a
    /// long gap.
    Warming,
    /// The sample was missing, not a number or too large. The receptor bridges a short gap
    /// ([`MAX_BRIDGED`](crate::MAX_BRIDGED)).
    Missing,
}

impl fmt::Display for Withheld {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Warming => f.pad("warming"),
            Self::Missing => f.pad("missing"),
        }
    }
}

impl core::error::Error for Withheld {}
