//! Errors of the record and of the rig file: hypotheses like the effects, and commoner than they are.
//!
//! In: the columns of a record, a prepared problem and what the search found. Out: the [`gross::Gross`] errors, with the
//! sentence of each ([`sentence`], [`units`]), if one stands above every set of effects.
//! Columns are looked at without any simulation first ([`columns_alone`]); then every kind of error ([`fault`]) is a hypothesis
//! of one number ([`suspect`]), screened ([`screen`]), fitted ([`examine`]) and weighed against the effects ([`weigh`]).
//! Imports: `numerics`, `problem`, `fit`, `search`.

pub(crate) mod columns_alone;
pub(crate) mod examine;
pub(crate) mod fault;
pub(crate) mod gross;
pub(crate) mod screen;
pub(crate) mod sentence;
pub(crate) mod suspect;
pub(crate) mod units;
pub(crate) mod weigh;
