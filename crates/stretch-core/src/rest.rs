//! Parameters for tracking the drift of the resting signal.

use crate::{
    DesignError,
    sizes::{extent, not_negative, size},
};

/// Parameters of a baseline that follows the resting signal.
///
/// A muscle is never longer than at rest, and a joint does not extend beyond its straight position. Therefore a signal
/// below its calibrated resting level (or above it, if the signal falls with the target) must have drifted, and the
/// baseline follows it. Let `s` be the signal times the sign of the polarity, `b` the baseline, and `e` the running
/// average of `s - b - level` over about [`RestTracker::AVERAGE_S`], which suppresses noise. For each sample:
/// - if `e < 0`: `b += e dt/catch_up_s`;
/// - otherwise `b += leak dt`. The baseline thus rises slowly, and drift in the other direction is corrected at the
///   next rest.
///
/// The input of the model is `s - b`. If a model predicts how its memory shifts the resting signal, `level` is shifted
/// by the same amount. [`RestLevel`](crate::RestLevel) implements this per sample. Source: this project. It is a
/// one-sided form of the zero update of strapdown navigation.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct RestTracker {
    /// Resting signal at calibration, in the signal's unit.
    pub level: f64,
    /// Time constant with which the baseline follows a signal beyond the level, in seconds.
    pub catch_up_s: f64,
    /// Rate at which the baseline rises otherwise, in signal units per second.
    pub leak: f64,
}

impl RestTracker {
    /// Time constant of the running average `e`, in seconds.
    pub const AVERAGE_S: f64 = 0.05;
    /// Largest magnitude of the baseline, as a share of the signal's range. A larger offset means a different
    /// gauge, not drift.
    pub const FURTHEST: f64 = 0.2;
    /// Largest magnitude with which a single sample enters the average `e`, as a share of the signal's range. It
    /// limits the effect of spikes, because drift is slow.
    pub const MOST_EXCESS: f64 = 0.1;

    /// Checks every number.
    ///
    /// # Errors
    /// [`DesignError::OutOfRange`] that names the field.
    pub fn validate(&self) -> Result<(), DesignError> {
        size("rest.level", self.level)?;
        extent("rest.catch_up_s", self.catch_up_s)?;
        not_negative("rest.leak", self.leak)?;
        Ok(())
    }
}
