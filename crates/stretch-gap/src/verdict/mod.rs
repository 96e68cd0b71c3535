//! The verdict, and how it is put into words.
//!
//! In: the evidence, the errors of the record and the thresholds. Out: a [`diagnosis::Diagnosis`].
//! [`judge`] decides what kind of answer the evidence carries, [`naming`] which effects are named, tied or faint, [`coverage`] whether the
//! record carries a name at all; [`sentence`] puts the answer into words, [`notes`] adds to them. [`next_experiment`] asks of a finished
//! diagnosis what to measure next.
//! Imports: every folder but none of this one's callers.

pub(crate) mod answer;
pub(crate) mod coverage;
pub(crate) mod diagnosis;
pub(crate) mod judge;
pub(crate) mod naming;
pub(crate) mod next_experiment;
pub(crate) mod note;
pub(crate) mod notes;
pub(crate) mod sentence;
#[cfg(test)]
mod tests;
