//! The error of creating a receptor.

use core::fmt;

use stretch_core::DesignError;
use stretch_filter::FilterError;

/// The reason why no receptor can be created from a calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ReceptorError {
    /// The calibration holds another model, or a number that the receptor cannot hold.
    Calibration(DesignError),
    /// The rate estimator that the calibration names needs later samples, which a live stream does
    /// not have.
    LooksAhead,
    /// The calibration was fitted with another rate estimator or another sample rate. The variant has no numbers,
    /// because their formatting would cost a board some kilobytes.
    Rate,
}

impl From<DesignError> for ReceptorError {
    fn from(error: DesignError) -> Self {
        Self::Calibration(error)
    }
}

impl From<FilterError> for ReceptorError {
    fn from(error: FilterError) -> Self {
        match error {
            FilterError::Design(error) => Self::Calibration(error),
            // all other errors are about recordings and cannot occur in a design
            _ => Self::LooksAhead,
        }
    }
}

impl fmt::Display for ReceptorError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Calibration(error) => error.fmt(f),
            Self::LooksAhead => f.write_str(
                "the rate estimator needs future samples: live, use a causal Savitzky-Golay, a differentiator or a tracker",
            ),
            Self::Rate => f.write_str(
                "the rate estimator is not the one with which the calibration was fitted: design it with the window, the degree and the \
                 sample rate of the calibration",
            ),
        }
    }
}

impl core::error::Error for ReceptorError {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            Self::Calibration(error) => Some(error),
            Self::LooksAhead | Self::Rate => None,
        }
    }
}
