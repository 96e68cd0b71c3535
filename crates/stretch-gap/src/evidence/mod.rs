//! Gathers the evidence for and against the effects that the search found. Test trials are read
//! here for the first time.
//!
//! Input: a prepared problem and the result of the search. Output: [`gathered::Evidence`], with the
//! outputs and residuals of every stage, and the results of the other modules. These are the
//! [`candidates`] with probabilities ([`probability`]) and intervals ([`bootstrap`]); the part of
//! the gap that each effect closes ([`shares`]); whether the data can come from this simulator at
//! all ([`sanity`]); how stable the named effects are ([`stability`]); the excess that noise alone
//! leaves ([`null_band`]); the places at which the gap is largest ([`localise`]); a hypothesis for
//! what the catalogue lacks ([`term_sum`]); and how the output responds to each parameter
//! ([`responses`]). Uses the modules `numerics`, `problem`, `fit`, `search` and `missing`.

pub(crate) mod bootstrap;
pub(crate) mod candidates;
pub(crate) mod detection_limit;
pub(crate) mod gathered;
pub(crate) mod localise;
pub(crate) mod null_band;
pub(crate) mod probability;
pub(crate) mod responses;
pub(crate) mod sanity;
pub(crate) mod shares;
pub(crate) mod stability;
pub(crate) mod term_sum;
