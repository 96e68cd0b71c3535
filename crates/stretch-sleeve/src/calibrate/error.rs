//! Errors of calibrating several gauges and of priors.

use stretch_calibrate::CalibrateError;

/// Why gauges could not be calibrated together, or a prior could not be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SleeveError {
    /// More channels than a calibration can hold, or none.
    #[error(
        "{asked} signals were named; a calibration takes 1 to {most}: name the columns of the gauges with --signal s1,s2"
    )]
    Channels {
        /// Number of named signals.
        asked: usize,
        /// Largest possible number.
        most: usize,
    },
    /// Two channels are identical, or one is a line of the other.
    #[error(
        "{first} and {second} are the same signal, apart from a factor and an offset, and the second adds nothing: leave one of \
         them out of --signal"
    )]
    Copies {
        /// The first.
        first: String,
        /// The second.
        second: String,
    },
    /// A calibration to renew was not made from the prior.
    #[error(
        "this calibration was not made from this prior: make one with stretch calibrate --prior, or give --of WEARER instead"
    )]
    OtherPrior,
    /// A prior or a session of a prior cannot be used with these data.
    #[error("{file}: {problem}")]
    Prior {
        /// The file, or what it describes.
        file: String,
        /// What is wrong, and what to do.
        problem: String,
    },
    /// Errors that calibrations of any kind can have.
    #[error(transparent)]
    Calibrate(CalibrateError),
}

impl<E: Into<CalibrateError>> From<E> for SleeveError {
    fn from(error: E) -> Self {
        Self::Calibrate(error.into())
    }
}
