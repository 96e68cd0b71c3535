//! The search for the set of effects that the simulator lacks.
//!
//! In: a prepared problem and the thresholds. Out: [`selection::Found`], the best set of effects with its rivals, and every
//! set that was fitted on the way ([`sets`]).
//! Effects are screened by one simulation a start ([`screen`]), the promising ones fitted ([`sets`]), and taken where they meet
//! the acceptance criterion ([`acceptance`]); where re-tuning took parameters far, an effect begins once beside them as shipped ([`unstrained`]). Beside the effects two hypotheses of the record are weighed: commands that switch
//! between its rows ([`command_timing`]) and other sizes of the nuisances ([`re_estimate`]). [`baselines`] are simpler methods.
//! Imports: `numerics`, `problem`, `fit`.

pub(crate) mod acceptance;
pub(crate) mod baselines;
pub(crate) mod command_timing;
pub(crate) mod re_estimate;
pub(crate) mod screen;
pub(crate) mod selection;
pub(crate) mod sets;
pub(crate) mod unstrained;

#[cfg(test)]
mod tests;
