//! Where the signal stands at rest, followed as it drifts.

use crate::DesignError;

/// A baseline that follows the resting signal.
///
/// A muscle is never longer than at rest and a joint never straighter than
/// straight: whenever the signal falls below its frozen resting level (or rises
/// above it, for a signal that falls with the target), that is drift, and the
/// baseline gives way. With `s` the signal times the sign of the polarity and
/// `b` the baseline, a sample:
/// - `s - b < level`: `b += (s - b - level) dt/catch_up_s`;
/// - else `b += leak dt`, so that drift the other way is found at the next rest.
///
/// The model sees `s - b`. Source: this project; it is the one-sided zero
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
    /// Checks every number.
    ///
    /// # Errors
    /// [`DesignError::OutOfRange`] that names the field.
    pub fn validate(&self) -> Result<(), DesignError> {
        DesignError::check("rest.level", self.level, true)?;
        DesignError::check("rest.catch_up_s", self.catch_up_s, self.catch_up_s > 0.0)?;
        DesignError::check("rest.leak", self.leak, self.leak >= 0.0)?;
        Ok(())
    }
}
