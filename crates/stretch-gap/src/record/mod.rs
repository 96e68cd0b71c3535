//! Errors of the record and of the rig file: hypotheses like the effects, and more frequent than
//! they are.
//!
//! Input: the columns of a record, a prepared problem and what the search found. Output: the
//! [`gross::Gross`] errors, with the sentence of each ([`sentence`], [`units`]), if one is more
//! probable than every set of effects. Columns are first checked without any simulation
//! ([`columns_alone`]). Then every kind of error ([`fault`]) is a hypothesis with one parameter
//! ([`suspect`]), screened ([`screen`]), fitted ([`examine`]) and weighed against the effects
//! ([`gross`]). Imports: `numerics`, `problem`, `fit`, `search`.

pub(crate) mod columns_alone;
pub(crate) mod examine;
pub(crate) mod fault;
pub(crate) mod gross;
pub(crate) mod screen;
pub(crate) mod sentence;
pub(crate) mod suspect;
pub(crate) mod units;
