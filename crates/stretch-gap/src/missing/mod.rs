//! A name for what the catalogue lacks: a sparse sum of terms of what was recorded, proposed where most of a gap is left.
//!
//! A discrepancy between simulator and rig can be learnt as a few terms of a library (Kaheman et al. 2019,
//! arXiv 1909.08574), but whatever nominal parameters could have done has to be fitted with it, or terms stand in for
//! parameters (Brynjarsdottir and O'Hagan 2014, doi 10.1088/0266-5611/30/11/114007).
//!
//! In: a prepared problem and its best hypothesis. Out: a [`Proposed`] sum of terms, or none.
//! Recorded [`signals`] span a [`library`] of [`term`]s; [`sparse`] regression on the [`residue`] chooses a few; [`coloured`] noise says
//! whether they are more than chance; [`mod@propose`] does it all.
//! Imports: `numerics`, `problem`, `fit`.

mod coloured;
mod course;
mod dense;
mod digits;
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
