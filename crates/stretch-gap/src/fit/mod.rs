//! Fits hypotheses and scores them.
//!
//! Input: the simulator with its runs, and the roles of the samples. Output: a re-tuned
//! [`prepared::PreparedProblem`]. With it, any set of effects can be fitted, which yields a
//! [`hypothesis::Hypothesis`]: a model, its misfit in every stage, and a score. The modules, in the
//! order of use: the noise of every stage ([`noise_level`], [`isolated_outliers`]); residuals with
//! slow drift and offsets marginalised ([`metric`], [`nuisance`], [`hyper_parameters`]); a test of
//! whether a residual depends on the [`motion`], in which case no drift of the recorder is assumed;
//! residuals and sensitivities of the stages ([`comparison`]); bounded Levenberg-Marquardt fits in
//! scaled [`coordinate`]s ([`levenberg_marquardt`]); reduced chi-square and scores ([`score`],
//! [`octaves`]); errors that several outputs have in common ([`alike`]); deviations of the forms of
//! effects ([`deviations`]); which parameters the data determine ([`identifiability`]);
//! re-tuning from several starts ([`starts`]); a fit of selected samples after a diagnosis
//! ([`sample_fit`]). Uses the modules `numerics` and `problem`.

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
pub(crate) mod spread;
pub(crate) mod starts;

#[cfg(test)]
pub(crate) mod tests;
