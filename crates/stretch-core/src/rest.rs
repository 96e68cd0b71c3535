//! The value of the signal at rest, followed as it drifts.

use crate::{
    DesignError,
    sizes::{MOST, extent, size},
};

/// A baseline that follows the resting signal.
///
/// A muscle is never longer than at rest and a joint never straighter than
/// straight: whenever the signal falls below its frozen resting level (or rises
/// above it, for a signal that falls with the target), that is drift, and the
/// baseline gives way. With `s` the signal times the sign of the polarity, `b` the
/// baseline and `e` the mean of `s - b - level` over about [`RestTracker::AVERAGE_S`],
/// so that noise is no drift, a sample:
/// - `e < 0`: `b += e dt/catch_up_s`;
/// - else `b += leak dt`, so that drift the other way is found at the next rest.
///
/// The model sees `s - b`. A model that knows how memory moves a resting signal
/// moves `level` with it. [`RestLevel`](crate::RestLevel) is this, stepped. Source: this project; it is the one-sided zero
/// update of strapdown navigation.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct RestTracker {
    /// The resting signal at calibration, in the signal's unit.
    pub level: f64,
    /// How fast a signal beyond the level pulls the baseline, in seconds.
    pub catch_up_s: f64,
    /// How fast the baseline rises otherwise, in signal units per second.
    pub leak: f64,
}

impl RestTracker {
    /// Time constant of the excess's running average, in seconds.
    pub const AVERAGE_S: f64 = 0.05;
    /// The furthest that a baseline goes, as a share of the signal's range: what is
    /// beyond is no drift but another gauge.
    pub const FURTHEST: f64 = 0.2;
    /// What a sample beyond the level counts for at most, as a share of the signal's
    /// range: drift is slow, a spike is not drift.
    pub const MOST_EXCESS: f64 = 0.1;

    /// Checks every number.
    ///
    /// # Errors
    /// [`DesignError::OutOfRange`] that names the field.
    pub fn validate(&self) -> Result<(), DesignError> {
        size("rest.level", self.level)?;
        extent("rest.catch_up_s", self.catch_up_s)?;
        DesignError::check("rest.leak", self.leak, (0.0..=MOST).contains(&self.leak))?;
        Ok(())
    }
}
