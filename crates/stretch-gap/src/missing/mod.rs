//! Proposes an equation for a cause outside the catalogue: a sum of a few terms that are functions
//! of the recorded signals, for the stage with the largest gap.
//!
//! A discrepancy between simulator and rig can be learnt as a sum of a few terms that are chosen
//! from a library (Kaheman et al. 2019, arXiv 1909.08574). The nominal parameters have to be fitted
//! together with the terms, because otherwise terms would compensate for wrong parameters
//! (Brynjarsdottir and O'Hagan 2014, doi 10.1088/0266-5611/30/11/114007).
//!
//! Input: a prepared problem and its best hypothesis. Output: a [`Proposed`] sum of terms, or none.
//! A [`library`] contains [`term`]s of the recorded [`signals`]. Sparse regression ([`sparse`])
//! chooses a few that explain the residual ([`residue`]). A comparison with [`coloured`] noise
//! decides whether they are more than chance. [`mod@propose`] runs all steps. Uses the modules
//! `numerics`, `problem` and `fit`.

mod coloured;
mod course;
mod jitter;
mod library;
mod propose;
mod proposed;
mod residue;
mod sparse;
mod term;
mod term_inputs;
#[cfg(test)]
mod tests;

pub use course::Course;
pub(crate) use propose::{Proposal, propose};
pub use proposed::{Proposed, ProposedTerm, SignalScale};
pub use term::{Factor, Passage, RateForm, Term};
