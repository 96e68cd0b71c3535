//! The verdict, and how it is put into words.
//!
//! In: the evidence, the errors of the record and the thresholds. Out: a [`diagnosis::Diagnosis`].
//! [`judge`] decides what kind of answer the evidence carries, [`naming`] which effects are named, tied or faint, [`coverage`]
//! whether the record carries a name at all ([`too_little`]), [`proposal`] whether a sum of terms outside the catalogue beats it;
//! [`sentence`] puts the answer into words, [`extrapolated`], [`nothing_above`] and [`swinging`] add notes. [`next_experiment`] asks of a finished diagnosis what to measure next.
//! Imports: every folder but none of this one's callers.

pub(crate) mod coverage;
pub(crate) mod diagnosis;
pub(crate) mod extrapolated;
pub(crate) mod judge;
pub(crate) mod naming;
#[cfg(test)]
mod naming_tests;
pub(crate) mod next_experiment;
pub(crate) mod nothing_above;
pub(crate) mod proposal;
pub(crate) mod sentence;
pub(crate) mod swinging;
pub(crate) mod too_little;
