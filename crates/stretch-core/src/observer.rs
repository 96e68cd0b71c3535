//! The forward model of a gauge (from motion to signal), and the parameters of the filter that inverts it.
//!
//! The *drive* is the normalised strain of the gauge, including its memory. A *play* is a backlash operator
//! (`arithmetic::play`).

use crate::{
    DesignError, FitSummary, Interval, RestTracker, Values,
    sizes::{curve, domain, extent, size},
};

/// Largest number of relaxations in an [`ObserverMap`].
pub const MAX_OBSERVER_RELAXATIONS: usize = 2;
/// Largest number of plays in an [`ObserverMap`].
pub const MAX_OBSERVER_PLAYS: usize = 3;
/// Largest number of knots in the curve of an [`ObserverMap`].
pub const MAX_KNOTS: usize = 33;

/// The forward model of a gauge, and the parameters of the Kalman filter that inverts it.
///
/// With `y` the normalised target and `r` its rate:
/// - drive `u = y + lead_s r + sum a_i (y - l_i) + sum b_j (y - play(y, w_j))`;
/// - signal `v = curve(u) + noise`, where the monotone curve is linear between knots.
///
/// Here `l_i` is the lag `l_i' = (y - l_i)/tau_i`, with the amplitude `a_i`. The play of half-width `w_j` has the
/// weight `b_j`. The state of the filter is `y`, `r` and every `l_i`. `r` is a random walk of spectral density
/// `agility`. The gain depends on the slope of the curve: where the signal hardly depends on the target, the filter
/// relies on the predicted motion, elsewhere on the signal. `y` is clamped to `estimate_domain`.
///
/// Every number is a property of the gauge or of the motion, with a unit. Source: this project. The filter is an
/// extended Kalman filter (Kalman 1960, doi:10.1115/1.3662552) that linearises the curve with a secant instead of the
/// tangent wherever the secant is steeper.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct ObserverMap {
    /// The tracker of the resting signal, if its drift is followed.
    pub rest: Option<RestTracker>,
    /// Signal at evenly spaced drives over `drive_domain`, strictly monotone.
    pub curve: Values<MAX_KNOTS>,
    /// The drives of the first and the last knot.
    pub drive_domain: Interval,
    /// Time constants of the relaxations, in seconds.
    pub relaxations_s: Values<MAX_OBSERVER_RELAXATIONS>,
    /// Amplitudes of the relaxations. With `l' = (y - l)/tau`, `amplitude (y - l)` is added to the drive. A
    /// positive amplitude makes the gauge overshoot, a negative one makes it lag.
    pub amplitudes: Values<MAX_OBSERVER_RELAXATIONS>,
    /// Seconds by which the signal leads the target; negative if the signal lags.
    pub lead_s: f64,
    /// Half-widths of the plays (hysteresis elements), in normalised target.
    pub radii: Values<MAX_OBSERVER_PLAYS>,
    /// Weights of the plays. A negative weight gives the usual hysteresis, in which the signal lags.
    pub play_weights: Values<MAX_OBSERVER_PLAYS>,
    /// Standard deviation of the signal around the model, in the signal's unit.
    pub noise: f64,
    /// Spectral density of the rate's random walk, in 1/s^3 of normalised target.
    pub agility: f64,
    /// Range of the normalised targets in the fit.
    pub estimate_domain: Interval,
    /// Statistics of the estimates' errors in the fit, in normalised target.
    pub fit: FitSummary,
}

impl ObserverMap {
    /// Checks every number and length.
    ///
    /// # Errors
    /// [`DesignError`] that names the field.
    pub fn validate(&self) -> Result<(), DesignError> {
        if let Some(rest) = &self.rest {
            rest.validate()?;
        }
        let fields = ["length of observer.curve", "step of observer.curve", "observer.curve"];
        curve(fields, &self.curve)?;
        domain("observer.drive_domain", self.drive_domain)?;
        domain("observer.estimate_domain", self.estimate_domain)?;
        for &tau in self.relaxations_s.iter() {
            extent("observer.relaxations_s", tau)?;
        }
        for &radius in self.radii.iter() {
            extent("observer.radii", radius)?;
        }
        let (a, b) = (self.amplitudes.len(), self.play_weights.len());
        let taus = self.relaxations_s.len();
        DesignError::check("length of observer.amplitudes", a as f64, a == taus)?;
        DesignError::check("length of observer.play_weights", b as f64, b == self.radii.len())?;
        for &weight in self.amplitudes.iter().chain(self.play_weights.iter()) {
            size("observer.amplitudes or play_weights", weight)?;
        }
        DesignError::check("observer.lead_s", self.lead_s, self.lead_s.abs() <= 10.0)?;
        extent("observer.noise", self.noise)?;
        extent("observer.agility", self.agility)?;
        Ok(())
    }
}
