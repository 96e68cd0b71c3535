//! Which estimator turns a voltage into its rate.

use crate::DesignError;

/// The estimator of the signal's rate, as a calibration records it.
///
/// A surface fitted on one estimator's rates is only right with that estimator:
/// the choice is part of the calibration. `stretch-filter` builds what is named here.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case", deny_unknown_fields))]
#[non_exhaustive]
pub enum RateEstimator {
    /// Central difference of a log, as the paper's; looks one sample ahead, so
    /// it cannot run live.
    CentralDifference,
    /// Savitzky-Golay: slope of the polynomial of `degree` that fits the
    /// newest `window` samples best, taken `delay` samples before the newest.
    SavitzkyGolay {
        /// Samples in the window.
        window: u16,
        /// Degree of the local polynomial.
        degree: u8,
        /// How many samples before the newest the slope is taken.
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
        /// Standard deviation of the acceleration times the squared period,
        /// over the standard deviation of the noise; dimensionless.
        tracking_index: f64,
    },
}

impl RateEstimator {
    /// The longest Savitzky-Golay window that a record may name, in samples.
    pub const MAX_WINDOW: u16 = 64;

    /// Eleven points, degree 2, at the newest sample: causal, 0.1 s at 100 Hz.
    pub const SAVGOL_11_2: Self = Self::SavitzkyGolay { window: 11, degree: 2, delay: 0 };

    /// The kind, as messages call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::CentralDifference => "a central difference",
            Self::SavitzkyGolay { .. } => "Savitzky-Golay",
            Self::Differentiator { .. } => "a differentiator",
            Self::Tracker { .. } => "a tracker",
        }
    }

    /// Checks every number of the record.
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
