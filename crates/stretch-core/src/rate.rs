//! Parameters of the estimator that computes the rate of a voltage.

use crate::DesignError;

/// Kind and parameters of the estimator of the signal's rate, as stored in a calibration.
///
/// The estimator is part of the calibration, because a surface that was fitted to the rates of one
/// estimator is valid only with that estimator. The crate `stretch-filter` implements the
/// estimators.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case", deny_unknown_fields))]
#[non_exhaustive]
pub enum RateEstimator {
    /// Central difference over a log, as in the published method ("the paper"). It needs the
    /// next sample, so it cannot run live.
    CentralDifference,
    /// Savitzky-Golay: slope of the least-squares polynomial of `degree` through the newest
    /// `window` samples, evaluated `delay` samples before the newest.
    SavitzkyGolay {
        /// Samples in the window.
        window: u16,
        /// Degree of the local polynomial.
        degree: u8,
        /// Number of samples before the newest at which the slope is evaluated.
        delay: u16,
    },
    /// Band-limited differentiator: a second-order Butterworth low-pass in
    /// series with a difference.
    Differentiator {
        /// Cutoff of the low-pass, in hertz.
        cutoff_hz: f64,
    },
    /// Steady-state Kalman (alpha-beta) tracker.
    Tracker {
        /// Standard deviation of the acceleration times the squared sample period, divided by the
        /// standard deviation of the noise; dimensionless.
        tracking_index: f64,
    },
}

impl RateEstimator {
    /// The longest Savitzky-Golay window, in samples.
    pub const MAX_WINDOW: u16 = 64;

    /// Savitzky-Golay with eleven points and degree 2, evaluated at the newest sample: 0.1 s at 100 Hz.
    pub const SAVGOL_11_2: Self = Self::SavitzkyGolay { window: 11, degree: 2, delay: 0 };

    /// Returns the name of the kind for messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::CentralDifference => "a central difference",
            Self::SavitzkyGolay { .. } => "Savitzky-Golay",
            Self::Differentiator { .. } => "a differentiator",
            Self::Tracker { .. } => "a tracker",
        }
    }

    /// Checks every parameter.
    ///
    /// # Errors
    /// [`DesignError`] that names the field.
    pub fn validate(self) -> Result<Self, DesignError> {
        match self {
            Self::CentralDifference => {}
            Self::SavitzkyGolay { window, degree, delay } => {
                let shape = |field, n: u16, holds| DesignError::check(field, n.into(), holds);
                shape("rate.window", window, (2..=Self::MAX_WINDOW).contains(&window))?;
                shape("rate.degree", degree.into(), (1..window).contains(&degree.into()))?;
                shape("rate.delay", delay, delay < window)?;
            }
            Self::Differentiator { cutoff_hz } => {
                DesignError::check("rate.cutoff_hz", cutoff_hz, cutoff_hz > 0.0)?;
            }
            Self::Tracker { tracking_index } => {
                DesignError::check("rate.tracking_index", tracking_index, tracking_index > 0.0)?;
            }
        }
        Ok(self)
    }
}
