//! Thresholds that were calibrated on development cases, in one file.

use serde::{Deserialize, Serialize};

/// Thresholds of the decisions, read from `thresholds.toml`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Thresholds {
    /// Largest sum over the channels of reduced chi-square minus one (the excess) at which there is no gap.
    pub null_excess: f64,
    /// Smallest rise of the score that an added effect must achieve, nats.
    pub rise: f64,
    /// The same for an effect that closes less than `null_excess`, or no more than model
    /// discrepancy could explain, nats.
    pub faint_rise: f64,
    /// Smallest share of the remaining gap that an effect must close.
    pub share: f64,
    /// Model discrepancy: the share of the gap closed by a set that may be left because the forms
    /// of its effects differ from those of the rig. A further effect that closes no more than that
    /// in a stage must meet stricter criteria.
    pub model_discrepancy: f64,
    /// Temperature of the probabilities, nats: this difference of scores changes the ratio of two
    /// probabilities by a factor e.
    pub temperature: f64,
    /// Growth of the temperature with the share of the gap that the best set leaves, nats.
    pub rho: f64,
    /// Excess that an explained gap may leave, whatever the initial gap.
    pub unknown_excess: f64,
    /// Share of the closed excess that an explained gap may leave in addition, because of model
    /// discrepancy.
    pub unknown_share: f64,
    /// Change of the logarithm of the remaining excess that changes the odds of `unknown` by a
    /// factor e.
    pub unknown_soft: f64,
    /// Odds of `unknown` if the remaining excess is just what an explained gap may leave.
    pub unknown_odds: f64,
    /// Excess, summed over channels, from which a gap is relevant. A further named effect must
    /// close at least this much. A value of 0.05 corresponds to a residual of 1.025 times the
    /// noise.
    pub least_gap: f64,
}

impl Thresholds {
    /// Returns the relative amplitude by which another form changes an effect's contribution. It is
    /// the square root of `model_discrepancy`, which is a share of variance.
    pub(crate) fn discrepancy_amplitude(&self) -> f64 {
        self.model_discrepancy.sqrt()
    }

    /// Returns the thresholds of this version.
    pub fn frozen() -> Self {
        toml::from_str(include_str!("../../thresholds.toml")).expect("a test reads it")
    }
}
