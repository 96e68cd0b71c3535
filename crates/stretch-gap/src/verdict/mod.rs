//! The verdict of a diagnosis, and its description in words.
//!
//! Input: the evidence, the errors of the recording, and the thresholds. Output: a
//! [`diagnosis::Diagnosis`]. [`judge`] decides which [`answer`] the evidence supports,
//! [`naming`] which effects are named, tied or faint, and [`coverage`] whether the recording is
//! sufficient to name any. [`sentence`] describes the answer in words with [`phrases`], and
//! [`notes`] adds remarks.
//! [`next_experiment`] recommends what to measure after a diagnosis. Imports: every folder except
//! those that use this one.

pub(crate) mod answer;
pub(crate) mod coverage;
pub(crate) mod diagnosis;
pub(crate) mod family;
pub(crate) mod judge;
pub(crate) mod naming;
pub(crate) mod next_experiment;
pub(crate) mod note;
pub(crate) mod notes;
pub(crate) mod phrases;
pub(crate) mod sentence;
#[cfg(test)]
mod tests;
