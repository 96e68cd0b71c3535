//! Gathers the evidence for and against what was found. Test trials are read here, and nowhere
//! before.
//!
//! Input: a prepared problem and what the search found. Output: [`gathered::Evidence`]. It holds
//! the traces and residuals of every stage; the [`candidates`] with probabilities ([`probability`])
//! and intervals ([`bootstrap`]); what each effect closes ([`shares`]); whether the data can come
//! from this simulator at all ([`sanity`]); how stable the names are ([`stability`]); what noise
//! alone leaves ([`null_band`]); where the gap sits ([`localise`]); a hypothesis for what the
//! catalogue lacks ([`term_sum`]); and how the output responds to each parameter ([`responses`]).
//! Imports: `numerics`, `problem`, `fit`, `search`, `missing`.

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
