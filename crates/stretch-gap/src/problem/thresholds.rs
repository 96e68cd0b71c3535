//! Numbers that were calibrated on development cases, in one file.

use serde::{Deserialize, Serialize};

/// Thresholds of the decision, read from `thresholds.toml`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Thresholds {
    /// Excess, summed over channels, below which there is no gap.
    pub null_excess: f64,
    /// Smallest rise of the score for an effect that closes a gap, nats.
    pub rise: f64,
    /// Smallest rise of the score for an effect that closes less than a gap that counts.
    pub faint_rise: f64,
    /// Smallest share of the remaining gap that an effect must close.
    pub share: f64,
    /// Share of what was closed, in a stage and in each octave of it, that model discrepancy may leave to a further effect.
    pub model_discrepancy: f64,
    /// Temperature of the probabilities, nats.
    pub temperature: f64,
    /// Growth of the temperature with the share of the gap that the best set leaves, nats.
    pub rho: f64,
    /// Excess that may be left whatever the initial gap.
    pub unknown_excess: f64,
    /// Share of the excess that model discrepancy may leave.
    pub unknown_share: f64,
    /// Width of the border to `unknown`, in logarithms of the remaining excess.
    pub unknown_soft: f64,
    /// Odds of `unknown` at its border.
    pub unknown_odds: f64,
    /// Excess from which a gap counts, summed over channels. A further name must close at least
    /// this much: 0.05 is 1.025 times the noise.
    pub least_gap: f64,
}

impl Thresholds {
    /// Share of an effect's contribution that another form of it changes. The discrepancy is a
    /// share of the variance; deviations are amplitudes.
    pub(crate) fn discrepancy_amplitude(&self) -> f64 {
        self.model_discrepancy.sqrt()
    }

    /// The thresholds of this version.
    pub fn frozen() -> Self {
        toml::from_str(include_str!("../../thresholds.toml")).expect("a test reads it")
    }
}
