//! What detection limits are found from.

use crate::{
    fit::{hypothesis::Hypothesis, prepared::PreparedProblem},
    problem::thresholds::Thresholds,
};

/// The problem, the best set, whose rest is taken for noise, and the rule.
#[derive(Clone, Copy)]
pub(crate) struct Asked<'a> {
    pub(crate) problem: &'a PreparedProblem<'a>,
    pub(crate) best: &'a Hypothesis,
    pub(crate) thresholds: &'a Thresholds,
    /// Excess that noise alone stays below in 19 of 20 records.
    pub(crate) null_band: f64,
    pub(crate) seed: u64,
}
