//! Errors of filter designs and of functions on logs.

use core::fmt;
use stretch_core::DesignError;

/// The reason why a filter design was refused, or a log could not be processed.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum FilterError {
    /// A number of the design is out of range.
    Design(DesignError),
    /// The estimator needs future samples, so it cannot run live.
    LooksAhead {
        /// Number of future samples needed.
        samples: usize,
    },
    /// Two slices that belong together have different lengths.
    LengthsDiffer {
        /// Samples of the log.
        log: usize,
        /// Elements of the other slice (times or output).
        other: usize,
    },
    /// The log has fewer samples than the estimator needs.
    TooShort {
        /// Samples needed.
        needed: usize,
        /// Samples given.
        got: usize,
    },
    /// A sample or a time stamp that is NaN, infinite or beyond [`LARGEST_SAMPLE`](crate::LARGEST_SAMPLE).
    NotFinite {
        /// Its index.
        index: usize,
    },
    /// A time stamp that is not later than the one before it.
    NotIncreasing {
        /// Index of the offending stamp.
        index: usize,
        /// The stamp before it, in seconds.
        before_s: f64,
        /// The stamp itself, in seconds.
        time_s: f64,
    },
    /// A grid point is before the first or after the last sample. Functions never extrapolate.
    OutsideLog {
        /// The grid point, in seconds.
        time_s: f64,
        /// First time of the log, in seconds.
        first_s: f64,
        /// Last time of the log, in seconds.
        last_s: f64,
    },
}

impl From<DesignError> for FilterError {
    fn from(error: DesignError) -> Self {
        Self::Design(error)
    }
}

impl fmt::Display for FilterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Design(error) => error.fmt(f),
            Self::LooksAhead { samples } => write!(
                f,
                "this rate estimator needs {samples} future sample(s): live, use a causal Savitzky-Golay, \
                 a differentiator or a tracker"
            ),
            Self::LengthsDiffer { log, other } => {
                write!(f, "the log has {log} samples, but the other slice has {other}")
            }
            Self::TooShort { needed, got } => {
                write!(f, "the log has {got} samples, but {needed} are needed")
            }
            Self::NotFinite { index } => {
                write!(f, "element {index} is not a finite number within 1e18")
            }
            Self::NotIncreasing { index, before_s, time_s } => write!(
                f,
                "time stamp {index} is {time_s} s, which is not later than {before_s} s before it"
            ),
            Self::OutsideLog { time_s, first_s, last_s } => write!(
                f,
                "{time_s} s is outside the log, which runs from {first_s} s to {last_s} s"
            ),
        }
    }
}

impl core::error::Error for FilterError {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            Self::Design(error) => Some(error),
            _ => None,
        }
    }
}
