//! Fits of one hypothesis, and what a fit is measured by.
//!
//! In: the runs of a problem and the roles of its samples. Out: a [`prepared::PreparedProblem`], re-tuned, in which any set of effects becomes a
//! [`hypothesis::Hypothesis`]: a model, what it leaves of every stage, and a score.
//! In the order of use: the noise of every stage ([`noise_level`], less [`isolated_outliers`]); residuals in multiples of it with
//! slow drift and offsets marginalised ([`metric`], [`nuisance`], [`hyper_parameters`]), a recorder's drift only where the residual does not depend on the [`motion`]; residuals and sensitivities of the
//! stages ([`comparison`]); bounded Levenberg-Marquardt in scaled [`coordinate`]s ([`levenberg_marquardt`]); reduced
//! chi-square and scores ([`score`], [`octaves`]); errors that outputs share ([`alike`]); what another form of the same effects explains ([`deviations`]); which parameters the data
//! determine ([`identifiability`]); whether a drift swings ([`swing`]). Some samples fitted by themselves, after a diagnosis ([`sample_fit`]).
//! A descent ends in the nearest valley, so that re-tuning begins at several places ([`starts`]).
//! Imports: `numerics`, `problem`.

pub(crate) mod alike;
pub(crate) mod comparison;
pub(crate) mod coordinate;
pub(crate) mod deviations;
pub(crate) mod hyper_parameters;
pub(crate) mod hypothesis;
pub(crate) mod identifiability;
pub(crate) mod isolated_outliers;
pub(crate) mod levenberg_marquardt;
pub(crate) mod metric;
pub(crate) mod motion;
pub(crate) mod noise_level;
pub(crate) mod nuisance;
pub(crate) mod octaves;
pub(crate) mod prepared;
pub(crate) mod sample_fit;
pub(crate) mod score;
pub(crate) mod starts;
pub(crate) mod swing;

#[cfg(test)]
pub(crate) mod tests;
