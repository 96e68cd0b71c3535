//! The evidence for and against what was found; test trials are read here, and nowhere before.
//!
//! In: a prepared problem and what the search found. Out: [`gathered::Evidence`], the traces and residuals of every stage; the
//! [`candidates`] with probabilities ([`probability`]) and intervals ([`bootstrap`]); what each effect closes ([`shares`]); whether
//! it is the right simulator at all ([`sanity`]); how firmly it stands ([`stability`]); what noise alone leaves ([`null_band`]); where the gap sits ([`localise`]);
//! what the catalogue lacks as a hypothesis ([`mod@function`]); and how the output answers to each number ([`responses`]).
//! Imports: `numerics`, `problem`, `fit`, `search`, `missing`.

pub(crate) mod bootstrap;
pub(crate) mod candidates;
pub(crate) mod detection_limit;
pub(crate) mod excess;
pub(crate) mod function;
pub(crate) mod gathered;
pub(crate) mod localise;
pub(crate) mod null_band;
pub(crate) mod probability;
pub(crate) mod response;
pub(crate) mod responses;
pub(crate) mod sanity;
pub(crate) mod shares;
pub(crate) mod stability;
