//! The problem as its owner poses it: a simulator bound to the measurements that it is held against.
//!
//! In: what a user writes, an implementation of [`simulator::Simulator`] with a validated [`description::Description`] of its
//! stages, parameters, effects and trials ([`spec`]), its noise ([`noise`]), and what is known of
//! the record ([`record_facts`], [`mod@column`]).
//! Out: the samples that are fitted, held out and tested ([`roles`]), and every run, counted, stoppable and finite
//! ([`runs`]). Two simulators stand before another one: one alters parameters ([`altered_parameters`]), one corrects a
//! column (in `record`). [`thresholds`] are the calibrated numbers of the decisions.
//! Imports: `numerics` alone.

pub(crate) mod altered_parameters;
pub(crate) mod checks;
pub(crate) mod column;
pub(crate) mod description;
pub(crate) mod error;
pub(crate) mod linked_stages;
pub(crate) mod noise;
mod pace;
pub(crate) mod record_facts;
mod rests;
pub(crate) mod rows_used;
pub(crate) mod runs;
pub(crate) mod sample_roles;
pub(crate) mod simulator;
pub(crate) mod spec;
pub(crate) mod spectral_line;
pub(crate) mod thresholds;

#[cfg(test)]
mod tests;
