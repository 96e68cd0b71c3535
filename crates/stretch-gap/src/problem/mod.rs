//! The problem as a user states it: a simulator and the measurements that it is compared with.
//!
//! Input: an implementation of [`simulator::Simulator`], with a validated
//! [`description::Description`] of its stages, parameters, effects and trials ([`spec`]), its noise
//! ([`noise`]), and facts about the recording ([`record_facts`], [`mod@column`]). Output: the
//! fitted, held-out and test samples (`sample_roles`), and model runs that are counted, can be
//! stopped, and return finite values ([`runs`]). One simulator wraps another ([`altered`]): with
//! other tolerances, or with errors of the recording ([`fault`]). [`thresholds`] are the calibrated
//! thresholds of the decisions. Imports: only `numerics`.

pub(crate) mod altered;
pub(crate) mod checks;
pub(crate) mod column;
pub(crate) mod description;
pub(crate) mod error;
pub(crate) mod fault;
pub(crate) mod linked_stages;
pub(crate) mod noise;
mod pace;
pub(crate) mod record_facts;
mod rests;
pub(crate) mod runs;
pub(crate) mod sample_roles;
pub(crate) mod simulator;
pub(crate) mod spec;
pub(crate) mod spectral_line;
pub(crate) mod thresholds;

#[cfg(test)]
mod tests;
